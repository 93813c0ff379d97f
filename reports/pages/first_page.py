"""The first page of a liquid ring: for what fraction of devices, under which settings, and what to do."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged
from ringbalance.controller.judging.tune import tuned
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reports import summary
from ringbalance.reports.figure import FOUND, INK, MUTED, PAPER, THIRD, Drawing, draw, figure_of, panels
from ringbalance.reports.judged import (
    advice_view,
    choice_records,
    judgement_record,
    settings_lines,
    tuning_record,
)
from ringbalance.reports.prose import resting
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.requirements import MET, OPEN
from ringbalance.scene import Scene, SceneError, bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.draws import BLOCK
from ringbalance.scene.platform.jobs import Job
from ringbalance.verification.loops import calibration_of
from ringbalance.verification.runner import paper_scene

SETTINGS: Final = (
    "gas.pressure",
    "gas.conductance",
    "gas.critical_ratio",
    "gas.dead_volume",
    "gas.valve_lag",
    "controller.kind",
    "controller.proportional",
    "controller.integral_time",
    "controller.derivative_time",
    "controller.gas_time_offset",
    "controller.minimum_gas_time",
    "controller.maximum_gas_time",
    "controller.period",
    "controller.limit",
)
"""What a controller and a valve are set to."""
_OTHER_READING: Final = "liquid_ring_paper_calibrated"
"""The paper's disc with the bore that its Fig. 7 implies under the calibrated law."""
_QUESTION: Final = ("claim_06_wall_pressure", "claim_09_drag_coefficient", "claim_11_lambda")
"""What the study of the paper's disc asks: Eq. 12, k and lambda."""
_RESTS: Final = {
    "settling_time": (
        "tube.bore",
        "tube.hump_radius",
        "disc.plate_thickness",
        "rotor.influence_coefficient",
        "sensor.amplitude_noise",
    ),
    "correction_moment": ("tube.bore", "tube.hump_radius", "disc.plate_thickness"),
}
"""Inputs behind what is asked, by its code."""
_RUN: Final = (
    "verdict",
    "loop_factor",
    "settling_time_s",
    "stationary_deviation_m",
    "vibration_left_m",
    "gas",
    "overshoots",
    "misadjustments",
)
_ROTOR: Final = ("rotor.influence_coefficient", "rotor.lag_angle", "rotor.initial_amplitude")
_DOMINANT: Final = 3
_SHADES: Final = {MET: 0.28, OPEN: 0.1}
"""Opacity of the ground by what is known of the fraction there."""


def _tuning(work: Work) -> Record:
    """Settings by runs; `scene`: the scene with those recommended."""
    scene, balancer = work.ring, LiquidRingBalancer(work.ring)
    tuning = tuned(balancer, along=True, remedies=None)
    chosen = liquid_ring_scene(tuning.scene)
    return {
        "judged": tuning_record(balancer, tuning),
        "scene": tuning.recommended_scene,
        "settings": settings_lines(chosen, SETTINGS),
        "gas_pressure_Pa": scene.gas.pressure,
        "recommended_pressure_Pa": chosen.gas.pressure,
        "run": _run_record(chosen, work.calibration.model) if tuning.recommended.settings else None,
    }


def _choices(some: slice, _work: Work, tuning: Record) -> list[Record]:
    return choice_records(LiquidRingBalancer(tuning["scene"]), some)


def _collect(work: Work, tuning: Record, other_reading: Record | None, *choices: list[Record]) -> Record:
    scene, limit = work.ring, LiquidRingBalancer(work.ring).limit
    shown = ("settings", "gas_pressure_Pa", "recommended_pressure_Pa", "run")
    return {
        "limit_m": limit,
        "valve_given": scene.gas.conductance is not None,
        **tuning["judged"],
        "noise_open": not scene.sensor.amplitude_noise
        and scene.origin_of("sensor.amplitude_noise") == "default",
        "choices": [each for some in choices for each in some],
        **{key: tuning[key] for key in shown},
        "needed_moment_kg_m": scene.rotor.initial_amplitude / scene.rotor.influence_coefficient,
        "requirement": _requirement_record(scene, limit=limit),
        "bore_m": scene.tube.bore,
        "bore_uncertainty_stated": any(i.quantity == "bore" for i in scene.uncertainty),
        "other_reading": other_reading,
    }


