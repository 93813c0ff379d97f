"""Data against fit: one figure for each kind of reading."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.identification.against_fit import AgainstFit
from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.results.numbers import rounded
from ringbalance.scene.units import unit_factor

_NAMES: Final = {
    "trial_weight": "change by trial weights",
    "trial_amplitude": "amplitude with trial weights",
    "injection": "change by injections",
    "transfer": "liquid moved",
    "flow": "flow rate",
    "pressure": "pressure",
    "run_up": "vibration in the run-up",
    "positioning": "angle moved",
}
_SIGNS: Final = {"g*mm": "g mm", "ml/s": "ml/s", "um": "µm", "deg": "°"}
_PARTS: Final = ("real part", "imaginary part")
_HEIGHT: Final = 3.6
_MARGIN: Final = 0.08
"""Of the range of values, beside the outermost."""


def fit_figures(found: Sequence[AgainstFit]) -> list[Drawing]:
    """Measured over fitted values with their 95 % intervals, and the line on which both are equal."""
    return [_figure(each, place) for place, each in enumerate(found)]


def _figure(found: AgainstFit, place: int) -> Drawing:
    factor = unit_factor(found.unit) if found.unit else 1.0
    unit = f" in {_SIGNS.get(found.unit, found.unit)}" if found.unit else ""
    name = _NAMES.get(found.kind, found.kind)
    slope = _slope(found)

    def paint(axes: Axes) -> None:
        low, high = _range(found, factor)
        axes.plot((low, high), (low, high), color=style.MUTED, linewidth=1, label="fitted = measured")
        for part in np.unique(found.component).tolist():
            _points(axes, found, part, factor)
        axes.set(xlim=(low, high), ylim=(low, high))
        axes.set_yticks([tick for tick in axes.get_xticks() if low <= tick <= high])
        axes.annotate(
            f"slope {slope}",
            (0.97, 0.05),
            xycoords="axes fraction",
            ha="right",
            color=style.INK,
            bbox={"facecolor": style.SURFACE, "edgecolor": "none", "pad": 1.5},
        )

    return draw(
        name=f"fit-{found.kind.replace('_', '-')}-{place}",
        paint=paint,
        x=f"{name}, fitted{unit}",
        y=f"measured{unit}",
        columns=2,
        height=_HEIGHT,
        alt=f"{name}: measured over fitted values, slope {slope}.",
        caption=f"Measured over fitted values of {found.column} ({found.kind}), bars of 95 %.",
    )


def _points(axes: Axes, found: AgainstFit, part: int, factor: float) -> None:
    """One component of the numbers, with bars both ways."""
    mine, vibration = found.component == part, bool(np.any(found.component))
    drawn: dict[str, Any] = style.line(part, size=3.2)
    axes.errorbar(
        found.fitted[mine] / factor,
        found.measured[mine] / factor,
        xerr=found.fitted_uncertainty[mine] / factor,
        yerr=found.measured_uncertainty[mine] / factor,
        color=drawn["color"],
        marker=drawn.get("marker", "o"),
        markersize=3.2,
        linestyle="none",
        elinewidth=0.8,
        label=_PARTS[part] if vibration else "readings",
    )


def _range(found: AgainstFit, factor: float) -> tuple[float, float]:
    ends = [
        value + sign * width
        for value, width in (
            (found.measured, found.measured_uncertainty),
            (found.fitted, found.fitted_uncertainty),
        )
        for sign in (-1, 1)
    ]
    low, high = float(np.min(ends)) / factor, float(np.max(ends)) / factor
    beside = _MARGIN * (high - low)
    return low - beside, high + beside


def _slope(found: AgainstFit) -> str:
    width = found.slope_uncertainty
    if found.slope is None or width is None:
        return "undefined"
    return f"{rounded(found.slope, width)} ± {rounded(width, width)}"
