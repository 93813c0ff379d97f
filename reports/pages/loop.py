"""Control loop and tuning: runs under each law, devices settled over time, and the effect of a wrong k."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Wedge
from matplotlib.ticker import FuncFormatter, PercentFormatter

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reports.figure import (
    AS_PAPER,
    FOUND,
    INK,
    MAP,
    MUTED,
    SURFACE,
    TIME,
    Drawing,
    amplitudes,
    draw,
    panels,
    plain_number,
)
from ringbalance.reports.judged import judgement_record
from ringbalance.reports.run_figures import early_time, fill_ratios, residual_polar
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.summary import is_papers
from ringbalance.results.numbers import shown
from ringbalance.results.rows import series
from ringbalance.scene.models import Scene

SETTINGS: Final[dict[str, dict[str, Any]]] = {
    "own": {**AS_PAPER, "label": "the scene’s settings"},
    "recommended": {"color": FOUND, "label": "the recommended settings"},
}
_LAWS: Final[dict[str, dict[str, Any]]] = {
    "calibrated": {"color": FOUND, "label": "the calibrated law"},
    "paper": {**AS_PAPER, "label": "the paper’s law"},
}
_EARLY_FRACTION: Final = 0.6
"""Fraction of a run up to which its injections have an axis apart from the rest of the run."""
_MAX_LETTERED: Final = 14
_MAX_FRAMES: Final = 7


def _reach(work: Work) -> Record:
    """Largest vibration, m, that a pair cancels, and direction of the first pair in the sensor's phase."""
    scene, moment = work.ring, float(work.calibration.answers.usable_moment)
    return {
        "pairs": scene.disc.chambers // 2,
        "vibration_m": moment * scene.rotor.influence_coefficient,
        "direction_rad": -scene.rotor.lag_angle,
    }


def _loop(reach: Record, evidence: Record) -> Record:
    loops, limit = evidence["closed_loop"], evidence["limit_m"]
    # The paper's law is compared on the paper's own disc alone.
    runs = {law: loops[law] for law in _LAWS if law in loops and (law != "paper" or is_papers(evidence))}
    run, disc = runs.get("calibrated"), (evidence.get("operation") or {}).get("disc")
    judged_settings = evidence.get("summary") or {}
    settled = [
        (look, judged_settings[name]["settled"])
        for name, look in SETTINGS.items()
        if judged_settings.get(name)
    ]
    best = judged_settings.get("recommended") or judged_settings.get("own")
    return {
        "amplitude": _amplitude(runs, limit) if runs else None,
        "rings": _rings(run, disc) if run and disc else None,
        "laws": list(runs),
        "polar": residual_polar(run, reach) if run and reach else None,
        "settling": settling(settled, best["asked"]) if best else None,
    }


def _injections_until(run: Record) -> float:
    """End of the last injection, s; without injections the end of the run."""
    ends = [item["time_s"] + item["duration_s"] for item in run["injections"]]
    return float(max(ends, default=run["time_s"][-1]))


