"""The evidence document: all that a report says, as plain numbers and texts, gathered from every room.

Everything but `times` and `provenance` is the same, to the last bit, for the same scene file, seed and
versions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from datetime import date
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.controller.loop import simulate
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.law.flow_law import FlowLaw, Regime
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reports.pictures.fields import shown_field
from ringbalance.reports.provenance import provenance, versions
from ringbalance.reports.saved import keep_cases, kept_cases, looks_at_no_scene
from ringbalance.reports.section import Record, Work
from ringbalance.reports.sections import begun, collected, completed
from ringbalance.scene import AnyScene, Scene, scene_table
from ringbalance.scene.platform.processes import Workers
from ringbalance.verification import paper_numbers
from ringbalance.verification.catalogue import load_cases
from ringbalance.verification.evidence import Level
from ringbalance.verification.loops import calibration_of
from ringbalance.verification.result import CaseResult, merge_saved
from ringbalance.verification.runner import DRIVEN, cases_under_way

Progress = Callable[[str], None]

FORMAT: Final = 1
LAW_POINTS: Final = 51
"""Fill ratios at which the flow law is drawn."""


def collect_evidence(
    scene: Scene,
    *,
    level: Level = "light",
    scene_text: str = "",
    saved: Sequence[Mapping[str, Any]] = (),
    pool: Workers | None = None,
    progress: Progress | None = None,
    judged: Callable[[list[Record]], None] | None = None,
) -> Record:
    """Run everything that a report rests on, pictures excepted, and gather it in one JSON-able document.

    Args: `scene_text`: the scene file's own text, for the appendix; empty where there is none. `pool`: runs
    cases beside this process. `judged`: called with all cases as soon as they are there.
    Raises: SceneError: a scene that cannot be calibrated or simulated.
    """
    tell = progress or (lambda _: None)
    # The claims about the other balancer stand in the reports on it; here only where everything is asked for.
    ids = [case.id for case in load_cases() if level == "heavy" or case.paper != DRIVEN]
    # Before the cases, the last of which this process takes when it has nothing else to do.
    apart = begun(scene, level, pool)
    with cases_of_report(ids, scene=scene, level=level, pool=pool) as judged_cases:
        tell("pressure field")
        pressure = _pressure(scene)
        tell("calibration")
        calibration = calibration_of(scene)
        tell("closed loop")
        runs = _closed_loop(scene, calibration)
        tell("sections")
        work = Work(scene=scene, calibration=calibration, level=level)
        sections = collected(work, without=apart)
        tell("verification")
        found, kept = judged_cases(tell)
    cases = merge_saved(found, saved)
    if judged is not None:
        judged(cases)
    sections = completed(sections, apart, work, pool)
    # What a section measured by the clock does not reproduce.
    clocked = {name: record.pop("times") for name, record in sections.items() if "times" in record}
    return {
        "format": FORMAT,
        "level": level,
        "versions": versions(),
        "scene": scene_record(scene, scene_text, [asdict(row) for row in scene_table(scene)]),
        "seeds": {"run": scene.run.seed},
        "limit_m": scene.controller.limit,
        "paper": _paper(),
        "operating_point": _operating_point(scene, calibration),
        "pressure": pressure,
        "calibration": calibration_document(calibration),
        "flow_law": _flow_law(scene, calibration),
        "closed_loop": runs,
        **sections,
        "verification": cases,
        "pictures": {"drawn": False, "text": "The 3-D pictures were not asked for.", "files": []},
        "provenance": provenance(),
        "times": {"date": date.today().isoformat(), "kept_cases": kept} | clocked,
    }


def scene_record(scene: AnyScene, text: str, rows: list[Record]) -> Record:
    """Names, hashes and text of a scene file, with the rows of its values."""
    return {
        "name": scene.name,
        "file": scene.source,
        "sha256": scene.sha256,
        "values_sha256": scene.values_sha256,
        "text": text,
        "origins": dict(scene.origins),
        "measured": asdict(scene.measured) if scene.measured.files else None,
        "states_uncertainty": bool(scene.uncertainty),
        "table": rows,
    }


def _paper() -> Record:
    """What the paper says, for comparison."""
    low, high = paper_numbers.LOWEST_PRESSURE, paper_numbers.HIGHEST_PRESSURE
    return {
        "drag_coefficient": paper.PAPER_DRAG_COEFFICIENT,
        "lambda_m": paper.PAPER_LAMBDA,
        "lambda_spread": paper_numbers.LAMBDA_TOLERANCE,
        "working_range_Pa": [low.value, high.value],
        "figure_4_pressures_Pa": [paper_numbers.LOW_PRESSURE, paper_numbers.HIGH_PRESSURE],
    }


def _pressure(scene: Scene) -> Record:
    field = shown_field(scene, fill_ratio=scene.disc.max_fill_ratio)
    return {"profile": field.pressure_profile(scene=scene), "mesh": field.record()}


def _closed_loop(scene: Scene, calibration: Calibration) -> Record:
    models = {"calibrated": calibration.model, "paper": paper_model(scene)}
    return {name: simulate(scene, model).to_dict() for name, model in models.items()}


@contextmanager
def cases_of_report(
    ids: Sequence[str], *, scene: Scene, level: Level, pool: Workers | None = None
) -> Iterator[Callable[[Progress], tuple[list[Record], dict[str, str]]]]:
    """Start the cases of a report that no earlier one has kept; they run beside the body.

    Args: `pool`: runs cases beside this process.
    Yields: What waits for them, to be called in the body: records of all cases, and the date of each that an
    earlier report has kept.
    """
    kept = kept_cases() if level == "light" else {}
    wanted = [name for name in ids if name not in kept]

    def finished(under_way: Iterator[CaseResult], tell: Progress) -> tuple[list[Record], dict[str, str]]:
        ran = {case["id"]: case for case in _finished(under_way, tell)}
        if level == "light":
            _keep(ran, kept)
        found = {name: ran[name] if name in ran else kept[name]["record"] for name in ids}
        return list(found.values()), {name: kept[name]["date"] for name in ids if name not in ran}

    if not wanted:
        yield partial(finished, iter(()))
        return
    with cases_under_way(
        wanted, scene=scene, level=level, mutations=level == "heavy", workers=pool
    ) as under_way:
        yield partial(finished, under_way)


def _finished(under_way: Iterator[CaseResult], tell: Progress) -> list[Record]:
    """Records of the cases as they come."""
    results = []
    for result in under_way:
        tell(f"verification: {result.definition.title}")
        results.append(result)
    return [_without_time(case) for case in [each.to_dict() for each in results]]


def _keep(ran: Mapping[str, Record], kept: Mapping[str, Record]) -> None:
    """Keep what other scenes' reports need not run again; what broke down is run again."""
    today = date.today().isoformat()
    new = {
        name: {"date": today, "record": case}
        for name, case in ran.items()
        if looks_at_no_scene(case) and not case["broken"]
    }
    if new:
        keep_cases({**kept, **new})


