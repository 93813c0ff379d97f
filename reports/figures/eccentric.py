"""Figures of a run with two eccentric masses, from documents in SI: of the run, and of its locked twin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record
from ringbalance.results.numbers import shown
from ringbalance.scene.arrays import FloatArray

_RPM: Final = 30 / math.pi
DEVIATIONS: Final = 2.0
"""Half-width of a band: a normal error is within it with 95 %."""
_LARGE: Final = 0.01
"""Imbalance from which on it is given in kg m."""
_COLOURS: Final = (style.FOUND, style.THIRD)
_POLE_ROOM, _NEAR = 0.75, 0.02
"""Half of the poles' picture over their extent, and the least extent."""
_SHORTEST: Final = 0.09
"""Fraction of the time axis that the name of a stage needs."""
_LOCKED: Final = {**style.AS_PAPER, "linewidth": 1.2, "label": "masses locked"}
_BALANCED: Final = {"color": style.FOUND, "linewidth": 1.2, "label": "balanced"}


def eccentric_figures(scene: EccentricScene, run: Record, locked: Record) -> list[Drawing]:
    """Amplitude over time and over speed, angles of the masses, and both estimates with their bands."""
    varies = max(run["speed_rad_s"]) > min(run["speed_rad_s"])
    return [
        amplitude_over_time(run, locked),
        *([amplitude_over_speed(run, locked)] if varies else []),
        mass_angles(run),
        imbalance_estimate(run, scene.imbalance.mass * scene.imbalance.radius),
        friction_estimates(run, scene.masses.friction_arm),
    ]


def amplitude_over_time(run: Record, locked: Record) -> Drawing:
    """Vibration amplitude over time, m, balanced and with the masses locked, with the limit."""

    def paint(axes: Axes) -> None:
        pairs = ((locked, _LOCKED), (run, _BALANCED))
        curves = [(told["time_s"], np.asarray(told["amplitude_m"]), line) for told, line in pairs]
        style.amplitudes(axes, curves, run["limit_m"])
        _shade_stages(axes, run)

    return draw(
        name="eccentric-amplitude",
        paint=paint,
        columns=3,
        wide=True,
        height=3.2,
        alt=f"Vibration amplitude over time: at worst {_worst(run)} balanced, {_worst(locked)} locked.",
        caption=f"Vibration amplitude over time. At worst {_worst(run)} with balancing, {_worst(locked)} "
        "with the masses locked at their first places. Shaded in turn: the stages of the strategy.",
    )


def _shade_stages(axes: Axes, run: Record) -> None:
    span = run["time_s"][-1] - run["time_s"][0]
    axes.set_xlim(run["time_s"][0], run["time_s"][-1])
    for place, stage in enumerate(run["stages"]):
        start, end = stage["start_s"], stage["end_s"]
        if place % 2 == 0:
            axes.axvspan(start, end, color=style.MUTED, alpha=0.12, linewidth=0)
        if end - start > _SHORTEST * span:
            axes.annotate(
                stage["name"].replace("_", " "),
                (start, 1),
                xycoords=("data", "axes fraction"),
                xytext=(3, -3),
                textcoords="offset points",
                va="top",
                color=style.MUTED,
            )


def amplitude_over_speed(run: Record, locked: Record) -> Drawing:
    """Vibration amplitude over the rotor's speed, m, balanced and with the masses locked."""

    def paint(axes: Axes) -> None:
        pairs = ((locked, _LOCKED), (run, _BALANCED))
        curves = [
            (_RPM * np.asarray(told["speed_rad_s"]), np.asarray(told["amplitude_m"]), line)
            for told, line in pairs
        ]
        style.amplitudes(axes, curves, run["limit_m"])
        ends = _RPM * min(run["speed_rad_s"]), _RPM * max(run["speed_rad_s"])
        axes.set(xlabel="speed in rpm", xlim=ends)

    return draw(
        name="eccentric-run-up",
        paint=paint,
        columns=3,
        wide=True,
        height=3.2,
        alt=f"Vibration amplitude over speed: at worst {_worst(run)} balanced, {_worst(locked)} locked.",
        caption="Run-up: vibration amplitude over speed. The vertical part of a line is what happens while "
        "the speed is constant.",
    )


def mass_angles(run: Record) -> Drawing:
    """Angles of both masses and their goals over time, degrees, until shortly after balancing."""
    until = _until(run)
    early = np.asarray(run["time_s"]) <= until
    time = np.asarray(run["time_s"])[early]

    def paint(axes: Axes) -> None:
        for index, colour in enumerate(_COLOURS):
            angle, goal = (
                np.degrees(np.asarray(run[key][index]))[early] for key in ("mass_angle_rad", "goal_rad")
            )
            axes.plot(time, angle, color=colour, label=f"mass {index + 1}")
            axes.plot(time, goal, color=colour, linewidth=1, linestyle=":", label=f"goal {index + 1}")
        axes.set_xlim(0, until)

    return draw(
        name="eccentric-angles",
        paint=paint,
        columns=4,
        x="time in s",
        y="angle in °",
        alt=f"Angles of both masses and their goals in the first {shown(until, 's', digits=2)}.",
        caption="Angles of both masses in the rotor’s frame, not wrapped, and where they should be.",
    )


