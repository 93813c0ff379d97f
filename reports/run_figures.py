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

_UM_PER_M: Final = 1e6
_NUMBERED_SAMPLES: Final = 12
_SAMPLE_DISTANCE: Final = 0.09
"""Least distance between numbered samples, over the picture's half width."""


def figures_of(scene: SceneFile, run: Any) -> list[Drawing]:
    """Figures of a run of a scene; for a balancer without its own figures the amplitude over time."""
    figures = _FIGURES.get(scene.balancer)
    return [run_amplitude(run.to_dict())] if figures is None else figures(scene, run)


def _ring(_: SceneFile, simulation: Simulation) -> list[Drawing]:
    run = simulation_document(simulation)
    times = []
    if injections := run["injections"]:
        # Duration of each injection by chamber, over the time at which its valve opens.
        spans = [item["duration_s"] for item in injections]
        paints = []
        for index, letter in enumerate(run["fill_ratio"]):
            group = [item for item in injections if item["chamber"] == letter]
            starts, durations = ([item[key] for item in group] for key in ("time_s", "duration_s"))
            paints.append(curve(starts, durations, letter, linestyle="", **line(index, size=3.5)))
        figure = draw(
            "run-valve-open",
            *paints,
            logarithmic("y", within=(0.5 * min(spans), 2 * max(spans))),
            x=TIME,
            y=("valve-open time", "s"),
            xlim=(0, None),
            ylim=(0.7 * min(spans), 1.4 * max(spans)),
            columns=6,
        )
        times.append(figure)
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


_FIGURES: Final[Mapping[str, Callable[..., list[Drawing]]]] = MappingProxyType(
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
        height=2.5,
    )


def early_time(run: Record) -> float:
    """End, s, of the part of a run in which a liquid ring uses most of its gas."""
    spent = np.cumsum([item["duration_s"] for item in run["injections"]])
    if spent.size == 0:
        return float(run["time_s"][-1]) or 1.0
    last = run["injections"][int(np.searchsorted(spent, 0.9 * spent[-1]))]
    return float(min(run["time_s"][-1], 1.4 * (last["time_s"] + last["duration_s"])))


def fill_ratios(run: Record, until: float) -> Drawing:
    """Fill ratio of every chamber over time. Args: `until`: end of the time axis, s."""
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


def residual_polar(run: Record, reach: Record | None = None) -> Drawing:
    """Residual vibration as a vector over a run, with the limit's circle and the vibration that the disc can
    cancel; the first samples of the controller are numbered.

    Args: `run`: a simulation document. `reach`: amplitude `vibration_m` that one pair cancels, direction
    `direction_rad` of the first pair's vibration (minus the lag angle), number of `pairs`; None: not shown.
    """
    amplitude, phase = _UM_PER_M * np.asarray(run["amplitude_m"]), np.asarray(run["phase_rad"])
    limit, ends = run["limit_m"] * _UM_PER_M, np.zeros(0, dtype=np.complex128)
    if reach is not None:
        ends = _reachable(reach["vibration_m"] * _UM_PER_M, reach["direction_rad"], reach["pairs"])
    radius = 1.15 * float(max(amplitude.max(), limit, *np.abs(ends), 0.0))
    sampled = run.get("samples", {"time_s": []})["time_s"][:_NUMBERED_SAMPLES]

    def paint(axes: Axes) -> None:
        boxes = ((0.04, 0.09, 0.4, 0.7), (0.56, 0.09, 0.4, 0.7))
        far, near = panels(axes, *boxes, projection="polar")
        for panel, span, title in ((far, radius, "whole run"), (near, 4 * limit, "near the limit")):
            panel.plot(np.linspace(0, math.tau, 120), np.full(120, limit), color=PAPER)
            panel.plot(phase, amplitude, color=FOUND, linewidth=1.1)
            for index, face in ((0, SURFACE), (-1, FOUND)):
                look: Any = {"color": FOUND, "markerfacecolor": face, "markersize": 6}
                panel.plot(phase[index], amplitude[index], "o", **look)
            panel.set_title(f"{title}, radius in µm", loc="left", fontsize="medium", color=INK, pad=16)
            # Numbers of the rings away from the beginning of the run.
            panel.set(ylim=(0, span), rlabel_position=math.degrees(phase[0]) + 195)
            panel.set_yticks([tick for tick in nice_span(span) if tick > 0])
            panel.yaxis.set_major_formatter(FuncFormatter(plain_number))
            panel.set_xticks(np.arange(8) * math.pi / 4, [f"{angle}°" for angle in range(0, 360, 45)])
        if sampled:
            sizes = _UM_PER_M * np.interp(sampled, run["time_s"], run["amplitude_m"])
            phases = np.interp(sampled, run["time_s"], np.unwrap(run["phase_rad"]))
            points = sizes * np.exp(1j * phases)
            far.plot(phases, sizes, ".", color=FOUND, markersize=5)
            for number, (angle, size) in enumerate(zip(phases, sizes, strict=True)):
                if np.all(np.abs(points[:number] - points[number]) > _SAMPLE_DISTANCE * radius):
                    note(str(number + 1), (angle, size), (5, 3), color=FOUND)(far)
        if reach is not None:
            # The unbalance points ahead of the vibration by the lag angle.
            lag = -reach["direction_rad"]
            heavy = phase[0] + lag
            far.plot([heavy, heavy], [0, radius], color=MUTED, linewidth=1, linestyle=(0, (6, 2, 1, 2)))
            text = f"unbalance, lag {plain_number(round(math.degrees(lag), 1))}°"
            side = "right" if math.cos(heavy) > 0 else "left"
            ground = {"facecolor": SURFACE, "edgecolor": "none", "pad": 1}
            note(text, (heavy, 0.6 * radius), (0, 3), ha=side, va="bottom", bbox=ground)(far)
            closed = np.append(ends, ends[0])
            far.plot(np.angle(closed), np.abs(closed), color=THIRD, linestyle=(0, (5, 2)))

    return draw("residual-polar", paint, columns=0, wide=True, height=3.2)


def _reachable(length: float, direction: float, pairs: int) -> Any:
    """Corners of the polygon that equal pairs reach together, each between plus and minus its length, as
    complex vectors.

    The first is the sum of all, l e^(jd) (1 + e^(j pi/n) + ... ) = 2 l e^(jd)/(1 - e^(j pi/n)); each next one
    has one sign changed, which turns it by pi/n.
    Args: `length`: of one pair's vector. `direction`: of the first pair's vector, rad.
    """
    step = np.exp(1j * math.pi / pairs)
    return 2 * length * np.exp(1j * direction) / (1 - step) * step ** np.arange(2 * pairs)
