"""The first page: what the loop does, which gain to set, what it costs, and what all of it rests on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from ringbalance.controller.loop import simulate
from ringbalance.controller.members import ASSUMED_INFLUENCE
from ringbalance.controller.tuning.highest_pressure import highest_pressure
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reports.pages.requirements import (
    CAPACITY,
    SMALLEST,
    STANDING,
    Requirement,
    decision,
    more_capacity,
    requirement_figure,
    requirement_record,
    requirement_table,
    requirements,
)
from ringbalance.reports.prose import key_words, named_with_origin
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.summary import LIKELY, tuning_of
from ringbalance.reports.traced import found_at, read, states_uncertainty, traced
from ringbalance.results.numbers import MISSING, THIN_SPACE, given, number, percent, shown
from ringbalance.results.requirements import MISSED, OPEN
from ringbalance.scene import Scene, SceneError, bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.uncertain import half_widths
from ringbalance.verification.assumptions import assumptions_of
from ringbalance.verification.case import RestsOn
from ringbalance.verification.loops import calibration_of
from ringbalance.verification.runner import paper_scene

_OTHER_READING: Final = "liquid_ring_paper_calibrated"
"""The paper's disc with the bore that its Fig. 7 implies under the calibrated law."""
RETUNED: Final = "calibrated_retuned"
"""Name of the run with the recommended settings."""
_VALVE: Final = {
    OPEN: "Choose the valve before anything else is built, and put its conductance, critical ratio and lag "
    "into the scene: only a fast one can reach the limit.",
    MISSED: "Find a valve and gas line that can give smaller corrections, or raise the limit: "
    "with {valve} no run is sure to reach it, whatever the gain.",
}
"""What to do about a valve that may not, or cannot, reach the limit."""
_ROTOR: Final = ("rotor.influence_coefficient", "rotor.lag_angle", "rotor.initial_amplitude")
_DOMINANT: Final = 3
_MAIN: Final = {
    "velocity": "flow velocity",
    "usable_moment": "usable moment",
    "lambda": "lever arm λ",
    "wall_pressure": "wall pressure",
    "needed_moment": "capacity needed",
}
_NEEDED: Final = "needed_moment"
"""Results whose causes of uncertainty are compared; k and the margin follow from the velocity's."""
_CREST: Final = RestsOn(
    path="tube.hump_radius",
    documented=True,
    why="any place between the chamber’s inner wall and the fullest ring fits",
)
_ENDINGS: Final = {
    "settled": "settles",
    "hovering": "hovers about its limit",
    "not settled": "does not settle",
    "unstable": "is unstable",
}


def _collect(work: Work) -> Record:
    rotor = work.scene.rotor
    return {
        "needed_moment_kg_m": rotor.initial_amplitude / rotor.influence_coefficient,
        "needed_uncertainty_kg_m": needed_uncertainty(work.scene),
        "gas_pressure_uncertainty_Pa": half_widths(work.scene).get("pressure", 0.0),
        "requirement": requirement_record(work.scene),
        "highest_gas_pressure_Pa": highest_pressure(work.scene, work.calibration.model),
        "crest": crest_range(work.scene, work.calibration),
        "bore_m": work.scene.tube.bore,
        "bore_uncertainty_stated": any(i.quantity == "bore" for i in work.scene.uncertainty),
        "time_limit_s": work.scene.run.time_limit,
        "other_reading": _other_reading(work),
        "tuning": work.tuning.to_dict(),
    }


def needed_uncertainty(scene: Scene) -> float:
    """Of the initial unbalance, kg m at 95 %, by that of the influence coefficient: stated, else assumed."""
    assumed = ASSUMED_INFLUENCE * scene.rotor.influence_coefficient
    width = half_widths(scene).get("influence_coefficient", assumed)
    return scene.rotor.initial_amplitude * width / scene.rotor.influence_coefficient**2