def _amplitude(runs: dict[str, Record], limit: float) -> Drawing:
    """Vibration amplitude over whole runs, with every injection of the first one.

    A long rest after the injections has a separate axis.
    """
    end = max(float(run["time_s"][-1]) for run in runs.values())
    early = 1.15 * max(map(_injections_until, runs.values()))
    parts = {(0.0, end): (0.09, 0.15, 0.89, 0.68)}
    if 0 < early < _EARLY_FRACTION * end:
        parts = {(0.0, early): (0.09, 0.15, 0.6, 0.68), (early, end): (0.72, 0.15, 0.26, 0.68)}
    curves = [(run["time_s"], 1e6 * np.asarray(run["amplitude_m"]), _LAWS[law]) for law, run in runs.items()]

    def paint(axes: Axes) -> None:
        first, *others = axes_of_parts = panels(axes, *parts.values())
        for panel, span in zip(axes_of_parts, parts, strict=True):
            amplitudes(curves, 1e6 * limit)(panel)
            panel.set(xlim=span, xlabel="time in s")
            panel.xaxis.set_major_formatter(FuncFormatter(plain_number))
        for panel in others:
            panel.tick_params(labelleft=False)
        first.set_ylabel("amplitude, zero to peak, in µm")
        groups, across = _together(next(iter(runs.values()))["injections"]), first.get_xaxis_transform()
        for start, last, letters in groups:
            # Line over the time that the valve is open.
            first.plot((start, last), (1.0, 1.0), color=INK, linewidth=3, transform=across, clip_on=False)
            first.axvline(start, color=MUTED, linewidth=0.5, alpha=0.6)
            if len(groups) <= _MAX_LETTERED:
                first.text(start, 1.02, "".join(letters), ha="center", va="bottom", transform=across)
        for look in (*(_LAWS[law] for law in runs), {"color": MUTED, "linestyle": ":", "label": "limit"}):
            axes.plot([], [], **look)

    return draw("amplitude", paint, columns=3, wide=True, height=2.9)


def _together(injections: Sequence[Record]) -> list[tuple[float, float, list[str]]]:
    """Groups of valves that open together: time, s, time when the last of them closes, and chambers."""
    groups = [list(items) for _, items in groupby(injections, key=lambda item: item["time_s"])]
    return [
        (
            float(items[0]["time_s"]),
            max(float(item["time_s"] + item["duration_s"]) for item in items),
            sorted(item["chamber"] for item in items),
        )
        for items in groups
    ]


def _frames_of(run: Record) -> list[tuple[str, float]]:
    """Titles and times, s, of the start, of the rest after the first injections, and of the end."""
    last, groups = float(run["time_s"][-1]), _together(run["injections"])
    # Liquid flows on for a while after a valve has closed.
    rests = [*(start for start, _, _ in groups[1:]), last]
    after = [
        (f"{series(letters)}, {shown(start, 's', digits=2)}", min(rest, last))
        for (start, _, letters), rest in zip(groups, rests, strict=False)
    ]
    return [("start", 0.0), *after[: _MAX_FRAMES - 2], ("end", last)]


def _rings(run: Record, disc: Record) -> Drawing:
    """The ring at the start, after the first injections and at the end, as the shaft sees it: each chamber
    with its liquid, drawn as a sector between the radii that its fill takes."""
    frames = _frames_of(run)
    width = 1 / len(frames)
    outer, inner, half = disc["outer_radius_m"], disc["inner_radius_m"], 180 / disc["chambers"]

    def at(time: float, values: Sequence[float]) -> float:
        return float(np.interp(time, run["time_s"], values))

    def paint(axes: Axes) -> None:
        boxes = [(index * width + 0.004, 0.0, width - 0.008, 0.76) for index in range(len(frames))]
        for panel, (title, time) in zip(panels(axes, *boxes), frames, strict=True):
            for index, (letter, fills) in enumerate(run["fill_ratio"].items()):
                ends = ((2 * index - 1) * half, (2 * index + 1) * half)
                depth = outer - math.sqrt(outer**2 - at(time, fills) * (outer**2 - inner**2))
                for thick, colour in ((outer - inner, SURFACE), (depth, MAP[8])):
                    panel.add_patch(Wedge((0, 0), outer, *ends, width=thick, facecolor=colour, edgecolor=INK))
                point = 0.55 * inner * np.exp(1j * math.radians(2 * half * index))
                look: Record = {"ha": "center", "va": "center", "color": MUTED, "fontsize": "small"}
                panel.text(point.real, point.imag, letter, **look)
            panel.set(xlim=(-1.05 * outer, 1.05 * outer), ylim=(-1.05 * outer, 1.05 * outer), aspect="equal")
            panel.set_axis_off()
            left = shown(at(time, run["amplitude_m"]), "m", digits=2)
            panel.set_title(f"{title}\n{left}", color=INK, fontsize="small")

    return draw("ring-frames", paint, columns=0, wide=True, height=1.15 + 6.6 / max(len(frames), 4) * 0.9)


