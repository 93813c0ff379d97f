"""Figs. 5, 7, 8 and 9: friction estimation, positioning, fine tuning and the run-up, by the strategy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.imbalance import convergence_time
from ringbalance.verification.eccentric_mass.scenes import at_constant_speed, changed, envelope, thinned
from ringbalance.verification.evidence import Curve, Series, figure

_PAPER_ARMS = (0.01, 0.005)
"""Of Fig. 5, m."""
_PAPER_PLACES = (45.0, 135.0)
"""Phases of the imbalance in Figs. 7 and 8, deg."""
_PAPER_ERROR = math.radians(10.0)
"""Of the masses' places in Fig. 8, rad."""
_CONVERGED = 0.05
"""Relative error of the friction arm within which its estimate has converged."""


@dataclass(frozen=True, kw_only=True)
class FigureFive:
    """Friction arms found while both masses go round."""

    arms: tuple[float, ...]
    """True, m."""
    runs: tuple[EccentricRun, ...]
    time_to_converge: tuple[float, ...]
    """From the beginning of the friction stage until both estimates keep within 5 %, s."""


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

    def amplitudes(self, *, until: float = math.inf) -> Series:
        """Amplitude over time of every run."""
        names = [f"imbalance at {phase:.0f} degrees" for phase in self.phases]
        return amplitude_figure("amplitude", dict(zip(names, self.runs, strict=True)), until=until)


@dataclass(frozen=True, kw_only=True)
class FigureNine:
    """The run-up, balanced and with locked masses."""

    balanced: EccentricRun
    locked: EccentricRun
    balanced_peak: tuple[float, float]
    """Largest amplitude after the run-up has begun, m, and the speed there, rad/s."""
    locked_peak: tuple[float, float]
    """The same with locked masses."""
    critical_speed: float
    """sqrt(K_B/M) with the eccentric masses, rad/s."""
    rotor_critical_speed: float
    """sqrt(K_B/m_r), which the paper prints as 135 rpm, rad/s."""


def amplitude_figure(
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


def figure_five(scene: EccentricScene, *, time_limit: float = 12.0) -> FigureFive:
    """Find the friction arms of Fig. 5. Source: Fig. 5 of the paper on eccentric masses."""
    level = at_constant_speed(scene, time_limit=time_limit)
    runs = tuple(simulate_eccentric(changed(level, "masses", friction_arm=(a, a))) for a in _PAPER_ARMS)
    pairs = list(zip(runs, _PAPER_ARMS, strict=True))
    return FigureFive(
        arms=_PAPER_ARMS,
        runs=runs,
        time_to_converge=tuple(_friction_time(run, arm) for run, arm in pairs),
    )


def _friction_time(run: EccentricRun, arm: float) -> float:
    begun = [stage.start for stage in run.stages if stage.name == "friction estimation"]
    if not begun:
        return math.inf
    error = np.max(np.abs(run.estimates.friction_arm - arm), axis=1) / arm
    return convergence_time(run.time, error, limit=_CONVERGED) - begun[0]


def figure_seven(scene: EccentricScene, *, time_limit: float = 30.0) -> BalancingFigure:
    """Balance the two imbalances of the paper's Fig. 7 at constant speed."""
    return _balanced(at_constant_speed(scene, time_limit=time_limit))


def figure_eight(scene: EccentricScene, *, time_limit: float = 400.0) -> BalancingFigure:
    """The same with masses that stop 10 degrees beside their targets, and fine tuning: the paper's Fig. 8."""
    level = at_constant_speed(scene, time_limit=time_limit)
    return _balanced(changed(level, "supervisor", target_error=(_PAPER_ERROR, _PAPER_ERROR)))


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


def figure_nine(scene: EccentricScene) -> FigureNine:
    """Run up through the critical speed, balanced at low speed and not at all.

    Source: Fig. 9 of the paper on eccentric masses, whose critical speed leaves the eccentric masses out.
    """
    parameters = plant_parameters(scene)
    balanced = simulate_eccentric(scene)
    locked = _locked(changed(scene, "sensor", position_noise=0.0))
    begins = scene.rotor.speed_profile[-2].time if len(scene.rotor.speed_profile) > 1 else 0.0
    return FigureNine(
        balanced=balanced,
        locked=locked,
        balanced_peak=_run_up_peak(balanced, after=begins),
        locked_peak=_run_up_peak(locked, after=begins),
        critical_speed=math.sqrt(parameters.stiffness / parameters.mass),
        rotor_critical_speed=math.sqrt(parameters.stiffness / scene.rotor.mass),
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
