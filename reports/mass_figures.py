"""Figures of one run with two eccentric masses, from its document in SI."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter
from numpy.typing import ArrayLike

from ringbalance.reports.figure import (
    AMPLITUDE,
    AS_PAPER,
    FOUND,
    INK,
    MUTED,
    THIRD,
    TIME,
    AxisLabel,
    Drawing,
    Paint,
    amplitudes,
    curve,
    draw,
    figure_of,
    level,
    note,
    panels,
    plain_number,
    upright,
)
from ringbalance.reports.section import Record
from ringbalance.results.numbers import display_unit, number, shown
from ringbalance.scene.arrays import FloatArray

BAND_SIGMAS: Final = 2.0
"""Half-width of a band, standard deviations: a normal error is within it with 95 %."""
_COLOURS: Final = (FOUND, THIRD)
_LOCKED: Final = {**AS_PAPER, "linewidth": 1.2, "label": "masses locked"}
_BALANCED: Final = {"color": FOUND, "linewidth": 1.2, "label": "balanced"}
_STAGE_NUMBER_WIDTH: Final = 0.012
"""Fraction of the time axis that the number of a stage needs."""
_NARROW_HEIGHT_IN: Final = 2.4
_MAX_LAG_DEG: Final = 300
"""Angle above which a lag is shown as a lead."""
_ACROSS: Final = ("data", "axes fraction")


def over_time(run: Record, locked: Record, devices: Record | None = None) -> Drawing:
    """Vibration amplitude over time, balanced and with the masses locked, with the limit: while the strategy
    works, its stages numbered, and over the whole run.

    Args: `devices`: band of drawn devices, `time_s`, `low_m` and `high_m`.
    """
    curves = [
        (each["time_s"], each["amplitude_m"], look) for each, look in ((locked, _LOCKED), (run, _BALANCED))
    ]

    band = [] if devices is None else [_band(devices["time_s"], devices["low_m"], devices["high_m"])]

    unit = display_unit("m", *run["amplitude_m"], run["limit_m"])

    def paint(axes: Axes) -> None:
        early, all_run = panels(axes, (0.09, 0.15, 0.43, 0.74), (0.56, 0.15, 0.42, 0.74))
        for panel, end in ((early, _until(run)), (all_run, run["time_s"][-1])):
            for part in (*band, amplitudes(curves, run["limit_m"])):
                part(panel)
            panel.set(xlim=(run["time_s"][0], end), xlabel="time in s")
            for index, stage in enumerate(run["stages"]):
                begin, last = stage["start_s"], min(stage["end_s"], end)
                if index % 2 == 0:
                    panel.axvspan(begin, last, color=MUTED, alpha=0.12, linewidth=0)
                if last - begin > _STAGE_NUMBER_WIDTH * end and (panel is early or last == end):
                    look: dict[str, Any] = {"xycoords": _ACROSS, "va": "top", "ha": "center"}
                    note(str(index + 1), ((begin + last) / 2, 1), (0, -3), **look)(panel)
            panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: plain_number(unit.factor * value)))
        early.set_ylabel(f"{AMPLITUDE[0]} in {unit.symbol}")
        all_run.tick_params(labelleft=False)
        handles, labels = all_run.get_legend_handles_labels()
        figure_of(axes).legend(handles, labels, loc="upper left", ncols=4, borderaxespad=0.0, borderpad=0.1)

    return draw("eccentric-amplitude", paint, columns=0, wide=True, height=2.7)


def _band(x: ArrayLike, low: ArrayLike, high: ArrayLike) -> Paint:
    """Shade from the least to the largest amplitude of drawn devices, m."""
    look: dict[str, Any] = {"color": FOUND, "alpha": 0.2, "linewidth": 0, "label": "drawn devices"}
    return lambda axes: axes.fill_between(np.asarray(x), np.asarray(low), np.asarray(high), **look)


def run_up(run: Record, locked: Record, rotor: Record, devices: Record | None = None) -> list[Drawing]:
    """Bode plot of a run-up: vibration amplitude over speed, balanced and with the masses locked, and the lag
    of the locked rotor behind its unbalance, with the critical speed.

    Args: `rotor`: its `critical_speed_rad_s`, `amplification_factor` (None: none is defined), and
    `locked_phase_rad`, the phase of the unbalance with the masses locked. `devices`: as in `over_time`.
    """
    lag = np.degrees((rotor["locked_phase_rad"] - np.asarray(locked["phase_rad"])) % math.tau)
    # A small lead is not shown as a lag of almost a turn.
    lag = np.where(lag > _MAX_LAG_DEG, lag - 360, lag)
    critical, factor = rotor["critical_speed_rad_s"], rotor["amplification_factor"]
    ends = min(*run["speed_rad_s"], critical), max(*run["speed_rad_s"], critical)
    at_critical = upright(critical, color=INK, linewidth=0.9, linestyle=(0, (6, 2, 1, 2)))
    text = f"critical speed {shown(critical, 'rad/s', digits=3)}"
    text += f", amplification factor {number(factor, digits=2)}" if factor else ""
    # Clear of the lag curve, which passes 90 degrees at the critical speed.
    right = critical > sum(ends) / 2
    aligned: dict[str, Any] = {"ha": "right", "va": "top"} if right else {"ha": "left", "va": "bottom"}
    shift, height = ((-4, -4), 1.0) if right else ((4, 4), 0.0)
    over: dict[str, Any] = {"x": ("speed", "rad/s"), "xlim": ends, "wide": True}
    bands = []
    if devices is not None:
        # At a constant speed the band has one width for each time, and no width over the speed.
        speed = np.asarray(np.interp(devices["time_s"], run["time_s"], run["speed_rad_s"]))
        changing = np.flatnonzero(np.diff(speed)) + 1
        bands.append(
            _band(speed[changing], *(np.asarray(devices[key])[changing] for key in ("low_m", "high_m")))
        )
    pairs = ((locked, _LOCKED), (run, _BALANCED))
    curves = [(each["speed_rad_s"], each["amplitude_m"], look) for each, look in pairs]
    return [
        draw(
            "eccentric-run-up",
            *bands,
            amplitudes(curves, run["limit_m"]),
            at_critical,
            y=("amplitude", "m"),
            columns=4,
            height=2.1,
            **over,
        ),
        draw(
            "eccentric-lag",
            curve(locked["speed_rad_s"], lag, **_LOCKED),
            at_critical,
            note(text, (critical, height), shift, xycoords=_ACROSS, **aligned),
            lambda axes: axes.set_yticks((0, 90, 180)),
            y=("lag", "°"),
            ylim=(-30, 210),
            height=1.5,
            **over,
        ),
    ]


def mass_angles(run: Record) -> Drawing:
    """Angles of both masses and their goals over time, degrees, until shortly after balancing."""
    early, time = _early(run)
    angles, goals = (np.degrees(run[key])[:, early] for key in ("mass_angle_rad", "goal_rad"))
    return draw(
        "eccentric-angles",
        *(
            paint
            for index, colour in enumerate(_COLOURS)
            for paint in (
                curve(time, angles[index], f"mass {index + 1}", color=colour),
                curve(time, goals[index], f"goal {index + 1}", color=colour, linewidth=1, linestyle=":"),
            )
        ),
        x=TIME,
        y=("angle", "°"),
        xlim=(0, _until(run)),
        columns=4,
        height=_NARROW_HEIGHT_IN,
    )


def imbalance_estimate(run: Record, true: float) -> Drawing:
    """Magnitude of the estimated imbalance over time, kg m, with its 95 % band and the true one."""
    vector = np.asarray(run["estimates"]["imbalance_kg_m"])
    covariance = np.asarray(run["estimates"]["imbalance_covariance"])
    size = np.hypot(*vector)
    direction = vector / np.where(size > 0, size, 1.0)
    deviation = np.sqrt(np.maximum(np.einsum("in,nij,jn->n", direction, covariance, direction), 0.0))
    return _estimate(run, "imbalance", ("imbalance", "kg m"), [size], [deviation], [true])


def friction_estimates(run: Record, true: Sequence[float]) -> Drawing:
    """Estimated friction arms over time, m, with their 95 % bands and the true ones."""
    arms = np.asarray(run["estimates"]["friction_arm_m"])
    deviations = np.sqrt(np.asarray(run["estimates"]["friction_variance"]))
    return _estimate(run, "friction", ("friction arm", "m"), arms, deviations, true)


def _estimate(
    run: Record,
    name: str,
    label: AxisLabel,
    values: Sequence[FloatArray] | FloatArray,
    deviations: Sequence[FloatArray] | FloatArray,
    true: Sequence[float],
) -> Drawing:
    early, time = _early(run)
    paints: list[Paint] = []
    for index, (value, deviation) in enumerate(zip(values, deviations, strict=True)):
        colour, which = _COLOURS[index], f" {index + 1}" if len(true) > 1 else ""
        band: ArrayLike = BAND_SIGMAS * deviation[early]
        paints.append(curve(time, value[early], f"estimate{which}", band=band, color=colour))
        paints.append(level(true[index], f"true{which}", color=colour, linewidth=1, linestyle=":"))
    largest = max(*true, *(float(np.max(value[early])) for value in values), 0.0)
    return draw(
        f"eccentric-{name}",
        *paints,
        x=TIME,
        y=label,
        xlim=(0, _until(run)),
        ylim=(min(0.0, -0.1 * largest), 1.5 * largest or 1.0),
        columns=4,
        height=_NARROW_HEIGHT_IN,
    )


def _early(run: Record) -> tuple[Any, FloatArray]:
    """Mask of the instants before `_until`, and their times, s."""
    time = np.asarray(run["time_s"])
    early = time <= _until(run)
    return early, time[early]


def _until(run: Record) -> float:
    """End of the time axis, s: shortly after the last stage has begun."""
    end, last = run["time_s"][-1], run["stages"][-1]["start_s"]
    return float(min(end, 1.2 * last) if last > 0 else end) or 1.0
