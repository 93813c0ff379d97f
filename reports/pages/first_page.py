"""First page of a liquid ring: fraction of devices that settle, recommended settings, and remedies."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import partial
from itertools import groupby
from operator import itemgetter
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.judging.remedies import tried_choices
from ringbalance.controller.judging.tune import tuned
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.loop import simulate
from ringbalance.design.in_place import kept_design
from ringbalance.reports import summary
from ringbalance.reports.figure import FOUND, INK, MUTED, PAPER, THIRD, Drawing, draw, figure_of, panels
from ringbalance.reports.figures_page import READING_FILE, ReadableFigure, ReadingColumn, figures_page
from ringbalance.reports.judged import (
    advice_view,
    judgement_record,
    settings_lines,
    tuning_record,
)
from ringbalance.reports.prose import resting
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.numbers import percent
from ringbalance.results.requirements import MET, MISSED, OPEN
from ringbalance.scene import Scene, SceneError, bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.draws import BLOCK
from ringbalance.scene.errors import MODEL_KINDS
from ringbalance.scene.fitted import MODEL
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
"""Settings of controller and valve."""
_OTHER_READING: Final = "liquid_ring_paper_calibrated"
"""The paper's disc with the bore that its Fig. 7 implies under the calibrated law."""
_QUESTION: Final = ("claim_06_wall_pressure", "claim_09_drag_coefficient", "claim_11_lambda")
"""Claims that the study of the paper's disc decides: Eq. 12, k and lambda."""
_RESTS: Final = {
    "settling_time": (
        "tube.bore",
        "tube.hump_radius",
        "disc.plate_thickness",
        "rotor.influence_coefficient",
        "sensor.amplitude_noise",
    ),
    "correction_moment": ("tube.bore", "tube.hump_radius", "disc.plate_thickness"),
    "crater": ("disc.gas_hole_diameter", "disc.gas_hole_radius", "gas.conductance"),
}
"""Inputs that a requirement rests on, by its code."""
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
_VALVE: Final = ("gas.critical_ratio", "gas.valve_lag")
_ROTOR: Final = ("rotor.influence_coefficient", "rotor.lag_angle", "rotor.initial_amplitude")
_GROUNDS: Final[dict[str, Record]] = {
    MET: {"facecolor": THIRD, "alpha": 0.28, "linewidth": 0},
    OPEN: {"facecolor": "none", "edgecolor": THIRD, "alpha": 0.8, "hatch": "///", "linewidth": 0},
}
"""Ground by the verdict on the fraction of devices."""
_WITHOUT_GROUND: Final[Record] = {"facecolor": "none", "edgecolor": MUTED, "linewidth": 0.6}


def _tuning(work: Work) -> Record:
    """Settings found by runs, with the scene under the recommended ones as `scene`."""
    scene, balancer = work.ring, LiquidRingBalancer(work.ring)
    tuning = tuned(balancer, curve=True, remedies=True)
    chosen = liquid_ring_scene(tuning.scene)
    recommended_run = None
    # Without settings of the scene's own the run of every section has the recommended ones.
    if tuning.own is not None and tuning.recommended.settings:
        run = simulate(chosen, work.calibration.model).to_dict()
        recommended_run = {key: run[key] for key in _RUN if key in run} | {
            "injections": len(run["injections"])
        }
    return {
        "judged": tuning_record(balancer, tuning),
        "scene": tuning.recommended_scene,
        "settings": settings_lines(chosen, SETTINGS),
        "gas_pressure_Pa": scene.gas.pressure,
        "recommended_pressure_Pa": chosen.gas.pressure,
        "run": recommended_run,
    }


def _choices(some: slice, _work: Work, tuning: Record) -> list[Record]:
    choices = tried_choices(LiquidRingBalancer(tuning["scene"]), settings={}, some=some)
    return [each.document() for each in choices]


