"""Write the tables of README.md and docs/measurements.md that follow from cases and kinds of data.

python tools/measurement_tables.py            prints both pages with fresh tables
python tools/measurement_tables.py --write    puts the tables into the pages
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ringbalance.scene import write_whole
from ringbalance.verification.catalogue import load_cases
from ringbalance.verification.document import case_document, definition_document
from ringbalance.verification.runner import paper_scene, run_case
from ringbalance.verification.standing import HEADS, standing_rows
from ringbalance.verification.validation.comparison import KINDS

_ROOT: Final = Path(__file__).resolve().parents[1]
README: Final = _ROOT / "README.md"
PAGE: Final = _ROOT / "docs" / "measurements.md"


def kind_table() -> str:
    """Kinds of data and their columns."""
    return _markdown(
        ("kind", "measured column", "what it is", "further columns"),
        [
            (
                f"`{name}`",
                f"`{kind.measured}`",
                kind.title,
                "; ".join(
                    f"`{column}`: {text}" for column, text in {**kind.columns, **kind.optional}.items()
                ),
            )
            for name, kind in KINDS.items()
        ],
    )


def standing_table(cases: Sequence[Mapping[str, Any]]) -> str:
    """What stands behind each quantity. Args: `cases`: their documents."""
    return _markdown(HEADS, standing_rows(cases))


def _markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def fresh(page: str, name: str, table: str) -> str:
    """A page with one of its tables written again."""
    block = re.compile(rf"<!-- table: {name} -->\n.*?<!-- end -->", re.DOTALL)
    return block.sub(lambda _: f"<!-- table: {name} -->\n{table}\n<!-- end -->", page)


def _documents() -> list[dict[str, Any]]:
    """Cases that compare with measurements, run; of the others their text."""
    scene = paper_scene()
    return [
        case_document(run_case(case.id, scene=scene))
        if case.kind == "validation"
        else definition_document(case)
        for case in load_cases()
    ]


if __name__ == "__main__":
    for path, name, table in (
        (PAGE, "kinds", kind_table()),
        (README, "standing", standing_table(_documents())),
    ):
        text = fresh(path.read_text(encoding="utf-8"), name, table)
        if "--write" in sys.argv:
            write_whole(path, text)
        else:
            print(text)
