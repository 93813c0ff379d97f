"""Four imbalances estimated, and the covariances that the printed time needs."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.imbalance import FigureFour, figure_four
from ringbalance.verification.eccentric_mass.scenes import thinned
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure

_PRINTED = 3.5
"""Middle of the printed 3 to 4 s."""


def values(scene: EccentricScene) -> dict[str, float]:
    return _judged(figure_four(scene, scales=(1.0,)))


def _judged(found: FigureFour) -> dict[str, float]:
    norm = found.covariance_norm
    return {
        "honest": _within(found, max(found.honest_time)),
        "covariance": float(np.max(norm[:, -1] / norm[:, 0])),
    }


def _within(found: FigureFour, time: float) -> float:
    """A time, at most that of the whole record."""
    return min(time, float(found.time[-1]))


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Convergence times under honest and under ever less honest covariances."""
    found = figure_four(scene)
    judged = _judged(found)
    if defect is not None:
        judged["honest"] = _within(found, float(found.scaled_time[-1]))
    reached = np.isfinite(found.scaled_time)
    scale = np.exp(np.interp(_PRINTED, found.scaled_time[reached], np.log(found.scales[reached])))
    return Evidence(
        found={name: Found(value=value) for name, value in judged.items()},
        numbers={"printed": _PRINTED, "scale": float(scale)},
        series=(_estimates(found), _times(found)),
    )


def _estimates(found: FigureFour) -> Series:
    """The figure's own four curves, as distances from the truth over the imbalance."""
    error = np.linalg.norm(found.estimate - found.true[:, None, :], axis=2)
    size = np.linalg.norm(found.true, axis=1)
    shown = found.time <= 0.5
    curves = (
        Curve(f"{phase:.0f} degrees", "1", thinned(row[shown] / one))
        for phase, row, one in zip(found.phases, error, size, strict=True)
    )
    name = "error of the estimate over the imbalance, honest covariances"
    return figure(name, ("time", "s", thinned(found.time[shown])), *curves)


def _times(found: FigureFour) -> Series:
    reached = np.isfinite(found.scaled_time)
    return figure(
        "time to be within 2 % over the noise that the filter assumes",
        ("assumed over true noise", "1", found.scales[reached]),
        Curve("found", "s", found.scaled_time[reached]),
        Curve("printed", "s", np.full(int(reached.sum()), _PRINTED), style="paper"),
        log=True,
    )
