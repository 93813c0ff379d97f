"""The first page: what the loop does, which gain to set, what it costs, and what all of it rests on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from ringbalance.controller.loop import simulate
from ringbalance.controller.tuning.tune import tuning_document
from ringbalance.reports.numbers import MISSING, given, measured, number, percent, shown
from ringbalance.reports.section import Cells, Record, Section, Table, Work
from ringbalance.scene import SceneError, bundled_scene, liquid_ring_scene, load_scene
from ringbalance.verification.loops import calibration_of
from ringbalance.verification.runner import paper_scene

_OTHER_READING: Final = "liquid_ring_paper_calibrated"
"""The paper's disc with the bore that its Fig. 7 implies under the calibrated law."""
_RETUNED: Final = "calibrated_retuned"
_GRAM_MILLIMETRE: Final = 1e6
_MICROMETRE: Final = 1e6
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
        "bore_m": work.scene.tube.bore,
        "bore_uncertainty_stated": any(i.quantity == "bore" for i in work.scene.uncertainty),
        "time_limit_s": work.scene.run.time_limit,
        "other_reading": _other_reading(work),
        "tuning": tuning_document(work.tuning),
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
    return {
        "loop_lead": [*_loop_lead(evidence), *_chance(found, evidence)],
        "alerts": [*_dry(evidence), *_reach(found, evidence), *_gas_line(evidence), *_chamber(evidence)],
        "rests": [*_bore(found, evidence), _EXACT, _NO_MEASUREMENT],
        "loop": _loop_table(evidence),
        "reach": _reach_table(found, evidence["calibration"].get("residual_liquid")),
    }


_EXACT: Final = (
    "An input whose uncertainty the scene does not state is taken as exact, so each ± is a lower bound where "
    "inputs are assumed."
)
_NO_MEASUREMENT: Final = (
    "No measurement of this device is compared with here. Every verdict on the paper compares a model with a "
    "model."
)


def loop_sentences(evidence: Record) -> list[str]:
    """What the loop does under the calibrated law and with the recommended gain."""
    return _loop_lead(evidence)


def _retuned(evidence: Record) -> Record | None:
    runs = (evidence.get("consequences") or {}).get("runs", [])
    return next((run for run in runs if run.get("name") == _RETUNED), None)


def _ending(run: Record) -> str:
    verdict = run.get("verdict") or ("settled" if run["settled"] else "not settled")
    when = f" in {shown(run['settling_time_s'], 's', digits=2)}" if run["settled"] else ""
    return f"{_ENDINGS[verdict]}{when}"


def _loop_lead(evidence: Record) -> list[str]:
    run = evidence["closed_loop"].get("calibrated")
    if run is None:
        return ["The closed loop was not run."]
    told = [f"Under the calibrated law the loop {_ending(run)}{_factor(run)}."]
    tuned = _retuned(evidence)
    if tuned is not None:
        gain, own = (shown(r, "s/m", digits=2) for r in _gains(evidence, tuned))
        told.append(f"Recommended gain: {gain} (the scene has {own}). With it this run {_ending(tuned)}.")
    paper = evidence["closed_loop"].get("paper")
    if paper is not None:
        told.append(f"Under the paper’s law, with the scene’s gain, it {_ending(paper)}.")
    return told


def _gains(evidence: Record, tuned: Record) -> tuple[float, float | None]:
    runs = evidence["consequences"]["runs"]
    own: Record = next((run for run in runs if run.get("name") == "calibrated"), {})
    return tuned["proportional_s_per_m"], own.get("proportional_s_per_m")


def _factor(run: Record) -> str:
    if run.get("loop_factor") is None:
        return ""
    value, limit = (number(run[key], digits=3) for key in ("loop_factor", "loop_factor_limit"))
    return f": one injection takes {value} times a small residual away, and from {limit} times on it grows"


def _chance(found: Record, evidence: Record) -> list[str]:
    """Fractions of the ensembles that have settled by the end, with the scene's gain and the recommended."""
    ensembles = (evidence.get("consequences") or {}).get("ensembles", [])
    if len(ensembles) < 3 or not found:
        return []
    members, until = ensembles[1]["members"], given(found["time_limit_s"], "s")
    own, tuned = (percent(1 - e["probability"]["not_settled"]["value"]) for e in ensembles[1:])
    return [
        f"Of {members} runs over the stated uncertainties and the noise, {own} have settled by {until} with "
        f"the scene’s gain and {tuned} with the recommended one. {_tuned(found['tuning'])}"
    ]


