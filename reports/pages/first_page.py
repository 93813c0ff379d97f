"""The first page of a liquid ring: for what fraction of devices, under which settings, and what to do."""

from __future__ import annotations

from typing import Final

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged
from ringbalance.controller.judging.tune import tuned
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reports import summary
from ringbalance.reports.figure import Drawing
from ringbalance.reports.judged import (
    advice_view,
    choice_records,
    judgement_record,
    settings_rows,
    settings_text,
    tuning_record,
)
from ringbalance.reports.pages.pressure_figure import pressure_figure
from ringbalance.reports.prose import key_words, named_with_origin, resting
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.traced import read, states_uncertainty, traced
from ringbalance.results.numbers import given, percent
from ringbalance.scene import Scene, SceneError, bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.draws import BLOCK
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
    "gas",
    "overshoots",
    "misadjustments",
)
_ROTOR: Final = ("rotor.influence_coefficient", "rotor.lag_angle", "rotor.initial_amplitude")
_DOMINANT: Final = 3
_SHARES: Final = {True: "{}: {}, merely not known", False: "{}: {}, varies between devices"}
"""An input and its share, by whether all devices have it in common."""


def _collect(work: Work) -> Record:
    scene, balancer = work.scene, LiquidRingBalancer(work.scene)
    tuning = tuned(balancer, along=True, remedies=None)
    chosen = liquid_ring_scene(tuning.scene)
    return {
        "limit_m": balancer.limit,
        "valve_given": scene.gas.conductance is not None,
        **tuning_record(balancer, tuning),
        "noise_open": not scene.sensor.amplitude_noise
        and scene.origin_of("sensor.amplitude_noise") == "default",
        "choices": choice_records(balancer.on_scene(tuning.recommended_scene)),
        "settings": list(settings_rows(chosen, SETTINGS)),
        "gas_pressure_Pa": scene.gas.pressure,
        "recommended_pressure_Pa": chosen.gas.pressure,
        "run": _run_record(chosen, work.calibration.model) if tuning.recommended.settings else None,
        "needed_moment_kg_m": scene.rotor.initial_amplitude / scene.rotor.influence_coefficient,
        "requirement": requirement_record(scene, limit=balancer.limit),
        "bore_m": scene.tube.bore,
        "bore_uncertainty_stated": any(i.quantity == "bore" for i in scene.uncertainty),
        "other_reading": _other_reading(scene),
    }


def _run_record(scene: Scene, model: BalancerModel) -> Record:
    """One run with the recommended settings, as the table of runs has it."""
    run = simulate(scene, model).to_dict()
    return {**{key: run[key] for key in _RUN if key in run}, "injections": len(run["injections"])}


def requirement_record(scene: Scene, *, limit: float) -> Record:
    """What is required of a scene's balancer, SI; None where nothing is stated.

    Args: `limit`: vibration amplitude that every device is asked to come below, m.
    """
    wanted, rotor = scene.requirement, scene.rotor
    left = limit / rotor.influence_coefficient
    return {
        "settling_time_s": wanted.settling_time,
        "residual_m": limit,
        "grade_m_s": wanted.grade,
        "correction_moment_kg_m": wanted.correction_moment,
        "rotor_mass_kg": rotor.mass,
        "rotor_speed_rad_s": rotor.speed,
        # G = U omega/m (ISO 21940-11:2016).
        "grade_at_residual_m_s": None if rotor.mass is None else left * rotor.speed / rotor.mass,
        "residual_moment_kg_m": left,
    }


def _other_reading(scene: Scene) -> Record | None:
    """The paper's disc with the other bore that Fig. 7 allows; None for any other disc."""
    if scene.values_sha256 != paper_scene().values_sha256:
        return None
    try:
        other = liquid_ring_scene(load_scene(bundled_scene(_OTHER_READING)))
    except SceneError:
        return None
    found = judgement_record(judged(balancer_of(other), {}, most=BLOCK))
    k = calibration_of(other).operating_point.k
    return {"bore_m": other.tube.bore, "k": k, "fraction": found["fraction"]}


def _view(found: Record, evidence: Record) -> Record:
    return {
        "question": _question(evidence),
        "settings": settings_text(found.get("settings", ())),
        "rests_on": {code: resting(evidence, *paths) for code, paths in _RESTS.items()},
        "pressure": _pressure(found),
        **advice_view(found),
        "alerts": [*_dry(evidence), *_chamber(evidence)],
        "dominant": _dominant(found, evidence),
        "rests": [*_bore(found, evidence), *_exact(evidence), *_borrowed(evidence)],
    }


