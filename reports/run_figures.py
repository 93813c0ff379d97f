"""Figures of one run, whichever balancer made it, from its document in SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from ringbalance.controller.document import simulation_document
from ringbalance.controller.eccentric_mass.plant import rotor_record
from ringbalance.controller.eccentric_mass.run import locked_run
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.simulation import Simulation
from ringbalance.reports.figure import (
    AMPLITUDE,
    FOUND,
    INK,
    MUTED,
    PAPER,
    SURFACE,
    THIRD,
    TIME,
    Drawing,
    Paint,
    amplitudes,
    curve,
    draw,
    line,
    logarithmic,
    nice_span,
    note,
    panels,
    plain_number,
)
from ringbalance.reports.mass_figures import (
    friction_estimates,
    imbalance_estimate,
    mass_angles,
    over_time,
    run_up,
)
from ringbalance.reports.section import Record
from ringbalance.scene.origins import SceneFile

_MICROMETRE: Final = 1e6
_NUMBERED, _APART = 12, 0.09
"""Samples that are numbered, and how far they must stand apart over the picture's half width."""


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
        *(run_up(document, locked, rotor_record(scene)) if run.speed.max() > run.speed.min() else []),
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
    """Residual vibration as a vector over a run, with the limit's circle and what the disc can cancel; the
    first samples of the controller numbered.

    Args: `run`: a simulation document. `reach`: of a pair alone, `vibration_m`, and of the first pair,
    `direction_rad` as vibration, minus the lag angle, with the number of `pairs`; None: not shown.
    """
    amplitude, phase = _MICROMETRE * np.asarray(run["amplitude_m"]), np.asarray(run["phase_rad"])
    limit, ends = run["limit_m"] * _MICROMETRE, np.zeros(0, dtype=np.complex128)
    if reach is not None:
        ends = _reachable(reach["vibration_m"] * _MICROMETRE, reach["direction_rad"], reach["pairs"])
    whole = 1.15 * float(max(amplitude.max(), limit, *np.abs(ends), 0.0))

    def paint(axes: Axes) -> None:
        boxes = ((0.04, 0.05, 0.4, 0.8), (0.56, 0.05, 0.4, 0.8))
        far, near = panels(axes, *boxes, projection="polar")
        for panel, span, title in ((far, whole, "whole run"), (near, 4 * limit, "near the limit")):
            panel.plot(np.linspace(0, math.tau, 120), np.full(120, limit), color=PAPER)
            panel.plot(phase, amplitude, color=FOUND, linewidth=1.1)
            for place, face in ((0, SURFACE), (-1, FOUND)):
                look: Any = {"color": FOUND, "markerfacecolor": face, "markersize": 6}
                panel.plot(phase[place], amplitude[place], "o", **look)
            panel.set_title(f"{title}, radius in µm", loc="left", fontsize="medium", color=INK, pad=16)
            # The numbers of the rings where the run does not begin.
            panel.set(ylim=(0, span), rlabel_position=math.degrees(phase[0]) + 195)
            panel.set_yticks([tick for tick in nice_span(span) if tick > 0])
            panel.yaxis.set_major_formatter(FuncFormatter(plain_number))
            panel.set_xticks(np.arange(8) * math.pi / 4, [f"{angle}°" for angle in range(0, 360, 45)])
        _number_samples(far, run, whole)
        if reach is not None:
            _unbalance(far, phase[0], -reach["direction_rad"], whole)
            closed = np.append(ends, ends[0])
            far.plot(np.angle(closed), np.abs(closed), color=THIRD, linestyle=(0, (5, 2)))

    return draw("residual-polar", paint, columns=0, wide=True, height=3.9)


def _number_samples(panel: Axes, run: Record, span: float) -> None:
    """Of the first samples of the controller their numbers, from one on, where they stand apart."""
    times = run.get("samples", {"time_s": []})["time_s"][:_NUMBERED]
    if not times:
        return
    sizes = _MICROMETRE * np.interp(times, run["time_s"], run["amplitude_m"])
    phases = np.interp(times, run["time_s"], np.unwrap(run["phase_rad"]))
    places = sizes * np.exp(1j * phases)
    panel.plot(phases, sizes, ".", color=FOUND, markersize=5)
    for number, (phase, size) in enumerate(zip(phases, sizes, strict=True)):
        earlier = np.abs(places[:number] - places[number])
        if np.all(earlier > _APART * span):
            note(str(number + 1), (phase, size), (5, 3), color=FOUND)(panel)


def _unbalance(panel: Axes, phase: float, lag: float, span: float) -> None:
    """The way that the unbalance points, ahead of the vibration by the lag angle."""
    heavy = phase + lag
    panel.plot([heavy, heavy], [0, span], color=MUTED, linewidth=1, linestyle=(0, (6, 2, 1, 2)))
    text = f"unbalance, lag {plain_number(round(math.degrees(lag), 1))}°"
    side = "right" if math.cos(heavy) > 0 else "left"
    ground = {"facecolor": SURFACE, "edgecolor": "none", "pad": 1}
    note(text, (heavy, 0.85 * span), (0, 3), ha=side, va="bottom", bbox=ground)(panel)


def _reachable(length: float, direction: float, pairs: int) -> Any:
    """Corners of what equal pairs give together, each between plus and minus its length, as complex vectors.

    The first is the sum of all, l e^(jd) (1 + e^(j pi/n) + ... ) = 2 l e^(jd)/(1 - e^(j pi/n)); each next one
    has one sign changed, which turns it by pi/n.
    Args: `length`: of one pair's vector. `direction`: of the first pair's, rad.
    """
    step = np.exp(1j * math.pi / pairs)
    return 2 * length * np.exp(1j * direction) / (1 - step) * step ** np.arange(2 * pairs)
