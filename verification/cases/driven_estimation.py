"""What the eccentric-mass paper estimates: the imbalance (Fig. 4) and the friction arms (Fig. 5)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.imbalance_filter import (
    ProcessNoise,
    filter_matrices,
    imbalance_history,
    locked_masses,
    start_estimate,
)
from ringbalance.controller.eccentric_mass.integration import run_plant
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import believed_whirl
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, as_found, figure
from ringbalance.verification.papers import at_constant_speed, changed, convergence_time, thinned

_PRINTED: Final = 3.5
"""Middle of the printed 3 to 4 s."""
_PHASES: Final = (30.0, 100.0, 210.0, 300.0)
"""Of the imbalance in Fig. 4, deg."""
_KNOWN: Final = 0.02
"""Relative error of the imbalance within which its estimate has converged."""
_SCALES: Final = (1.0, 10.0, 100.0, 1000.0, 1500.0, 2000.0, 2500.0, 1e4)
"""Sensor noise that the filter assumes, over the true one."""
_RECORD: Final = 8.0
"""Time of a record for Fig. 4, s."""
_FRICTION_TIME: Final = 12.0
"""Time limit of a run for Fig. 5, s."""
_BEFORE, _AFTER = 0.1, 0.6
"""Shown around the beginning of the friction stage, s."""
_ARMS: Final = (0.01, 0.005)
"""Of Fig. 5, m."""
_ARM_KNOWN: Final = 0.05
"""Relative error of the friction arm within which its estimate has converged."""


@dataclass(frozen=True, kw_only=True)
class _ImbalanceRecord:
    """A locked rotor at constant speed, measured in its own frame."""

    time: FloatArray
    """s, shape (n,)."""
    samples: FloatArray
    """x, y, x', y' with noise, shape (n, 4)."""
    imbalance: complex
    """True, kg m."""
    speed: float


class _FigureFour(NamedTuple):
    """Estimates of four imbalances, and how their convergence hangs on the covariances."""

    time: FloatArray
    """s, shape (n,)."""
    true: FloatArray
    """Along the rotor's axes, kg m, shape (phases, 2)."""
    estimate: FloatArray
    """With honest covariances, kg m, shape (phases, n, 2)."""
    covariance_norm: FloatArray
    """Largest singular value of P, shape (phases, n)."""
    honest_time: tuple[float, ...]
    """From when on the estimate keeps within 2 % of the imbalance, for each phase, s."""
    scales: FloatArray
    """Assumed over true sensor noise, shape (scales,)."""
    scaled_time: FloatArray
    """The same time for the first phase, s, shape (scales,); infinite where it is never reached."""


def imbalance_ends(scene: EccentricScene) -> Evidence:
    """With honest covariances alone."""
    return Evidence(found=_judged(figure_four(scene, scales=(1.0,))))


def _judged(found: _FigureFour, time: float | None = None) -> dict[str, Found]:
    """Args: `time`: of convergence, s; default that with honest covariances."""
    norm, slowest = found.covariance_norm, max(found.honest_time) if time is None else time
    return as_found(honest=min(slowest, found.time[-1]), covariance=np.max(norm[:, -1] / norm[:, 0]))


