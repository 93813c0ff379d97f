"""The evidence document: the whole content of a report as plain numbers and texts, from every package.

For the same scene file, seed and versions everything but `times` and `provenance` is equal to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from datetime import date
from functools import partial
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import AS_GIVEN, Draws, RunResult, balancer_of
from ringbalance.controller.eccentric_mass.plant import PlantParameters, rotor_record
from ringbalance.controller.eccentric_mass.run import locked_run, simulate_eccentric
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains, loops_document
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint
from ringbalance.controller.eccentric_mass.static_answers import (
    largest_whirl_per_imbalance,
    starting_speed,
    static_quantities,
    whirl_per_imbalance,
)
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE
from ringbalance.controller.loop import simulate
from ringbalance.physics.evaporation import exhaust_cold
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reports.pictures.fields import chamber_field
from ringbalance.reports.saved import keep_cases, kept_cases, provenance, versions
from ringbalance.reports.section import Record, Work, ring_of
from ringbalance.reports.sections import sections_of
from ringbalance.results.numbers import format_given, short, with_unit
from ringbalance.scene import AnyScene, Scene, liquid_ring_scene, scene_table
from ringbalance.scene.arrays import finite
from ringbalance.scene.keys.declaration import Entries, keys_of
from ringbalance.scene.keys.fields import ValueReader
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.origins import SceneFile
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
_BAND_DEVICES: Final = 64
"""Number of drawn devices, those of the verdict, whose vibration makes a band."""
_BAND_INSTANTS: Final = 600
_LAW_FILLS: Final = 51
_RUN_UP_SPEEDS: Final = 1001


def collect_evidence(
    scene: AnyScene,
    *,
    level: Level = "light",
    scene_text: str = "",
    saved: Sequence[Mapping[str, Any]] = (),
    pool: Workers | None = None,
    progress: Progress = lambda _: None,
) -> Record:
    """Run all that a report is based on, pictures excepted, and collect it in one JSON-able document.

    Args: `scene_text`: the scene file's own text, for the appendix; empty where there is none. `saved`:
    results of heavy cases, used for those not run. `pool`: processes that share the work with this one.
    Raises: SceneError: a scene that cannot be calibrated or simulated.
    """
    ids = [case.id for case in load_cases() if case.paper == scene.balancer]
    stored = kept_cases() if level == "light" else {}
    missing, heavy = [name for name in ids if name not in stored], level == "heavy"
    cases = case_jobs(missing, scene=ring_of(scene) or paper_scene(), level=level, mutations=heavy)
    sections, work = sections_of(scene.balancer), Work(scene=scene, level=level)
    study = partial(_STUDIES.get(scene.balancer, _plain_study), scene)
    # Longest jobs first, then short ones: a busy worker does not return the jobs that it has taken.
    jobs = [
        *(job for section in sections.values() for job in section.jobs(work)),
        Job(
            name="study",
            title="Pressure, law and runs",
            needs=("tuning",) if ring_of(scene) else (),
            do=study,
        ),
        *cases,
    ]
    # A worker does not know a balancer that was registered in this process.
    answers = dict(answers_of(jobs, pool if scene.balancer in _STUDIES else None, progress))
    ran = {
        # Wall time does not reproduce, and no verdict depends on it.
        result.definition.id: {key: value for key, value in result.to_dict().items() if key != "time_s"}
        for job in cases
        for result in answers[job.name]
    }
    # Cases that depend on no scene serve other reports; one that broke down is run again.
    date_today = date.today().isoformat()
    new = {
        name: {"date": date_today, "record": case}
        for name, case in ran.items()
        if level == case["cost"] == "light" and case["judged_on"] == "paper" and not case["broken"]
    }
    if new:
        keep_cases({**stored, **new})
    collected = {name: answers[name] for name in sections if answers.get(name) is not None}
    # Measured times do not reproduce.
    clocked = {name: record.pop("times") for name, record in collected.items() if "times" in record}
    verification = [ran[name] if name in ran else stored[name]["record"] for name in ids]
    dates = {name: stored[name]["date"] for name in ids if name not in ran}
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
        "times": {"date": date_today, "kept_cases": dates} | clocked,
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


def _ring_study(scene: Scene, tuning: Record) -> Record:
    """Pressure, calibration, both flow laws and a run under each, for several sections.

    Runs have the scene's settings, or, where it gives no gain, the recommended ones.
    Args: `tuning`: the job of that name of page 1.
    """
    field = chamber_field(scene, fill_ratio=scene.disc.max_fill_ratio)
    calibration = calibration_of(scene)
    models = {"calibrated": calibration.model, "paper": paper_model(scene)}
    # Equal fills under the scene's gas pressure: the flow there, and Eq. 19's velocity.
    half, speed, tube = (
        scene.disc.max_fill_ratio / 2,
        abs(float(calibration.answers.velocity)),
        calibration.tube,
    )
    nearest = int(np.argmin(np.abs(np.asarray(tube.velocity) - speed)))
    equal_fills = calibration.paper_law.evaluate(
        fill_ratio=half, opposite_fill_ratio=half, gas_pressure=applied_pressure(scene.gas)
    )
    # Both laws over the fill, at the pressures of Fig. 4, or at the scene's own and at twice that.
    pressures = [papers.LOW_PRESSURE_PA, papers.HIGH_PRESSURE_PA]
    if scene.gas.pressure not in pressures:
        pressures = [scene.gas.pressure, 2 * scene.gas.pressure]
    fill = np.linspace(0.0, scene.disc.max_fill_ratio, _LAW_FILLS)
    calibrated, printed = (
        law.evaluate(fill_ratio=fill[None, :], gas_pressure=np.array(pressures)[:, None])
        for law in (calibration.flow_law, calibration.paper_law)
    )
    ran = scene if tuning["judged"]["own"] else liquid_ring_scene(tuning["scene"])
    runs = {name: simulate(ran, model).to_dict() for name, model in models.items()}
    hourly = next(row["value"] for row in runs["calibrated"]["conventions"] if row["key"] == "gas_per_hour")
    cold = exhaust_cold(ran, gas_per_hour=hourly) if hourly else None
    return {
        "limit_m": scene.controller.limit,
        "paper": {
            "drag_coefficient": paper.PAPER_DRAG_COEFFICIENT,
            "lambda_m": paper.PAPER_LAMBDA_M,
            "lambda_spread": papers.LAMBDA_TOLERANCE,
        },
        "operating_point": {
            "fill_ratio": half,
            "gas_pressure_Pa": scene.gas.pressure,
            "reynolds": speed * scene.tube.bore / scene.liquid.kinematic_viscosity,
            "flow_state": str(np.asarray(tube.flow_state)[nearest]),
            "velocity_paper_m_s": float(equal_fills.velocity),
        },
        "pressure": {"profile": field.pressure_profile(scene=scene), "mesh": field.record},
        "calibration": calibration_document(calibration),
        "flow_law": {
            "gas_pressure_Pa": pressures,
            "fill_ratio": fill.tolist(),
            "velocity_m_s": calibrated.velocity.tolist(),
            "velocity_uncertainty": calibrated.uncertainty.tolist(),
            "regime": [[Regime(int(value)).label for value in row] for row in calibrated.regime],
            "velocity_paper_m_s": printed.velocity.tolist(),
        },
        "closed_loop": runs,
        "exhaust_cold": cold and cold._asdict(),
    }


def _plain_study(scene: SceneFile) -> Record:
    """One run of any balancer by its scene, as a document of `simulate`, and the scene's requirements."""
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
    # One at a time: a trace has every sample.
    devices = (
        balancer.run({}, Draws.block(FIRST_VERDICT_DEVICE + number, 1), trace=True).traced[0]
        for number in range(_BAND_DEVICES)
    )
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
        "drawn": _amplitude_band(devices, end=scene.run.time_limit),
        "known": [each.document() for each in static_quantities(scene)],
        "run_up": _run_up_record(scene),
    }


