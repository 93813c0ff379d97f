"""The evidence document: all that a report says, as plain numbers and texts, gathered from every room.

Everything but `times` and `provenance` is the same, to the last bit, for the same scene file, seed and
versions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from datetime import date
from functools import partial
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import AS_GIVEN, Draws, balancer_of
from ringbalance.controller.eccentric_mass.plant import rotor_record
from ringbalance.controller.eccentric_mass.run import locked_run, simulate_eccentric
from ringbalance.controller.eccentric_mass.run_rows import amplitude_band
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains, loops_document
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reports.pictures.fields import chamber_field
from ringbalance.reports.saved import keep_cases, kept_cases, looks_at_no_scene, provenance, versions
from ringbalance.reports.section import Record, Work, ring_of
from ringbalance.reports.sections import sections_of
from ringbalance.results.numbers import given, short, with_unit
from ringbalance.scene import AnyScene, Scene, scene_table
from ringbalance.scene.keys.declaration import Entries, Key, keys_of
from ringbalance.scene.keys.fields import ValueReader
from ringbalance.scene.keys.schema import TableSchema
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.origins import InputUncertainty, SceneFile
from ringbalance.scene.platform.jobs import Job, answers_of
from ringbalance.scene.platform.processes import Workers
from ringbalance.scene.units import DIMENSIONS
from ringbalance.verification import papers
from ringbalance.verification.catalogue import load_cases
from ringbalance.verification.evidence import Level
from ringbalance.verification.loops import calibration_of
from ringbalance.verification.result import merge_saved
from ringbalance.verification.runner import case_jobs, paper_scene

Progress = Callable[[str], None]

FORMAT: Final = 1
_TRACED: Final = 16
"""Drawn devices of the band of their vibration, the first of the verdict's."""
_LAW_POINTS: Final = 51
"""Fill ratios at which the flow law is drawn."""


def collect_evidence(
    scene: AnyScene,
    *,
    level: Level = "light",
    scene_text: str = "",
    saved: Sequence[Mapping[str, Any]] = (),
    pool: Workers | None = None,
    progress: Progress = lambda _: None,
) -> Record:
    """Run everything that a report rests on, pictures excepted, and gather it in one JSON-able document.

    Args: `scene_text`: the scene file's own text, for the appendix; empty where there is none. `saved`:
    results of heavy cases, which take the place of those not run. `pool`: runs cases beside this process.
    Raises: SceneError: a scene that cannot be calibrated or simulated.
    """
    ids = [case.id for case in load_cases() if case.paper == scene.balancer]
    kept = kept_cases() if level == "light" else {}
    wanted, heavy = [name for name in ids if name not in kept], level == "heavy"
    cases = case_jobs(wanted, scene=ring_of(scene) or paper_scene(), level=level, mutations=heavy)
    sections, work = sections_of(scene.balancer), Work(scene=scene, level=level)
    study = partial(_STUDIES.get(scene.balancer, _plain_study), scene)
    # The longest first, and behind it what is short: a worker that is at work does not give those back.
    jobs = [
        *(job for section in sections.values() for job in section.jobs(work)),
        Job(name="study", title="Pressure, law and runs", do=study),
        *cases,
    ]
    # A worker does not know a balancer that was registered in this process.
    answers = dict(answers_of(jobs, pool if scene.balancer in _STUDIES else None, progress))
    ran = {
        # Wall time does not reproduce, and no verdict hangs on it.
        each.definition.id: {key: value for key, value in each.to_dict().items() if key != "time_s"}
        for job in cases
        for each in answers[job.name]
    }
    if level == "light":
        _keep(ran, kept)
    collected = {name: answers[name] for name in sections if answers.get(name) is not None}
    # What a section measured by the clock does not reproduce.
    clocked = {name: record.pop("times") for name, record in collected.items() if "times" in record}
    verification = [ran[name] if name in ran else kept[name]["record"] for name in ids]
    dates = {name: kept[name]["date"] for name in ids if name not in ran}
    return {
        "format": FORMAT,
        "level": level,
        "balancer": scene.balancer,
        "versions": versions(),
        "scene": _scene_record(scene, scene_text),
        "seeds": {"run": scene.run.seed},
        **answers["study"],
        **collected,
        "verification": merge_saved(verification, saved),
        "pictures": {"drawn": False, "text": "The 3-D pictures were not asked for.", "files": []},
        "provenance": provenance(),
        "times": {"date": date.today().isoformat(), "kept_cases": dates} | clocked,
    }


