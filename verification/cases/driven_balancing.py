"""The eccentric-mass paper's runs: positioning, fine tuning and run-up (Figs. 7 to 9), and their bound."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
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

_RPM = 30 / np.pi
_PRINTED = 135.0


def run_up(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """The run-up through the critical speed, balanced at low speed and locked.

    The critical speed that the paper prints leaves the eccentric masses out.


        Peaks and critical speeds."""
    parameters = PlantParameters.of(scene)
    critical, without = (
        _RPM * math.sqrt(parameters.stiffness / mass) for mass in (parameters.mass, scene.rotor.mass)
    )
    balanced, locked = simulate_eccentric(scene), _locked(changed(scene, "sensor", position_noise=0.0))
    begins = scene.rotor.speed_profile[-2].time if len(scene.rotor.speed_profile) > 1 else 0.0
    largest, speed = _run_up_peak(locked, after=begins)
    peak = largest if defect else _run_up_peak(balanced, after=begins)[0]
    return Evidence(
        found={"critical": Found(value=critical, corrected=without), "peak": Found(value=peak / largest)},
        reference={"critical": Reference(value=_PRINTED, uncertainty=from_rounding(1.0))},
        numbers={"locked": largest, "balanced": peak, "peak_speed": _RPM * speed, "without": without},
        series=(
            _amplitude_figure(
                "amplitude during the run-up",
                {"locked": locked, "balanced at 100 rpm": balanced},
                beside="locked",
            ),
        ),
    )


@lru_cache(maxsize=1)
def _locked(scene: EccentricScene) -> EccentricRun:
    """With locked masses; no sensor is looked at, so that one run serves every noise of the position."""
    return simulate_eccentric(changed(scene, "supervisor", strategy="locked"))


def _run_up_peak(run: EccentricRun, *, after: float) -> tuple[float, float]:
    """Largest amplitude from a time on, and the speed at which it falls. Returns: m and rad/s."""
    first = int(np.searchsorted(run.time, after))
    at = first + int(np.argmax(run.amplitude[first:]))
    return float(run.amplitude[at]), float(run.speed[at])


def _amplitude_figure(
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


_SHOWN = 12.0
"""s."""
_PAPER_PLACES = (45.0, 135.0)
"""Phases of the imbalance in Figs. 7 and 8, deg."""
_PAPER_ERROR = math.radians(10.0)
"""Of the masses' places in Fig. 8, rad."""