def _without_time(case: Record) -> Record:
    """Wall time does not reproduce, and a verdict must not hang on it."""
    return {key: value for key, value in case.items() if key != "time_s"}


def _operating_point(scene: Scene, calibration: Calibration) -> Record:
    """The calibration's operating point, with the flow state there and Eq. 19's velocity."""
    record: Record = dict(calibration_document(calibration)["operating_point"])
    speed, tube = record["k_at_velocity_m_s"], calibration.tube
    reynolds = speed * scene.tube.bore / scene.liquid.kinematic_viscosity
    nearest = int(np.argmin(np.abs(np.asarray(tube.velocity) - speed)))
    by_paper = calibration.paper_law.evaluate(
        fill_ratio=record["fill_ratio"],
        opposite_fill_ratio=record["fill_ratio"],
        gas_pressure=scene.gas.pressure,
    )
    return record | {
        "reynolds": reynolds,
        "flow_state": str(np.asarray(tube.flow_state)[nearest]),
        "velocity_paper_m_s": float(by_paper.velocity),
        "priming_uncertainty": _total(calibration, "priming_pressure_vented"),
        "stall_uncertainty": _total(calibration, "stall_pressure"),
    }


def _total(calibration: Calibration, quantity: str) -> float | None:
    """Expanded uncertainty (95 %) of a quantity; None where it has no budget."""
    budget = calibration.budgets.get(quantity)
    return None if budget is None else budget.total


def _flow_law(scene: Scene, calibration: Calibration) -> Record:
    """Both laws over the fill, at the pressures of Fig. 4, or at the scene's own and at twice that."""
    drawn = [paper_numbers.LOW_PRESSURE, paper_numbers.HIGH_PRESSURE]
    pressures = drawn if scene.gas.pressure in drawn else [scene.gas.pressure, 2 * scene.gas.pressure]
    fill = np.linspace(0.0, scene.disc.max_fill_ratio, LAW_POINTS)

    def rows(law: FlowLaw) -> Record:
        flow = law.evaluate(fill_ratio=fill[None, :], gas_pressure=np.array(pressures)[:, None])
        return {
            "velocity": flow.velocity.tolist(),
            "uncertainty": flow.uncertainty.tolist(),
            "regime": [[Regime(int(value)).label for value in row] for row in flow.regime],
        }

    found, printed = rows(calibration.flow_law), rows(calibration.paper_law)
    return {
        "gas_pressure_Pa": pressures,
        "fill_ratio": fill.tolist(),
        "velocity_m_s": found["velocity"],
        "velocity_uncertainty": found["uncertainty"],
        "regime": found["regime"],
        "velocity_paper_m_s": printed["velocity"],
        "regime_paper": printed["regime"],
    }