def _collect(work: Work, tuning: Record, other_reading: Record | None, *choices: list[Record]) -> Record:
    scene, limit = work.ring, LiquidRingBalancer(work.ring).limit
    parts = [choice for records in choices for choice in records]
    best = max(parts, key=lambda each: (each["verdict"] == MET, each["fraction"]["value"]), default=None)
    settings = tuning["settings"]
    if best is not None and best["verdict"] == MET:
        changed = tuning["scene"].with_values({**best["changes"], **best["settings"]}, origin="inferred")
        settings = settings_lines(liquid_ring_scene(changed), SETTINGS)
    return {
        "limit_m": limit,
        "valve_given": scene.gas.conductance is not None,
        "assumed_absent": assumed_absent(scene),
        "humidity_given": scene.gas.relative_humidity is not None,
        **tuning["judged"],
        "noise_open": not scene.sensor.amplitude_noise
        and scene.origin_of("sensor.amplitude_noise") == "default",
        "choices": parts,
        "best_choice": best,
        "in_place": kept_design(work.scene),
        "settings": settings,
        **{key: tuning[key] for key in ("gas_pressure_Pa", "recommended_pressure_Pa", "run")},
        "needed_moment_kg_m": scene.rotor.initial_amplitude / scene.rotor.influence_coefficient,
        "requirement": _requirement_record(scene, limit=limit),
        "bore_m": scene.tube.bore,
        "bore_uncertainty_stated": any(i.quantity == "bore" for i in scene.uncertainty),
        "other_reading": other_reading,
    }


def assumed_absent(scene: Scene) -> list[str]:
    """Effects on the verdict that the scene does not state and the program assumes absent, in words."""
    absent = {
        "no leak of the gas distributor": scene.gas.leak_to_ambient is None
        and scene.gas.leak_from_supply is None,
        "no runout of the sensor": scene.sensor.runout_amplitude is None,
    }
    return [words for words, holds in absent.items() if holds]


def _requirement_record(scene: Scene, *, limit: float) -> Record:
    """Unbalance and balance quality grade that the limit of the amplitude, m, allows; SI, None: not known."""
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
    (judgement,) = judged_all(balancer_of(other), [{}], most=BLOCK)
    k = calibration_of(other).quantities["drag_coefficient"].value
    return {"bore_m": other.tube.bore, "k": k, "fraction": judgement_record(judgement)["fraction"]}


def _view(record: Record, evidence: Record) -> Record:
    origins = evidence["scene"]["origins"]
    rows = {row["path"]: row["origin"] for row in evidence["scene"]["table"]}
    verdicts = {case["id"]: case["verdict"] for case in summary.claims(evidence)}
    # The study's question is about the paper's own disc alone.
    answered = summary.is_papers(evidence) and verdicts.keys() >= set(_QUESTION)
    return {
        "question": {name: verdicts[name] for name in _QUESTION} if answered else {},
        "rests_on": {code: resting(evidence, *paths) for code, paths in _RESTS.items()},
        "pressure": _pressure_figure(record),
        **_over_pressure(record),
        "values_file": READING_FILE,
        **advice_view(record),
        "in_place": advice_view({"remedies": [record["in_place"]]})["remedies"][0]
        if record.get("in_place")
        else "",
        # An error of a model in the words of what it acts on.
        "acts_on": {f"{MODEL}{name}": kind.acts_on for name, kind in MODEL_KINDS.items()},
        "borrowed": [path for path in _ROTOR if "default" in (rows.get(path), origins.get(path))],
        "valve_taken": [
            row
            for row in evidence["scene"]["table"]
            if record.get("valve_given") and row["path"] in _VALVE and row["origin"] in ("assumed", "default")
        ],
    }


