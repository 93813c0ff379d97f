"""What a scene demands of its eccentric masses, and what its run and its loops come to.

Intervals follow from the scene's stated uncertainties and its sensors' noise: the plant is moved, not what
the controller is configured with, which does not know what is unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.plan import STAGE_NAMES, Stage
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.sampled_loops import GAIN_MARGIN, RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_drawn
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.targets import target_angles
from ringbalance.results.requirements import AT_LEAST, AT_MOST, Interval, Requirement
from ringbalance.scene.origins import InputUncertainty
from ringbalance.scene.paths import moved_at

_LIMIT: Final = "supervisor.limit"
_ROUNDING: Final = 1e-12
_FEWEST: Final = 3
_Judged = Mapping[str, Requirement]
"""What a run comes to, by quantity."""
NOISE: Final = "sensor.noise"
_SEEDS: Final = 2
DRAWS: Final = 39
"""Of so many: 95 % of further ones lie between least and greatest, or between an end and the second."""


def eccentric_requirements(scene: EccentricScene, run: EccentricRun) -> tuple[Requirement, ...]:
    """Of its run as the scene says, and of its loops.

    A scene that states uncertainties is run again with all inputs drawn, which gives the intervals, and with
    each input at both ends of its own, which tells what they come from.
    """
    moved, drawn = _moved_runs(scene), _drawn_runs(scene)
    rows = (_with_intervals(row, moved, drawn) for row in _of_run(scene, run))
    return (*rows, *_of_loops(RecommendedGains.of(scene)))


def _of_run(scene: EccentricScene, run: EccentricRun) -> Sequence[Requirement]:
    plant = PlantParameters.of(scene)
    deviation = float(np.sqrt(np.max(np.linalg.eigvalsh(run.estimates.imbalance_covariance[-1]))))
    estimate = float(np.hypot(*run.estimates.imbalance[-1]))
    limit, gate = scene.supervisor.limit, scene.imbalance_filter.gate
    until, why = _deadline(scene)
    return [
        Requirement(
            "balancing moment", "kg m", AT_LEAST, plant.unbalance, "the imbalance to cancel", reach_of(scene)
        ),
        Requirement("amplitude at the end", "m", AT_MOST, limit, _LIMIT, run.final_amplitude),
        Requirement("largest amplitude after balancing", "m", AT_MOST, limit, _LIMIT, _largest_balanced(run)),
        Requirement("settling time", "s", AT_MOST, until, why, run.settling_time),
        Requirement(
            "standard deviation of the imbalance, from noise",
            "kg m",
            AT_MOST,
            gate * plant.unbalance,
            f"imbalance_filter.gate, {100 * gate:g} % of the imbalance",
            deviation if estimate > 0 else None,
        ),
    ]


def reach_of(scene: EccentricScene) -> float:
    """Largest imbalance that the masses cancel, kg m."""
    moment = PlantParameters.of(scene).moment
    gap = scene.masses.arc_length / scene.masses.guide_radius
    # Of an imbalance beyond all reach, what the masses side by side leave is what they lack.
    beyond = 4 * moment
    return beyond - target_angles(beyond, 0.0, moment, gap).residual


def _deadline(scene: EccentricScene) -> tuple[float, str]:
    """Time by which the rotor must be balanced, s, and what sets it."""
    change = scene.steady_until
    if change is not None:
        return change, "the speed begins to change"
    return scene.run.time_limit, "run.time_limit, the end of the run"


def _of_loops(gains: RecommendedGains) -> Sequence[Requirement]:
    why = "half the gain at which the loop is unstable"
    return [
        Requirement(f"gain margin of the {loop.name}", "", AT_LEAST, GAIN_MARGIN, why, loop.gain_margin)
        for loop in gains.loops
    ]


def _judged(scene: EccentricScene, run: EccentricRun) -> _Judged:
    return {row.quantity: row for row in _of_run(scene, run)}


def _with_intervals(
    row: Requirement, moved: Mapping[str, Sequence[_Judged]], drawn: Sequence[_Judged]
) -> Requirement:
    if not drawn or row.achieved is None:
        return row
    every = [run[row.quantity] for run in drawn]
    known = [each for each in every if each.achieved is not None]
    both = {path: [run[row.quantity] for run in runs] for path, runs in moved.items()}
    return replace(
        row,
        required_interval=_interval(row.required, [each.required for each in every]),
        achieved_interval=_interval(row.achieved, [float(each.achieved or 0.0) for each in known]),
        excess_interval=_interval(row.excess, [each.excess for each in known]),
        effects=_effects(row.excess, both),
        lost=tuple(path for path, ends in both.items() if any(end.achieved is None for end in ends)),
        reached=len(known) / len(every),
        held=sum(each.met for each in known) / len(every),
    )


def _interval(value: float, drawn: Sequence[float]) -> Interval | None:
    """None where nothing moves it, or too few runs come to it."""
    if len(drawn) < _FEWEST:
        return None
    low, high = interval(value, drawn)
    return (low, high) if high - low > _ROUNDING * abs(value) else None


def _effects(excess: float, moved: Mapping[str, Sequence[Requirement]]) -> dict[str, Interval]:
    """By how much each cause alone lowers and raises what is in excess, both at least zero."""
    found = {}
    for path, ends in moved.items():
        if changes := [end.excess - excess for end in ends if end.achieved is not None]:
            found[path] = (max(0.0, -min(changes)), max(0.0, *changes))
    return found


def _largest_balanced(run: EccentricRun) -> float | None:
    """From the strategy's rest on, m; None when it did not come to that."""
    last = run.stages[-1]
    if last.name != STAGE_NAMES[Stage.REST]:
        return None
    return float(np.max(run.amplitude[run.time >= last.start]))


