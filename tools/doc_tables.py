"""Generated parts of the documents, and the typeset equations.

A part stands in its page between `<!-- table: NAME -->` and `<!-- end -->`.
"""

from __future__ import annotations

import json
import lzma
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import scene_reference
from api_page import name_reference
from benchmark_tables import kept_rates, levels_table, markdown, models_table, workers_table
from drag_coefficient_doc import document_tables
from typesetting import typeset

from ringbalance.export.blocks import declared
from ringbalance.identification.kinds.kind import Kind
from ringbalance.identification.reading import KINDS
from ringbalance.reports.prose import equations as report_equations
from ringbalance.reports.saved import saved_cases
from ringbalance.results.rows import sentences
from ringbalance.verification.catalogue import load_cases
from ringbalance.verification.result import definition_document
from ringbalance.verification.runner import paper_scene, run_case
from ringbalance.verification.standing import HEADS, standing_rows

ROOT: Final = Path(__file__).resolve().parents[1]
EQUATIONS: Final = ROOT / "reports" / "data" / "equations.json.xz"
_BLOCK: Final = re.compile(r"<!-- table: (\w+) -->\n.*?<!-- end -->", re.DOTALL)
_PLACE: Final = re.compile(r"\{(\w+)[^}]*\}")


def kind_table(*balancers: str) -> str:
    """Kinds of measurement, and their columns, that scenes of some balancers predict, or of test benches."""
    return markdown(
        ("kind", "what it is", "measured", "further columns"),
        [
            (
                f"`{name}`",
                kind.title + (", eccentric masses" if kind.balancer == "eccentric_mass" else ""),
                "; ".join(_explained(kind, measured=True)),
                "; ".join(_explained(kind, measured=False)),
            )
            for name, kind in KINDS.items()
            if kind.balancer in balancers and (kind.balancer or kind.stated)
        ],
    )


def _explained(kind: Kind, *, measured: bool) -> list[str]:
    """Measured columns, or the others, with their meaning."""
    letters = ["`chamber`: letter of the driven chamber"] if kind.has_chamber and not measured else []
    return letters + [
        f"`{column.head}`: {column.meaning}"
        + (" (optional)" if column.optional else "")
        + (f" (instead of `{kind.one_of[0]}`)" if column.name in kind.one_of[1:] else "")
        for column in kind.columns
        if column.measured == measured
    ]


def standing_table(cases: Sequence[Mapping[str, Any]]) -> str:
    """Evidence for each quantity, from documents of the cases; heavy cases come from the stored results."""
    heavy = {case["id"]: {"verdict": case["verdict"], "numbers": case["numbers"]} for case in saved_cases()}
    return markdown(HEADS, standing_rows([{**case, **heavy.get(case["id"], {})} for case in cases]))


def finding_table() -> str:
    """Codes of findings with severity, values and sentence."""
    return markdown(
        ("code", "severity", "values", "sentence"),
        [
            (
                f"`{code}`",
                each.severity,
                ", ".join(f"`{name}`" for name in each.values),
                _PLACE.sub(r"*\1*", each.text),
            )
            for code, each in sentences().items()
        ],
    )


_BLOCKS = {
    **{kind: f"`{kind}`" for kind in ("law", "disc", "controller")},
    "measured": "masses: `controller`, `plant`",
    "strategy": "masses: `controller`",
    "plant": "masses: `plant`",
}


def block_table() -> str:
    """Variables of the exported blocks."""
    heads = ("block", "variable", "side", "unit", "from", "to", "meaning")
    return markdown(
        heads,
        [
            (
                label,
                f"`{each['name'].replace('#', each.get('letters', 'a')[0])}`"
                + (", ..." if "#" in each["name"] else ""),
                "in" if each.get("input") else "in, out" if kind == "measured" else "out",
                each["range"].get("unit", "-"),
                each["range"].get("min", "0"),
                each["range"].get("max", "1").replace("MOST", "largest"),
                each["description"]
                .replace("#", each.get("letters", "A")[0])
                .replace("MOST", "the largest fill ratio"),
            )
            for kind, label in _BLOCKS.items()
            for each in declared()[kind]
        ],
    )


def equations() -> bytes:
    """Contents of the file of equations: SVG by LaTeX, for the report and the cases."""
    latex = {
        *(each.latex for each in report_equations().values()),
        *(e for c in load_cases() for e in c.equations),
    }
    return lzma.compress(json.dumps({each: typeset(each) for each in sorted(latex)}).encode(), preset=9)


PARTS: Final[Mapping[str, Callable[[], Mapping[str, str]]]] = MappingProxyType(
    {
        "docs/api.md": lambda: {"names": name_reference()},
        "docs/scene-file.md": scene_reference.tables,
        "docs/measurements.md": lambda: {"kinds": kind_table("")},
        "docs/fit.md": lambda: {"fit_kinds": kind_table("liquid_ring", "eccentric_mass")},
        "docs/findings.md": lambda: {"findings": finding_table()},
        "docs/export.md": lambda: {"block_variables": block_table()},
        "docs/is-k-50-right.md": document_tables,
        "docs/how-to-choose.md": lambda: {
            "models": models_table(kept_rates()),
            "levels": levels_table(kept_rates()),
        },
        "docs/clusters.md": lambda: {"workers": workers_table(kept_rates())},
        "docs/standing.md": lambda: {"standing": standing_table(_documents())},
    }
)
"""Generated parts by page."""


def fresh(page: str, tables: Mapping[str, str]) -> str:
    """A page with its generated parts replaced. Raises: ValueError: its parts are not those of `tables`."""
    names = _BLOCK.findall(page)
    if sorted(names) != sorted(tables):
        raise ValueError(f"the page has {names}, written are {sorted(tables)}")
    return _BLOCK.sub(lambda match: f"<!-- table: {match[1]} -->\n{tables[match[1]]}\n<!-- end -->", page)


def text_of(name: str) -> str:
    """Present text of a page."""
    return (ROOT / name).read_text(encoding="utf-8")


def _documents() -> list[dict[str, Any]]:
    """Results of the cases that compare with measurements, run now; definitions of the others."""
    scene = paper_scene()
    return [
        run_case(case.id, scene=scene).to_dict() if case.kind == "validation" else definition_document(case)
        for case in load_cases()
    ]


def files(words: Sequence[str] = ()) -> Iterator[tuple[Path, bytes]]:
    """Documents with their generated parts replaced, all or those named, and the equations."""
    for name, tables in PARTS.items():
        if not words or name in words:
            yield ROOT / name, fresh(text_of(name), tables()).encode()
    if not words:
        yield EQUATIONS, equations()
