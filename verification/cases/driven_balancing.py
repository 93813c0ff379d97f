"""The eccentric-mass paper's runs: positioning, fine tuning and run-up (Figs. 7 to 9) with their bound, and
its estimates: the imbalance (Fig. 4) and the friction arms (Fig. 5).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.imbalance_filter import (
    imbalance_filter,
    imbalance_history,
    locked_masses,
)
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import locked_run, simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import filter_settings
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.evidence import (
    Evidence,
    FigureCurve,
    Found,
    Level,
    Series,
    as_found,
    figure,
    printed,
)
from ringbalance.verification.papers import at_constant_speed, changed, convergence_time, envelope, thinned

_RPM: Final = 30 / np.pi
_PRINTED_CRITICAL_RPM: Final = printed(135.0, last_digit=1.0)
_SHOWN_S: Final = 12.0
_FIG_7_PHASES_DEG: Final = (45.0, 135.0)
"""Phases of the imbalance in Figs. 7 and 8."""
_TARGET_ERROR_RAD: Final = math.radians(10.0)
"""Error of the masses' positions in Fig. 8."""
_MAX_MASS_RATE_RAD_S: Final = 1.0
"""Largest rate of the masses against the rotor, rad/s."""


def run_up(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """The run-up through the critical speed, balanced at low speed and locked.

    The critical speed that the paper prints leaves the eccentric masses out.
    """
    parameters = PlantParameters.of(scene)
    critical, without = (
        _RPM * math.sqrt(parameters.stiffness / mass) for mass in (parameters.mass, scene.rotor.mass)
    )
    balanced, locked = simulate_eccentric(scene), _locked(changed(scene, {"sensor.position_noise": 0.0}))
    begins = scene.rotor.speed_profile[-2].time if len(scene.rotor.speed_profile) > 1 else 0.0
    first = int(np.searchsorted(locked.time, begins))
    at = first + int(np.argmax(locked.amplitude[first:]))
    largest = float(locked.amplitude[at])
    peak = largest if defect else float(np.max(balanced.amplitude[balanced.time >= begins]))
    runs = {"locked": locked, "balanced at 100 rpm": balanced}
    return Evidence(
        quantities={
            "critical": Found(value=critical, corrected=without, reference=_PRINTED_CRITICAL_RPM),
            "peak": Found(value=peak / largest),
        },
        numbers={
            "locked": largest,
            "balanced": peak,
            "peak_speed": _RPM * float(locked.speed[at]),
            "without": without,
        },
        series=(_amplitudes("amplitude during the run-up", runs, reference="locked"),),
    )


@lru_cache(maxsize=1)
def _locked(scene: EccentricScene) -> EccentricRun:
    """Run with locked masses; it uses no sensor, so one run serves every position noise."""
    return simulate_eccentric(changed(scene, {"supervisor.strategy": "locked"}))


def _amplitudes(
    name: str, runs: Mapping[str, EccentricRun], *, until: float = math.inf, reference: str = ""
) -> Series:
    """Amplitude over time of runs with the same samples, by curve name, one of them the reference."""
    time = next(iter(runs.values())).time
    shown = time <= until
    curves = (
        FigureCurve(
            label, "m", envelope(run.amplitude[shown]), style="reference" if label == reference else "found"
        )
        for label, run in runs.items()
    )
    return figure(name, ("time", "s", thinned(time[shown])), *curves)


class _Balanced(NamedTuple):
    """Runs for several phases of the imbalance."""

    runs: Mapping[str, EccentricRun]
    """Runs by their names in a figure."""
    before: FloatArray
    """Steady amplitude of each run before the masses move, m."""
    positioned: FloatArray
    """Mean amplitude in the last second of the check, m; infinite without one."""
    after: FloatArray
    """Mean amplitude in the last second of the run, m."""


def _balanced_at_constant_speed(scene: EccentricScene, *, time_limit: float) -> _Balanced:
    """Balance the two imbalances of the paper's Fig. 7, one run each."""
    constant = at_constant_speed(scene, time_limit=time_limit)
    runs = {
        f"imbalance at {phase:.0f} degrees": simulate_eccentric(
            changed(constant, {"imbalance.phase": math.radians(phase)})
        )
        for phase in _FIG_7_PHASES_DEG
    }
    positioned = []
    for run in runs.values():
        end = next((stage.end for stage in run.stages if stage.name == "check"), None)
        if end is None:
            positioned.append(math.inf)
        else:
            positioned.append(float(np.mean(run.amplitude[(run.time > end - 1.0) & (run.time <= end)])))
    return _Balanced(
        runs=runs,
        before=np.array([run.unbalanced_amplitude for run in runs.values()]),
        positioned=np.array(positioned),
        after=np.array([run.final_amplitude for run in runs.values()]),
    )


def _off_target(scene: EccentricScene) -> EccentricScene:
    """The scene with masses that stop 10 degrees off their targets, then with trials alone, as in Fig. 8."""
    error = (_TARGET_ERROR_RAD, _TARGET_ERROR_RAD)
    return changed(scene, {"supervisor.target_error": error, "supervisor.correction": "trials"})


def positioning(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Two imbalances balanced at constant speed: amplitudes before, on the way and after, Fig. 7."""
    aimed = scene if defect is None else _off_target(scene)
    balanced = _balanced_at_constant_speed(aimed, time_limit=30.0)
    runs = list(balanced.runs.values())
    shown = runs[0].time <= _SHOWN_S
    angles = figure(
        f"angles of the masses, {next(iter(balanced.runs))}",
        ("time", "s", thinned(runs[0].time[shown])),
        *(
            FigureCurve(name, "rad", thinned(angle[shown]))
            for name, angle in zip(("mass 1", "mass 2"), runs[0].mass_angle, strict=True)
        ),
    )
    arrived = [stage.end for run in runs for stage in run.stages if stage.name == "positioning"]
    return Evidence(
        quantities=as_found(ratio=np.max(balanced.positioned / balanced.before)),
        numbers={
            "before": balanced.before[0],
            "first": balanced.positioned[0],
            "second": balanced.positioned[1],
            "arrived": max(arrived),
        },
        series=(_amplitudes("amplitude", balanced.runs, until=_SHOWN_S), angles),
    )


def fine_tuning(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Masses ten degrees off their targets, then tuned by trial, Fig. 8."""
    time_limit = 200.0 if defect is None else 25.0
    balanced = _balanced_at_constant_speed(_off_target(scene), time_limit=time_limit)
    settled = [run.settling_time or run.time[-1] for run in balanced.runs.values()]
    return Evidence(
        quantities=as_found(
            left=np.min(balanced.positioned / balanced.before),
            ended=np.max(balanced.after / balanced.before),
        ),
        numbers={
            "left_m": balanced.positioned.min(),
            "end": balanced.after.max(),
            "time": max(settled),
        },
        series=(_amplitudes("amplitude", balanced.runs),),
    )


def bound(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Appendix B: the printed force over the largest one, and a run's amplitude over the corrected bound.

    The printed argument shows that the energy falls while the rotor's fixed-frame velocity exceeds Y/C_B, and
    concludes that the motion is bounded.  That does not follow: nothing is said of the displacement, and the
    energy may rise while the velocity is small.  Integrating the impulse response does give a bound.
    """
    speed = scene.rotor.speed_profile[0].speed
    parameters = PlantParameters.of(scene)
    turning = _motion_bound(parameters, speed=speed, rate=_MAX_MASS_RATE_RAD_S)
    judged = (
        _motion_bound(parameters, speed=0.0, rate=_MAX_MASS_RATE_RAD_S)
        if defect == "rotor_at_rest"
        else turning
    )
    runs = _balanced_at_constant_speed(scene, time_limit=30.0).runs.values()
    largest = max(run.worst_amplitude for run in runs)
    return Evidence(
        quantities=as_found(
            force_ratio=judged.printed_force / judged.force, amplitude_ratio=largest / turning.amplitude
        ),
        numbers={"bound": turning.amplitude, "largest": largest},
    )


class _MotionBound(NamedTuple):
    """Bounds on the rotor's motion in the fixed frame, for masses that move within given rates."""

    force: float
    """Y, largest force on the rotor, N."""
    printed_force: float
    """Y from the printed F_T, which drops b W^2 of each mass, N."""
    amplitude: float
    """Bound on |Z| once the start's transient is gone, m."""


def _motion_bound(parameters: PlantParameters, *, speed: float, rate: float) -> _MotionBound:
    """Bound the rotor's motion for masses that move with at most a given rate.

    M Z'' + C_B Z' + K_B Z = F with |F| <= Y = U W^2 + 2 b (W + w)^2, so |Z| <= Y int |h| dt, where
    the impulse response h of an underdamped rotor has int |h| dt = coth(pi zeta/(2 sqrt(1 - zeta^2)))/K_B.
    Raises: ValueError: no damping, which bounds nothing, or so much that the rotor does not swing.
    Source: Appendix B of the paper on eccentric masses, corrected.
    """
    ratio = parameters.damping / (2 * math.sqrt(parameters.stiffness * parameters.mass))
    if not 0 < ratio < 1:
        raise ValueError("the damping ratio of the rotor must lie between 0 and 1, both excluded")
    root = math.sqrt(1 - ratio**2)
    b, w = parameters.moment, abs(speed)
    force = parameters.unbalance * w**2 + 2 * b * (w + rate) ** 2
    printed = parameters.unbalance * w**2 + 2 * b * (rate**2 + 2 * w * rate)
    amplitude = force / parameters.stiffness / math.tanh(math.pi * ratio / (2 * root))
    return _MotionBound(force, printed, amplitude)


_PRINTED_TIME_S: Final = 3.5
"""Middle of the printed 3 to 4 s."""
_FIG_4_PHASES_DEG: Final = (30.0, 100.0, 210.0, 300.0)
"""Phases of the imbalance in Fig. 4."""
_CONVERGED_IMBALANCE: Final = 0.02
"""Relative error of the imbalance within which its estimate has converged."""
_NOISE_RATIOS: Final = (1.0, 10.0, 100.0, 1000.0, 1500.0, 2000.0, 2500.0, 1e4)
"""Sensor noise that the filter assumes, over the true one."""
_RECORD_S: Final = 8.0
"""Duration of a record for Fig. 4."""
_FRICTION_S: Final = 12.0
"""Time limit of a run for Fig. 5."""
_BEFORE_S, _AFTER_S = 0.1, 0.6
"""Times shown before and after the beginning of the friction stage."""
_FRICTION_ARMS_M: Final = (0.01, 0.005)
"""Friction arms of Fig. 5."""
_CONVERGED_ARM: Final = 0.05
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
    """Estimates of four imbalances, and their convergence times under several covariances."""

    time: FloatArray
    """s, shape (n,)."""
    true: FloatArray
    """True imbalances along the rotor's axes, kg m, shape (phases, 2)."""
    estimate: FloatArray
    """Estimates with the true noise covariances, kg m, shape (phases, n, 2)."""
    covariance_norm: FloatArray
    """Largest singular value of P, shape (phases, n)."""
    honest_time: tuple[float, ...]
    """Time from which on the estimate keeps within 2 % of the imbalance, for each phase, s."""
    scales: FloatArray
    """Assumed over true sensor noise, shape (scales,)."""
    scaled_time: FloatArray
    """Convergence time of the first phase at each scale, s, shape (scales,); infinite without convergence."""


def imbalance_ends(scene: EccentricScene) -> Evidence:
    """Convergence times with the true noise covariances alone."""
    return Evidence(quantities=_judged(_figure_four(scene, scales=(1.0,))))


def _judged(estimates: _FigureFour, time: float | None = None) -> dict[str, Found]:
    """Judged quantities. Args: `time`: of convergence, s; default that with the true noise covariances."""
    norm, slowest = estimates.covariance_norm, max(estimates.honest_time) if time is None else time
    return as_found(honest=min(slowest, estimates.time[-1]), covariance=np.max(norm[:, -1] / norm[:, 0]))


def imbalance(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Convergence of the estimates of four imbalances, and the covariances that give the printed time."""
    estimates = _figure_four(scene)
    reached = np.isfinite(estimates.scaled_time)
    scales, times = estimates.scales[reached], estimates.scaled_time[reached]
    scale = np.exp(np.interp(_PRINTED_TIME_S, times, np.log(scales)))
    over_scale = figure(
        "time to be within 2 % over the noise that the filter assumes",
        ("assumed over true noise", "1", scales),
        FigureCurve("found", "s", times),
        FigureCurve("printed", "s", np.full(times.shape, _PRINTED_TIME_S), style="paper"),
        log=True,
    )
    # The four curves of the figure, as distances from the true imbalance over its magnitude.
    error = np.linalg.norm(estimates.estimate - estimates.true[:, None, :], axis=2)
    relative = error / np.linalg.norm(estimates.true, axis=1)[:, None]
    shown = estimates.time <= 0.5
    errors = figure(
        "error of the estimate over the imbalance, honest covariances",
        ("time", "s", thinned(estimates.time[shown])),
        *(
            FigureCurve(f"{phase:.0f} degrees", "1", thinned(row[shown]))
            for phase, row in zip(_FIG_4_PHASES_DEG, relative, strict=True)
        ),
    )
    return Evidence(
        quantities=_judged(estimates, None if defect is None else float(estimates.scaled_time[-1])),
        numbers={"printed": _PRINTED_TIME_S, "scale": float(scale)},
        series=(errors, over_scale),
    )


def _imbalance_record(scene: EccentricScene, *, duration: float) -> _ImbalanceRecord:
    """Measure a rotor that starts at its centre, the masses locked at their first angles.

    Returns: One sample for each step of the sensor, without the instant of the start.
    """
    run = locked_run(at_constant_speed(scene, time_limit=duration))
    random = np.random.default_rng(scene.run.seed)
    deviations = np.repeat([scene.sensor.position_noise, scene.sensor.velocity_noise], 2)
    clean = run.history["state"][1:, :4]
    parameters = PlantParameters.of(scene)
    return _ImbalanceRecord(
        time=run.time[1:],
        samples=clean + deviations * random.standard_normal(clean.shape),
        imbalance=complex(parameters.unbalance * np.exp(1j * parameters.phase)),
        speed=float(run.speed[0]),
    )


def _estimate_imbalance(
    scene: EccentricScene, record: _ImbalanceRecord, *, scale: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """States, shape (n, 6), and covariances, shape (n, 6, 6), of the scene's filter over a record."""
    keys = scene.imbalance_filter
    settings = filter_settings(scene)._replace(step=scene.sensor.step, laboratory=False)
    masses = PlantParameters.of(scene).mass_vector(scene.masses.initial_angle)
    return imbalance_history(
        imbalance_filter(settings, speeds=record.speed),
        samples=record.samples,
        variance=scale**2 * np.repeat([keys.position_noise**2, keys.velocity_noise**2], 2),
        masses=locked_masses(masses),
    )


def _figure_four(scene: EccentricScene, *, scales: tuple[float, ...] = _NOISE_RATIOS) -> _FigureFour:
    """Estimates of the four imbalances of the paper's Fig. 4, and of one with scaled noise covariances."""
    turned = [changed(scene, {"imbalance.phase": math.radians(phase)}) for phase in _FIG_4_PHASES_DEG]
    records = [_imbalance_record(rotor, duration=_RECORD_S) for rotor in turned]
    pairs = list(zip(turned, records, strict=True))
    estimates = [_estimate_imbalance(*pair) for pair in pairs]
    first, record = pairs[0]
    scaled = (_estimate_imbalance(first, record, scale=scale)[0] for scale in scales)
    return _FigureFour(
        time=record.time,
        true=np.array([[each.imbalance.real, each.imbalance.imag] for each in records]),
        estimate=np.array([states[:, 4:] for states, _ in estimates]),
        covariance_norm=np.array([np.linalg.norm(covariances, 2, (1, 2)) for _, covariances in estimates]),
        honest_time=tuple(
            _time_of(each, states) for each, (states, _) in zip(records, estimates, strict=True)
        ),
        scales=np.asarray(scales, dtype=np.float64),
        scaled_time=np.array([_time_of(record, states) for states in scaled]),
    )


def _time_of(record: _ImbalanceRecord, states: FloatArray) -> float:
    error = np.abs(states[:, 4] + 1j * states[:, 5] - record.imbalance) / abs(record.imbalance)
    return convergence_time(record.time, error, limit=_CONVERGED_IMBALANCE)


def friction(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Two friction arms estimated while both masses go round: their errors and the time they take."""
    runs = _friction_runs(scene)
    wrong = 1.1 if defect == "another_friction" else 1.0
    errors = [
        np.max(np.abs(run.history["friction_arm"][-1] / (wrong * arm) - 1)) for arm, run in runs.items()
    ]
    slowest = max(friction_time(run, arm) for arm, run in runs.items())
    time = runs[_FRICTION_ARMS_M[0]].time - _begun(runs[_FRICTION_ARMS_M[0]])
    shown = (time > -_BEFORE_S) & (time < _AFTER_S)
    when = thinned(time[shown])
    estimated = (
        FigureCurve(f"{1e3 * arm:g} mm, first mass", "m", thinned(run.history["friction_arm"][shown, 0]))
        for arm, run in runs.items()
    )
    printed = (
        FigureCurve(f"{1e3 * arm:g} mm, printed", "m", np.full(when.size, arm), style="reference")
        for arm in runs
    )
    axis = ("time since the masses started", "s", when)
    return Evidence(
        quantities=as_found(error=max(errors), slowest=slowest),
        series=(figure("friction arm, estimated", axis, *estimated, *printed),),
    )


def _friction_runs(scene: EccentricScene) -> Mapping[float, EccentricRun]:
    """Runs by their true friction arm, m. Source: Fig. 5 of the paper on eccentric masses."""
    constant = at_constant_speed(scene, time_limit=_FRICTION_S)
    return {
        arm: simulate_eccentric(changed(constant, {"masses.friction_arm": (arm, arm)}))
        for arm in _FRICTION_ARMS_M
    }


def friction_time(run: EccentricRun, arm: float) -> float:
    """Time from the beginning of the friction stage until both estimates keep within 5 %, s."""
    error = np.max(np.abs(run.history["friction_arm"] - arm), axis=1) / arm
    return convergence_time(run.time, error, limit=_CONVERGED_ARM) - _begun(run)


def _begun(run: EccentricRun) -> float:
    """Beginning of the friction stage, s; without one minus infinity, so that nothing has converged."""
    return next((stage.start for stage in run.stages if stage.name == "friction estimation"), -math.inf)
