"""Measurements and fit: data against fit, and of a fitted scene what was known before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.identification.documents import AgainstFit
from ringbalance.reports.figure import (
    FOUND,
    INK,
    MUTED,
    PAPER,
    SURFACE,
    Drawing,
    Paint,
    curve,
    draw,
    level,
    line,
)
from ringbalance.reports.section import Record, Section
from ringbalance.results.numbers import rounded
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.describe import usual_name
from ringbalance.scene.units import unit_factor

_FAR: Final = 4.0
"""Times what the 95 % interval has, above which a profile is not drawn."""
_POINTS: Final = 81
"""Of a drawn profile."""
_ROW: Final = 0.5
"""Height of a parameter in the figure of intervals, inches."""


def _show(_own: Record, evidence: Record) -> Record | None:
    found = evidence["scene"].get("measured")
    if not found:
        return None
    profiled = any(len(each["profile"]) > 2 for each in found["quantities"])
    return {
        "intervals": _intervals(found),
        "profiles": _profiles(found) if profiled else None,
        "findings": [_sentence(each["text"], found) for each in found["findings"]],
    }


def _sentence(text: str, found: Record) -> str:
    """A finding, with the quantities' usual names in place of keys that are no words."""
    for each in found["quantities"]:
        if "_" in each["quantity"]:
            text = text.replace(each["quantity"], usual_name(each["quantity"]))
    return f"{text[0].upper()}{text[1:]}.".replace(" -", " \N{MINUS SIGN}")


def _intervals(found: Record) -> Drawing:
    """Intervals before and after, each relative to the fitted value and the wider of the two."""
    quantities = found["quantities"]

    def interval(row: int, each: Record, ends: tuple[str, str], middle: str, colour: str) -> Paint:
        label = {"before": "before", "value": "after"}[middle] if row == 0 else None
        place = row + (0.28 if middle == "before" else 0.04)
        *shown, centre = (
            float(np.clip((each[key] - each["value"]) / _scale(each), -_FAR, _FAR))
            for key in (*ends, middle)
            if each[key] is not None
        )

        def paint(axes: Axes) -> None:
            axes.plot(shown, [place] * len(shown), color=colour, linewidth=2.5)
            axes.plot([centre], [place], "o", color=colour, label=label)

        return paint

    def names(axes: Axes) -> None:
        # They are longer than the margin beside the axes.
        for row, each in enumerate(quantities):
            axes.text(-_FAR, row - 0.27, usual_name(each["quantity"]), verticalalignment="center")
        axes.set_yticks([])

    return draw(
        "fitted-intervals",
        *(
            interval(row, each, ends, middle, colour)
            for row, each in enumerate(quantities)
            for ends, middle, colour in (
                (("before_low", "before_high"), "before", PAPER),
                (("low", "high"), "value", FOUND),
            )
        ),
        names,
        x=("distance from the fitted value, in half-widths of its interval", "1"),
        ylim=(len(quantities) - 0.5, -0.5),
        wide=True,
        height=1.2 + _ROW * len(quantities),
    )


def _scale(each: Record) -> float:
    """Half-width after the fit; of the interval before, or the value, where there is none."""
    for low, high in (("low", "high"), ("before_low", "before_high")):
        if each[low] is not None and each[high] is not None and each[high] > each[low]:
            return float(each[high] - each[low]) / 2
    return abs(float(each["value"])) or 1.0


def _curve(each: Record) -> tuple[FloatArray, FloatArray]:
    """Distance from the fitted value, and the rise, whose root is nearly straight between the points."""
    away = (np.asarray(each["profile"], dtype=np.float64) - each["value"]) / _scale(each)
    roots = np.sign(away) * np.sqrt(np.maximum(each["rise"], 0.0))
    fine = np.union1d(away, np.linspace(away.min(), away.max(), _POINTS))
    return fine, np.interp(fine, away, roots) ** 2


def _profiles(found: Record) -> Drawing:
    drawn = [each for each in found["quantities"] if len(each["profile"]) > 2]
    highest = max(float(np.max(each["rise"])) for each in drawn)
    return draw(
        "fitted-profiles",
        *(curve(*_curve(each), usual_name(each["quantity"]), **line(i)) for i, each in enumerate(drawn)),
        level(1.0, color=MUTED, linewidth=1),
        x=("distance from the fitted value, in half-widths of its interval", "1"),
        y=("rise over that at 95 %", "1"),
        xlim=(-2, 2),
        ylim=(0, min(1.5 * max(highest, 1.0), _FAR)),
        columns=3,
        wide=True,
        height=3.0,
    )


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
    low, high = _range(found, factor)

    def ends(axes: Axes) -> None:
        axes.set(xlim=(low, high), ylim=(low, high))
        axes.set_yticks([tick for tick in axes.get_xticks() if low <= tick <= high])
        axes.annotate(
            f"slope {_slope(found)}",
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


def _range(found: AgainstFit, factor: float) -> tuple[float, float]:
    pairs = ((found.measured, found.measured_uncertainty), (found.fitted, found.fitted_uncertainty))
    low = min(float(np.min(value - width)) for value, width in pairs) / factor
    high = max(float(np.max(value + width)) for value, width in pairs) / factor
    return low - _MARGIN * (high - low), high + _MARGIN * (high - low)


def _slope(found: AgainstFit) -> str:
    width = found.slope_uncertainty
    if found.slope is None or width is None:
        return "undefined"
    return f"{rounded(found.slope, width)} ± {rounded(width, width)}"