def crest_range(scene: Scene, calibration: Calibration) -> Record | None:
    """Where a siphon crest that nobody gave may lie, and the gas pressures that lift the liquid over it."""
    point = calibration.operating_point
    (crest,) = assumptions_of((_CREST,), scene) or (None,)
    if crest is None or point.priming_vented is None:
        return None
    head = 0.5 * scene.liquid.density * scene.rotor.speed**2 / calibration.flow_law.gas_factor
    pressures = [point.priming_vented + head * (crest.value**2 - r**2) for r in (crest.high, crest.low)]
    return {
        "radius_m": [crest.low, crest.high],
        "priming_pressure_Pa": pressures,
        "why": crest.why,
    }


def _other_reading(work: Work) -> Record | None:
    """The paper's disc with the other bore that Fig. 7 allows; None for any other disc."""
    if work.scene.values_sha256 != paper_scene().values_sha256:
        return None
    try:
        scene = liquid_ring_scene(load_scene(bundled_scene(_OTHER_READING)))
    except SceneError:
        return None
    calibration = calibration_of(scene)
    run = simulate(scene, calibration.model)
    return {
        "bore_m": scene.tube.bore,
        "k": calibration.operating_point.k,
        "loop_factor": run.loop.value,
        "verdict": run.verdict.value,
        "settled": run.settled,
        "settling_time_s": run.settling_time,
    }


def _view(found: Record, evidence: Record) -> Record:
    rows = requirements(evidence)
    return {
        "decision": decision(rows),
        "loop_lead": loop_sentences(evidence),
        "alerts": [*_dry(evidence), *_gas_line(evidence), *_chamber(evidence)],
        "requirements": requirement_table(rows),
        "bars": requirement_figure(rows),
        "actions": _actions(evidence, rows),
        "dominant": _dominant(evidence),
        "unmeasured": f"{_measured(evidence)} {_OF_PARTS}",
        "rests": [*_bore(found, evidence), *_exact(evidence), *_borrowed(evidence)],
    }


def _measured(evidence: Record) -> str:
    found = evidence["scene"].get("measured")
    if not found:
        return "No comparison with measurements of this device exists."
    rows = sum(each["rows"] for each in found["files"])
    return f"Fitted to {rows} measurements of this device (annex); no others are compared with the result."


_OF_PARTS: Final = (
    "Verdicts on the paper compare a model with "
    "a model; only parts of the model, the friction of a straight pipe among them, are compared with "
    "measurements."
)


def loop_sentences(evidence: Record) -> list[str]:
    """What the loop does under the calibrated law, which gain to set, and what the paper's law expects."""
    run = evidence["closed_loop"].get("calibrated")
    if run is None:
        return ["The closed loop was not run."]
    line = evidence["calibration"].get("gas_line") or {"given": True}
    ideal = "" if line["given"] else ", with a valve that acts at once,"
    told = [
        f"Under the calibrated law{ideal} the loop {_ending(run)}{_factor(run)}.",
        *_others(evidence, run),
    ]
    tuned = _retuned(evidence)
    if tuned is not None:
        gain, own = (_gain_of(evidence, name) for name in (RETUNED, "calibrated"))
        change = _change(evidence)
        told.append(
            f"Recommended gain: {gain} (the scene has {own}){f', with {change}' if change else ''}. "
            f"With {'these settings' if change else 'it'} this run {_ending(tuned)}."
        )
    paper = evidence["closed_loop"].get("paper")
    if paper is not None:
        told.append(f"Under the paper’s law, with the scene’s gain, it {_ending(paper)}.")
    return told


def _others(evidence: Record, run: Record) -> list[str]:
    """What the drawn runs do with the scene's gain, where the scene's own run does not stand for them."""
    ensembles = (evidence.get("consequences") or {}).get("ensembles", [])
    if len(ensembles) < 3:
        return []
    settle = 1 - ensembles[1]["probability"]["not_settled"]["value"]
    if settle >= LIKELY if run["settled"] else settle <= 1 - LIKELY:
        return []
    members = ensembles[1]["members"]
    return [f"Of {members} runs over the uncertain inputs {percent(settle)} settle with this gain."]


def _change(evidence: Record) -> str:
    """Keys and values that are recommended beside the gain, as keys of the scene file; empty: none."""
    return str(tuning_of(evidence).get("change") or "")


