"""What the eccentric-mass paper estimates: the imbalance (Fig. 4) and the friction arms (Fig. 5)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ringbalance.controller.eccentric_mass.imbalance_filter import (
    FilterMatrices,
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
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure
from ringbalance.verification.papers import at_constant_speed, changed, convergence_time, thinned

_PRINTED = 3.5
"""Middle of the printed 3 to 4 s."""
_PAPER_PHASES = (30.0, 100.0, 210.0, 300.0)
"""Of the imbalance in Fig. 4, deg."""
_IMBALANCE_CONVERGED = 0.02
"""Relative error of the imbalance within which its estimate has converged."""
_SCALES = (1.0, 10.0, 100.0, 1000.0, 1500.0, 2000.0, 2500.0, 1e4)
"""Sensor noise that the filter assumes, over the true one."""


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


@dataclass(frozen=True, kw_only=True)
class _FigureFour:
    """Estimates of four imbalances, and how their convergence hangs on the covariances."""

    time: FloatArray
    """s, shape (n,)."""
    phases: tuple[float, ...]
    """deg."""
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
    return Evidence(found=as_found(**_judged(figure_four(scene, scales=(1.0,)))))


def _judged(found: _FigureFour) -> dict[str, float]:
    norm = found.covariance_norm
    return {
        "honest": _within(found, max(found.honest_time)),
        "covariance": float(np.max(norm[:, -1] / norm[:, 0])),
    }


def _within(found: _FigureFour, time: float) -> float:
    """A time, at most that of the whole record."""
    return min(time, float(found.time[-1]))


def imbalance(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """How fast four imbalances become known, and under which covariances that takes the printed time.

    Convergence times under honest and under ever less honest covariances."""
    found = figure_four(scene)
    judged = _judged(found)
    if defect is not None:
        judged["honest"] = _within(found, float(found.scaled_time[-1]))
    reached = np.isfinite(found.scaled_time)
    scale = np.exp(np.interp(_PRINTED, found.scaled_time[reached], np.log(found.scales[reached])))
    return Evidence(
        found=as_found(**judged),
        numbers={"printed": _PRINTED, "scale": float(scale)},
        series=(_estimates(found), _times(found)),
    )


def _estimates(found: _FigureFour) -> Series:
    """The figure's own four curves, as distances from the truth over the imbalance."""
    error = np.linalg.norm(found.estimate - found.true[:, None, :], axis=2)
    size = np.linalg.norm(found.true, axis=1)
    shown = found.time <= 0.5
    curves = (
        Curve(f"{phase:.0f} degrees", "1", thinned(row[shown] / one))
        for phase, row, one in zip(found.phases, error, size, strict=True)
    )
    name = "error of the estimate over the imbalance, honest covariances"
    return figure(name, ("time", "s", thinned(found.time[shown])), *curves)


def _times(found: _FigureFour) -> Series:
    reached = np.isfinite(found.scaled_time)
    return figure(
        "time to be within 2 % over the noise that the filter assumes",
        ("assumed over true noise", "1", found.scales[reached]),
        Curve("found", "s", found.scaled_time[reached]),
        Curve("printed", "s", np.full(int(reached.sum()), _PRINTED), style="paper"),
        log=True,
    )


def imbalance_record(scene: EccentricScene, *, duration: float) -> _ImbalanceRecord:
    """Measure a rotor that starts at its centre, the masses locked at their first angles.

    Returns: One sample for each step of the sensor, without the instant of the start.
    """
    level = at_constant_speed(scene, time_limit=duration)
    run = run_plant(level, locked=True)
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


def _scene_matrices(scene: EccentricScene, *, angular_velocity: float) -> FilterMatrices:
    """Matrices of the scene's imbalance filter for samples in the rotor's frame."""
    told = scene.imbalance_filter
    noise = ProcessNoise(told.velocity_walk**2, told.unbalance_walk**2)
    euler = told.discretisation == "euler"
    return filter_matrices(believed_whirl(scene), noise, angular_velocity, scene.sensor.step, False, euler)