def _amplitude_band(runs: Iterable[RunResult], *, end: float) -> Record:
    """Smallest, median and largest amplitude of runs at equally spaced times; the amplitude of a run is its
    maximum since the time before, so that no peak is lost.

    Args: `end`: last of the times, s. Returns: Plain numbers for JSON, SI; a run that ended before has its
        last value.
    """
    time = np.linspace(0.0, end, _BAND_INSTANTS)
    peaks, settled = [], 0
    for result in runs:
        run, settled = result.run, settled + result.settled
        edges = np.minimum(np.searchsorted(run.time, time), run.time.size - 1)
        since = np.concatenate([edges[:1], edges[:-1]])
        peaks.append([run.amplitude[a : max(b, a) + 1].max() for a, b in zip(since, edges, strict=True)])
    low, middle, high = (row.tolist() for row in np.quantile(np.array(peaks), [0.0, 0.5, 1.0], axis=0))
    return {
        "time_s": time.tolist(),
        "low_m": low,
        "middle_m": middle,
        "high_m": high,
        "runs": len(peaks),
        "settled": settled,
    }


def _run_up_record(scene: EccentricScene) -> Record | None:
    """Speed up to which locked masses keep the limit, rad/s, and the limit at the speed of balancing, m, that
    keeps the scene's over the whole profile, by |alpha| of steady states; None: a constant speed."""
    speeds, start = scene.rotor.profile[1], starting_speed(scene)
    if np.ptp(speeds) == 0 or start <= 0:
        return None
    plant, limit = PlantParameters.of(scene), scene.supervisor.limit
    grid = np.linspace(0.0, float(np.max(speeds)), _RUN_UP_SPEEDS)[1:]
    locked = [abs(plant.steady_whirl(speed, scene.masses.initial_angle)) for speed in grid]
    above = np.flatnonzero(np.array(locked) > limit)
    largest = largest_whirl_per_imbalance(scene, after=scene.supervisor.start)
    return {
        "start_rad_s": start,
        "locked_limit_speed_rad_s": float(grid[max(above[0] - 1, 0)]) if above.size else None,
        "limit_at_start_m": finite(limit * whirl_per_imbalance(scene, start) / largest),
    }


