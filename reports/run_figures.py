"""Figures of one run, whichever balancer made it, from its document in SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.ticker import FuncFormatter
from numpy.typing import ArrayLike

from ringbalance.controller.document import simulation_document
from ringbalance.controller.eccentric_mass.plant import rotor_record
from ringbalance.controller.eccentric_mass.run import locked_run
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.simulation import Simulation
from ringbalance.reports.figure import (
    AMPLITUDE,
    AS_PAPER,
    FOUND,
    GRID,
    INK,
    MUTED,
    PAPER,
    SURFACE,
    THIRD,
    TIME,
    Axis,
    Drawing,
    Paint,
    amplitudes,
    curve,
    draw,
    level,
    line,
    logarithmic,
    nice_span,
    note,
    panels,
    plain_number,
)
from ringbalance.reports.section import Record
from ringbalance.results.numbers import number
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.origins import SceneFile

DEVIATIONS: Final = 2.0
"""Half-width of a band: a normal error is within it with 95 %."""
_COLOURS: Final = (FOUND, THIRD)
_LOCKED: Final = {**AS_PAPER, "linewidth": 1.2, "label": "masses locked"}
_BALANCED: Final = {"color": FOUND, "linewidth": 1.2, "label": "balanced"}
_LIMIT: Final = {"color": MUTED, "linewidth": 1, "linestyle": ":", "label": "limit"}
_SHORTEST: Final = 0.09
"""Fraction of the time axis that the name of a stage needs."""
_MICROMETRE: Final = 1e6
_MILLIMETRE: Final = 1e3
RPM: Final = 30 / math.pi
_LAG_TOP: Final = 300
"""Lag, deg, above which an angle is a lead."""
_ACROSS: Final = ("data", "axes fraction")
_LABEL_ANGLES: Final = (-90, -75, -105, -60, -120, -45, -135)
"""Where the label of a ring may stand, deg; the first of equals is taken."""


def figures_of(scene: SceneFile, run: Any) -> list[Drawing]:
    """What is drawn of a run of a scene; of a balancer without figures of its own the amplitude over time."""
    drawn = _OWN.get(scene.balancer)
    return [run_amplitude(run.to_dict())] if drawn is None else drawn(scene, run)


def _ring(_: SceneFile, simulation: Simulation) -> list[Drawing]:
    run = simulation_document(simulation)
    times = [_valve_open_times(run)] if run["injections"] else []
    return [run_amplitude(run), *times, fill_ratios(run, early_time(run)), residual_polar(run)]


def _masses(scene: EccentricScene, run: EccentricRun) -> list[Drawing]:
    document, locked = run.to_dict(), locked_run(scene).to_dict()
    return [
        over_time(document, locked),
        *([run_up(document, locked, rotor_record(scene))] if run.speed.max() > run.speed.min() else []),
        mass_angles(document),
        imbalance_estimate(document, scene.imbalance.mass * scene.imbalance.radius),
        friction_estimates(document, scene.masses.friction_arm),
    ]


_OWN: Final[Mapping[str, Callable[..., list[Drawing]]]] = MappingProxyType(
    {"liquid_ring": _ring, "eccentric_mass": _masses}
)


def run_amplitude(run: Record) -> Drawing:
    """True and measured vibration amplitude over time, m, with the limit."""
    samples = run.get("samples", {"time_s": [], "amplitude_m": []})
    pairs = zip(samples["time_s"], samples["amplitude_m"], strict=True)
    seen = [(time, value) for time, value in pairs if value is not None]
    dots = {"color": PAPER, "linestyle": "", "marker": "o", "markersize": 2.5, "label": "measured"}
    true = (run["time_s"], run["amplitude_m"], {"color": FOUND, "linewidth": 1.2, "label": "true"})
    curves = [true, (*np.transpose(seen), dots)] if seen else [true]
    return draw(
        "run-amplitude",
        amplitudes(curves, run["limit_m"]),
        x=TIME,
        y=AMPLITUDE,
        columns=3,
        wide=True,
        height=3.2,
    )


def early_time(run: Record) -> float:
    """Time by which most of a ring's gas has been spent, s: where the loop does its work."""
    spent = np.cumsum([item["duration_s"] for item in run["injections"]])
    if spent.size == 0:
        return float(run["time_s"][-1]) or 1.0
    last = run["injections"][int(np.searchsorted(spent, 0.9 * spent[-1]))]
    return float(min(run["time_s"][-1], 1.4 * (last["time_s"] + last["duration_s"])))


