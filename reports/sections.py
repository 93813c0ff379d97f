"""The sections of the report in the page's order.

A new one is a module with its `SECTION`, a template of its name, and a line in `SECTIONS`.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from types import MappingProxyType
from typing import Any, Final

from ringbalance.reports import summary
from ringbalance.reports.figure import Drawing
from ringbalance.reports.pages import (
    cases,
    chamber,
    drag_coefficient,
    eccentric,
    first_page,
    loop,
    measured,
    operation,
    plain,
    tube,
    tube_flow,
)
from ringbalance.reports.pages.standing import CASES, CONDITIONS, CREDIBILITY, DEFAULTS, DOCUMENT, PARAMETERS
from ringbalance.reports.section import Document, Record, Section
from ringbalance.scene.registry import registered_or_none

SECTIONS: Final[tuple[Section, ...]] = (
    first_page.SECTION,
    CONDITIONS,
    operation.SECTION,
    loop.LOOP,
    Section(name="claims", title="Claims of the liquid-ring paper", document="report", of_paper=True),
    CREDIBILITY,
    PARAMETERS,
    DOCUMENT,
    chamber.DISC,
    chamber.PRESSURE,
    chamber.MOMENT,
    chamber.WAVES,
    tube.TUBE,
    tube_flow.SECTION,
    tube.LAW,
    tube.CREST,
    drag_coefficient.SECTION,
    loop.INJECTIONS,
    loop.CONSEQUENCES,
    CASES,
    Section(name="numerics", title="Numerical verification"),
    cases.EXTREMES,
    cases.TRADE,
    Section(name="models", title="Models used, and why"),
    measured.SECTION,
    DEFAULTS,
    Section(name="scene", title="Scene file, mesh and versions"),
)
_BY_BALANCER: Final[Mapping[str, tuple[Section, ...]]] = MappingProxyType(
    {"liquid_ring": SECTIONS, eccentric.BALANCER: eccentric.SECTIONS}
)
"""Sections by balancer, for balancers with their own pages."""
CASES_VIEW: Final = "verification"
"""Key of the view of all cases among those of the sections."""
PREFIXES: Final[Mapping[Document, str]] = MappingProxyType({"report": "", "annex": "A"})
"""Prefix of the number of every section, figure, table and equation, by document."""


def sections_of(balancer: str) -> dict[str, Section]:
    """The sections of a report on a kind of balancer, in the page's order, by name."""
    sections = _BY_BALANCER.get(balancer) or registered_or_none("report", balancer) or plain.SECTIONS
    return {section.name: section for section in sections}


def view_of(name: str, evidence: Record) -> Record | None:
    """Texts and figures of a section, or, under `CASES_VIEW`, of every case by its id."""
    if name == CASES_VIEW:
        return {case["id"]: cases.case_view(case) for case in evidence[CASES_VIEW]}
    return sections_of(evidence["balancer"])[name].view(evidence)


def views_of(evidence: Record) -> dict[str, Record | None]:
    """Views of all sections, None where one has nothing to show, and of the cases."""
    return {name: view_of(name, evidence) for name in (*sections_of(evidence["balancer"]), CASES_VIEW)}


def numbered(evidence: Record, views: Mapping[str, Record | None]) -> list[Record]:
    """The sections that have something to show, in order and numbered."""
    counts, of_paper = {"report": count(1), "annex": count(1)}, summary.is_papers(evidence)
    return [
        {
            "name": name,
            "title": section.title,
            "template": section.file,
            "document": (document := "annex" if section.of_paper and not of_paper else section.document),
            "number": f"{PREFIXES[document]}{next(counts[document])}",
            "view": view,
        }
        for name, section in sections_of(evidence["balancer"]).items()
        if (view := views[name]) is not None
    ]


def drawings_in(content: Any) -> list[Drawing]:
    """Every drawing within nested records and lists, in their order."""
    if isinstance(content, Drawing):
        return [content]
    if isinstance(content, dict):
        content = list(content.values())
    parts = content if isinstance(content, list | tuple) else ()
    return [drawing for part in parts for drawing in drawings_in(part)]
