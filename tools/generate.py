"""Everything that is generated: one program writes it, or says what is not what it would write.

    python tools/generate.py TARGET ...            exit code 1 where a file holds something else; names it
    python tools/generate.py --write TARGET ...    writes it

Words after a target that are none narrow it down: `pages docs/fit.md`, `reports RING MASSES`. Targets:
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from types import MappingProxyType
from typing import Final

from ringbalance.scene import write_whole

TARGETS: Final = MappingProxyType(
    {
        "docs": ("doc_tables", "generated parts of the documents; equations as they are set"),
        "pages": ("page_runs", "what the code of pages prints and draws; those named, or all"),
        "reports": ("report_texts", "words of two kept reports; of two folders of a report their evidence"),
        "measurements": ("example_measurements", "example files of measurements"),
        "chambers": ("example_chambers", "meshes of chambers (needs gmsh)"),
        "water": ("water_table", "properties of water (needs chemicals)"),
        "end_losses": ("end_losses_table", "laminar end losses of a tube; takes an hour, resumes"),
        "rotating_friction": ("rotating_friction_table", "friction of a rotating tube; takes hours, resumes"),
    }
)
"""By name: the module whose `files(words)` gives pairs of a path and its bytes, and what it makes."""


def asked(words: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Targets, each with the words that select among its files. Raises: SystemExit: no target comes first."""
    places = [start for start, word in enumerate(words) if word in TARGETS]
    if not places or places[0]:
        lines = (f"    {name:<20}{text}" for name, (_, text) in TARGETS.items())
        raise SystemExit("\n".join([(__doc__ or "").rstrip(), *lines]))
    for start, end in zip(places, [*places[1:], len(words)], strict=True):
        yield words[start], [*words[start + 1 : end]]


def main(arguments: Sequence[str]) -> int:
    """Write what differs, or name it."""
    write, stale = "--write" in arguments, False
    for target, words in asked([word for word in arguments if word != "--write"]):
        # Imported late: processes of a target import this module, and each target needs other packages.
        for path, content in import_module(TARGETS[target][0]).files(words):
            if path.exists() and path.read_bytes() == content:
                continue
            stale = True
            print(f"{path}: {'written' if write else 'not what is generated now'}")
            if write:
                write_whole(path, content)
    return int(stale and not write)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
