"""What an engineer looks up: where the disc works, what it can do, and what the results hang on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from scipy.ndimage import distance_transform_edt

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.prose import key_words
from ringbalance.reports.section import Record
from ringbalance.results.numbers import given, number, percent, shown
from ringbalance.scene.arrays import FloatArray

_SHADES: Final = {
    "siphon": (style.FOUND, 0.30),
    "separated": (style.THIRD, 0.24),
    "spilling": (style.FIFTH, 0.30),
    "blocked": (style.MUTED, 0.10),
    "reverse": (style.FOURTH, 0.26),
    "cannot be told": (style.PAPER, 0.22),
}
_CLEARANCE: Final = 2.2
"""Cells between a regime's name and the edge of its area, at the least."""
_LINE: Final = 0.035
"""Of the map's height on either side of the working range, which its regimes' names keep clear of."""
_MICROMETRE: Final = 1e6
_BARS: Final = 5
"""Inputs that a panel of the tornado shows."""
_BINS: Final = 16
_WIDEST: Final = 2.5
"""Times the requirement at which a bar is cut off."""
_LABEL_ANGLES: Final = (-90, -75, -105, -60, -120, -45, -135)
"""Where the label of a ring may stand, deg; the first of equals is taken."""


def operating_map(found: Record) -> Drawing:
    """Regime of the unprimed tube over the driven chamber's fill and the gas pressure.

    Args: `found`: `operating_map` of the evidence: axes, names and numbers of the regimes, the
    operating point and the fills that the scene's gas works between.
    """
    fill, pressure = np.asarray(found["fill_ratio"]), np.asarray(found["gas_pressure_Pa"]) * 1e-6
    regime, names = np.array([[int(sign) for sign in row] for row in found["regime"]]), found["regimes"]
    point, working = found["point"], found["working_fill_ratio"]
    gas = point["gas_pressure_Pa"] * 1e-6

    def paint(axes: Axes) -> None:
        for index, name in enumerate(names):
            colour, strength = _SHADES[name]
            there = regime == index
            if there.all() or not there.any():
                continue
            axes.contourf(fill, pressure, there, levels=[0.5, 1.5], colors=[colour], alpha=strength)
            axes.contour(fill, pressure, there, levels=[0.5], colors=[style.MUTED], linewidths=0.7)
        clear = _LINE * (pressure[-1] - pressure[0])
        _name_areas(
            axes, fill, pressure, np.where(np.abs(pressure - gas)[:, None] < clear, -1, regime), names
        )
        axes.plot(
            working, [gas, gas], "|-", color=style.INK, linewidth=2, markersize=9, label="working range"
        )
        axes.plot([point["fill_ratio"]], [gas], "o", color=style.INK, markersize=6, label="operating point")
        axes.set(xlim=(fill[0], fill[-1]), ylim=(pressure[0], pressure[-1]))
        axes.grid(visible=False)

    there = point["regime"]
    low, high = (number(value, digits=2) for value in working)
    return draw(
        name="operating-map",
        paint=paint,
        x="fill ratio of the driven chamber",
        y="gas pressure in MPa, gauge",
        columns=2,
        wide=True,
        height=3.6,
        alt=f"Map of the tube’s regimes over fill and gas pressure; at the operating point: {there}.",
        caption=f"Regime of the tube as the gas valve opens, the opposite chamber holding the rest of the "
        f"pair’s liquid. At the operating point: {there}. Working range: fills of {low} to {high} at "
        f"{given(point['gas_pressure_Pa'], 'Pa')}; outside it gas enters a port.",
    )


def _name_areas(axes: Axes, fill: FloatArray, pressure: FloatArray, regime: Any, names: list[str]) -> None:
    """Each regime's name at the place in its area that is farthest from the edges."""
    for index, name in enumerate(names):
        room = distance_transform_edt(np.pad(regime == index, 1))[1:-1, 1:-1]
        row, column = np.unravel_index(np.argmax(room), room.shape)
        if room[row, column] >= _CLEARANCE:
            axes.text(
                fill[column], pressure[row], name, ha="center", va="center", color=style.INK, weight="bold"
            )