def _retuned(evidence: Record) -> Record | None:
    """The run with the recommended settings, if there are any."""
    place = place_of_run(evidence, RETUNED)
    return None if place is None else evidence["consequences"]["runs"][place]


def place_of_run(evidence: Record, name: str) -> int | None:
    """Position of a run among those of the consequences; None where it is not among them."""
    runs = (evidence.get("consequences") or {}).get("runs", [])
    return next((place for place, run in enumerate(runs) if run.get("name") == name), None)


def _ending(run: Record) -> str:
    verdict = run.get("verdict") or ("settled" if run["settled"] else "not settled")
    when = f" in {shown(run['settling_time_s'], 's', digits=2)}" if run["settled"] else ""
    return f"{_ENDINGS[verdict]}{when}"


def _gain_of(evidence: Record, name: str) -> str:
    path = f"consequences.runs.{place_of_run(evidence, name)}.proportional_s_per_m"
    return MISSING if found_at(evidence, path) is None else read(evidence, path, "s/m", digits=2)


def _factor(run: Record) -> str:
    """What the loop factor means for a small residual, in plain words."""
    factor = run.get("loop_factor")
    if factor is None:
        return ""
    value, limit = (
        traced(number(run[key], digits=3), f"closed_loop.calibrated.{key}")
        for key in ("loop_factor", "loop_factor_limit")
    )
    if factor > run["loop_factor_limit"]:
        chance = "; that this run settles is chance" if run["settled"] else ""
        end = f"more than {limit} times, so that it grows{chance}"
    elif factor > 1:
        end = (
            f"so that {percent(factor - 1)} of it is left on the opposite side; "
            f"from {limit} times on it would grow"
        )
    else:
        end = f"and leaves the rest to the next; from {limit} times on it would grow"
    return f". One injection removes {value} times a small residual, {end}"


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


def _gas_line(evidence: Record) -> list[str]:
    warning = (evidence["calibration"].get("gas_line") or {}).get("warning")
    return [_sentence(warning)] if warning else []


def _chamber(evidence: Record) -> list[str]:
    status = evidence["calibration"].get("status") or {"code": "ok"}
    return [] if status["code"] == "ok" else [_sentence(status["text"])]


def _actions(evidence: Record, rows: Sequence[Requirement]) -> list[str]:
    """What to do next, the most urgent first."""
    verdicts = {row.name.split(" with ")[0]: row.verdict for row in reversed(rows)}
    told = _valve_and_gain(evidence, verdicts)
    if verdicts.get(STANDING) in {MISSED, OPEN} and not _change(evidence):
        told.append(
            "Put the valve into the scene and run tune: it recommends the times to add to the valve-open "
            "times, without which small corrections transfer no liquid."
        )
    if verdicts.get(CAPACITY) in {MISSED, OPEN}:
        told.append(more_capacity(evidence["calibration"]["residual_liquid"]))
    if any("siphon crest radius" in row.rests for row in rows):
        told.append(_crest(evidence))
    if any("bore" in row.rests for row in rows):
        told.append(
            "Measure the flow through the tube at three gas pressures; every velocity and gain rests on the "
            "bore."
        )
    return told


def _crest(evidence: Record) -> str:
    if evidence["operating_point"].get("priming_pressure_vented_Pa") is None:
        return (
            "Find out whether the tube passes over a siphon crest, and at which radius: this scene has none, "
            "and with one the flow needs more gas pressure to start."
        )
    return (
        "Measure the radius of the siphon crest: it sets the gas pressure that starts the flow. More "
        "pressure starts it too, but leaves less usable moment and other gains: change it in the scene first."
    )


