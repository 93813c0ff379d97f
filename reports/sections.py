"""The sections of the report in the page's order.

A new one is a module with its `SECTION`, a template of its name, and a line in `SECTIONS`.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from concurrent.futures import Future
from functools import partial
from itertools import count
from types import MappingProxyType
from typing import Any, Final

from ringbalance.reports import summary
from ringbalance.reports.figure import Drawing
from ringbalance.reports.pages import (
    chamber,
    consequences,
    drag_coefficient,
    eccentric,
    first_page,
    loop,
    measured,
    operation,
    plain,
    studies,
    tube,
    tube_flow,
)
from ringbalance.reports.pages.standing import CASES, CONDITIONS, CREDIBILITY, DOCUMENT
from ringbalance.reports.section import Place, Record, Section, Work
from ringbalance.scene import Scene
from ringbalance.scene.platform.processes import Workers
from ringbalance.verification.evidence import Level
from ringbalance.verification.loops import calibration_of

SECTIONS: Final[tuple[Section, ...]] = (
    first_page.SECTION,
    CONDITIONS,
    operation.SECTION,
    loop.LOOP,
    Section(name="claims", title="Claims of the liquid-ring paper", place="report", of_paper=True),
    CREDIBILITY,
    Section(name="parameters", title="Parameters and their origin", place="report"),
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
    consequences.SECTION,
    CASES,
    eccentric.SECOND_BALANCER,
    Section(name="numerics", title="Numerical verification"),
    studies.EXTREMES,
    studies.TRADE,
    Section(name="models", title="Models used, and why"),
    measured.SECTION,
    Section(name="scene", title="Scene file, mesh and versions"),
)
_BY_BALANCER: Final[Mapping[str, tuple[Section, ...]]] = MappingProxyType(
    {"liquid_ring": SECTIONS, eccentric.BALANCER: eccentric.SECTIONS}
)
"""Of those balancers that have pages of their own."""
Begun = dict[str, Future[Record | None]]
PREFIXES: Final[Mapping[Place, str]] = MappingProxyType({"report": "", "annex": "A"})
"""Before the number of every section, figure, table and equation of a document."""


def begun(scene: Scene, level: Level, pool: Workers | None) -> Begun:
    """Have a worker, where there is one, collect the evidence of sections apart."""
    if pool is None:
        return {}
    apart = [section.name for section in SECTIONS if section.apart]
    return {name: pool.submit(_section_evidence, name, scene, level) for name in apart}


def _section_evidence(name: str, scene: Scene, level: Level) -> Record | None:
    """What one section collects of a scene."""
    work = Work(scene=scene, calibration=calibration_of(scene), level=level)
    return next(section for section in SECTIONS if section.name == name).collect(work)


def collected(work: Work, *, without: Collection[str]) -> Record:
    """The evidence of the sections that have some of their own."""
    found = {section.name: section.collect(work) for section in SECTIONS if section.name not in without}
    return {name: record for name, record in found.items() if record is not None}


def completed(found: Record, apart: Begun, work: Work, pool: Workers | None) -> Record:
    """The evidence of all sections in their order: `found`, and that of those `begun` apart."""
    if pool is not None:
        own = partial(_section_evidence, scene=work.scene, level=work.level)
        found |= {name: pool.taken(one, partial(own, name)) for name, one in reversed(apart.items())}
    ordered = {section.name: found.get(section.name) for section in SECTIONS}
    return {name: record for name, record in ordered.items() if record is not None}


def sections_of(evidence: Record) -> tuple[Section, ...]:
    """The sections of a report on the evidence's kind of balancer."""
    balancer = evidence.get("balancer", "liquid_ring")
    return _BY_BALANCER.get(balancer, plain.SECTIONS)


def section_view(name: str, text: str) -> Record | None:
    """What one section shows of the evidence, given as its file has it."""
    evidence = json.loads(text)
    return next(section for section in sections_of(evidence) if section.name == name).view(evidence)


def section_views(evidence: Record) -> dict[str, Record | None]:
    """What each section shows, by name; None where it has nothing to show."""
    return {section.name: section.view(evidence) for section in sections_of(evidence)}


def viewed(evidence: Record, views: Mapping[str, Record | None]) -> list[Record]:
    """The sections that have something to show by `section_views`, in order and numbered."""
    counts, own = {"report": count(1), "annex": count(1)}, summary.is_papers(evidence)
    return [
        {
            "name": s.name,
            "title": s.title,
            "template": s.file,
            "place": (place := "annex" if s.of_paper and not own else s.place),
            "number": f"{PREFIXES[place]}{next(counts[place])}",
            "view": view,
        }
        for s in sections_of(evidence)
        if (view := views[s.name]) is not None
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