def tornado(budgets: dict[str, Record], titles: dict[str, str]) -> Drawing | None:
    """Contribution of each input, of the model and of the numerics to the main results' uncertainties.

    Args: `budgets`: `budgets` of the calibration, by quantity. `titles`: of the quantities to show, by key.
    Returns: The figure, a panel a quantity; None without any.
    """
    panels = {titles[key]: budgets[key] for key in titles if key in budgets and budgets[key]["value"]}
    if not panels:
        return None
    columns = 3 if len(panels) > 2 else len(panels)
    rows = -(-len(panels) // columns)
    height = 0.35 + rows * (0.55 + 0.2 * (_BARS + 2))

    def paint(axes: Axes) -> None:
        axes.set_axis_off()
        for place, (title, budget) in enumerate(panels.items()):
            row, column = divmod(place, columns)
            side, room = 1 / columns, 1 / rows
            bars = style.figure_of(axes).add_axes(
                ((column + 0.47) * side, 1 - (row + 0.86) * room, 0.47 * side, 0.68 * room)
            )
            _panel(bars, title, budget)

    told = "; ".join(f"{title}: {_causes(budget)[0][0]}" for title, budget in panels.items())
    return draw(
        name="tornado",
        paint=paint,
        columns=0,
        wide=True,
        height=height,
        alt=f"Contributions to the uncertainty of each result, in percent; the largest are {told}.",
        caption="What the main results hang on: expanded uncertainty (95 %) that each cause alone gives, in "
        f"percent of the result. The largest cause: {told}.",
    )


def _causes(budget: Record) -> list[tuple[str, float]]:
    """Names and relative contributions, the largest first."""
    own = [(key_words(path), width) for path, width in budget["inputs"].items()]
    own += [("the model", budget["model"]), ("numerics", budget["numerical"])]
    return sorted(((name, abs(width / budget["value"])) for name, width in own), key=lambda c: -c[1])


def _panel(bars: Axes, title: str, budget: Record) -> None:
    causes = _causes(budget)[:_BARS]
    for place, (name, share) in enumerate(causes):
        colour = {"the model": style.PAPER, "numerics": style.MUTED}.get(name, style.FOUND)
        bars.barh(place, 200 * share, left=-100 * share, height=0.62, color=colour, linewidth=0)
    limit = 115 * max(causes[0][1], 1e-9)
    bars.set(ylim=(len(causes) - 0.4, -0.6), xlim=(-limit, limit))
    bars.set_yticks(range(len(causes)), [name for name, _ in causes])
    bars.tick_params(axis="y", length=0)
    ticks = _nice_span(limit)
    bars.set_xticks(
        ticks[:: len(ticks) // 2], [f"{style.plain_number(t)} %" for t in ticks[:: len(ticks) // 2]]
    )
    bars.set_title(title.split(",")[0], loc="left", x=-0.9, fontsize="medium", weight="bold", color=style.INK)
    bars.grid(visible=False, axis="y")
    bars.spines["left"].set_visible(False)


def settling_histogram(samples: Sequence[Record]) -> Drawing | None:
    """Settling times of samples of runs, a panel each, with those that never settle as a bar of their own.

    Args: `samples`: `title`, `edges_s`, `counts`, `runs`, `not_settled` (fraction), `time_limit_s` of
    each.
    Returns: The figure; None without samples.
    """
    if not samples:
        return None

    def paint(axes: Axes) -> None:
        axes.set_axis_off()
        side = 1 / len(samples)
        for place, sample in enumerate(samples):
            panel = style.figure_of(axes).add_axes((place * side + 0.085, 0.2, side - 0.105, 0.62))
            _histogram(panel, sample)
            if not place:
                panel.set_ylabel("share of all runs in %")

    told = "; ".join(f"{percent(s['not_settled'])} of {s['runs']} {s['title']}" for s in samples)
    return draw(
        name="settling-histogram",
        paint=paint,
        columns=0,
        wide=True,
        height=2.7,
        alt=f"Histogram of settling times. Runs that do not settle: {told}.",
        caption=f"Settling times over the stated uncertainties and the noise. Not settled by "
        f"{given(samples[0]['time_limit_s'], 's')}: {told}.",
    )


def _histogram(panel: Axes, sample: Record) -> None:
    edges, counts = np.asarray(sample["edges_s"], dtype=float), np.asarray(sample["counts"], dtype=float)
    step = max(-(-counts.size // _BINS), 1)
    starts = np.arange(0, counts.size, step)
    shares = 100 * np.add.reduceat(counts, starts) / sample["runs"]
    ends = edges[np.append(starts, counts.size)]
    panel.bar(
        ends[:-1], shares, width=np.diff(ends), align="edge", color=style.FOUND, edgecolor=style.SURFACE
    )
    span = float(ends[-1] - ends[0])
    place, width = ends[-1] + 0.14 * span, 0.1 * span
    never = 100 * sample["not_settled"]
    panel.bar(
        place, never, width=width, color=style.SURFACE, edgecolor=style.PAPER, hatch="////", linewidth=1
    )
    panel.text(place, never + 1.5, percent(sample["not_settled"]), ha="center", color=style.PAPER)
    ticks = [tick for tick in _nice_span(float(ends[-1])) if ends[0] <= tick <= ends[-1] - 0.05 * span]
    panel.set_xticks([*ticks, place], [*(style.plain_number(tick) for tick in ticks), "never"])
    panel.set_title(sample["title"], loc="left", fontsize="medium", color=style.INK)
    panel.set(xlabel="settling time in s", xlim=(ends[0], place + width), ylim=(0, 112))


def residual_polar(run: Record, reach: Record | None = None) -> Drawing:
    """Residual vibration as a vector over a run, with the limit's circle and what the disc can cancel.

    Args: `run`: a simulation document. `reach`: of a pair alone, `vibration_m`, and of the first pair,
    `direction_rad` as vibration, with the number of `pairs`; None: not shown.
    """
    vector = np.asarray(run["amplitude_m"]) * np.exp(1j * np.asarray(run["phase_rad"])) * _MICROMETRE
    limit = run["limit_m"] * _MICROMETRE
    ends = np.zeros(0, dtype=np.complex128)
    if reach is not None:
        ends = reachable(reach["vibration_m"] * _MICROMETRE, reach["direction_rad"], reach["pairs"])

    def paint(axes: Axes) -> None:
        axes.set_axis_off()
        panels = [style.figure_of(axes).add_axes((left, 0.02, 0.42, 0.9)) for left in (0.02, 0.55)]
        whole, close = 1.15 * float(np.abs([*vector, *ends, limit]).max()), 4 * limit
        for panel, span, title in zip(panels, (whole, close), ("whole run", "near the limit"), strict=True):
            _residual(panel, vector, limit, span, ends)
            panel.set_title(title, loc="left", fontsize="medium", color=style.INK)
        panels[1].text(-0.98 * close, -0.98 * close, "circle: limit", color=style.PAPER)
        if ends.size:
            closed, corner = np.append(ends, ends[0]), -0.98 * whole
            panels[0].plot(closed.real, closed.imag, color=style.THIRD, linestyle=(0, (5, 2)))
            panels[0].text(corner, corner, "dashed: what the disc can cancel", color=style.THIRD)

    first, last = (shown(float(abs(vector[i])) / _MICROMETRE, "m", digits=2) for i in (0, -1))
    dashed = " Dashed: vibrations that the pairs can cancel together, each within its usable moment."
    return draw(
        name="residual-polar",
        paint=paint,
        columns=0,
        wide=True,
        height=3.7,
        alt=f"Residual vibration as a vector in the rotor’s plane, from {first} to {last}.",
        caption=f"Residual vibration as a vector, from {first} (ring) to {last} (dot); radius in µm, angle "
        f"as the sensor’s phase. Solid circle: the limit.{dashed if ends.size else ''}",
    )


def reachable(length: float, direction: float, pairs: int) -> Any:
    """Corners of what equal pairs give together, each between plus and minus its length, as complex vectors.

    The first is the sum of all, l e^(jd) (1 + e^(j pi/n) + ... ) = 2 l e^(jd)/(1 - e^(j pi/n)); each next one
    has one sign changed, which turns it by pi/n.
    Args: `length`: of one pair's vector. `direction`: of the first pair's, rad.
    """
    step = np.exp(1j * math.pi / pairs)
    return 2 * length * np.exp(1j * direction) / (1 - step) * step ** np.arange(2 * pairs)


def _residual(panel: Axes, vector: Any, limit: float, span: float, ends: Any) -> None:
    """Args: `ends`: corners of what is drawn dashed, for the labels of the rings to keep away from."""
    panel.set(xlim=(-span, span), ylim=(-span, span), aspect="equal")
    panel.axhline(0, color=style.GRID, linewidth=0.8)
    panel.axvline(0, color=style.GRID, linewidth=0.8)
    panel.grid(visible=False)
    for spine in panel.spines.values():
        spine.set_visible(False)
    rings = [ring for ring in _nice_span(span) if ring > 0]
    for ring in rings:
        panel.add_patch(Circle((0, 0), ring, fill=False, color=style.GRID, linewidth=0.8))
        label = _clearest(ring, vector, ends)
        panel.text(
            label.real,
            label.imag,
            f"{style.plain_number(ring)} µm",
            color=style.MUTED,
            ha="center",
            va="center",
            bbox={"facecolor": style.SURFACE, "edgecolor": "none", "pad": 1},
        )
    panel.set_xticks([])
    panel.set_yticks([])
    panel.text(span, 0, "0°", color=style.MUTED, ha="right", va="bottom")
    panel.text(0, span, "90°", color=style.MUTED, va="top")
    panel.add_patch(Circle((0, 0), limit, fill=False, color=style.PAPER, linewidth=1.6))
    panel.plot(vector.real, vector.imag, color=style.FOUND, linewidth=1.1)
    for place, face in ((0, style.SURFACE), (-1, style.FOUND)):
        panel.plot(
            vector.real[place], vector.imag[place], "o", color=style.FOUND, markerfacecolor=face, markersize=6
        )


def _clearest(ring: float, vector: Any, ends: Any) -> complex:
    """Where on the lower half of a ring a label lies farthest from the run and from the dashed sides."""
    sides = np.linspace(ends, np.roll(ends, -1), 40).ravel() if ends.size else ends
    places = ring * np.exp(1j * np.radians(_LABEL_ANGLES))
    gaps = np.abs(places[:, None] - np.concatenate([vector, sides])).min(axis=1)
    return complex(places[int(np.argmax(gaps))])


def requirement_bars(rows: Iterable[Record]) -> Drawing | None:
    """What is required against what is reached, each over its requirement, with 95 % intervals.

    Args: `rows`: `label`, `required`, `reached`, `low` and `high` (ends of what is reached), `at_least`
    (whether more is better) and `verdict` of each; a bar beyond the axis ends in its number.
    Returns: The figure; None without rows.
    """
    kept = [row for row in rows if row["required"] and row["reached"] is not None]
    if not kept:
        return None
    end = min(1.08 * max(1.0, *(row["high"] / row["required"] for row in kept)), _WIDEST)

    def paint(axes: Axes) -> None:
        for place, row in enumerate(kept):
            _requirement_bar(axes, place, row, end)
        axes.set_yticks([])
        axes.set(ylim=(len(kept) - 0.6, -0.95), xlim=(0, end))
        axes.spines["left"].set_visible(False)
        axes.grid(visible=False, axis="y")

    told = "; ".join(f"{row['label']} {row['verdict']}" for row in kept)
    return draw(
        name="requirements",
        paint=paint,
        x="reached over required",
        columns=0,
        wide=True,
        height=0.8 + 0.44 * len(kept),
        alt=f"Requirements against what is reached: {told}.",
        caption="Reached over required, with the 95 % interval where known. The line at 1 is the "
        "requirement; a number stands where a bar or an interval goes on beyond the axis.",
    )


def _requirement_bar(axes: Axes, place: int, row: Record, end: float) -> None:
    ratio, low, high = (row[key] / row["required"] for key in ("reached", "low", "high"))
    colour = {"met": style.THIRD, "not met": style.PAPER}.get(row["verdict"], style.FIFTH)
    axes.barh(place, min(ratio, end), height=0.42, color=colour, alpha=0.75, linewidth=0)
    if high > low:
        axes.plot([low, min(high, end)], [place, place], color=style.INK, linewidth=1.2)
        caps = [each for each in (low, high) if each < end]
        axes.plot(caps, [place] * len(caps), "|", color=style.INK, markersize=6)
    axes.plot([1, 1], [place - 0.24, place + 0.24], color=style.INK, linewidth=1.8)
    if high > end:
        start = "up to " if ratio <= end else ("" if high <= ratio else f"{number(ratio, digits=2)} to ")
        beyond = f"{start}{number(max(ratio, high), digits=2)} \u25b8"
        axes.text(0.995 * end, place - 0.28, beyond, ha="right", va="bottom", color=style.INK)
    sense = "at least" if row["at_least"] else "at most"
    axes.text(0.0, place - 0.28, f"{row['label']} ({sense}): {row['verdict']}", va="bottom", color=style.INK)


def _nice_span(span: float) -> list[float]:
    """Two to five round ticks on either side of zero, and zero, within plus and minus a span."""
    step = next(
        step * 10.0**exponent
        for exponent in range(math.floor(math.log10(span)) - 1, 99)
        for step in (1, 2, 5)
        if span / (step * 10.0**exponent) < 3
    )
    count = int(span / step)
    return [step * place for place in range(-count, count + 1)]