def _scene_record(scene: AnyScene, text: str) -> Record:
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
        "table": _ROWS.get(scene.balancer, parameters)(scene),
    }


def _ring_study(scene: Scene) -> Record:
    """What several sections of a liquid ring look at."""
    field = chamber_field(scene, fill_ratio=scene.disc.max_fill_ratio)
    calibration = calibration_of(scene)
    models = {"calibrated": calibration.model, "paper": paper_model(scene)}
    return {
        "limit_m": scene.controller.limit,
        "paper": {
            "drag_coefficient": paper.PAPER_DRAG_COEFFICIENT,
            "lambda_m": paper.PAPER_LAMBDA,
            "lambda_spread": papers.LAMBDA_TOLERANCE,
        },
        "operating_point": _operating_point(scene, calibration),
        "pressure": {"profile": field.pressure_profile(scene=scene), "mesh": field.record},
        "calibration": calibration_document(calibration),
        "flow_law": _flow_law(scene, calibration),
        "closed_loop": {name: simulate(scene, model).to_dict() for name, model in models.items()},
    }


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


def _operating_point(scene: Scene, calibration: Calibration) -> Record:
    """Equal fills under the scene's gas pressure: the flow there, and Eq. 19's velocity."""
    speed, tube = abs(float(calibration.answers.velocity)), calibration.tube
    nearest = int(np.argmin(np.abs(np.asarray(tube.velocity) - speed)))
    half = scene.disc.max_fill_ratio / 2
    by_paper = calibration.paper_law.evaluate(
        fill_ratio=half, opposite_fill_ratio=half, gas_pressure=scene.gas.pressure
    )
    return {
        "fill_ratio": half,
        "gas_pressure_Pa": scene.gas.pressure,
        "reynolds": speed * scene.tube.bore / scene.liquid.kinematic_viscosity,
        "flow_state": str(np.asarray(tube.flow_state)[nearest]),
        "velocity_paper_m_s": float(by_paper.velocity),
    }


def _flow_law(scene: Scene, calibration: Calibration) -> Record:
    """Both laws over the fill, at the pressures of Fig. 4, or at the scene's own and at twice that."""
    drawn = [papers.LOW_PRESSURE, papers.HIGH_PRESSURE]
    pressures = drawn if scene.gas.pressure in drawn else [scene.gas.pressure, 2 * scene.gas.pressure]
    fill = np.linspace(0.0, scene.disc.max_fill_ratio, _LAW_POINTS)

    found, printed = (
        law.evaluate(fill_ratio=fill[None, :], gas_pressure=np.array(pressures)[:, None])
        for law in (calibration.flow_law, calibration.paper_law)
    )
    return {
        "gas_pressure_Pa": pressures,
        "fill_ratio": fill.tolist(),
        "velocity_m_s": found.velocity.tolist(),
        "velocity_uncertainty": found.uncertainty.tolist(),
        "regime": [[Regime(int(value)).label for value in row] for row in found.regime],
        "velocity_paper_m_s": printed.velocity.tolist(),
    }


def _plain_study(scene: SceneFile) -> Record:
    """One run of any balancer as its scene says, as `simulate` shows it, and what the scene demands."""
    balancer = balancer_of(scene)
    run = balancer.run({}, AS_GIVEN, trace=True).traced[0].run
    return {
        "closed_loop": {"balanced": run.to_dict()},
        "known": [each.document() for each in balancer.quantities()],
        "run": balancer.rows(run).document(),
    }


