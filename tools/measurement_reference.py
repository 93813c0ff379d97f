"""Write the table of docs/measurements.md from the kinds of data that can be predicted.

python tools/measurement_reference.py            prints the page with a fresh table
python tools/measurement_reference.py --write    puts it into docs/measurements.md
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from ringbalance.scene import write_whole
from ringbalance.verification.validation.comparison import KINDS

PAGE = Path(__file__).resolve().parents[1] / "docs" / "measurements.md"
BLOCK = re.compile(r"<!-- table: kinds -->\n.*?<!-- end -->", re.DOTALL)


def kind_reference() -> str:
    """Markdown table of the kinds and their columns."""
    rows = [
        f"| `{name}` | `{kind.measured}` | {kind.title} | "
        + "; ".join(f"`{column}`: {text}" for column, text in {**kind.columns, **kind.optional}.items())
        + " |"
        for name, kind in KINDS.items()
    ]
    return "\n".join(
        ["| kind | measured column | what it is | further columns |", "|---|---|---|---|", *rows]
    )


def fresh(page: str) -> str:
    """The page with a fresh table."""
    return BLOCK.sub(lambda _: f"<!-- table: kinds -->\n{kind_reference()}\n<!-- end -->", page)


if __name__ == "__main__":
    text = fresh(PAGE.read_text(encoding="utf-8"))
    if "--write" in sys.argv:
        write_whole(PAGE, text)
    else:
        print(text)
