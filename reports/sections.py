"""The sections of the report in the page's order.

A new one is a module with its `SECTION`, a template of its name, and a line in `SECTIONS`.
"""

from __future__ import annotations

from typing import Any, Final

from ringbalance.reports.figures.style import Drawing
from ringbalance.reports.pages import consequences as consequence_view
from ringbalance.reports.pages import drag_coefficient as fifty
from ringbalance.reports.pages import eccentric_mass as driven
from ringbalance.reports.pages import extremes, first_page, sloshing
from ringbalance.reports.pages import model_selection as trade
from ringbalance.reports.pages import paper_figures as paper_again
from ringbalance.reports.pages import siphon_crest as hump
from ringbalance.reports.pages import tube_flow as inside
from ringbalance.reports.section import Record, Section, Work

SECTIONS: Final[tuple[Section, ...]] = (
    first_page.SECTION,
    Section(name="disc", title="The disc and its liquid"),
    Section(name="pressure", title="Pressure of the liquid"),
    Section(name="moment", title="Balancing moment and λ"),
    sloshing.SECTION,
    Section(name="tube", title="The connecting tube"),
    inside.SECTION,
    Section(name="law", title="The flow law"),
    hump.SECTION,
    fifty.SECTION,
    Section(name="loop", title="The closed loop"),
    paper_again.SECTION,
    consequence_view.SECTION,
    Section(name="claims", title="Claims of the liquid-ring paper"),
    driven.SECTION,
    Section(name="numerics", title="Numerical verification"),
    extremes.SECTION,
    trade.SECTION,
    Section(name="models", title="Models used, and why"),
    Section(name="scene", title="Scene and provenance"),
)


def collected(work: Work, *, last: bool) -> Record:
    """The evidence of the sections that have some of their own."""
    found = {section.name: section.collect(work) for section in SECTIONS if section.last is last}
    return {name: record for name, record in found.items() if record is not None}


def viewed(evidence: Record) -> list[Record]:
    """What each section shows, in the page's order, without those that have nothing to show."""
    views = [(section, section.view(evidence)) for section in SECTIONS]
    return [
        {"name": s.name, "title": s.title, "template": s.template, "view": view}
        for s, view in views
        if view is not None
    ]


def drawings_in(content: Any) -> list[Drawing]:
    """Every drawing within nested records and lists, in their order."""
    if isinstance(content, Drawing):
        return [content]
    if isinstance(content, dict):
        return [drawing for value in content.values() for drawing in drawings_in(value)]
    if isinstance(content, list | tuple):
        return [drawing for value in content for drawing in drawings_in(value)]
    return []