def _pressure(found: Record) -> Drawing | None:
    if not found.get("along"):
        return None
    return pressure_figure(
        found["along"]["levels"],
        asked=(found["recommended"] or found["own"])["asked"],
        needed=found["needed_moment_kg_m"],
        own=found["gas_pressure_Pa"],
        recommended=found["recommended_pressure_Pa"],
    )


def _question(evidence: Record) -> Record:
    """Verdicts on what the study of the paper's disc asks, by case; empty for any other disc."""
    cases = {case["id"]: case for case in summary.claims(evidence)}
    if not summary.is_papers(evidence) or not cases.keys() >= set(_QUESTION):
        return {}
    return {name: cases[name]["verdict"] for name in _QUESTION}


def _dry(evidence: Record) -> list[str]:
    run = evidence["closed_loop"].get("calibrated") or {"injections": []}
    warning = (run.get("gas") or {}).get("warning")
    dry = [i for i in run["injections"] if i.get("event") == "empty"]
    if not dry and not warning:
        return []
    chambers = " and ".join(sorted({item["chamber"] for item in dry}))
    if warning:
        return [_sentence(warning)]
    many = "1 injection runs its" if len(dry) == 1 else f"{len(dry)} injections run their"
    return [f"{many} chamber dry ({chambers}): gas then passes through the tube into the opposite one."]


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:].rstrip('.')}."


def _chamber(evidence: Record) -> list[str]:
    status = evidence["calibration"].get("status") or {"code": "ok"}
    return [] if status["code"] == "ok" else [_sentence(status["text"])]


def _dominant(found: Record, evidence: Record) -> list[str]:
    """The inputs that decide most of what the drawn devices differ in."""
    return [
        _SHARES[each["common"]].format(
            _input(evidence, each), traced(percent(each["index"]), f"summary.ranking.{place}.index")
        )
        for place, each in enumerate(found.get("ranking", ())[:_DOMINANT])
        if each["index"] > each["noise"]
    ]


def _input(evidence: Record, ranked: Record) -> str:
    path = ranked["path"]
    label: str = named_with_origin(evidence, path) if path else ranked["name"].removeprefix("model: ")
    return f"{label[0].upper()}{label[1:]}"


def _exact(evidence: Record) -> list[str]:
    """That results hold for exactly the scene's values, where it states no uncertainty."""
    if states_uncertainty(evidence):
        return []
    return [
        "The scene states no uncertainty of its inputs: devices differ by what is assumed of them and by the "
        "models alone, and tolerances of the parts are likely to matter more. [uncertainty] in the scene "
        "file states them."
    ]


def _borrowed(evidence: Record) -> list[str]:
    """Values of the paper's rotor that stand in for those of the user's."""
    origins = evidence["scene"].get("origins") or {}
    rows = {row.get("path"): row.get("origin") for row in evidence["scene"].get("table") or []}
    names = [key_words(p) for p in _ROTOR if "default" in (rows.get(p), origins.get(p))]
    if not names:
        return []
    return [
        f"Not in the scene, so those of the paper’s rotor: {', '.join(names)}. Unbalance, gain and settling "
        "time hold for that rotor only."
    ]


def _bore(found: Record, evidence: Record) -> list[str]:
    if not found:
        return []
    bore, other = given(found["bore_m"], "m"), found["other_reading"]
    if other is None:
        exact = f"The bore of {bore}, on which k and every velocity rest, is taken as exact."
        return [] if found["bore_uncertainty_stated"] else [exact]
    k = read(evidence, "operating_point.k", "1", digits=2)
    place = "summary.other_reading"
    settled = traced(percent(other["fraction"]["value"]), f"{place}.fraction.value")
    return [
        f"The paper gives no bore. This scene assumes {bore}, from Fig. 7 under k = 50, and k is then {k}. "
        f"Under the calibrated law Fig. 7 gives {read(evidence, f'{place}.bore_m', 'm', digits=3)} and k = "
        f"{read(evidence, f'{place}.k', '1', digits=2)}; there, with the same gain, {settled} of the devices "
        "settle. Which of the two the paper’s machine had is not known."
    ]


SECTION: Final = Section(
    name="summary",
    title="Decision",
    place="report",
    collect=_collect,
    apart=True,
    show=_view,
    always=True,
)
