"""Closed-loop runs after section 6 of the liquid-ring paper: its own law, an exact sensor."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np

from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Simulation
from ringbalance.reduced_model.calibration import calibrate, known_chamber_and_law
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.loop_models import ControllerKind
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import CaseTable, FigureCurve, Found, Series, figure

PHASES: Final = tuple(math.radians(angle) for angle in (90, 180, 270, 360))
"""Phases of the initial vibration, the four cases of Fig. 6, rad."""
AMPLITUDES: Final = (2e-6, 4e-6, 6e-6, 8e-6, 10e-6)
"""Amplitudes of the initial vibration, the five cases of Fig. 8, m."""
GAINS: Final = (0.04e6, 0.08e6, 0.12e6, 0.16e6, 0.20e6)
"""Kp of Fig. 7, s/m."""
PERIODS: Final = (0.25, 0.5, 1.0)
"""Periods between operations, s; the paper gives none: the middle one is judged, the others are its range."""
_STEPS: Final = ("first_trial", "long_step", "short_step")
_CURVE_POINTS: Final = 400


def loop_scene(
    scene: Scene,
    *,
    kind: ControllerKind,
    amplitude: float = AMPLITUDES[-1],
    phase: float = PHASES[0],
    **settings: Any,
) -> Scene:
    """A scene set up for one run of section 6, with an exact sensor: the paper names no noise.

    Args: `amplitude`, m, and `phase`, rad: of the initial vibration. `settings`: of the controller, SI.
    """
    return dataclasses.replace(
        scene,
        controller=dataclasses.replace(scene.controller, kind=kind, **settings),
        rotor=dataclasses.replace(scene.rotor, initial_amplitude=amplitude, initial_phase=phase),
        sensor=dataclasses.replace(scene.sensor, amplitude_noise=0.0, phase_noise=0.0),
    )


def mistaken_lag(scene: Scene) -> Scene:
    """A scene whose controller is configured with a lag angle that is wrong by a third of a turn."""
    wrong = scene.rotor.lag_angle + math.radians(120)
    return dataclasses.replace(
        scene, controller=dataclasses.replace(scene.controller, assumed_lag_angle=wrong)
    )


@lru_cache(maxsize=512)
def run_loop(scene: Scene, law: str = "paper") -> Simulation:
    """One closed-loop run. Args: `law`: "paper" or "calibrated"; one calibrated law serves all runs."""
    paper = law == "paper"
    return simulate(scene, paper_model(scene) if paper else BalancerModel.of(flow_law_of(scene)))


@lru_cache(maxsize=16)
def calibration_of(scene: Scene) -> Calibration:
    """Calibrate a scene, once in a process."""
    return calibrate(scene)


def flow_law_of(scene: Scene) -> CalibratedLaw:
    """The law of `calibrate` without the rest, once for all scenes that differ in rotor and control alone."""
    rotor = {"influence_coefficient": 1.0, "lag_angle": 0.0, "initial_amplitude": 1.0, "initial_phase": 0.0}
    control = dict.fromkeys(("limit", "period", "hold_time", "proportional", *_STEPS), 1.0)
    still = dataclasses.replace(
        loop_scene(scene, kind="target_vector", **control),
        rotor=dataclasses.replace(scene.rotor, **rotor),
        run=dataclasses.replace(scene.run, seed=0, time_limit=1.0),
    )
    return known_chamber_and_law(still)[1]


def runs_with(
    scene: Scene,
    *,
    kind: ControllerKind = "target_vector",
    amplitudes: Sequence[float] = AMPLITUDES[-1:],
    phases: Sequence[float] = PHASES[:1],
    periods: Sequence[float] = PERIODS,
    **settings: Any,
) -> list[Simulation]:
    """Runs at each period, s, from each amplitude, m, and phase, rad, in this order.

    Args: `settings`: of the controller, SI.
    """
    return [
        run_loop(loop_scene(scene, kind=kind, amplitude=amplitude, phase=phase, period=period, **settings))
        for period, amplitude, phase in itertools.product(periods, amplitudes, phases)
    ]


def overshooting(runs: Sequence[Simulation]) -> float:
    """Fraction of the runs that overshoot."""
    return sum(run.overshoots > 0 for run in runs) / len(runs)


def settling(run: Simulation) -> float:
    """Settling time, s, infinite where the run did not settle."""
    return math.inf if run.settling_time is None else run.settling_time


def slowest_within(scene: Scene, runs: Sequence[Simulation]) -> float:
    """The longest settling time of some runs, s, at most the time limit."""
    return min(max(map(settling, runs)), scene.run.time_limit)


def settled_after(runs: Sequence[Simulation]) -> float | str:
    """The longest settling time of some runs, s, for a table."""
    time = max(map(settling, runs))
    return time if math.isfinite(time) else "not settled"


def worst(runs: Sequence[Simulation]) -> float:
    """Largest number of misadjustments in a run."""
    return float(max(run.misadjustments for run in runs))


def runs_table(
    name: str,
    settings: Mapping[str, Sequence[float | str]],
    groups: Sequence[Sequence[Simulation]],
    *,
    shown: Sequence[str] = ("settled after", "misadjustments"),
    units: Mapping[str, str],
) -> CaseTable:
    """Worst outcomes of groups of runs, each group at one value of every setting."""

    def most_overshoots(runs: Sequence[Simulation]) -> float:
        return float(max(run.overshoots for run in runs))

    outcomes: Mapping[str, Callable[[Sequence[Simulation]], float | str]] = {
        "settled after": settled_after,
        "misadjustments": worst,
        "overshoots": most_overshoots,
        "most in one run": most_overshoots,
        "runs that overshoot": overshooting,
    }
    columns = {title: [outcomes[title](runs) for runs in groups] for title in shown}
    times = {"settled after": "s"} if "settled after" in shown else {}
    return CaseTable(name=name, columns={**settings, **columns}, units={**units, **times})


def over_period(numbers: Sequence[float]) -> Found:
    """Number at the middle one of `PERIODS`; the numbers at the others are its reach."""
    value = float(numbers[1])
    return Found(value=value).moved(min(numbers) - value, max(numbers) - value)


def amplitude_series(name: str, runs: dict[str, Simulation]) -> Series:
    """Amplitude against time of several runs, by the name of their curve, on one time axis."""
    longest = max(float(run.time[-1]) for run in runs.values())
    time = np.linspace(0.0, longest, _CURVE_POINTS)
    curves = tuple(
        FigureCurve(label, "m", np.interp(time, run.time, run.amplitude)) for label, run in runs.items()
    )
    return figure(name, ("time", "s", time), *curves)