def _run_record(scene: Scene, model: BalancerModel) -> Record:
    """One run with the recommended settings, as the table of runs has it."""
    run = simulate(scene, model).to_dict()
    return {**{key: run[key] for key in _RUN if key in run}, "injections": len(run["injections"])}


def _requirement_record(scene: Scene, *, limit: float) -> Record:
    """What the limit of a scene's vibration amplitude, m, means for its rotor; SI, None where not known."""
    rotor = scene.rotor
    left = limit / rotor.influence_coefficient
    return {
        "rotor_mass_kg": rotor.mass,
        "rotor_speed_rad_s": rotor.speed,
        # G = U omega/m (ISO 21940-11:2016).
        "grade_at_residual_m_s": None if rotor.mass is None else left * rotor.speed / rotor.mass,
        "residual_moment_kg_m": left,
    }


def _other_reading(work: Work) -> Record | None:
    """The paper's disc with the other bore that Fig. 7 allows; None for any other disc."""
    if work.scene.values_sha256 != paper_scene().values_sha256:
        return None
    try:
        other = liquid_ring_scene(load_scene(bundled_scene(_OTHER_READING)))
    except SceneError:
        return None
    found = judgement_record(judged(balancer_of(other), {}, most=BLOCK))
    k = calibration_of(other).quantities["drag_coefficient"].value
    return {"bore_m": other.tube.bore, "k": k, "fraction": found["fraction"]}


def _view(found: Record, evidence: Record) -> Record:
    origins = evidence["scene"]["origins"]
    rows = {row["path"]: row["origin"] for row in evidence["scene"]["table"]}
    return {
        "question": _question(evidence),
        "rests_on": {code: resting(evidence, *paths) for code, paths in _RESTS.items()},
        "pressure": _pressure_figure(found),
        **advice_view(found),
        # Inputs that decide most of what the drawn devices differ in.
        "dominant": [
            place for place, each in enumerate(found["ranking"][:_DOMINANT]) if each["index"] > each["noise"]
        ],
        "borrowed": [path for path in _ROTOR if "default" in (rows.get(path), origins.get(path))],
    }


def _pressure_figure(found: Record) -> Drawing | None:
    """Drawn devices at every gas pressure, each with its best settings; None with fewer than three."""
    levels = (found.get("along") or {"levels": ()})["levels"]
    if len(levels) < 3:
        return None
    pressure = 1e-6 * np.array([each["value"] for each in levels])
    half = (pressure[1:] + pressure[:-1]) / 2
    ends = np.concatenate([pressure[:1], half, pressure[-1:]])
    own, recommended = (1e-6 * found[f"{key}_pressure_Pa"] for key in ("gas", "recommended"))

    def paint(axes: Axes) -> None:
        three = panels(axes, (0.12, 0.64, 0.85, 0.2), (0.12, 0.385, 0.85, 0.17), (0.12, 0.12, 0.85, 0.17))
        for panel, fill in zip(three, (_shares, _moments, _times), strict=True):
            for low, high, each in zip(ends[:-1], ends[1:], levels, strict=True):
                panel.axvspan(low, high, color=THIRD, alpha=_SHADES.get(each["verdict"], 0.0), linewidth=0)
            panel.axvline(own, color=INK, linewidth=1, linestyle=":", label="the scene’s pressure")
            if recommended != own:
                panel.axvline(recommended, color=INK, linewidth=1.4, label="recommended")
            fill(panel, pressure, levels, found)
            panel.set(xlim=(pressure[0], pressure[-1]), ylim=(0, None))
            panel.tick_params(labelbottom=panel is three[-1])
        three[-1].set_xlabel("gas pressure in MPa, gauge")
        handles, labels = three[0].get_legend_handles_labels()
        grounds = [Patch(color=THIRD, alpha=shade, linewidth=0) for shade in _SHADES.values()]
        place: Record = {"loc": "upper left", "ncols": 2, "borderaxespad": 0.0, "borderpad": 0.1}
        figure_of(axes).legend([*handles, *grounds], [*labels, *_SHADES], **place)

    return draw("pressure-choice", paint, columns=0, height=3.5)


