"""The report of any balancer that has no pages of its own: devices drawn, findings, and the run."""

from __future__ import annotations

from collections import Counter
from typing import Final

from ringbalance.controller.balancer import Balancer, balancer_of
from ringbalance.reports.judged import advice_view, own_record, settings_lines
from ringbalance.reports.pages.standing import DOCUMENT
from ringbalance.reports.run_figures import run_amplitude
from ringbalance.reports.section import Record, Section, Work
from ringbalance.scene.faults import SceneError

_DRAWN: Final = {"time_s", "amplitude_m", "limit_m"}
"""Keys of a run's document that its figure is made of."""
_FEWEST, _MOST = 16, 64
"""Devices that are drawn of a balancer whose runs take long."""


def decision(work: Work) -> Record:
    """What the first page of any balancer rests on."""
    balancer = balancer_of(work.scene)
    paths = (each.path for each in balancer.settings() if "[" not in each.path)
    return {
        "limit_m": _limit(balancer),
        **own_record(balancer, first=_FEWEST, most=_MOST),
        "recommended": None,
        "settings": settings_lines(work.scene, paths),
    }


def _limit(balancer: Balancer) -> float | None:
    try:
        return balancer.rotor().limit
    except SceneError:
        return None


def decision_view(found: Record, evidence: Record) -> Record:
    """What the first page of any balancer shows of it."""
    return {
        **advice_view(found),
        "origins": Counter(row["origin"] for row in evidence["scene"]["table"]).most_common(),
    }


def _summary(found: Record, evidence: Record) -> Record:
    run = evidence["closed_loop"]["balanced"]
    return {
        **decision_view(found, evidence),
        "amplitude": run_amplitude(run) if run.keys() >= _DRAWN else None,
    }


SECTIONS: Final = (
    Section(
        name="summary",
        title="Decision",
        place="report",
        collect=decision,
        show=_summary,
        template="plain_summary.html",
    ),
    Section(name="parameters", title="Parameters and their origin", place="report"),
    DOCUMENT,
    Section(name="scene", title="Scene file"),
)
