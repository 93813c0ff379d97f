"""Effort over the speed under four ways of compensating friction."""

from __future__ import annotations

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.effort import FigureSix, figure_six
from ringbalance.verification.evidence import Axis, Curve, Evidence, Found, Level, Series

_STEP = {"light": 4e-4, "heavy": 1e-4}
"""s, of the integration; the effort hangs on it by a thousandth."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Growth of the effort with the speed."""
    found = figure_six(scene, step=_STEP[level])
    judged = found.exact if defect is None else found.without
    without = found.growth(found.without)
    return Evidence(
        found={"exact": Found(value=float(found.growth(judged).min()))},
        numbers={
            "without": float(without.min()),
            "without_most": float(without.max()),
            "short": float(found.growth(found.short).min()),
            "as_printed": float(found.growth(found.printed).min()),
        },
        series=(_figure(found),),
    )


def _figure(found: FigureSix) -> Series:
    """The first mass ratio at the third weight, near the paper's own choice."""
    at = (0, 2)
    return Series(
        name="effort of one move over the speed",
        x=Axis(name="speed over natural frequency", unit="1", values=found.speed_ratios),
        y=(
            Curve(name="compensated exactly", unit="N m s", values=found.exact[at]),
            Curve(name="arm assumed a fifth too small", unit="N m s", values=found.short[at]),
            Curve(name="not compensated", unit="N m s", values=found.without[at]),
            Curve(name="as printed", unit="N m s", values=found.printed[at], style="paper"),
        ),
    )
