"""Effort over the speed under four ways of compensating friction."""

from __future__ import annotations

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.effort import FigureSix, figure_six
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure

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
    return figure(
        "effort of one move over the speed",
        ("speed over natural frequency", "1", found.speed_ratios),
        Curve("compensated exactly", "N m s", found.exact[at]),
        Curve("arm assumed a fifth too small", "N m s", found.short[at]),
        Curve("not compensated", "N m s", found.without[at]),
        Curve("as printed", "N m s", found.printed[at], style="paper"),
    )