def fill_ratios(run: Record, until: float) -> Drawing:
    """Fill ratio of every chamber against time. Args: `until`: end of the time axis, s."""
    return draw(
        "fill-ratios",
        *(
            curve(run["time_s"], values, letter, **line(index))
            for index, (letter, values) in enumerate(run["fill_ratio"].items())
        ),
        x=TIME,
        y=("fill ratio", "1"),
        xlim=(0, until),
        columns=6,
    )


def _valve_open_times(run: Record) -> Drawing:
    """How long each injection keeps its valve open, s, by chamber, over the time at which it opens."""
    spans = [item["duration_s"] for item in run["injections"]]

    def of(index: int, letter: str) -> Paint:
        mine = [item for item in run["injections"] if item["chamber"] == letter]
        times, durations = ([item[key] for item in mine] for key in ("time_s", "duration_s"))
        return curve(times, durations, letter, linestyle="", **line(index, size=3.5))

    return draw(
        "run-valve-open",
        *(of(index, letter) for index, letter in enumerate(run["fill_ratio"])),
        logarithmic("y", within=(0.5 * min(spans), 2 * max(spans))),
        x=TIME,
        y=("valve-open time", "s"),
        xlim=(0, None),
        ylim=(0.7 * min(spans), 1.4 * max(spans)),
        columns=6,
    )


def residual_polar(run: Record, reach: Record | None = None) -> Drawing:
    """Residual vibration as a vector over a run, with the limit's circle and what the disc can cancel.

    Args: `run`: a simulation document. `reach`: of a pair alone, `vibration_m`, and of the first pair,
    `direction_rad` as vibration, with the number of `pairs`; None: not shown.
    """
    vector = np.asarray(run["amplitude_m"]) * np.exp(1j * np.asarray(run["phase_rad"])) * _MICROMETRE
    limit = run["limit_m"] * _MICROMETRE
    ends = np.zeros(0, dtype=np.complex128)
    if reach is not None:
        ends = _reachable(reach["vibration_m"] * _MICROMETRE, reach["direction_rad"], reach["pairs"])
    whole, close = 1.15 * float(np.abs([*vector, *ends, limit]).max()), 4 * limit

    def paint(axes: Axes) -> None:
        far, near = panels(axes, (0.02, 0.02, 0.42, 0.9), (0.55, 0.02, 0.42, 0.9))
        for panel, span, title in ((far, whole, "whole run"), (near, close, "near the limit")):
            _residual(panel, vector, limit, span, ends)
            panel.set_title(title, loc="left", fontsize="medium", color=INK)
        near.text(-0.98 * close, -0.98 * close, "circle: limit", color=PAPER)
        if ends.size:
            closed, corner = np.append(ends, ends[0]), -0.98 * whole
            far.plot(closed.real, closed.imag, color=THIRD, linestyle=(0, (5, 2)))
            far.text(corner, corner, "dashed: what the disc can cancel", color=THIRD)

    return draw("residual-polar", paint, columns=0, wide=True, height=3.7)


def _reachable(length: float, direction: float, pairs: int) -> Any:
    """Corners of what equal pairs give together, each between plus and minus its length, as complex vectors.

    The first is the sum of all, l e^(jd) (1 + e^(j pi/n) + ... ) = 2 l e^(jd)/(1 - e^(j pi/n)); each next one
    has one sign changed, which turns it by pi/n.
    Args: `length`: of one pair's vector. `direction`: of the first pair's, rad.
    """
    step = np.exp(1j * math.pi / pairs)
    return 2 * length * np.exp(1j * direction) / (1 - step) * step ** np.arange(2 * pairs)


