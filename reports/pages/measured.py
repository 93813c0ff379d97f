"""Measurements and fit: data against fit, and the findings of a fitted scene."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.identification.documents import AgainstFit
from ringbalance.reports.figure import (
    INK,
    MUTED,
    SURFACE,
    Drawing,
    curve,
    draw,
    line,
)
from ringbalance.reports.prose import opening
from ringbalance.reports.section import Record, Section
from ringbalance.results.numbers import rounded
from ringbalance.scene.describe import usual_name
from ringbalance.scene.units import unit_factor


def _show(_own: Record, evidence: Record) -> Record | None:
    measured = evidence["scene"].get("measured")
    if not measured:
        return None
    sentences = []
    for finding in measured["findings"]:
        text = finding["text"]
        for each in measured["quantities"]:
            # Keys are shown as names.
            if "_" in each["quantity"]:
                text = text.replace(each["quantity"], usual_name(each["quantity"]))
        sentences.append(f"{opening(text)}.".replace(" -", " \N{MINUS SIGN}"))
    return {"findings": sentences}


SECTION: Final = Section(name="measured", title="Measurements and fit", show=_show, always=True)


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
_MARGIN: Final = 0.08
"""Margin beyond the outermost values, over their range."""


def fit_figures(comparisons: Sequence[AgainstFit]) -> list[Drawing]:
    """Measured over fitted values with their 95 % intervals, and the line on which both are equal."""
    drawings = []
    for index, data in enumerate(comparisons):
        factor = unit_factor(data.unit) if data.unit else 1.0
        unit = _SIGNS.get(data.unit, data.unit) or "1"
        pairs = ((data.measured, data.measured_uncertainty), (data.fitted, data.fitted_uncertainty))
        least = min(float(np.min(value - width)) for value, width in pairs) / factor
        most = max(float(np.max(value + width)) for value, width in pairs) / factor
        ends = least - _MARGIN * (most - least), most + _MARGIN * (most - least)
        drawing = draw(
            f"fit-{data.kind.replace('_', '-')}-{index}",
            curve(ends, ends, "fitted = measured", color=MUTED, linewidth=1),
            partial(_readings, data, factor),
            partial(_slope, data, ends),
            x=(f"{_NAMES.get(data.kind, data.kind)}, fitted", unit),
            y=("measured", unit),
            height=3.6,
        )
        drawings.append(drawing)
    return drawings


def _readings(data: AgainstFit, factor: float, axes: Axes) -> None:
    """Each component of the readings, with bars both ways."""
    vibration = bool(np.any(data.component))
    for part in np.unique(data.component).tolist():
        mask = data.component == part
        axes.errorbar(
            data.fitted[mask] / factor,
            data.measured[mask] / factor,
            xerr=data.fitted_uncertainty[mask] / factor,
            yerr=data.measured_uncertainty[mask] / factor,
            **line(part, size=3.2),
            linestyle="none",
            elinewidth=0.8,
            label=_PARTS[part] if vibration else "readings",
        )


def _slope(data: AgainstFit, ends: tuple[float, float], axes: Axes) -> None:
    """Equal limits and ticks on both axes, and the slope of measured over fitted values."""
    axes.set(xlim=ends, ylim=ends)
    axes.set_yticks([tick for tick in axes.get_xticks() if ends[0] <= tick <= ends[1]])
    slope, width, text = data.slope, data.slope_uncertainty, "undefined"
    if slope is not None and width is not None:
        text = f"{rounded(slope, width)} ± {rounded(width, width)}"
    ground = {"facecolor": SURFACE, "edgecolor": "none", "pad": 1.5}
    look: Record = {"xycoords": "axes fraction", "ha": "right", "color": INK, "bbox": ground}
    axes.annotate(f"slope {text}", (0.97, 0.05), **look)
