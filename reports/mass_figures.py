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
    Axis,
    Drawing,
    Paint,
    amplitudes,
    curve,
    draw,
    level,
    note,
    panels,
    plain_number,
)
from ringbalance.reports.section import Record
from ringbalance.results.numbers import number
from ringbalance.scene.arrays import FloatArray

DEVIATIONS: Final = 2.0
"""Half-width of a band: a normal error is within it with 95 %."""
_COLOURS: Final = (FOUND, THIRD)
_LOCKED: Final = {**AS_PAPER, "linewidth": 1.2, "label": "masses locked"}
_BALANCED: Final = {"color": FOUND, "linewidth": 1.2, "label": "balanced"}
_LIMIT: Final = {"color": MUTED, "linewidth": 1, "linestyle": ":", "label": "limit"}
_DRAWN: Final[dict[str, Any]] = {"color": FOUND, "alpha": 0.2, "linewidth": 0}
_SHORTEST: Final = 0.09
"""Fraction of the time axis that the name of a stage needs."""
_MILLIMETRE: Final = 1e3
_NARROW_HEIGHT: Final = 2.4
_RPM: Final = 30 / math.pi
_LAG_TOP: Final = 300
"""Lag, deg, above which an angle is a lead."""
_ACROSS: Final = ("data", "axes fraction")


def over_time(run: Record, locked: Record, drawn: Record | None = None) -> Drawing:
    """Vibration amplitude over time, m, balanced and with the masses locked, with the limit.

    Args: `drawn`: band of drawn devices, `time_s`, `low_m` and `high_m`.
    """
    pairs = ((locked, _LOCKED), (run, _BALANCED))
    return draw(
        "eccentric-amplitude",
        lambda axes: _band(axes, drawn and drawn["time_s"], drawn, 1.0),
        amplitudes([(each["time_s"], each["amplitude_m"], look) for each, look in pairs], run["limit_m"]),
        lambda axes: _shade_stages(axes, run),
        x=TIME,
        y=AMPLITUDE,
        xlim=(run["time_s"][0], run["time_s"][-1]),
        columns=4,
        wide=True,
        height=3.2,
    )


def _band(axes: Axes, at: Any, drawn: Record | None, factor: float) -> None:
    """Where drawn devices lie. Args: `at`: abscissae. `factor`: of the axis, per metre."""
    if drawn is not None:
        low, high = (factor * np.asarray(drawn[key]) for key in ("low_m", "high_m"))
        axes.fill_between(at, low, high, label="drawn devices", **_DRAWN)


def _shade_stages(axes: Axes, run: Record) -> None:
    span = run["time_s"][-1] - run["time_s"][0]
    for place, stage in enumerate(run["stages"]):
        start, end = stage["start_s"], stage["end_s"]
        if place % 2 == 0:
            axes.axvspan(start, end, color=MUTED, alpha=0.12, linewidth=0)
        if end - start > _SHORTEST * span:
            name = stage["name"].replace("_", " ")
            note(name, (start, 1), (3, -3), xycoords=_ACROSS, va="top")(axes)


def run_up(run: Record, locked: Record, rotor: Record, drawn: Record | None = None) -> Drawing:
    """Bode plot of a run-up: vibration amplitude over speed, balanced and with the masses locked, and below
    it the lag of the locked rotor behind its unbalance, with the critical speed.

    Args: `rotor`: its `critical_speed_rad_s`, `amplification_factor` (None: none is defined), and
    `locked_phase_rad`, the phase of what the locked masses leave of the unbalance. `drawn`: as
    of `over_time`.
    """
    speeds = [_RPM * np.asarray(each["speed_rad_s"]) for each in (locked, run)]
    lag = np.degrees((rotor["locked_phase_rad"] - np.asarray(locked["phase_rad"])) % math.tau)
    # What lies a little before the unbalance is drawn there, not a turn later.
    lag = np.where(lag > _LAG_TOP, lag - 360, lag)
    critical, factor = _RPM * rotor["critical_speed_rad_s"], rotor["amplification_factor"]
    ends = min(speeds[1].min(), critical), max(speeds[1].max(), critical)

    def paint(axes: Axes) -> None:
        top, below = panels(axes, (0.09, 0.43, 0.89, 0.47), (0.09, 0.135, 0.89, 0.25))
        values = [_MILLIMETRE * np.asarray(each["amplitude_m"]) for each in (locked, run)]
        curves = zip(speeds, values, (_LOCKED, _BALANCED), strict=True)
        if drawn is not None:
            _band(top, *_while_speed_changes(run, drawn), _MILLIMETRE)
        amplitudes(curves, _MILLIMETRE * run["limit_m"])(top)
        below.plot(speeds[0], lag, **_LOCKED)
        for panel in (top, below):
            panel.axvline(critical, color=INK, linewidth=0.9, linestyle=(0, (6, 2, 1, 2)))
            panel.set_xlim(*ends)
            panel.xaxis.set_major_formatter(FuncFormatter(plain_number))
        top.tick_params(labelbottom=False)
        top.set_ylabel("zero to peak in mm")
        below.set(ylim=(-30, 210), yticks=(0, 90, 180), ylabel="lag in °", xlabel="speed in rpm")
        text = f"critical speed {number(critical, digits=3)} rpm"
        text += f", amplification factor {number(factor, digits=2)}" if factor else ""
        side = "right" if critical > sum(ends) / 2 else "left"
        # Where the lag is not: it passes 90 degrees at the critical speed.
        shift, at = ((-4, -4), 1.0) if side == "right" else ((4, 4), 0.0)
        up = "top" if side == "right" else "bottom"
        note(text, (critical, at), shift, xycoords=_ACROSS, ha=side, va=up)(below)
        for look in (_LOCKED, _BALANCED, _LIMIT):
            axes.plot([], [], **look)
        if drawn is not None:
            axes.fill_between([], [], [], label="drawn devices", **_DRAWN)

    return draw("eccentric-run-up", paint, columns=4, wide=True, height=3.5)