def _residual(panel: Axes, vector: Any, limit: float, span: float, ends: Any) -> None:
    """Args: `ends`: corners of what is drawn dashed, for the labels of the rings to keep away from."""
    panel.set(xlim=(-span, span), ylim=(-span, span), aspect="equal", xticks=[], yticks=[])
    panel.axhline(0, color=GRID, linewidth=0.8)
    panel.axvline(0, color=GRID, linewidth=0.8)
    panel.grid(visible=False)
    for spine in panel.spines.values():
        spine.set_visible(False)
    for ring in (ring for ring in nice_span(span) if ring > 0):
        panel.add_patch(Circle((0, 0), ring, fill=False, color=GRID, linewidth=0.8))
        place = _clearest(ring, vector, ends)
        ground = {"facecolor": SURFACE, "edgecolor": "none", "pad": 1}
        text = f"{plain_number(ring)} µm"
        panel.text(place.real, place.imag, text, color=MUTED, ha="center", va="center", bbox=ground)
    panel.text(span, 0, "0°", color=MUTED, ha="right", va="bottom")
    panel.text(0, span, "90°", color=MUTED, va="top")
    panel.add_patch(Circle((0, 0), limit, fill=False, color=PAPER, linewidth=1.6))
    panel.plot(vector.real, vector.imag, color=FOUND, linewidth=1.1)
    for end, face in ((vector[0], SURFACE), (vector[-1], FOUND)):
        panel.plot(end.real, end.imag, "o", color=FOUND, markerfacecolor=face, markersize=6)


def _clearest(ring: float, vector: Any, ends: Any) -> complex:
    """Where on the lower half of a ring a label lies farthest from the run and from the dashed sides."""
    sides = np.linspace(ends, np.roll(ends, -1), 40).ravel() if ends.size else ends
    places = ring * np.exp(1j * np.radians(_LABEL_ANGLES))
    gaps = np.abs(places[:, None] - np.concatenate([vector, sides])).min(axis=1)
    return complex(places[int(np.argmax(gaps))])


def over_time(run: Record, locked: Record) -> Drawing:
    """Vibration amplitude over time, m, balanced and with the masses locked, with the limit."""
    pairs = ((locked, _LOCKED), (run, _BALANCED))
    return draw(
        "eccentric-amplitude",
        amplitudes([(each["time_s"], each["amplitude_m"], look) for each, look in pairs], run["limit_m"]),
        lambda axes: _shade_stages(axes, run),
        x=TIME,
        y=AMPLITUDE,
        xlim=(run["time_s"][0], run["time_s"][-1]),
        columns=3,
        wide=True,
        height=3.2,
    )


def _shade_stages(axes: Axes, run: Record) -> None:
    span = run["time_s"][-1] - run["time_s"][0]
    for place, stage in enumerate(run["stages"]):
        start, end = stage["start_s"], stage["end_s"]
        if place % 2 == 0:
            axes.axvspan(start, end, color=MUTED, alpha=0.12, linewidth=0)
        if end - start > _SHORTEST * span:
            name = stage["name"].replace("_", " ")
            note(name, (start, 1), (3, -3), xycoords=_ACROSS, va="top")(axes)


def run_up(run: Record, locked: Record, rotor: Record) -> Drawing:
    """Bode plot of a run-up: vibration amplitude over speed, balanced and with the masses locked, and below
    it the lag of the locked rotor behind its unbalance, with the critical speed.

    Args: `rotor`: its `critical_speed_rad_s`, `amplification_factor` (None: none is defined), and
    `locked_phase_rad`, the phase of what the locked masses leave of the unbalance.
    """
    speeds = [RPM * np.asarray(each["speed_rad_s"]) for each in (locked, run)]
    lag = np.degrees((rotor["locked_phase_rad"] - np.asarray(locked["phase_rad"])) % math.tau)
    # What lies a little before the unbalance is drawn there, not a turn later.
    lag = np.where(lag > _LAG_TOP, lag - 360, lag)
    critical, factor = RPM * rotor["critical_speed_rad_s"], rotor["amplification_factor"]
    ends = min(speeds[1].min(), critical), max(speeds[1].max(), critical)

    def paint(axes: Axes) -> None:
        top, below = panels(axes, (0.09, 0.42, 0.89, 0.49), (0.09, 0.11, 0.89, 0.27))
        values = [_MILLIMETRE * np.asarray(each["amplitude_m"]) for each in (locked, run)]
        curves = zip(speeds, values, (_LOCKED, _BALANCED), strict=True)
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
        note(text, (critical, 0.0), (-4 if side == "right" else 4, 4), xycoords=_ACROSS, ha=side)(top)
        for look in (_LOCKED, _BALANCED, _LIMIT):
            axes.plot([], [], **look)

    return draw("eccentric-run-up", paint, columns=3, wide=True, height=4.4)


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