def _shares(panel: Axes, pressure: FloatArray, levels: Sequence[Record], found: Record) -> None:
    fractions = [each["fraction"] for each in levels]
    value, low, high = (100 * np.array([each[key] for each in fractions]) for key in ("value", "low", "high"))
    _banded(panel, pressure, low, value, high, marker="o", markersize=3)
    _asked(panel, 100 * (found["recommended"] or found["own"])["asked"], "asked")
    panel.set_title("devices that settle, in %", loc="left", fontsize="medium", pad=3)


def _moments(panel: Axes, pressure: FloatArray, levels: Sequence[Record], found: Record) -> None:
    moments = [list(each["usable_moment_kg_m"].values()) for each in levels]
    _banded(panel, pressure, *(1e6 * np.array(moments, dtype=np.float64).T))
    _asked(panel, 1e6 * found["needed_moment_kg_m"], "unbalance")
    panel.set_title("moment that can be corrected, in g mm", loc="left", fontsize="medium", pad=3)


def _times(panel: Axes, pressure: FloatArray, levels: Sequence[Record], _found: Record) -> None:
    times = {key: [each["settling_time_s"][key] for each in levels] for key in ("p50", "p90")}
    for (_, values), colour, marker in zip(times.items(), (FOUND, MUTED), "os", strict=True):
        panel.plot(pressure, np.array(values, dtype=np.float64), color=colour, marker=marker, markersize=3)
    panel.set_title("time to settle, in s", loc="left", fontsize="medium", pad=3)
    if not any(time is not None for time in times["p50"]):
        panel.set_yticks([])
        panel.text(0.5, 0.5, "half of the devices nowhere settle", ha="center", transform=panel.transAxes)


def _banded(
    panel: Axes, x: FloatArray, low: FloatArray, middle: FloatArray, high: FloatArray, **look: Any
) -> None:
    panel.fill_between(x, low, high, color=FOUND, alpha=0.25, linewidth=0)
    panel.plot(x, middle, color=FOUND, **look)


def _asked(panel: Axes, level: float, text: str) -> None:
    """A dashed level with its name at its right end, below it."""
    panel.axhline(level, color=PAPER, linestyle="--", linewidth=1)
    look: Record = {"color": PAPER, "fontsize": "small", "ha": "right", "va": "top"}
    panel.annotate(text, (1.0, level), (-3, -2), panel.get_yaxis_transform(), "offset points", **look)


def _question(evidence: Record) -> Record:
    """Verdicts on what the study of the paper's disc asks, by case; empty for any other disc."""
    cases = {case["id"]: case for case in summary.claims(evidence)}
    if not summary.is_papers(evidence) or not cases.keys() >= set(_QUESTION):
        return {}
    return {name: cases[name]["verdict"] for name in _QUESTION}


SECTION: Final = Section(
    name="summary",
    title="Decision",
    place="report",
    collect=_collect,
    parts=(
        Job(name="tuning", title="Settings by runs", do=_tuning),
        Job(name="other_reading", title="The paper’s disc with its other bore", do=_other_reading),
        *(
            Job(name=f"valve {n}", needs=("tuning",), do=partial(_choices, slice(n - 1, end)))
            for n, end in ((1, 1), (2, 2), (3, None))
        ),
    ),
    show=_view,
    always=True,
)
