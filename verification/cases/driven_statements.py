"""Statements of the eccentric-mass paper without a formula: estimates that perturb nothing (Fig. 7), no limit
cycle, and a regulator that minimises vibration and power.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.plant import ANGLE, PlantParameters, X, Y, plant_row, plant_step
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.evidence import Evidence, FigureCurve, Level, as_found, figure
from ringbalance.verification.papers import at_constant_speed, changed, envelope, thinned

_STEADY_S: Final = 16.0
"""Time after which the whirl from the rotor's start is below a millionth."""
_UNEQUAL_ARMS_M: Final = (0.01, 0.005)
_PERIODS: Final = {"A": "imbalance estimation", "B": "friction estimation"}
_PERIODS_S: Final = 4.0
_MOVE_S: Final = 12.0
_RATE_GAINS: Final = (0.5, 0.75, 1.25, 1.5, 2.0)
"""Rate gains of other regulators over that of the LQR, whose position gain they have."""
_WEIGHT_RATIOS: Final = (1.0, 100.0)
"""Smallest and largest q/r, whose own regulators are compared."""
_SPEED_RATIOS: Final = (0.96, 1.0)
"""Constant speeds at which the masses are free, over the critical one."""
_HOLDING_ARMS_M: Final = (0.1, 0.1)
"""Friction arms above the largest displacement of the rotor."""
_FREE_S, _WATCHED_S = 60.0, 20.0
"""Time from rest, and its last part."""
_STEP_S: Final = 1e-3