def imbalance_estimate(run: Record, true: float) -> Drawing:
    """Magnitude of the estimated imbalance over time, kg m, with its 95 % band and the true one."""
    vector = np.asarray(run["estimates"]["imbalance_kg_m"])
    covariance = np.asarray(run["estimates"]["imbalance_covariance"])
    size = np.hypot(*vector)
    along = vector / np.where(size > 0, size, 1.0)
    deviation = np.sqrt(np.maximum(np.einsum("in,nij,jn->n", along, covariance, along), 0.0))
    factor, unit = (1.0, "kg·m") if true >= _LARGE else (1e6, "g·mm")
    curves = [(size, deviation, true)]
    return _estimate(run, "imbalance", f"imbalance in {unit}", curves, "Magnitude of the imbalance", factor)


def friction_estimates(run: Record, true: tuple[float, float]) -> Drawing:
    """Estimated friction arms over time, m, with their 95 % bands and the true ones."""
    arms = np.asarray(run["estimates"]["friction_arm_m"])
    deviations = np.sqrt(np.asarray(run["estimates"]["friction_variance"]))
    curves = list(zip(arms, deviations, true, strict=True))
    return _estimate(run, "friction", "friction arm in µm", curves, "Friction arms of both masses", 1e6)


def _estimate(
    run: Record,
    name: str,
    label: str,
    curves: list[tuple[FloatArray, FloatArray, float]],
    title: str,
    factor: float,
) -> Drawing:
    until = _until(run)
    early = np.asarray(run["time_s"]) <= until
    time = np.asarray(run["time_s"])[early]

    def paint(axes: Axes) -> None:
        largest = 0.0
        for index, (value, deviation, true) in enumerate(curves):
            colour, which = _COLOURS[index], f" {index + 1}" if len(curves) > 1 else ""
            values, widths = factor * value[early], DEVIATIONS * factor * deviation[early]
            axes.plot(time, values, color=colour, label=f"estimate{which}")
            style.band(axes, time, values, widths, colour)
            axes.axhline(factor * true, color=colour, linewidth=1, linestyle=":", label=f"true{which}")
            largest = max(largest, factor * true, float(np.max(values)))
        axes.set(xlim=(0, until), ylim=(min(0.0, -0.1 * largest), 1.5 * largest or 1.0))

    return draw(
        name=f"eccentric-{name}",
        paint=paint,
        columns=4,
        x="time in s",
        y=label,
        alt=f"{title} as estimated over time, with a 95 % band, and the true value.",
        caption=f"{title} as estimated, with the filter’s own 95 % band, and as it is in the plant.",
    )


def sampled_poles(loops: Sequence[Record]) -> Drawing:
    """Sampled poles of the drives' loops in the complex plane, with the unit circle where they are.

    Args: `loops`: those of the tuning document.
    """

    def paint(axes: Axes) -> None:
        axes.add_patch(Circle((0, 0), 1, fill=False, color=style.INK, linewidth=1))
        for index, loop in enumerate(loops):
            poles = np.asarray(loop["poles"])
            axes.plot(poles[:, 0], poles[:, 1], linestyle="", label=loop["name"], **style.line(index, size=6))
        points = np.array([[1.0, 0.0], *(pole for loop in loops for pole in loop["poles"])])
        low, high = points.min(axis=0), points.max(axis=0)
        middle, half = (low + high) / 2, _POLE_ROOM * max(*(high - low), _NEAR)
        ends = np.column_stack((middle - half, middle + half))
        axes.set(xlim=ends[0], ylim=ends[1], aspect="equal")

    outside = [loop["name"] for loop in loops if not loop["stable"]]
    told = f"Outside, and unstable: {', '.join(outside)}" if outside else "All lie within: stable"
    return draw(
        name="sampled-poles",
        paint=paint,
        x="real part",
        y="imaginary part",
        columns=2,
        height=3.4,
        alt=f"Poles of the sampled loops and the unit circle. {told}.",
        caption=f"Poles of the drives’ loops as they run, sampled, and the unit circle. {told}.",
    )


def _worst(run: Record) -> str:
    return shown(run["worst_amplitude_m"], "m", digits=3)


def _until(run: Record) -> float:
    """Shortly after the last stage has begun, s."""
    end, last = run["time_s"][-1], run["stages"][-1]["start_s"]
    return float(min(end, 1.2 * last) if last > 0 else end) or 1.0