def _over_pressure(record: Record) -> Record:
    """Ranges of gas pressure, Pa, in whose levels one verdict holds, and the most frequent end of other
    devices below and above the recommended pressure."""
    levels = (record.get("along") or {"levels": ()})["levels"]
    alike = [(verdict, list(group)) for verdict, group in groupby(levels, itemgetter("verdict"))]
    spans = [
        (verdict, group[0]["value"], group[-1]["value"]) for verdict, group in alike if verdict != MISSED
    ]
    chosen, ends = record["recommended_pressure_Pa"], {"below": Counter[str](), "above": Counter[str]()}
    for level in levels:
        if level["value"] != chosen:
            ends["below" if level["value"] < chosen else "above"] += Counter(level.get("ended"))
    for counts in ends.values():
        counts.pop("settled", None)
    return {
        "spans": spans,
        "causes": {side: next(iter(counts.most_common(1)), ("",))[0] for side, counts in ends.items()},
    }


def _pressure_figure(record: Record) -> Drawing | None:
    """Drawn devices at every gas pressure, each with its best settings; None with fewer than three."""
    levels = (record.get("along") or {"levels": ()})["levels"]
    if len(levels) < 3:
        return None
    pressure = 1e-6 * np.array([level["value"] for level in levels])
    half = (pressure[1:] + pressure[:-1]) / 2
    ends = np.concatenate([pressure[:1], half, pressure[-1:]])
    scene_pressure, recommended = (1e-6 * record[f"{key}_pressure_Pa"] for key in ("gas", "recommended"))
    fractions = (
        100 * np.array([[level["fraction"][key] for key in ("low", "value", "high")] for level in levels]).T
    )
    usable = [list(level["usable_moment_kg_m"].values()) for level in levels]
    moments = 1e6 * np.array(usable, dtype=np.float64).T
    times = {key: [level["settling_time_s"][key] for level in levels] for key in ("p50", "p90")}

    def paint(axes: Axes) -> None:
        boxes = (0.12, 0.63, 0.85, 0.18), (0.12, 0.385, 0.85, 0.16), (0.12, 0.14, 0.85, 0.16)
        titles = (
            "devices that settle, in %",
            "moment that can be corrected, in g mm",
            "time to settle, in s",
        )
        three = panels(axes, *boxes)
        for panel, title in zip(three, titles, strict=True):
            for low, high, level in zip(ends[:-1], ends[1:], levels, strict=True):
                if level["verdict"] in _GROUNDS:
                    panel.axvspan(low, high, **_GROUNDS[level["verdict"]])
            panel.axvline(scene_pressure, color=INK, linewidth=1, linestyle=":", label="the scene’s pressure")
            if recommended != scene_pressure:
                panel.axvline(recommended, color=INK, linewidth=1.4, label="recommended")
            panel.set_title(title, loc="left", fontsize="medium", pad=3)
        required = 100 * (record["recommended"] or record["own"])["asked"]
        _banded(three[0], (pressure, *fractions), (required, "required"), marker="o", markersize=3)
        _banded(three[1], (pressure, *moments), (1e6 * record["needed_moment_kg_m"], "unbalance"))
        for values, colour, marker in zip(times.values(), (FOUND, MUTED), "os", strict=True):
            heights = np.array(values, dtype=np.float64)
            three[2].plot(pressure, heights, color=colour, marker=marker, markersize=3)
        if not any(time is not None for time in times["p50"]):
            three[2].set_yticks([])
            middle = three[2].transAxes
            three[2].text(0.5, 0.5, "half of the devices nowhere settle", ha="center", transform=middle)
        for panel in three:
            panel.set(xlim=(pressure[0], pressure[-1]), ylim=(0, None))
            panel.tick_params(labelbottom=panel is three[2])
        # Room above the highest mark.
        highest = max((time for row in times.values() for time in row if time), default=1.0)
        three[2].set_ylim(0, 1.15 * highest)
        three[0].set_yticks((0, 50, 100))
        three[2].set_xlabel("gas pressure in MPa, gauge")
        handles, labels = three[0].get_legend_handles_labels()
        grounds = {**_GROUNDS, MISSED: _WITHOUT_GROUND}
        patches = [Patch(**look) for look in grounds.values()]
        legend: Record = {"loc": "upper left", "ncols": 3, "borderaxespad": 0.0, "borderpad": 0.1}
        figure_of(axes).legend([*handles, *patches], [*labels, *grounds], columnspacing=1.0, **legend)

    return draw("pressure-choice", paint, columns=0, height=2.95)