def _moved_runs(scene: EccentricScene) -> dict[str, list[_Judged]]:
    """What a run comes to with one input at either end of its stated interval, by the input's path.

    With any uncertainty stated, `NOISE` has the runs with further seeds. Empty: none is stated.
    """
    if not scene.uncertainty:
        return {}
    settings, seed = StrategySettings.of(scene), scene.run.seed

    def came_to(plant: EccentricScene, number: int) -> _Judged:
        return _judged(plant, simulate_eccentric(plant, seed=number, settings=settings))

    moved = {
        each.quantity: [came_to(plant, seed) for plant in _both_ends(scene, each)]
        for each in scene.uncertainty
    }
    return moved | {NOISE: [came_to(scene, seed + more) for more in range(1, _SEEDS + 1)]}


def _drawn_runs(scene: EccentricScene) -> list[_Judged]:
    """What runs come to with all stated inputs, and the noise, drawn at once; empty: none is stated."""
    if not scene.uncertainty and not scene.fitted.quantities:
        return []
    settings, seed = StrategySettings.of(scene), scene.run.seed
    plants = (
        (
            eccentric_drawn(scene, np.random.default_rng(np.random.SeedSequence(number, spawn_key=(1,)))),
            number,
        )
        for number in range(seed + 1, seed + 1 + DRAWS)
    )
    return [_judged(plant, simulate_eccentric(plant, seed=n, settings=settings)) for plant, n in plants]


def interval(value: float, drawn: Sequence[float]) -> tuple[float, float]:
    """Both ends between which 95 % of what is drawn lies; the value as the scene says is among them.

    An amplitude is least where nothing is wrong: such a value lies at the end of what is drawn, not in its
    middle, and a sum of squares of the effects of single inputs would count an end that nothing reaches.
    Source: order statistics; of n draws, a further one falls between two with i others between them with
        probability (i + 1)/(n + 1), whatever the distribution.
    """
    low, *_, high = ordered = sorted(drawn)
    if value < low:
        return value, ordered[-2]
    return (ordered[1], value) if value > high else (low, high)


def _both_ends(scene: EccentricScene, uncertain: InputUncertainty) -> Iterator[EccentricScene]:
    def at(sign: int) -> Callable[[float], float]:
        return lambda value: value + sign * uncertain.absolute(value)

    for sign in (-1, 1):
        yield moved_at(scene, uncertain.quantity, at(sign))