def settling(curves: Sequence[tuple[dict[str, Any], Record]], required_fraction: float) -> Drawing | None:
    """Fraction of drawn devices that has settled by a time, with its bounds; None where none settles.

    Args: `curves`: looks, and times, fractions and bounds as in the evidence.
    """
    if not any(each["time_s"] for _, each in curves):
        return None

    def paint(axes: Axes) -> None:
        for look, each in curves:
            time, value, low, high = (np.array(each[key]) for key in ("time_s", "value", "low", "high"))
            axes.step(time, value, where="post", **look)
            axes.fill_between(time, low, high, step="post", color=look["color"], alpha=0.2, linewidth=0)
        axes.axhline(required_fraction, color=MUTED, linewidth=1, linestyle=":", label="required")
        axes.yaxis.set_major_formatter(PercentFormatter(1, symbol=""))

    look: Record = {"x": TIME, "y": ("settled devices in %", "1"), "xlim": (0, None), "ylim": (0, 1.05)}
    return draw("settling", paint, columns=3, wide=True, height=2.1, **look)


LOOP: Final = Section(
    name="loop", title="Loop and tuning", document="report", collect=_reach, show=_loop, always=True
)


def _injections(_own: Record, evidence: Record) -> Record:
    run = evidence["closed_loop"].get("calibrated")
    return {"fills": fill_ratios(run, early_time(run)) if run else None}


INJECTIONS: Final = Section(
    name="injections", title="The closed loop, injection by injection", show=_injections
)


_LINEAR_FILL_CHANGE: Final = 1e-3


def _loop_gain(scene: Scene, model: BalancerModel) -> Record | None:
    """The proportional loop about equal fills under one law; None when the gas drives no flow there.

    e_(n+1) = (1 - h) e_n with h = Kc dA/dt and dA/dt = kappa |dM/dx| u S/V: a residual changes its sign
    from h = 1 on and grows from h = 2 on.
    Returns: u; k by Eq. 18 at that velocity, 2p/(rho u^2) - 1; lambda; dA/dt per valve-open time; and h, the
        fraction of the residual that one operation removes.
    Source: sections 4.2 and 5 of the liquid-ring paper; a discrete first-order loop.
    """
    x, pressure = scene.disc.initial_fill, scene.gas.pressure
    flow = model.flow.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure)
    u = float(flow.velocity)
    if u <= 0 or pressure <= 0:
        return None
    ends = np.array([x - _LINEAR_FILL_CHANGE, x + _LINEAR_FILL_CHANGE])
    moments = model.moment.pair_vector(fill_ratio=ends, opposite_fill_ratio=2 * x - ends)
    per_fill = float(abs(moments[1] - moments[0])) / (2 * _LINEAR_FILL_CHANGE)
    slope = scene.rotor.influence_coefficient * per_fill * u * model.tube_area / model.chamber_volume
    return {
        "law": model.name,
        "velocity_m_s": u,
        "drag_coefficient": 2 * pressure / (model.density * u**2) - 1,
        "moment_per_transferred_mass_m": per_fill / (model.density * model.chamber_volume),
        "slope_m_per_s": slope,
        "gain_per_operation": scene.controller.proportional * slope,
    }


def _consequences(work: Work) -> Record:
    """Gains of both laws, and the paper's law judged on the devices of the calibrated one in the summary."""
    gains = [_loop_gain(work.ring, model) for model in (paper_model(work.ring), work.calibration.model)]
    (paper,) = judged_all(balancer_of(work.ring, flow_law="paper"), [{}])
    return {
        "gain": [each for each in gains if each is not None],
        "paper": judgement_record(paper),
    }


CONSEQUENCES: Final = Section(
    name="consequences",
    title="What a wrong k costs",
    collect=_consequences,
    show=lambda _own, evidence: {} if (evidence.get("summary") or {}).get("own") else None,
)
