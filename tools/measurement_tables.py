"""Write the tables of README.md and of docs/ that follow from cases and kinds of data.

python tools/measurement_tables.py            prints the pages with fresh tables
python tools/measurement_tables.py --write    puts the tables into the pages
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ringbalance.identification.data.kinds import KINDS as FIT_KINDS
from ringbalance.identification.data.kinds import DataKind
from ringbalance.reports.saved import saved_cases
from ringbalance.scene import write_whole
from ringbalance.verification.catalogue import load_cases
from ringbalance.verification.document import case_document, definition_document
from ringbalance.verification.runner import paper_scene, run_case
from ringbalance.verification.standing import HEADS, standing_rows
from ringbalance.verification.validation.kinds import KINDS

_ROOT: Final = Path(__file__).resolve().parents[1]
README: Final = _ROOT / "README.md"
PAGE: Final = _ROOT / "docs" / "measurements.md"
FIT_PAGE: Final = _ROOT / "docs" / "fit.md"


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


def fit_kind_table() -> str:
    """Kinds of data that a fit takes, and their columns."""
    return _markdown(
        ("kind", "what it is", "measured", "further columns"),
        [
            (
                f"`{name}`",
                kind.title + (", eccentric masses" if kind.balancer == "eccentric_mass" else ""),
                "; ".join(_explained(kind, measured=True)),
                "; ".join(_explained(kind, measured=False)),
            )
            for name, kind in FIT_KINDS.items()
        ],
    )


def _explained(kind: DataKind, *, measured: bool) -> list[str]:
    """The columns that are measured, or the others, with what they hold."""
    letters = ["`chamber`: letter of the driven chamber"] if kind.has_chamber and not measured else []
    return letters + [
        f"`{column.head}`: {column.meaning}"
        + (" (optional)" if column.optional else "")
        + (f" (instead of `{kind.one_of[0]}`)" if column.name in kind.one_of[1:] else "")
        for column in kind.columns
        if column.measured == measured
    ]


def standing_table(cases: Sequence[Mapping[str, Any]]) -> str:
    """What stands behind each quantity, by the documents of the cases; heavy ones count as kept."""
    kept = {case["id"]: {"verdict": case["verdict"], "numbers": case["numbers"]} for case in saved_cases()}
    return _markdown(HEADS, standing_rows([{**case, **kept.get(case["id"], {})} for case in cases]))


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
        (FIT_PAGE, "fit_kinds", fit_kind_table()),
        (README, "standing", standing_table(_documents())),
    ):
        text = fresh(path.read_text(encoding="utf-8"), name, table)
        if "--write" in sys.argv:
            write_whole(path, text)
        else:
            print(text)
