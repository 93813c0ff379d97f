"""Writes docs/findings.md with `--write`; without it, exit code 1 says that the file is another."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Final

from ringbalance.results.findings import sentences

_DOCUMENT: Final = Path(__file__).parents[1] / "docs" / "findings.md"
_PLACE: Final = re.compile(r"\{(\w+)[^}]*\}")
_HEAD: Final = """# Findings

Every command's JSON has a list `findings`. Each has a `code` and a `severity`, which do not change, its
numbers as `values` (SI), the `change` of the scene that would mend it, by path of a key (`raise`, `lower`,
`set` or a new value, SI), and the sentence as `text`, whose wording may change. Values are in *italics*.

| code | severity | values | sentence |
|---|---|---|---|
"""


def document() -> str:
    """The whole file."""
    rows = []
    for code, each in sentences().items():
        values = ", ".join(f"`{name}`" for name in each.values)
        text = _PLACE.sub(r"*\1*", each.text)
        rows.append(f"| `{code}` | {each.severity} | {values} | {text} |")
    return _HEAD + "\n".join(rows) + "\n"


def main() -> int:
    """Returns: 1 where the file is another and is not to be written."""
    if "--write" in sys.argv:
        _DOCUMENT.write_text(document(), encoding="utf-8")
    return int(_DOCUMENT.read_text(encoding="utf-8") != document())


if __name__ == "__main__":
    sys.exit(main())
