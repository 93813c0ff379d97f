"""The measurements that a scene was fitted to: data, fit, and what was known before and after."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record, Section, Table
from ringbalance.results.numbers import MISSING, number, short
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
    parts: list[tuple[str, Any]] = [
        ("lead", _lead(found)),
        ("table", _files(found)),
        ("table", _quantities(found)),
        ("figure", _intervals(found)),
    ]
    if any(len(each["profile"]) > 2 for each in found["quantities"]):
        parts.append(("figure", _profiles(found)))
    if found["findings"]:
        parts.append(("items", [_sentence(each["text"], found) for each in found["findings"]]))
    return {"parts": parts}


def _lead(found: Record) -> str:
    rows = sum(each["rows"] for each in found["files"])
    measured = [each for each in found["quantities"] if each["verdict"] == "identified"]
    others = (
        ""
        if len(measured) == len(found["quantities"])
        else "; the others have the values that go with a combination that the data identify, or with what "
        "was known before"
    )
    return (
        f"This scene was fitted to {rows} measurements. They identify {len(measured)} of "
        f"{len(found['quantities'])} fitted quantities{others}. Every uncertainty stands by itself: how the "
        "errors of two quantities go together is not in the results of this report."
    )


def _sentence(text: str, found: Record) -> str:
    """A finding, with the quantities' usual names in place of keys that are no words."""
    for each in found["quantities"]:
        if "_" in each["quantity"]:
            text = text.replace(each["quantity"], usual_name(each["quantity"]))
    return f"{text[0].upper()}{text[1:]}.".replace(" -", " \N{MINUS SIGN}")


def _files(found: Record) -> Table:
    return Table(
        caption="Measurements. The hash (SHA-256) names the file’s bytes.",
        heads=("File", "Kind", "Rows", "SHA-256"),
        rows=[
            (each["file"], each["kind"].replace("_", " "), str(each["rows"]), each["sha256"][:12])
            for each in found["files"]
        ],
    )


def _quantities(found: Record) -> Table:
    return Table(
        caption="Fitted quantities, with intervals (95 %) before and after the fit.",
        heads=("Quantity", "Unit", "Before", "Interval before", "Fitted", "Interval", "Verdict"),
        rows=[
            (
                usual_name(each["quantity"]),
                MISSING if each["unit"] == "1" else each["unit"],
                short(each["before"]),
                _interval(each["before_low"], each["before_high"]),
                number(each["value"]),
                _interval(each["low"], each["high"]),
                each["verdict"],
            )
            for each in found["quantities"]
        ],
        style="dense",
    )


def _interval(low: float | None, high: float | None) -> str:
    return MISSING if low is None or high is None else f"{number(low)} to {number(high)}"


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
        caption="Intervals (95 %) before and after the fit, in half-widths of the one after; cut off at "
        f"{short(_FAR)}. A point without a line had no interval.",
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
        caption="Profiles: minus two log likelihood above its least, all other quantities fitted again, over "
        "the rise that bounds the interval (line at 1). A parabola through 1 at distance 1 is a quantity "
        "in which the model is linear.",
    )


SECTION: Final = Section(
    name="measured", title="Measurements and fit", show=_show, always=True, in_parts=True
)
