"""Two imbalances balanced at constant speed."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.runs import BalancingFigure
from ringbalance.verification.eccentric_mass.scenes import thinned
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure

_SHOWN = 12.0
"""s."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Amplitudes before, on the way and after."""
    found = BalancingFigure.seven(scene) if defect is None else BalancingFigure.eight(scene, time_limit=30.0)
    ratios = np.divide(found.positioned, found.before)
    arrived = [stage.end for run in found.runs for stage in run.stages if stage.name == "positioning"]
    return Evidence(
        found=as_found(ratio=ratios.max()),
        numbers={
            "before": found.before[0],
            "first": found.positioned[0],
            "second": found.positioned[1],
            "arrived": max(arrived),
        },
        series=(found.amplitudes(until=_SHOWN), _angles(found)),
    )


def _angles(found: BalancingFigure) -> Series:
    run = found.runs[0]
    shown = run.time <= _SHOWN
    angles = zip(("mass 1", "mass 2"), run.mass_angle, strict=True)
    return figure(
        f"angles of the masses, imbalance at {found.phases[0]:.0f} degrees",
        ("time", "s", thinned(run.time[shown])),
        *(Curve(name, "rad", thinned(angle[shown])) for name, angle in angles),
    )