def _valve_and_gain(evidence: Record, verdicts: Mapping[str, str]) -> list[str]:
    """The valve first: a gain holds for the valve that it was found with, and only where runs settle."""
    line = evidence["calibration"].get("gas_line") or {"given": True}
    valve = _VALVE.get(verdicts.get(SMALLEST, ""))
    valve_named = "the scene’s valve" if line["given"] else "any valve of the default range"
    told = [valve.format(valve=valve_named)] if valve else []
    tuned, tuning = _retuned(evidence), tuning_of(evidence)
    if tuned is None:
        return told
    gain = shown(tuned["proportional_s_per_m"], "s/m", digits=2)
    if tuning.get("fraction_settled") is not None and tuning["fraction_settled"] < LIKELY:
        reached = tuning.get("reachable_limit_m")
        lowest = f"; a limit of {shown(reached, 'm', digits=2)} is reached" if reached else ""
        share = percent(tuning["fraction_settled"])
        why = f" {_sentence(tuning['status'])}" if tuning.get("status") else ""
        return [
            *told,
            f"Do not expect settings to make this loop settle in {percent(LIKELY)} of runs: none that were "
            f"tried do; with the recommended ones {share} settle{lowest}.{why}",
        ]
    change = _change(evidence)
    if verdicts.get("Loop factor") in {MISSED, OPEN} or change:
        beside = f", and {change}" if change else ""
        later = " These hold for a valve that acts at once: tune again with the valve chosen in the scene."
        told.append(f"Set the proportional gain to {gain}{beside}.{'' if line['given'] else later}")
    return told


def _dominant(evidence: Record) -> list[str]:
    """The three effects of one cause on one main result that are largest, relative to it."""
    budgets = evidence["calibration"].get("budgets") or {}
    effects = []
    for name, budget in budgets.items():
        if name not in _MAIN or not budget["value"]:
            continue
        causes = {**budget["inputs"], "the model itself": budget["model"]}
        effects += [(width / abs(budget["value"]), cause, name) for cause, width in causes.items()]
    own = evidence.get("summary") or {}
    if own.get("needed_moment_kg_m") and own.get("needed_uncertainty_kg_m"):
        share = own["needed_uncertainty_kg_m"] / own["needed_moment_kg_m"]
        effects.append((share, "rotor.influence_coefficient", _NEEDED))
    largest = sorted(effects, reverse=True)[:_DOMINANT]
    return [_cause(evidence, cause, effect, name) for effect, cause, name in largest]


def _cause(evidence: Record, cause: str, effect: float, name: str) -> str:
    label = named_with_origin(evidence, cause)
    return f"{label[0].upper()}{label[1:]}: ±{THIN_SPACE}{percent(effect)} of the {_MAIN[name]}"


def _exact(evidence: Record) -> list[str]:
    """That results hold for exactly the scene's values, where it states no uncertainty."""
    if states_uncertainty(evidence):
        return []
    return [
        "The scene states no uncertainty of its inputs: every ± holds for exactly its values, and tolerances "
        "of the parts are likely to matter more. [uncertainty] in the scene file states them."
    ]


def _borrowed(evidence: Record) -> list[str]:
    """Values of the paper's rotor that stand in for those of the user's."""
    origins = evidence["scene"].get("origins") or {}
    rows = {row.get("path"): row.get("origin") for row in evidence["scene"].get("table") or []}
    names = [key_words(p) for p in _ROTOR if "default" in (rows.get(p), origins.get(p))]
    if not names:
        return []
    return [
        f"Not in the scene, so those of the paper’s rotor: {', '.join(names)}. Capacity needed, gain and "
        "settling time hold for that rotor only."
    ]


def _bore(found: Record, evidence: Record) -> list[str]:
    if not found:
        return []
    bore, other = given(found["bore_m"], "m"), found["other_reading"]
    if other is None:
        exact = f"The bore of {bore}, on which k and every velocity rest, is taken as exact."
        return [] if found["bore_uncertainty_stated"] else [exact]
    k = number(evidence["operating_point"]["k"], digits=2)
    return [
        f"The paper gives no bore. This scene assumes {bore}, from Fig. 7 under k = 50, and k is then {k}. "
        f"Under the calibrated law Fig. 7 gives {given(other['bore_m'], 'm', digits=3)} and k = "
        f"{number(other['k'], digits=2)}; there, with the same gain, the loop factor is "
        f"{number(other['loop_factor'], digits=2)} and the loop {_ending(other)}. Which of the two the "
        "paper’s machine had is not known."
    ]


SECTION: Final = Section(
    name="summary", title="Decision", place="report", collect=_collect, show=_view, always=True
)