def _while_speed_changes(run: Record, drawn: Record) -> tuple[FloatArray, Record]:
    """Speeds, rpm, and the band there: at one speed it has one width for each time."""
    speed: FloatArray = np.asarray(np.interp(drawn["time_s"], run["time_s"], run["speed_rad_s"]))
    changing = np.flatnonzero(np.diff(speed)) + 1
    return _RPM * speed[changing], {key: np.asarray(drawn[key])[changing] for key in ("low_m", "high_m")}


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
        height=_NARROW_HEIGHT,
    )


def imbalance_estimate(run: Record, true: float) -> Drawing:
    """Magnitude of the estimated imbalance over time, kg m, with its 95 % band and the true one."""
    vector = np.asarray(run["estimates"]["imbalance_kg_m"])
    covariance = np.asarray(run["estimates"]["imbalance_covariance"])
    size = np.hypot(*vector)
    along = vector / np.where(size > 0, size, 1.0)
    deviation = np.sqrt(np.maximum(np.einsum("in,nij,jn->n", along, covariance, along), 0.0))
    return _estimate(run, "imbalance", ("imbalance", "kg m"), [size], [deviation], [true])


def friction_estimates(run: Record, true: Sequence[float]) -> Drawing:
    """Estimated friction arms over time, m, with their 95 % bands and the true ones."""
    arms = np.asarray(run["estimates"]["friction_arm_m"])
    deviations = np.sqrt(np.asarray(run["estimates"]["friction_variance"]))
    return _estimate(run, "friction", ("friction arm", "m"), arms, deviations, true)


def _estimate(
    run: Record,
    name: str,
    shown: Axis,
    values: Sequence[FloatArray] | FloatArray,
    deviations: Sequence[FloatArray] | FloatArray,
    true: Sequence[float],
) -> Drawing:
    early, time = _early(run)
    paints: list[Paint] = []
    for index, (value, deviation) in enumerate(zip(values, deviations, strict=True)):
        colour, which = _COLOURS[index], f" {index + 1}" if len(true) > 1 else ""
        band: ArrayLike = DEVIATIONS * deviation[early]
        paints.append(curve(time, value[early], f"estimate{which}", band=band, color=colour))
        paints.append(level(true[index], f"true{which}", color=colour, linewidth=1, linestyle=":"))
    largest = max(*true, *(float(np.max(value[early])) for value in values), 0.0)
    return draw(
        f"eccentric-{name}",
        *paints,
        x=TIME,
        y=shown,
        xlim=(0, _until(run)),
        ylim=(min(0.0, -0.1 * largest), 1.5 * largest or 1.0),
        columns=4,
        height=_NARROW_HEIGHT,
    )


def _early(run: Record) -> tuple[Any, FloatArray]:
    """Which instants lie before `_until`, and their times, s."""
    time = np.asarray(run["time_s"])
    early = time <= _until(run)
    return early, time[early]


def _until(run: Record) -> float:
    """Shortly after the last stage has begun, s."""
    end, last = run["time_s"][-1], run["stages"][-1]["start_s"]
    return float(min(end, 1.2 * last) if last > 0 else end) or 1.0