def estimate_imbalance(
    scene: EccentricScene, record: _ImbalanceRecord, *, scale: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """States, shape (n, 6), and covariances, shape (n, 6, 6), of the scene's filter over a record."""
    told = scene.imbalance_filter
    variance = scale**2 * np.repeat([told.position_noise**2, told.velocity_noise**2], 2)
    start = start_estimate(told.initial_position, told.initial_velocity, told.initial_unbalance)
    first, second = scene.masses.initial_angle
    own = PlantParameters.of(scene).moment * (np.exp(1j * first) + np.exp(1j * second))
    return imbalance_history(
        start,
        matrices=_scene_matrices(scene, angular_velocity=record.speed),
        samples=record.samples,
        variance=variance,
        masses=locked_masses(complex(own)),
    )


def _time_of(scene: EccentricScene, record: _ImbalanceRecord, scale: float) -> float:
    states, _ = estimate_imbalance(scene, record, scale=scale)
    error = np.abs(states[:, 4] + 1j * states[:, 5] - record.imbalance) / abs(record.imbalance)
    return convergence_time(record.time, error, limit=_IMBALANCE_CONVERGED)


def figure_four(
    scene: EccentricScene, *, duration: float = 8.0, scales: tuple[float, ...] = _SCALES
) -> _FigureFour:
    """Estimates of the four imbalances of the paper's Fig. 4, and of one under dishonest covariances."""
    turned = [changed(scene, "imbalance", phase=math.radians(phase)) for phase in _PAPER_PHASES]
    records = [imbalance_record(one, duration=duration) for one in turned]
    found = [estimate_imbalance(one, record) for one, record in zip(turned, records, strict=True)]
    return _FigureFour(
        time=records[0].time,
        phases=_PAPER_PHASES,
        true=np.array([[record.imbalance.real, record.imbalance.imag] for record in records]),
        estimate=np.array([states[:, 4:] for states, _ in found]),
        covariance_norm=np.array([np.linalg.norm(covariances, 2, (1, 2)) for _, covariances in found]),
        honest_time=tuple(_time_of(one, r, 1.0) for one, r in zip(turned, records, strict=True)),
        scales=np.asarray(scales, dtype=np.float64),
        scaled_time=np.array([_time_of(turned[0], records[0], scale) for scale in scales]),
    )


_BEFORE, _AFTER = 0.1, 0.6
"""Shown around the beginning of the friction stage, s."""
_PAPER_ARMS = (0.01, 0.005)
"""Of Fig. 5, m."""
_FRICTION_CONVERGED = 0.05
"""Relative error of the friction arm within which its estimate has converged."""


def friction(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Two friction arms found while both masses go round.

    Errors of the friction arms and the time they take."""
    runs = friction_runs(scene)
    wrong = 1.1 if defect == "another_friction" else 1.0
    errors = [np.max(np.abs(run.estimates.friction_arm[-1] / (wrong * arm) - 1)) for arm, run in runs.items()]
    slowest = max(friction_time(run, arm) for arm, run in runs.items())
    return Evidence(found=as_found(error=max(errors), slowest=slowest), series=(_figure(runs),))


def friction_runs(scene: EccentricScene, *, time_limit: float = 12.0) -> Mapping[float, EccentricRun]:
    """Runs by their true friction arm, m. Source: Fig. 5 of the paper on eccentric masses."""
    level = at_constant_speed(scene, time_limit=time_limit)
    return {a: simulate_eccentric(changed(level, "masses", friction_arm=(a, a))) for a in _PAPER_ARMS}


def friction_time(run: EccentricRun, arm: float) -> float:
    """From the beginning of the friction stage until both estimates keep within 5 %, s."""
    begun = [stage.start for stage in run.stages if stage.name == "friction estimation"]
    if not begun:
        return math.inf
    error = np.max(np.abs(run.estimates.friction_arm - arm), axis=1) / arm
    return convergence_time(run.time, error, limit=_FRICTION_CONVERGED) - begun[0]


def _figure(runs: Mapping[float, EccentricRun]) -> Series:
    first = runs[_PAPER_ARMS[0]]
    begun = next(s.start for s in first.stages if s.name == "friction estimation")
    time = first.time - begun
    shown = (time > -_BEFORE) & (time < _AFTER)
    curves = [
        Curve(f"{1e3 * arm:g} mm, first mass", "m", thinned(run.estimates.friction_arm[shown, 0]))
        for arm, run in runs.items()
    ]
    count = curves[0].values.size
    true = [Curve(f"{1e3 * arm:g} mm, printed", "m", np.full(count, arm), style="reference") for arm in runs]
    when = ("time since the masses started", "s", thinned(time[shown]))
    return figure("friction arm, estimated", when, *curves, *true)
