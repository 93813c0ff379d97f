"""The second balancer, two eccentric masses: its paper's claims, and both balancers on one rotor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from typing import Final

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.compare import compare
from ringbalance.reports import summary
from ringbalance.reports.pages.cases import case_view
from ringbalance.reports.section import Record, Section, Work
from ringbalance.scene import AnyScene, SceneError, bundled_scene, load_scene

PAPER: Final = "eccentric_mass"
RIVAL: Final = "driven_masses_small"
"""Masses of a size for the liquid-ring paper's rotor."""
_RUNS: Final = 3
_SPAN: Final = 20.0
"""s compared at most: either balances the rotor within a few seconds or not at all."""


def _shortened(scene: AnyScene) -> AnyScene:
    return replace(scene, run=replace(scene.run, time_limit=min(scene.run.time_limit, _SPAN)))


def _collect(work: Work) -> Record | None:
    """Both balancers on the scene's rotor, where all is asked for: no scene of a liquid ring requires it."""
    if work.level == "light":
        return None
    rival = _shortened(load_scene(bundled_scene(RIVAL)))
    try:
        ring = balancer_of(_shortened(work.scene), flow_law=work.calibration.flow_law)
        found = compare(ring, balancer_of(rival), runs=_RUNS)
    except SceneError as error:
        # Without folders: the evidence is the same wherever the files stand.
        faults = (replace(fault, file=PurePath(fault.file).name) for fault in error.faults)
        return {"compared": None, "text": "\n".join(map(str, faults))}
    return {"compared": found.to_dict(), "text": ""}


def _view(_own: Record, evidence: Record) -> Record | None:
    cases = summary.claims(evidence, paper=PAPER)
    if not cases:
        return None
    views = [{**case_view(case), "elsewhere": False} for case in cases]
    return {"claims": views, "counts": summary.counted(cases)}


SECTION: Final = Section(
    name="driven", title="The second balancer", collect=_collect, show=_view, always=True
)
