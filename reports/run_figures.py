"""Figures of one run, whichever balancer made it, from its document in SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from ringbalance.controller.document import simulation_document
from ringbalance.controller.eccentric_mass.plant import rotor_record
from ringbalance.controller.eccentric_mass.run import locked_run
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.simulation import Simulation
from ringbalance.reports.figure import (
    AMPLITUDE,
    FOUND,
    GRID,
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
_NUMBERED, _APART, _SEEN = 12, 0.09, 0.02
"""Samples that are numbered, how far they must stand apart over the picture's half width, and the least lag
angle that is drawn, rad."""
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
    """Residual vibration as a vector over a run, with the limit's circle and what the disc can cancel; the
    first samples of the controller numbered.

    Args: `run`: a simulation document. `reach`: of a pair alone, `vibration_m`, and of the first pair,
    `direction_rad` as vibration, minus the lag angle, with the number of `pairs`; None: not shown.
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
        _number_samples(far, run, whole)
        if reach is not None:
            _lag(far, vector[0], -reach["direction_rad"], whole)
        near.text(-0.98 * close, -0.98 * close, "circle: limit", color=PAPER)
        if ends.size:
            closed, corner = np.append(ends, ends[0]), -0.98 * whole
            far.plot(closed.real, closed.imag, color=THIRD, linestyle=(0, (5, 2)))
            far.text(corner, corner, "dashed: what the disc can cancel", color=THIRD)

    return draw("residual-polar", paint, columns=0, wide=True, height=3.7)


def _number_samples(panel: Axes, run: Record, span: float) -> None:
    """Of the first samples of the controller their numbers, from one on, where they stand apart."""
    times = run.get("samples", {"time_s": []})["time_s"][:_NUMBERED]
    if not times:
        return
    phases = np.unwrap(np.asarray(run["phase_rad"]))
    sizes = _MICROMETRE * np.interp(times, run["time_s"], run["amplitude_m"])
    places = sizes * np.exp(1j * np.interp(times, run["time_s"], phases))
    taken: list[complex] = []
    for place, at in enumerate(places.tolist(), start=1):
        panel.plot(at.real, at.imag, ".", color=FOUND, markersize=5)
        if all(abs(at - other) > _APART * span for other in taken):
            note(str(place), (at.real, at.imag), (5, 3), color=FOUND)(panel)
            taken.append(at)


def _lag(panel: Axes, start: complex, lag: float, span: float) -> None:
    """The way that the unbalance points, ahead of the vibration by the lag angle, with that angle."""
    phase = float(np.angle(start))
    heavy = np.exp(1j * (phase + lag)) * span
    panel.plot([0, heavy.real], [0, heavy.imag], color=MUTED, linewidth=1, linestyle=(0, (6, 2, 1, 2)))
    if abs(lag) > _SEEN:
        arc = 0.3 * span * np.exp(1j * (phase + lag * np.linspace(0, 1, 30)))
        panel.plot(arc.real, arc.imag, color=MUTED, linewidth=1)
    text = f"unbalance, lag {plain_number(round(math.degrees(lag), 1))}°"
    aligned = "right" if heavy.real > 0 else "left"
    panel.text(0.8 * heavy.real, 0.8 * heavy.imag, text, color=MUTED, ha=aligned, va="bottom")


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