_STUDIES: Final[Mapping[str, Callable[..., Record]]] = MappingProxyType(
    {"liquid_ring": _ring_study, "eccentric_mass": _eccentric_study}
)
"""Studies by balancer, for those whose report shows more than one run."""


def parameters(scene: SceneFile) -> list[Record]:
    """Every value of a scene with its uncertainty, meaning and origin, as rows of a table."""
    uncertain = {each.quantity: each for each in scene.uncertainty}
    rows = []
    for name, table in scene_kind(scene.balancer).schema.tables.items():
        for key, entry in keys_of(table.record).items() if table.record is not None else ():
            path, value = f"{name}.{key}", getattr(getattr(scene, name, None), key, None)
            if value in (None, ()):
                continue
            origin, default = scene.origin_of(path), entry.presence.default
            if origin != "default":
                text = _written(value, entry.takes)
            elif entry.presence.kind != "standard":
                text = _written(value, entry.takes, digits=3)
            else:
                # A default is shown as in its declaration.
                defaults = default if isinstance(default, list) else [default]
                text = ", ".join(str(word).replace("*", " ") for word in defaults)
            width = uncertain.get(path)
            if width is None:
                uncertainty = ""
            elif width.relative:
                uncertainty = with_unit(short(100 * width.half_width), "%")
            else:
                uncertainty = _written(width.half_width, entry.takes)
            rows.append(
                {
                    "group": name.replace("_", " ").capitalize(),
                    "quantity": key.replace("_", " "),
                    "value": text,
                    "uncertainty": uncertainty,
                    "note": entry.presence.meaning,
                    "origin": origin,
                    "path": path,
                }
            )
    return rows


def _written(value: Any, takes: ValueReader | Entries, *, digits: int = 6) -> str:
    if isinstance(value, tuple):
        return ", ".join(_written(item, takes, digits=digits) for item in value)
    if isinstance(value, SpeedPoint):
        return f"{format_given(value.speed, 'rad/s')} from {format_given(value.time, 's')}"
    if isinstance(value, bool | str):
        return str(value)
    unit = DIMENSIONS[takes.dimension].si_unit.replace("*", " ") if takes.dimension else ""
    return format_given(value, unit, digits=digits) if unit else short(float(value), digits=digits)


_ROWS: Final[Mapping[str, Callable[..., list[Record]]]] = MappingProxyType({"liquid_ring": scene_table})
"""Rows of the scene's values by balancer, where its keys alone would not describe them."""