def _eccentric_study(scene: EccentricScene) -> Record:
    """The run, balanced and with its masses locked, drawn devices, loops, and the true values."""
    run, balancer = simulate_eccentric(scene), balancer_of(scene)
    several = balancer.run({}, Draws.block(FIRST_VERDICT_DEVICE, _TRACED), trace=True)
    truth = {
        "unbalance_kg_m": scene.imbalance.mass * scene.imbalance.radius,
        "phase_rad": scene.imbalance.phase,
        "friction_arm_m": list(scene.masses.friction_arm),
    }
    return {
        "truth": truth,
        "closed_loop": {"balanced": run.to_dict()},
        "locked": locked_run(scene).to_dict(),
        "rotor": rotor_record(scene),
        "tuning": loops_document(RecommendedGains.of(scene)),
        "drawn": amplitude_band(several.traced, end=scene.run.time_limit),
    }


_STUDIES: Final[Mapping[str, Callable[..., Record]]] = MappingProxyType(
    {"liquid_ring": _ring_study, "eccentric_mass": _eccentric_study}
)
"""By balancer, what has more to show than one run."""


def parameters(scene: SceneFile) -> list[Record]:
    """Every value of a scene with its uncertainty, meaning and origin, as rows of a table."""
    tables = scene_kind(scene.balancer).schema.tables
    widths = {each.quantity: _width(each, tables) for each in scene.uncertainty}
    return [
        {
            "group": name.replace("_", " ").capitalize(),
            "quantity": key.replace("_", " "),
            "value": _value(value, entry, scene.origin_of(f"{name}.{key}")),
            "uncertainty": widths.get(f"{name}.{key}", ""),
            "note": entry.presence.meaning,
            "origin": scene.origin_of(f"{name}.{key}"),
            "path": f"{name}.{key}",
        }
        for name, table in tables.items()
        if table.record is not None
        for key, entry in keys_of(table.record).items()
        if (value := getattr(getattr(scene, name, None), key, None)) not in (None, ())
    ]


def _value(value: Any, entry: Key, origin: str) -> str:
    """As the file has it; a default in the words of its declaration, or as it follows from other values."""
    if origin != "default":
        return _written(value, entry.takes)
    if entry.presence.kind != "standard":
        return _written(value, entry.takes, digits=3)
    texts = entry.presence.default if isinstance(entry.presence.default, list) else [entry.presence.default]
    return ", ".join(str(text).replace("*", " ") for text in texts)


def _width(uncertain: InputUncertainty, tables: Mapping[str, TableSchema]) -> str:
    if uncertain.relative:
        return with_unit(short(100 * uncertain.half_width), "%")
    table, key = uncertain.quantity.split(".")
    record = tables[table].record
    return _written(uncertain.half_width, keys_of(record)[key].takes) if record else ""


def _written(value: Any, takes: ValueReader | Entries, *, digits: int = 6) -> str:
    if isinstance(value, tuple):
        return ", ".join(_written(item, takes, digits=digits) for item in value)
    if isinstance(value, SpeedPoint):
        return f"{given(value.speed, 'rad/s')} from {given(value.time, 's')}"
    if isinstance(value, bool | str):
        return str(value)
    unit = DIMENSIONS[takes.dimension].si_unit.replace("*", " ") if takes.dimension else ""
    return given(value, unit, digits=digits) if unit else short(float(value), digits=digits)


def _ring_rows(scene: Scene) -> list[Record]:
    return [asdict(row) for row in scene_table(scene)]


_ROWS: Final[Mapping[str, Callable[..., list[Record]]]] = MappingProxyType({"liquid_ring": _ring_rows})
"""By balancer, how the values of a scene are described where its keys alone would not do."""