def pressure_page(evidence: Record, drawing: Drawing) -> str:
    """Page on which the figure over the gas pressure answers a pointer with its values."""
    record = evidence[SECTION.name]
    levels = record["along"]["levels"]
    pressures = [level["value"] for level in levels]

    def column(name: str, key: str, part: str, unit: str = "") -> ReadingColumn:
        return ReadingColumn(name=name, values=[level[key][part] for level in levels], unit=unit)

    fractions = [
        ReadingColumn(name=name, values=[percent(level["fraction"][part]) for level in levels])
        for name, part in (
            ("devices that settle", "value"),
            ("lower bound (95 %)", "low"),
            ("upper bound (95 %)", "high"),
        )
    ]
    columns = [
        ReadingColumn(name="gas pressure, gauge", values=pressures, unit="Pa"),
        *fractions,
        column("devices drawn", "fraction", "of"),
        ReadingColumn(name="verdict", values=[level["verdict"] for level in levels]),
        ReadingColumn(name="ends of the others", values=[_ends_text(level.get("ended")) for level in levels]),
        column("moment that can be corrected, median", "usable_moment_kg_m", "p50", "kg m"),
        column("by nine tenths of the devices at least", "usable_moment_kg_m", "p10", "kg m"),
        column("until half have settled", "settling_time_s", "p50", "s"),
        column("until nine tenths have settled", "settling_time_s", "p90", "s"),
    ]
    heights = [
        [100 * level["fraction"]["value"] for level in levels],
        [1e6 * (level["usable_moment_kg_m"]["p50"] or math.nan) for level in levels],
        [level["settling_time_s"]["p50"] or math.nan for level in levels],
    ]
    nearest = np.argmin(np.abs(np.array(pressures) - record["recommended_pressure_Pa"]))
    figure = ReadableFigure(
        drawing=drawing,
        label="Devices that settle, moment and time to settle over the gas pressure",
        caption="Drawn devices at each gas pressure, with the best settings there.",
        curves=[(1e-6 * np.array(pressures), values) for values in heights],
    )
    source = f"Figure of the report of {evidence['scene']['file']}, {evidence['times']['date']}."
    back = ("report.html", "Back to the report.")
    look: Record = {"start": int(nearest), "along_x": True, "has_dark": True}
    return figures_page(evidence["scene"]["name"], source, columns, [figure], back=back, **look)


def _ends_text(ended: Record | None) -> str:
    """Ends of runs that did not settle, with the number of devices."""
    counts = Counter({cause: count for cause, count in (ended or {}).items() if cause != "settled"})
    return ", ".join(f"{cause.replace('_', ' ')} {count}" for cause, count in counts.most_common())


def _banded(panel: Axes, curves: Sequence[Any], level: tuple[float, str], **look: Any) -> None:
    """A line in its band, and a dashed level with its name at its right end, below it.

    Args: `curves`: x, lower end of the band, line, and upper end. `level`: height and name.
    """
    (x, low, middle, high), (height, name) = curves, level
    panel.fill_between(x, low, high, color=FOUND, alpha=0.25, linewidth=0)
    panel.plot(x, middle, color=FOUND, **look)
    panel.axhline(height, color=PAPER, linestyle="--", linewidth=1)
    text: Record = {"color": PAPER, "fontsize": "small", "ha": "right", "va": "top"}
    panel.annotate(name, (1.0, height), (-3, -2), panel.get_yaxis_transform(), "offset points", **text)


SECTION: Final = Section(
    name="summary",
    title="Decision",
    document="report",
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
