"""One run of a scene with two eccentric masses: sensors, filters, supervisor, drives and plant."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from ringbalance.controller.eccentric_mass.document import eccentric_document, eccentric_rows
from ringbalance.controller.eccentric_mass.estimation.rotor_uncertainty import rotor_covariance
from ringbalance.controller.eccentric_mass.plant.open_loop import Progress, check_substeps
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.controller.eccentric_mass.remedies import expected_deviation, found_beforehand, remedies_of
from ringbalance.controller.eccentric_mass.run_loop import Record, recorded
from ringbalance.controller.eccentric_mass.run_record import EccentricRun, StageSpan
from ringbalance.controller.eccentric_mass.run_status import RunFacts
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.strategy.plan import RELEASED, STAGE_NAMES, Cause, Findings, Stage
from ringbalance.controller.eccentric_mass.strategy.settings import StrategySettings, believed_whirl
from ringbalance.controller.eccentric_mass.strategy.targets import Targets, target_angles
from ringbalance.results.result import Presentation
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import FloatArray, IntArray


def simulate_eccentric(
    scene: EccentricScene,
    *,
    seed: int | None = None,
    progress: Progress | None = None,
    settings: StrategySettings | None = None,
) -> EccentricRun:
    """Run a scene from a rotor at its centre and masses at rest, to its time limit.

    Args: `seed`: of numpy's default generator for the sensors' noise; default the scene's. `progress`: called
    several times a second; None for silence. `settings`: of the strategy; default those of the scene.
    Returns: EccentricRun; its status says how the run ended and what to do next. A run that diverges ends at
    the last sample that means anything.
    Raises: SceneError: a run that takes too many samples or steps.
    Source: Fig. 3 of the paper on eccentric masses.
    """
    check_substeps(scene)
    record, findings, innovation = recorded(
        scene, seed, progress or (lambda _, __: None), settings or StrategySettings.of(scene)
    )
    cause = Cause(int(record.cause[-1]))
    times, speeds = scene.rotor.profile
    time: FloatArray = np.arange(len(record.state), dtype=np.float64) * scene.sensor.step
    speed = np.interp(time, times, speeds)
    whirl = record.state[:, 0] + 1j * record.state[:, 1]
    facts = _facts(scene, record, cause, findings, innovation, speed, np.abs(whirl))
    outcome = facts.outcome
    remedies = remedies_of(facts)
    settled = facts.settling_time is not None and outcome.value in {"settled", "locked"}
    return EccentricRun(
        presentation=Presentation(document=eccentric_document, rows=eccentric_rows),
        balancer="eccentric_mass",
        scene=scene.name,
        source=scene.source,
        sha256=scene.sha256,
        outcome=outcome,
        settled=settled,
        settling_time=facts.settling_time if settled else None,
        ended=facts.ended,
        warned=(
            *(
                Finding(code="masses_beforehand", values={"text": text})
                for text in found_beforehand(scene, friction_known=facts.friction_known)
            ),
            *facts.warnings,
        ),
        remedies=remedies,
        innovation=innovation,
        limit=scene.supervisor.limit,
        time=time,
        speed=speed,
        whirl=whirl,
        mass_angle=np.ascontiguousarray(record.state[:, 4:6].T),
        mass_rate=np.ascontiguousarray(record.state[:, 6:8].T),
        goal=np.ascontiguousarray(record.goal.T),
        voltage=np.ascontiguousarray(record.voltage.T),
        drive_off=record.hold == RELEASED,
        energy=record.energy,
        estimates=record,
        rotor_covariance=_rotor_covariance(scene, record, speed),
        stages=_stages(record.stage, time),
        targets=_targets(scene, record),
        unbalanced_amplitude=_unbalanced(scene, float(speed[-1])),
    )


def locked_run(scene: EccentricScene, *, progress: Progress | None = None) -> EccentricRun:
    """The run of the same rotor with the masses clamped where they start: without balancing."""
    clamped = replace(scene, supervisor=replace(scene.supervisor, strategy="locked"))
    return simulate_eccentric(clamped, progress=progress)


def _facts(
    scene: EccentricScene,
    record: Record,
    cause: Cause,
    findings: Findings,
    innovation: float | None,
    speed: FloatArray,
    amplitude: FloatArray,
) -> RunFacts:
    time: FloatArray = np.arange(len(speed), dtype=np.float64) * scene.sensor.step
    most = PlantParameters.of(scene).maximum_voltage
    at_limit = np.any(np.abs(record.voltage) >= most, axis=1)
    estimating = np.flatnonzero(record.stage == int(Stage.IMBALANCE))
    fastest = float(np.max(np.abs(speed[estimating]))) if estimating.size else 0.0
    slowest = float(np.min(np.abs(speed[estimating]))) if estimating.size else 0.0
    angles = record.state[:, 4:6]
    return RunFacts(
        scene=scene,
        cause=cause,
        stage=Stage(int(record.stage[-1])),
        findings=findings,
        time=float(time[-1]),
        diverged=len(time) < scene.samples,
        speed=speed,
        amplitude=amplitude,
        left=_left(record, amplitude, scene.supervisor.limit),
        innovation=innovation,
        settling_time=_settling_time(time=time, amplitude=amplitude, limit=scene.supervisor.limit),
        deviation=float(np.sqrt(np.max(np.linalg.eigvalsh(record.imbalance_covariance[-1])))),
        imbalance=float(np.hypot(*record.imbalance[-1])),
        saturation=float(np.count_nonzero(at_limit)) * scene.sensor.step,
        hold=int(record.hold[-1]),
        least_gap=float(np.min(_separations(angles))),
        euler_limit=float(believed_whirl(scene).euler_step_limit(angular_velocity=fastest)),
        predicted=expected_deviation(scene, speed=slowest) if cause is Cause.IMBALANCE_UNCERTAIN else 0.0,
        friction_known=bool(np.any(record.stage == int(Stage.POSITIONING))),
    )


def _rotor_covariance(scene: EccentricScene, record: Record, speed: FloatArray) -> FloatArray:
    estimating = np.flatnonzero(record.stage == int(Stage.IMBALANCE))
    if estimating.size == 0:
        return np.zeros((2, 2))
    step = scene.sensor.step
    return rotor_covariance(
        scene,
        imbalance=complex(*record.imbalance[-1]),
        speed=float(speed[estimating[-1]]),
        begin=float(estimating[0]) * step,
        duration=estimating.size * step,
    )


def _left(record: Record, amplitude: FloatArray, limit: float) -> int | None:
    """Sample of the largest vibration above the limit after the rotor was balanced to within it; None for
    none.
    """
    content = np.isin(record.cause, (int(Cause.BALANCED), int(Cause.SPEED_CHANGED)))
    within = np.flatnonzero(content & (amplitude <= limit))
    if within.size == 0:
        return None
    worst = int(within[0]) + int(np.argmax(amplitude[within[0] :]))
    return worst if amplitude[worst] > limit else None


def _separations(angles: FloatArray) -> FloatArray:
    difference = angles[:, 1] - angles[:, 0]
    return np.abs(np.pi - np.mod(np.pi - difference, 2 * np.pi))


def _stages(stage: IntArray, time: FloatArray) -> tuple[StageSpan, ...]:
    edges = [0, *(np.flatnonzero(np.diff(stage)) + 1), len(stage) - 1]
    return tuple(
        StageSpan(name=STAGE_NAMES[stage[a]], start=float(time[a]), end=float(time[b]))
        for a, b in itertools.pairwise(edges)
    )


def _targets(scene: EccentricScene, record: Record) -> Targets | None:
    if not np.any(record.stage == int(Stage.POSITIONING)):
        return None
    x, y = record.imbalance[-1]
    gap = scene.masses.arc_length / scene.masses.guide_radius
    moment = PlantParameters.of(scene).moment
    return target_angles(float(np.hypot(x, y)), float(np.arctan2(y, x)), moment, gap)


def _unbalanced(scene: EccentricScene, speed: float) -> float:
    if speed == 0:
        return 0.0
    return abs(PlantParameters.of(scene).steady_whirl(speed, scene.masses.initial_angle))


def _settling_time(*, time: FloatArray, amplitude: FloatArray, limit: float) -> float | None:
    """Recorded instant from which on the amplitude is not above the limit to the end; None: it ends above."""
    above = np.flatnonzero(amplitude > limit)
    if above.size == 0:
        return float(time[0])
    last = int(above[-1])
    return None if last == time.size - 1 else float(time[last + 1])
