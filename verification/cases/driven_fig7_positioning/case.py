"""Two imbalances balanced at constant speed."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.runs import BalancingFigure, figure_eight, figure_seven
from ringbalance.verification.eccentric_mass.scenes import envelope, thinned
from ringbalance.verification.evidence import Axis, Curve, Evidence, Found, Level, Series

_SHOWN = 12.0
"""s."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Amplitudes before, on the way and after."""
    found = figure_seven(scene) if defect is None else figure_eight(scene, time_limit=30.0)
    ratios = np.divide(found.positioned, found.before)
    arrived = [stage.end for run in found.runs for stage in run.stages if stage.name == "positioning"]
    return Evidence(
        found={"ratio": Found(value=float(ratios.max()))},
        numbers={
            "before": found.before[0],
            "first": found.positioned[0],
            "second": found.positioned[1],
            "arrived": max(arrived),
        },
        series=(_amplitudes(found), _angles(found)),
    )


def _amplitudes(found: BalancingFigure) -> Series:
    shown = found.runs[0].time <= _SHOWN
    return Series(
        name="amplitude",
        x=Axis(name="time", unit="s", values=thinned(found.runs[0].time[shown])),
        y=tuple(
            Curve(name=f"imbalance at {phase:.0f} degrees", unit="m", values=envelope(run.amplitude[shown]))
            for phase, run in zip(found.phases, found.runs, strict=True)
        ),
    )


def _angles(found: BalancingFigure) -> Series:
    run = found.runs[0]
    shown = run.time <= _SHOWN
    return Series(
        name=f"angles of the masses, imbalance at {found.phases[0]:.0f} degrees",
        x=Axis(name="time", unit="s", values=thinned(run.time[shown])),
        y=tuple(
            Curve(name=f"mass {index + 1}", unit="rad", values=thinned(angle[shown]))
            for index, angle in enumerate(run.mass_angle)
        ),
    )