def undisturbed(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Largest change of the amplitude in periods (A) and (B) of Fig. 7, from a steady whirl.

    The paper's own law regulates the speed of each mass alone; the program's pair loop keeps them opposite.
    """
    steady = changed(
        at_constant_speed(scene, time_limit=_STEADY_S + _PERIODS_S), {"supervisor.start": _STEADY_S}
    )
    alone = {"friction_filter.pair_gain": 0.0}
    unequal = {"masses.friction_arm": _UNEQUAL_ARMS_M}
    runs = {
        "equal friction": simulate_eccentric(changed(steady, alone)),
        "unequal friction": simulate_eccentric(changed(steady, {**alone, **unequal})),
        "unequal friction, pair loop": simulate_eccentric(changed(steady, unequal)),
    }
    changes = {name: max(_change(run, stage) for stage in _PERIODS.values()) for name, run in runs.items()}
    before, least, most = _amplitudes(runs["equal friction"], _PERIODS["B"])
    _, least_unequal, most_unequal = _amplitudes(runs["unequal friction"], _PERIODS["B"])
    shown = runs["equal friction"].time > _STEADY_S
    curves = (FigureCurve(name, "m", envelope(run.amplitude[shown])) for name, run in runs.items())
    return Evidence(
        quantities=as_found(change=changes["equal friction" if defect is None else "unequal friction"]),
        numbers={
            "before": before,
            "least": least,
            "most": most,
            "least_unequal": least_unequal,
            "most_unequal": most_unequal,
            "unequal": changes["unequal friction"],
            "paired": changes["unequal friction, pair loop"],
        },
        series=(
            figure(
                "amplitude while the estimates are made",
                ("time", "s", thinned(runs["equal friction"].time[shown])),
                *curves,
            ),
        ),
    )


def _amplitudes(run: EccentricRun, stage: str) -> tuple[float, float, float]:
    """Steady amplitude before balancing, and the smallest and the largest of a stage, m."""
    (period,) = (each for each in run.stages if each.name == stage)
    inside = run.amplitude[(run.time >= period.start) & (run.time <= period.end)]
    before = float(run.amplitude[np.searchsorted(run.time, _STEADY_S)])
    return before, float(inside.min()), float(inside.max())


def _change(run: EccentricRun, stage: str) -> float:
    before, least, most = _amplitudes(run, stage)
    return max(before - least, most - before) / before


def limit_cycle(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Turns that masses with their drives off go on making on the track, near the critical speed."""
    parameters = PlantParameters.of(scene)
    critical = math.sqrt(parameters.stiffness / parameters.mass)
    if defect is not None:
        scene = changed(scene, {"masses.friction_arm": _HOLDING_ARMS_M})
    states = {ratio: _free(scene, ratio * critical) for ratio in _SPEED_RATIOS}
    watched = round(_WATCHED_S / _STEP_S)
    turns = [
        np.abs(each[-1, ANGLE:] - each[-watched - 1, ANGLE:]).max() / (2 * math.pi)
        for each in states.values()
    ]
    last = np.hypot(*states[1.0][-watched:, (X, Y)].T)
    locked = abs(parameters.steady_whirl(critical, scene.masses.initial_angle))
    time = _STEP_S * np.arange(states[1.0].shape[0])
    return Evidence(
        quantities=as_found(turns=float(max(turns))),
        numbers={
            "rate": max(turns) / _WATCHED_S * 60.0,
            "least": float(last.min()),
            "most": float(last.max()),
            "locked": locked,
            "speed": critical,
        },
        series=(
            figure(
                "amplitude at the critical speed",
                ("time", "s", thinned(time)),
                FigureCurve("masses free", "m", envelope(np.hypot(*states[1.0][:, (X, Y)].T))),
                FigureCurve(
                    "masses locked, steady", "m", np.full(thinned(time).size, locked), style="reference"
                ),
            ),
        ),
    )


def _free(scene: EccentricScene, speed: float) -> FloatArray:
    """Displacement, velocity and angles at constant speed from rest, drives off, shape (samples, 6)."""
    parameters, row = PlantParameters.of(scene), plant_row(scene.masses.initial_angle)
    states = [row[: ANGLE + 2].copy()]
    for _ in range(round(_FREE_S / _STEP_S)):
        plant_step(parameters, row, speed, 0.0, _STEP_S)
        states.append(row[: ANGLE + 2].copy())
    return np.array(states)


def optimal(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Vibration and energy of one positioning under the LQR, and under regulators that differ in k_d alone.

    Vibration is the integral of the squared amplitude from the beginning of positioning on.
    """
    steady = changed(
        at_constant_speed(scene, time_limit=_STEADY_S + _MOVE_S), {"supervisor.start": _STEADY_S}
    )
    vibration, energy = _cost(steady, 1.0)
    others = {gain: _cost(steady, gain) for gain in _RATE_GAINS if defect is None or gain < 1.0}
    # Of the larger of both ratios the smallest: below 1 a regulator has less of both.
    ratios = {gain: (cost[0] / vibration, cost[1] / energy) for gain, cost in others.items()}
    best = min(ratios, key=lambda gain: max(ratios[gain]))
    small, large = (
        _cost(changed(steady, {"lqr.state_weight": ratio * scene.lqr.input_weight}), 1.0)
        for ratio in _WEIGHT_RATIOS
    )
    return Evidence(
        quantities=as_found(both=max(ratios[best])),
        numbers={
            "gain": best,
            "vibration": ratios[best][0],
            "energy": ratios[best][1],
            "over_weight_vibration": large[0] / small[0],
            "over_weight_energy": large[1] / small[1],
        },
    )


def _cost(scene: EccentricScene, rate_gain: float) -> tuple[float, float]:
    """Integral of the squared amplitude, m^2 s, and energy, J, from the beginning of positioning on."""
    settings = StrategySettings.of(scene)
    law = settings.law._replace(rate_gain=rate_gain * settings.law.rate_gain)
    run = simulate_eccentric(scene, settings=settings._replace(law=law))
    (start,) = (each.start for each in run.stages if each.name == "positioning")
    first = int(np.searchsorted(run.time, start))
    energy = run.history["energy"]
    squares = run.amplitude[first:] ** 2
    return float(np.sum(squares) * settings.step), float(energy[-1] - energy[first])
