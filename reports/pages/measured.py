"""Measurements and fit: data against fit, and of a fitted scene what was known before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.identification.documents import AgainstFit
from ringbalance.reports.figure import (
    INK,
    MUTED,
    SURFACE,
    Drawing,
    Paint,
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
    found = evidence["scene"].get("measured")
    if not found:
        return None
    sentences = []
    for finding in found["findings"]:
        text = finding["text"]
        for each in found["quantities"]:
            # Usual names in place of keys that are no words.
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
"""Of the range of values, beside the outermost."""


def fit_figures(found: Sequence[AgainstFit]) -> list[Drawing]:
    """Measured over fitted values with their 95 % intervals, and the line on which both are equal."""
    return [_against(each, place) for place, each in enumerate(found)]


def _against(found: AgainstFit, place: int) -> Drawing:
    factor = unit_factor(found.unit) if found.unit else 1.0
    unit = _SIGNS.get(found.unit, found.unit) or "1"
    pairs = ((found.measured, found.measured_uncertainty), (found.fitted, found.fitted_uncertainty))
    least = min(float(np.min(value - width)) for value, width in pairs) / factor
    most = max(float(np.max(value + width)) for value, width in pairs) / factor
    low, high = least - _MARGIN * (most - least), most + _MARGIN * (most - least)
    slope, width, told = found.slope, found.slope_uncertainty, "undefined"
    if slope is not None and width is not None:
        told = f"{rounded(slope, width)} ± {rounded(width, width)}"

    def ends(axes: Axes) -> None:
        axes.set(xlim=(low, high), ylim=(low, high))
        axes.set_yticks([tick for tick in axes.get_xticks() if low <= tick <= high])
        axes.annotate(
            f"slope {told}",
            (0.97, 0.05),
            xycoords="axes fraction",
            ha="right",
            color=INK,
            bbox={"facecolor": SURFACE, "edgecolor": "none", "pad": 1.5},
        )

    return draw(
        f"fit-{found.kind.replace('_', '-')}-{place}",
        curve((low, high), (low, high), "fitted = measured", color=MUTED, linewidth=1),
        *(_points(found, part, factor) for part in np.unique(found.component).tolist()),
        ends,
        x=(f"{_NAMES.get(found.kind, found.kind)}, fitted", unit),
        y=("measured", unit),
        height=3.6,
    )


def _points(found: AgainstFit, part: int, factor: float) -> Paint:
    """One component of the numbers, with bars both ways."""
    mine, vibration = found.component == part, bool(np.any(found.component))
    return lambda axes: axes.errorbar(
        found.fitted[mine] / factor,
        found.measured[mine] / factor,
        xerr=found.fitted_uncertainty[mine] / factor,
        yerr=found.measured_uncertainty[mine] / factor,
        **line(part, size=3.2),
        linestyle="none",
        elinewidth=0.8,
        label=_PARTS[part] if vibration else "readings",
    )