def _tuned(tuning: Record) -> str:
    reached = (tuning["settling_time_s"] or {}).get("p95")
    if reached is None:
        return f"{tuning['status'][0].upper()}{tuning['status'][1:]}."
    fraction, low, high = (percent(f) for f in (tuning["fraction_settled"], *tuning["fraction_settled_95"]))
    return (
        f"With every term that the tolerance selects, {fraction} ({low} to {high}) of {tuning['runs']} runs "
        f"settle with it, and {percent(0.95)} within {shown(reached, 's', digits=2)}."
    )


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


def _reach(found: Record, evidence: Record) -> list[str]:
    rest = evidence["calibration"].get("residual_liquid")
    if not rest or not found:
        return []
    needed, usable = found["needed_moment_kg_m"], rest["usable_pair_moment_kg_m"]
    width, told = rest["usable_pair_moment_uncertainty"], shown(found["needed_moment_kg_m"], "kg m", digits=3)
    reach = shown(usable, "kg m", width)
    if needed > usable + width:
        return [f"The unbalance of {told} is beyond the {reach} that one pair can usably give."]
    if needed > usable - width:
        return [
            f"Whether one pair can give the {told} of the unbalance cannot be told: usable are {reach}. In "
            "the direction of a pair it has no help from the other."
        ]
    return []


def _gas_line(evidence: Record) -> list[str]:
    warning = (evidence["calibration"].get("gas_line") or {}).get("warning")
    return [_sentence(warning)] if warning else []


def _chamber(evidence: Record) -> list[str]:
    status = evidence["calibration"].get("status") or {"code": "ok"}
    return [] if status["code"] == "ok" else [_sentence(status["text"])]


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


def _loop_table(evidence: Record) -> Table:
    runs = evidence["closed_loop"]
    columns = {
        "Calibrated law,\nthe scene’s gain": runs.get("calibrated"),
        "Calibrated law,\nrecommended gain": _retuned(evidence),
        "The paper’s law,\nthe scene’s gain": runs.get("paper"),
    }

    def row(label: str, read: Callable[[Record], str]) -> Cells:
        return label, *(MISSING if run is None else read(run) for run in columns.values())

    def factor(run: Record) -> str:
        return number(run.get("loop_factor"), digits=3)

    def gas(key: str, text: Callable[[Any], str]) -> Callable[[Record], str]:
        return lambda run: text(run["gas"][key]) if run.get("gas") else MISSING

    def length(key: str) -> Callable[[Record], str]:
        return lambda run: number(run[key] * _MICROMETRE, digits=2) if run.get(key) else MISSING

    rows = [
        row("Verdict", lambda run: run.get("verdict") or MISSING),
        row("Loop factor h, unstable from 2", factor),
        row("Within the limit from", lambda run: shown(run["settling_time_s"], "s", digits=3)),
        row("Standard deviation that noise keeps up, µm", length("stationary_deviation_m")),
        row("Injections", lambda run: str(_injections(run))),
        row("Gas consumed, normal litres", gas("normal_litres", lambda v: number(v, digits=2))),
        row("Energy to compress it", gas("compression_energy_J", lambda v: shown(v, "J", digits=2))),
        row("Injections that run a chamber dry", gas("injections_run_dry", str)),
        row("Overshoots", lambda run: str(run["overshoots"])),
        row("Misadjustments", lambda run: str(run["misadjustments"])),
    ]
    shown_rows = [cells for cells in rows if any(cell != MISSING for cell in cells[1:])]
    return Table(
        caption=f"One run each, with the scene’s noise; the limit is {given(evidence['limit_m'], 'm')}.",
        heads=("", *columns),
        rows=shown_rows,
    )


def _injections(run: Record) -> int:
    return run["injections"] if isinstance(run["injections"], int) else len(run["injections"])


def _reach_table(found: Record, rest: Record | None) -> Table | None:
    if not rest or not found:
        return None
    usable = measured(
        _GRAM_MILLIMETRE * rest["usable_pair_moment_kg_m"],
        _GRAM_MILLIMETRE * rest["usable_pair_moment_uncertainty"],
    )
    needed, geometric = (
        _GRAM_MILLIMETRE * moment for moment in (found["needed_moment_kg_m"], rest["pair_moment_kg_m"])
    )
    rows = (
        ("needed for the initial vibration", number(needed, digits=3)),
        ("by geometry", number(geometric)),
        ("usable", usable),
    )
    return Table(
        caption="What one pair can correct. Below a residual fill gas enters the port, so the geometric "
        "moment is not usable to the end.",
        heads=("", "Moment, g mm"),
        rows=rows,
    )


SECTION: Final = Section(
    name="summary", title="Decision", place="report", collect=_collect, show=_view, always=True
)