def imbalance(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """How fast four imbalances become known, and under which covariances that takes the printed time."""
    found = figure_four(scene)
    reached = np.isfinite(found.scaled_time)
    scales, times = found.scales[reached], found.scaled_time[reached]
    scale = np.exp(np.interp(_PRINTED, times, np.log(scales)))
    over_scale = figure(
        "time to be within 2 % over the noise that the filter assumes",
        ("assumed over true noise", "1", scales),
        Curve("found", "s", times),
        Curve("printed", "s", np.full(times.shape, _PRINTED), style="paper"),
        log=True,
    )
    return Evidence(
        found=_judged(found, None if defect is None else float(found.scaled_time[-1])),
        numbers={"printed": _PRINTED, "scale": float(scale)},
        series=(_estimates(found), over_scale),
    )


def _estimates(found: _FigureFour) -> Series:
    """The figure's own four curves, as distances from the truth over the imbalance."""
    error = np.linalg.norm(found.estimate - found.true[:, None, :], axis=2)
    relative = error / np.linalg.norm(found.true, axis=1)[:, None]
    shown = found.time <= 0.5
    curves = (
        Curve(f"{phase:.0f} degrees", "1", thinned(row[shown]))
        for phase, row in zip(_PHASES, relative, strict=True)
    )
    name = "error of the estimate over the imbalance, honest covariances"
    return figure(name, ("time", "s", thinned(found.time[shown])), *curves)


def imbalance_record(scene: EccentricScene, *, duration: float) -> _ImbalanceRecord:
    """Measure a rotor that starts at its centre, the masses locked at their first angles.

    Returns: One sample for each step of the sensor, without the instant of the start.
    """
    run = run_plant(at_constant_speed(scene, time_limit=duration), locked=True)
    random = np.random.default_rng(scene.run.seed)
    deviations = np.repeat([scene.sensor.position_noise, scene.sensor.velocity_noise], 2)
    clean = run.state[1:, :4]
    parameters = PlantParameters.of(scene)
    return _ImbalanceRecord(
        time=run.time[1:],
        samples=clean + deviations * random.standard_normal(clean.shape),
        imbalance=complex(parameters.unbalance * np.exp(1j * parameters.phase)),
        speed=float(run.speed[0]),
    )


def estimate_imbalance(
    scene: EccentricScene, record: _ImbalanceRecord, *, scale: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """States, shape (n, 6), and covariances, shape (n, 6, 6), of the scene's filter over a record."""
    keys = scene.imbalance_filter
    noise = ProcessNoise(keys.velocity_walk**2, keys.unbalance_walk**2)
    euler = keys.discretisation == "euler"
    masses = PlantParameters.of(scene).moment * np.sum(np.exp(1j * np.array(scene.masses.initial_angle)))
    return imbalance_history(
        start_estimate(keys.initial_position, keys.initial_velocity, keys.initial_unbalance),
        matrices=filter_matrices(believed_whirl(scene), noise, record.speed, scene.sensor.step, False, euler),
        samples=record.samples,
        variance=scale**2 * np.repeat([keys.position_noise**2, keys.velocity_noise**2], 2),
        masses=locked_masses(complex(masses)),
    )


def figure_four(scene: EccentricScene, *, scales: tuple[float, ...] = _SCALES) -> _FigureFour:
    """Estimates of the four imbalances of the paper's Fig. 4, and of one under dishonest covariances."""
    turned = [changed(scene, "imbalance", phase=math.radians(phase)) for phase in _PHASES]
    records = [imbalance_record(one, duration=_RECORD) for one in turned]
    pairs = list(zip(turned, records, strict=True))
    found = [estimate_imbalance(*pair) for pair in pairs]
    first, record = pairs[0]
    scaled = (estimate_imbalance(first, record, scale=scale)[0] for scale in scales)
    return _FigureFour(
        time=record.time,
        true=np.array([[one.imbalance.real, one.imbalance.imag] for one in records]),
        estimate=np.array([states[:, 4:] for states, _ in found]),
        covariance_norm=np.array([np.linalg.norm(covariances, 2, (1, 2)) for _, covariances in found]),
        honest_time=tuple(_time_of(one, states) for one, (states, _) in zip(records, found, strict=True)),
        scales=np.asarray(scales, dtype=np.float64),
        scaled_time=np.array([_time_of(record, states) for states in scaled]),
    )


def _time_of(record: _ImbalanceRecord, states: FloatArray) -> float:
    error = np.abs(states[:, 4] + 1j * states[:, 5] - record.imbalance) / abs(record.imbalance)
    return convergence_time(record.time, error, limit=_KNOWN)


def friction(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Two friction arms found while both masses go round: their errors and the time they take."""
    runs = friction_runs(scene)
    wrong = 1.1 if defect == "another_friction" else 1.0
    errors = [np.max(np.abs(run.estimates.friction_arm[-1] / (wrong * arm) - 1)) for arm, run in runs.items()]
    slowest = max(friction_time(run, arm) for arm, run in runs.items())
    time = runs[_ARMS[0]].time - _begun(runs[_ARMS[0]])
    shown = (time > -_BEFORE) & (time < _AFTER)
    when = thinned(time[shown])
    estimated = (
        Curve(f"{1e3 * arm:g} mm, first mass", "m", thinned(run.estimates.friction_arm[shown, 0]))
        for arm, run in runs.items()
    )
    printed = (
        Curve(f"{1e3 * arm:g} mm, printed", "m", np.full(when.size, arm), style="reference") for arm in runs
    )
    axis = ("time since the masses started", "s", when)
    return Evidence(
        found=as_found(error=max(errors), slowest=slowest),
        series=(figure("friction arm, estimated", axis, *estimated, *printed),),
    )


def friction_runs(scene: EccentricScene) -> Mapping[float, EccentricRun]:
    """Runs by their true friction arm, m. Source: Fig. 5 of the paper on eccentric masses."""
    level = at_constant_speed(scene, time_limit=_FRICTION_TIME)
    return {a: simulate_eccentric(changed(level, "masses", friction_arm=(a, a))) for a in _ARMS}


def friction_time(run: EccentricRun, arm: float) -> float:
    """From the beginning of the friction stage until both estimates keep within 5 %, s."""
    error = np.max(np.abs(run.estimates.friction_arm - arm), axis=1) / arm
    return convergence_time(run.time, error, limit=_ARM_KNOWN) - _begun(run)


def _begun(run: EccentricRun) -> float:
    """Beginning of the friction stage, s; minus infinity without one, so that nothing counts as found."""
    return next((stage.start for stage in run.stages if stage.name == "friction estimation"), -math.inf)
