"""Report of a balancer without its own pages: drawn devices, findings, and the run."""

from __future__ import annotations

from collections import Counter
from typing import Final

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.judging.ranking import ranked
from ringbalance.controller.judging.remedies import tried_remedies
from ringbalance.controller.judging.search import searched
from ringbalance.reports.judged import advice_view, judgement_record, settings_lines
from ringbalance.reports.pages.standing import DEFAULTS, DOCUMENT, PARAMETERS
from ringbalance.reports.run_figures import run_amplitude
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.requirements import MET
from ringbalance.scene.faults import SceneError

_FIGURE_KEYS: Final = {"time_s", "amplitude_m", "limit_m"}
"""Keys of a run's document that its figure needs."""
_MIN_DEVICES, _MAX_DEVICES = 16, 64


def decision(work: Work) -> Record:
    """Evidence of the first page of any balancer: its own settings judged on drawn devices, with remedies."""
    balancer = balancer_of(work.scene)
    paths = (setting.path for setting in balancer.settings() if "[" not in setting.path)
    try:
        limit = balancer.rotor().limit
    except SceneError:
        limit = None
    (judgement,) = judged_all(balancer, [{}], first=_MIN_DEVICES, most=_MAX_DEVICES)
    # Remedies and measurements are of use where these settings do not suffice.
    suffices = judgement.verdict == MET or bool(judgement.meets.all())
    ranking = ranked(balancer, judgement)
    measures = () if suffices else tuple(ranking.findings())
    remedies = () if suffices else tried_remedies(balancer, judgement, search=searched)
    return {
        "limit_m": limit,
        "own": judgement_record(judgement),
        "remedies": [each.document() for each in remedies],
        "measures": [each.document() for each in measures],
        "ranking": ranking.document() if judgement.meets.size >= _MIN_DEVICES else [],
        "recommended": None,
        "settings": settings_lines(work.scene, paths),
    }


def decision_view(record: Record, evidence: Record) -> Record:
    """Advice in words, and numbers of inputs by origin, for the first page of any balancer."""
    return {
        **advice_view(record),
        "origins": Counter(row["origin"] for row in evidence["scene"]["table"]).most_common(),
    }


def _summary(record: Record, evidence: Record) -> Record:
    run = evidence["closed_loop"]["balanced"]
    return {
        **decision_view(record, evidence),
        "amplitude": run_amplitude(run) if run.keys() >= _FIGURE_KEYS else None,
    }


SECTIONS: Final = (
    Section(
        name="summary",
        title="Decision",
        document="report",
        collect=decision,
        show=_summary,
        template="plain_summary.html",
    ),
    PARAMETERS,
    DOCUMENT,
    DEFAULTS,
    Section(name="scene", title="Scene file"),
)
