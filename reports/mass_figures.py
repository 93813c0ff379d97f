"""Figures of one run with two eccentric masses, from its document in SI."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
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
    upright,
)
from ringbalance.reports.section import Record
from ringbalance.results.numbers import number, shown
from ringbalance.scene.arrays import FloatArray

DEVIATIONS: Final = 2.0
"""Half-width of a band: a normal error is within it with 95 %."""
_COLOURS: Final = (FOUND, THIRD)
_LOCKED: Final = {**AS_PAPER, "linewidth": 1.2, "label": "masses locked"}
_BALANCED: Final = {"color": FOUND, "linewidth": 1.2, "label": "balanced"}
_SHORTEST: Final = 0.09
"""Fraction of the time axis that the name of a stage needs."""
_NARROW_HEIGHT: Final = 2.4
_LAG_TOP: Final = 300
"""Lag, deg, above which an angle is a lead."""
_ACROSS: Final = ("data", "axes fraction")


def over_time(run: Record, locked: Record, drawn: Record | None = None) -> Drawing:
    """Vibration amplitude over time, m, balanced and with the masses locked, with the limit.

    Args: `drawn`: band of drawn devices, `time_s`, `low_m` and `high_m`.
    """
    curves = [(each["time_s"], each["amplitude_m"], look) for each, look in _pairs(run, locked)]
    return draw(
        "eccentric-amplitude",
        *([] if drawn is None else [_band(drawn["time_s"], drawn["low_m"], drawn["high_m"])]),
        amplitudes(curves, run["limit_m"]),
        lambda axes: _shade_stages(axes, run),
        x=TIME,
        y=AMPLITUDE,
        xlim=(run["time_s"][0], run["time_s"][-1]),
        columns=4,
        wide=True,
        height=3.2,
    )


def _band(at: ArrayLike, low: ArrayLike, high: ArrayLike) -> Paint:
    """Where drawn devices lie."""
    look: dict[str, Any] = {"color": FOUND, "alpha": 0.2, "linewidth": 0, "label": "drawn devices"}
    return lambda axes: axes.fill_between(np.asarray(at), np.asarray(low), np.asarray(high), **look)


def _shade_stages(axes: Axes, run: Record) -> None:
    span = run["time_s"][-1] - run["time_s"][0]
    for place, stage in enumerate(run["stages"]):
        start, end = stage["start_s"], stage["end_s"]
        if place % 2 == 0:
            axes.axvspan(start, end, color=MUTED, alpha=0.12, linewidth=0)
        if end - start > _SHORTEST * span:
            name = stage["name"].replace("_", " ")
            note(name, (start, 1), (3, -3), xycoords=_ACROSS, va="top")(axes)


def run_up(run: Record, locked: Record, rotor: Record, drawn: Record | None = None) -> list[Drawing]:
    """Bode plot of a run-up: vibration amplitude over speed, balanced and with the masses locked, and the lag
    of the locked rotor behind its unbalance, with the critical speed.

    Args: `rotor`: its `critical_speed_rad_s`, `amplification_factor` (None: none is defined), and
    `locked_phase_rad`, the phase of what the locked masses leave of the unbalance. `drawn`: as
    of `over_time`.
    """
    lag = np.degrees((rotor["locked_phase_rad"] - np.asarray(locked["phase_rad"])) % math.tau)
    # What lies a little before the unbalance is drawn there, not a turn later.
    lag = np.where(lag > _LAG_TOP, lag - 360, lag)
    critical, factor = rotor["critical_speed_rad_s"], rotor["amplification_factor"]
    ends = min(*run["speed_rad_s"], critical), max(*run["speed_rad_s"], critical)
    at_critical = upright(critical, color=INK, linewidth=0.9, linestyle=(0, (6, 2, 1, 2)))
    text = f"critical speed {shown(critical, 'rad/s', digits=3)}"
    text += f", amplification factor {number(factor, digits=2)}" if factor else ""
    # Where the lag is not: it passes 90 degrees at the critical speed.
    right = critical > sum(ends) / 2
    place: dict[str, Any] = {"ha": "right", "va": "top"} if right else {"ha": "left", "va": "bottom"}
    shift, at = ((-4, -4), 1.0) if right else ((4, 4), 0.0)
    over: dict[str, Any] = {"x": ("speed", "rad/s"), "xlim": ends, "wide": True}
    curves = [(each["speed_rad_s"], each["amplitude_m"], look) for each, look in _pairs(run, locked)]
    return [
        draw(
            "eccentric-run-up",
            *([] if drawn is None else [_band(*_while_speed_changes(run, drawn))]),
            amplitudes(curves, run["limit_m"]),
            at_critical,
            y=AMPLITUDE,
            columns=4,
            height=2.6,
            **over,
        ),
        draw(
            "eccentric-lag",
            curve(locked["speed_rad_s"], lag, **_LOCKED),
            at_critical,
            note(text, (critical, at), shift, xycoords=_ACROSS, **place),
            lambda axes: axes.set_yticks((0, 90, 180)),
            y=("lag", "°"),
            ylim=(-30, 210),
            height=1.8,
            **over,
        ),
    ]


def _pairs(run: Record, locked: Record) -> tuple[tuple[Record, dict[str, Any]], ...]:
    return (locked, _LOCKED), (run, _BALANCED)


def _while_speed_changes(run: Record, drawn: Record) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speeds and the band there: at one speed it has one width for each time."""
    speed = np.asarray(np.interp(drawn["time_s"], run["time_s"], run["speed_rad_s"]))
    changing = np.flatnonzero(np.diff(speed)) + 1
    low, high = (np.asarray(drawn[key])[changing] for key in ("low_m", "high_m"))
    return speed[changing], low, high


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
