"""The second balancer, two eccentric masses: its paper's claims, and both balancers on one rotor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from typing import Any, Final

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.compare import compare
from ringbalance.reports import summary
from ringbalance.reports.pages.cases import case_view
from ringbalance.reports.section import Cells, Record, Section, Table, Work
from ringbalance.results.numbers import MISSING, percent, shown
from ringbalance.scene import AnyScene, SceneError, bundled_scene, load_scene

PAPER: Final = "eccentric_mass"
RIVAL: Final = "driven_masses_small"
"""Masses of a size for the liquid-ring paper's rotor."""
_RUNS: Final = 3
_SPAN: Final = 20.0
"""s compared at most: either balances the rotor within a few seconds or not at all."""
_NAMES: Final = {"liquid_ring": "liquid ring", "eccentric_mass": "two eccentric masses"}


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


def _view(found: Record, evidence: Record) -> Record | None:
    cases = summary.claims(evidence, paper=PAPER)
    compared = found.get("compared")
    if not cases:
        return None
    return {
        "claims": [{**case_view(case), "elsewhere": False} for case in cases],
        "lead": f"Of {len(cases)} claims of the eccentric-mass paper {', '.join(summary.counted(cases))}.",
        "compared": compared and _table(compared),
        "status": _statuses(compared) if compared else [],
        "text": found.get("text", ""),
    }


def _table(found: Record) -> Table:
    def row(label: str, values: list[Any], text: Any) -> Cells:
        return label, *(MISSING if value is None else text(value) for value in values)

    return Table(
        caption="Both balancers on this rotor: the same speed, vibration, influence coefficient, sensor and "
        "limit. The eccentric masses are of a size for the liquid-ring paper’s rotor; all their values are "
        "assumed.",
        heads=("", *(_NAMES.get(name, name) for name in found["balancer"])),
        rows=[
            row("below the limit, and staying, after", found["time_s"], lambda v: shown(v, "s", digits=3)),
            row("vibration left", found["residual_ratio"], lambda v: percent(v, digits=2)),
            row("largest on the way", found["worst_amplitude_m"], lambda v: shown(v, "m", digits=3)),
            row("energy taken", found["energy_J"], lambda v: shown(v, "J", digits=2)),
        ],
    )


def _statuses(found: Record) -> list[str]:
    names = [_NAMES.get(name, name) for name in found["balancer"]]
    return [
        f"{name[0].upper()}{name[1:]}: {text}." for name, text in zip(names, found["status"], strict=True)
    ]


SECTION: Final = Section(
    name="driven", title="The second balancer", collect=_collect, show=_view, always=True
)
