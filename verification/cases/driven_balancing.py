"""The eccentric-mass paper's runs: positioning, fine tuning and run-up (Figs. 7 to 9), and their bound."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.evidence import (
    Curve,
    Evidence,
    Found,
    Level,
    Reference,
    Series,
    as_found,
    figure,
    from_rounding,
)
from ringbalance.verification.papers import at_constant_speed, changed, envelope, thinned

_RPM: Final = 30 / np.pi
_CRITICAL: Final = Reference(value=135.0, uncertainty=from_rounding(1.0))
"""Printed, rpm."""
_SHOWN: Final = 12.0
"""s."""
_PHASES: Final = (45.0, 135.0)
"""Of the imbalance in Figs. 7 and 8, deg."""
_BESIDE: Final = math.radians(10.0)
"""Error of the masses' places in Fig. 8, rad."""
_RATE: Final = 1.0
"""rad/s, of the masses against the rotor."""


def run_up(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """The run-up through the critical speed, balanced at low speed and locked.

    The critical speed that the paper prints leaves the eccentric masses out.
    """
    parameters = PlantParameters.of(scene)
    critical, without = (
        _RPM * math.sqrt(parameters.stiffness / mass) for mass in (parameters.mass, scene.rotor.mass)
    )
    balanced, locked = simulate_eccentric(scene), _locked(changed(scene, "sensor", position_noise=0.0))
    begins = scene.rotor.speed_profile[-2].time if len(scene.rotor.speed_profile) > 1 else 0.0
    first = int(np.searchsorted(locked.time, begins))
    at = first + int(np.argmax(locked.amplitude[first:]))
    largest = float(locked.amplitude[at])
    peak = largest if defect else float(np.max(balanced.amplitude[balanced.time >= begins]))
    runs = {"locked": locked, "balanced at 100 rpm": balanced}
    return Evidence(
        found={"critical": Found(value=critical, corrected=without), "peak": Found(value=peak / largest)},
        reference={"critical": _CRITICAL},
        numbers={
            "locked": largest,
            "balanced": peak,
            "peak_speed": _RPM * float(locked.speed[at]),
            "without": without,
        },
        series=(_amplitudes("amplitude during the run-up", runs, beside="locked"),),
    )


@lru_cache(maxsize=1)
def _locked(scene: EccentricScene) -> EccentricRun:
    """With locked masses; no sensor is looked at, so that one run serves every noise of the position."""
    return simulate_eccentric(changed(scene, "supervisor", strategy="locked"))


def _amplitudes(
    name: str, runs: Mapping[str, EccentricRun], *, until: float = math.inf, beside: str = ""
) -> Series:
    """Amplitude over time of runs with the same samples, by curve name; `beside` is one to compare with."""
    time = next(iter(runs.values())).time
    shown = time <= until
    curves = (
        Curve(label, "m", envelope(run.amplitude[shown]), style="reference" if label == beside else "found")
        for label, run in runs.items()
    )
    return figure(name, ("time", "s", thinned(time[shown])), *curves)


class _Balanced(NamedTuple):
    """Runs for several phases of the imbalance."""

    runs: Mapping[str, EccentricRun]
    """By what a figure calls them."""
    before: FloatArray
    """Steady amplitude of each before anything is moved, m."""
    positioned: FloatArray
    """Mean amplitude in the last second of the check, m; infinite without one."""
    after: FloatArray
    """Mean amplitude in the last second of the run, m."""


def balanced_at_constant_speed(scene: EccentricScene, *, time_limit: float) -> _Balanced:
    """Balance the two imbalances of the paper's Fig. 7."""
    level = at_constant_speed(scene, time_limit=time_limit)
    runs = {
        f"imbalance at {phase:.0f} degrees": simulate_eccentric(
            changed(level, "imbalance", phase=math.radians(phase))
        )
        for phase in _PHASES
    }
    return _Balanced(
        runs=runs,
        before=np.array([run.unbalanced_amplitude for run in runs.values()]),
        positioned=np.array([_in_check(run) for run in runs.values()]),
        after=np.array([run.final_amplitude for run in runs.values()]),
    )


def beside_the_targets(scene: EccentricScene) -> EccentricScene:
    """With masses that stop 10 degrees beside their targets, then trials alone, as in Fig. 8."""
    return changed(scene, "supervisor", target_error=(_BESIDE, _BESIDE), correction="trials")


def _in_check(run: EccentricRun) -> float:
    end = next((stage.end for stage in run.stages if stage.name == "check"), None)
    if end is None:
        return math.inf
    return float(np.mean(run.amplitude[(run.time > end - 1.0) & (run.time <= end)]))


def positioning(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Two imbalances balanced at constant speed: amplitudes before, on the way and after, Fig. 7."""
    given = scene if defect is None else beside_the_targets(scene)
    found = balanced_at_constant_speed(given, time_limit=30.0)
    runs = list(found.runs.values())
    shown = runs[0].time <= _SHOWN
    angles = figure(
        f"angles of the masses, {next(iter(found.runs))}",
        ("time", "s", thinned(runs[0].time[shown])),
        *(
            Curve(name, "rad", thinned(angle[shown]))
            for name, angle in zip(("mass 1", "mass 2"), runs[0].mass_angle, strict=True)
        ),
    )
    arrived = [stage.end for run in runs for stage in run.stages if stage.name == "positioning"]
    return Evidence(
        found=as_found(ratio=np.max(found.positioned / found.before)),
        numbers={
            "before": float(found.before[0]),
            "first": float(found.positioned[0]),
            "second": float(found.positioned[1]),
            "arrived": max(arrived),
        },
        series=(_amplitudes("amplitude", found.runs, until=_SHOWN), angles),
    )


def fine_tuning(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Masses ten degrees beside their targets, then tuned by trial, Fig. 8."""
    time_limit = 200.0 if defect is None else 25.0
    found = balanced_at_constant_speed(beside_the_targets(scene), time_limit=time_limit)
    settled = [run.settling_time or run.time[-1] for run in found.runs.values()]
    return Evidence(
        found=as_found(
            left=np.min(found.positioned / found.before), ended=np.max(found.after / found.before)
        ),
        numbers={
            "left_m": float(found.positioned.min()),
            "end": float(found.after.max()),
            "time": float(max(settled)),
        },
        series=(_amplitudes("amplitude", found.runs),),
    )


def bound(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Appendix B: the printed force beside the largest one, and the corrected bound beside a run.

    The printed argument shows that the energy falls while the rotor's fixed-frame velocity exceeds Y/C_B, and
    concludes that the motion is bounded.  That does not follow: nothing is said of the displacement, and the
    energy may rise while the velocity is small.  Integrating the impulse response does give a bound.
    """
    speed = scene.rotor.speed_profile[0].speed
    parameters = PlantParameters.of(scene)
    turning = motion_bound(parameters, speed=speed, rate=_RATE)
    judged = motion_bound(parameters, speed=0.0, rate=_RATE) if defect == "rotor_at_rest" else turning
    runs = balanced_at_constant_speed(scene, time_limit=30.0).runs.values()
    largest = max(run.worst_amplitude for run in runs)
    return Evidence(
        found=as_found(
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


def motion_bound(parameters: PlantParameters, *, speed: float, rate: float) -> _MotionBound:
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
