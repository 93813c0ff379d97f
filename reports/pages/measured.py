"""The measurements that a scene was fitted to: data, fit, and what was known before and after."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record, Section
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.describe import usual_name

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

    def paint(axes: Axes) -> None:
        for row, each in enumerate(quantities):
            scale = _scale(each)
            for side, ends, middle, colour, label in (
                (0.28, ("before_low", "before_high"), each["before"], style.PAPER, "before"),
                (0.04, ("low", "high"), each["value"], style.FOUND, "after"),
            ):
                shown = [(v - each["value"]) / scale for v in (each[e] for e in ends) if v is not None]
                kept = np.clip(shown, -_FAR, _FAR)
                place = float(np.clip((middle - each["value"]) / scale, -_FAR, _FAR))
                axes.plot(kept, [row + side] * len(kept), color=colour, linewidth=2.5)
                axes.plot([place], [row + side], "o", color=colour, label=label if row == 0 else None)
            # Names are longer than the margin beside the axes.
            axes.text(-_FAR, row - 0.27, usual_name(each["quantity"]), verticalalignment="center")
        axes.set_yticks([])
        axes.set_ylim(len(quantities) - 0.5, -0.5)

    return draw(
        name="fitted-intervals",
        paint=paint,
        x="distance from the fitted value, in half-widths of its interval",
        wide=True,
        height=1.2 + _ROW * len(quantities),
        alt="Intervals of the fitted quantities before and after the fit.",
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

    def paint(axes: Axes) -> None:
        for place, each in enumerate(drawn):
            axes.plot(*_curve(each), label=usual_name(each["quantity"]), **style.line(place))
        axes.axhline(1.0, color=style.MUTED, linewidth=1)
        highest = max(float(np.max(each["rise"])) for each in drawn)
        axes.set(xlim=(-2, 2), ylim=(0, min(1.5 * max(highest, 1.0), _FAR)))

    return draw(
        name="fitted-profiles",
        paint=paint,
        x="distance from the fitted value, in half-widths of its interval",
        y="rise over that at 95 %",
        wide=True,
        height=3.0,
        columns=3,
        alt="Profiles of the likelihood of the fitted quantities.",
    )


SECTION: Final = Section(name="measured", title="Measurements and fit", show=_show, always=True)