def positioning(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Two imbalances balanced at constant speed: positioning (Fig. 7), and with fine tuning after it
    (Fig. 8).

    Amplitudes before, on the way and after."""
    found = BalancingFigure.seven(scene) if defect is None else BalancingFigure.eight(scene, time_limit=30.0)
    ratios = np.divide(found.positioned, found.before)
    arrived = [stage.end for run in found.runs for stage in run.stages if stage.name == "positioning"]
    return Evidence(
        found=as_found(ratio=ratios.max()),
        numbers={
            "before": found.before[0],
            "first": found.positioned[0],
            "second": found.positioned[1],
            "arrived": max(arrived),
        },
        series=(found.amplitudes(until=_SHOWN), _angles(found)),
    )


def _angles(found: BalancingFigure) -> Series:
    run = found.runs[0]
    shown = run.time <= _SHOWN
    angles = zip(("mass 1", "mass 2"), run.mass_angle, strict=True)
    return figure(
        f"angles of the masses, imbalance at {found.phases[0]:.0f} degrees",
        ("time", "s", thinned(run.time[shown])),
        *(Curve(name, "rad", thinned(angle[shown])) for name, angle in angles),
    )


@dataclass(frozen=True, kw_only=True)
class BalancingFigure:
    """Runs for several phases of the imbalance."""

    phases: tuple[float, ...]
    """deg."""
    runs: tuple[EccentricRun, ...]
    before: tuple[float, ...]
    """Steady amplitude before anything is moved, m."""
    positioned: tuple[float, ...]
    """Mean amplitude in the last second of the check, m."""
    after: tuple[float, ...]
    """Mean amplitude in the last second of the run, m."""

    @classmethod
    def seven(cls, scene: EccentricScene, *, time_limit: float = 30.0) -> BalancingFigure:
        """Balance the two imbalances of the paper's Fig. 7 at constant speed."""
        return _balanced(at_constant_speed(scene, time_limit=time_limit))

    @classmethod
    def eight(cls, scene: EccentricScene, *, time_limit: float = 400.0) -> BalancingFigure:
        """The same with masses that stop 10 degrees beside their targets, then trials alone: Fig. 8."""
        level = at_constant_speed(scene, time_limit=time_limit)
        error = (_PAPER_ERROR, _PAPER_ERROR)
        return _balanced(changed(level, "supervisor", target_error=error, correction="trials"))

    def amplitudes(self, *, until: float = math.inf) -> Series:
        """Amplitude over time of every run."""
        names = [f"imbalance at {phase:.0f} degrees" for phase in self.phases]
        return _amplitude_figure("amplitude", dict(zip(names, self.runs, strict=True)), until=until)


def _balanced(scene: EccentricScene) -> BalancingFigure:
    turned = [changed(scene, "imbalance", phase=math.radians(phase)) for phase in _PAPER_PLACES]
    runs = tuple(simulate_eccentric(one) for one in turned)
    return BalancingFigure(
        phases=_PAPER_PLACES,
        runs=runs,
        before=tuple(run.unbalanced_amplitude for run in runs),
        positioned=tuple(_in_check(run) for run in runs),
        after=tuple(run.final_amplitude for run in runs),
    )


def _in_check(run: EccentricRun) -> float:
    """Mean amplitude over the last second of the check; infinite without one."""
    ends = [stage.end for stage in run.stages if stage.name == "check"]
    if not ends:
        return math.inf
    during = (run.time > ends[0] - 1.0) & (run.time <= ends[0])
    return float(np.mean(run.amplitude[during]))


_TIME = {None: 200.0, "tuning_given_up": 25.0}
"""s."""


def fine_tuning(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Masses ten degrees beside their targets, then tuned by trial.

    Amplitudes after positioning and after fine tuning."""
    found = BalancingFigure.eight(scene, time_limit=_TIME[defect])
    left = np.divide(found.positioned, found.before)
    ended = np.divide(found.after, found.before)
    settled = [run.settling_time or run.time[-1] for run in found.runs]
    return Evidence(
        found=as_found(left=left.min(), ended=ended.max()),
        numbers={"left_m": min(found.positioned), "end": max(found.after), "time": float(max(settled))},
        series=(found.amplitudes(),),
    )


_RATE = 1.0
"""rad/s, of the masses against the rotor."""


def bound(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Appendix B: the printed force beside the largest one, and the corrected bound beside a run.

    The printed argument shows that the energy falls while the rotor's fixed-frame velocity exceeds Y/C_B, and
    concludes that the motion is bounded.  That does not follow: nothing is said of the displacement, and the
    energy may rise while the velocity is small.  Integrating the impulse response does give a bound.


        Forces and amplitudes against their bounds."""
    speed = scene.rotor.speed_profile[0].speed
    parameters = PlantParameters.of(scene)
    turning = motion_bound(parameters, speed=speed, rate=_RATE)
    judged = motion_bound(parameters, speed=0.0, rate=_RATE) if defect == "rotor_at_rest" else turning
    bound = turning.amplitude
    if defect == "response_left_out":
        bound = parameters.unbalance * speed**2 / parameters.stiffness
    missing = 2 * parameters.moment * speed**2
    largest = max(run.worst_amplitude for run in BalancingFigure.seven(scene).runs)
    return Evidence(
        found={
            "force_ratio": Found(
                value=judged.printed_force / judged.force,
                corrected=(judged.printed_force + missing) / judged.force,
            ),
            "amplitude_ratio": Found(value=largest / bound),
        },
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
