"""What the stated uncertainties of a scene with eccentric masses, and its sensors' noise, do to a run.

The plant is moved, not what the controller is configured with: it does not know what is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.strategy.settings import strategy_settings
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.models import InputUncertainty
from ringbalance.scene.uncertain import NORMAL_95, eccentric_moved

Judged = Mapping[str, float | None]
"""Numbers that a run comes to, by name; None: it does not come to it."""
NOISE: Final = "sensor.noise"
_SEEDS: Final = 2
DRAWS: Final = 39
"""Of so many: 95 % of further ones lie between least and greatest, or between an end and the second."""


def moved_runs(
    scene: EccentricScene, judge: Callable[[EccentricScene, EccentricRun], Judged], *, seed: int
) -> dict[str, list[Judged]]:
    """What a run comes to with one input at either end of its stated interval, by the input's path.

    With any uncertainty stated, `NOISE` has the runs with further seeds. Empty: none is stated.
    """
    if not scene.uncertainty:
        return {}
    settings = strategy_settings(scene)

    def came_to(plant: EccentricScene, number: int) -> Judged:
        return judge(plant, simulate_eccentric(plant, seed=number, settings=settings))

    moved = {
        each.quantity: [came_to(plant, seed) for plant in _both_ends(scene, each)]
        for each in scene.uncertainty
    }
    return moved | {NOISE: [came_to(scene, seed + more) for more in range(1, _SEEDS + 1)]}


def drawn_runs(
    scene: EccentricScene, judge: Callable[[EccentricScene, EccentricRun], Judged], *, seed: int
) -> list[Judged]:
    """What runs come to with all stated inputs, and the noise, drawn at once; empty: none is stated."""
    if not scene.uncertainty:
        return []
    settings = strategy_settings(scene)
    plants = (
        (drawn_plant(scene, np.random.default_rng(np.random.SeedSequence(number, spawn_key=(1,)))), number)
        for number in range(seed + 1, seed + 1 + DRAWS)
    )
    return [judge(plant, simulate_eccentric(plant, seed=n, settings=settings)) for plant, n in plants]


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
        yield eccentric_moved(scene, uncertain.quantity, at(sign))


def drawn_plant(scene: EccentricScene, random: np.random.Generator) -> EccentricScene:
    """The scene with every stated input drawn: relative ones log-normal, so that none changes its sign."""
    for uncertain in scene.uncertainty:
        move = _drawn(uncertain, random.standard_normal() / NORMAL_95)
        scene = eccentric_moved(scene, uncertain.quantity, move)
    return scene


def _drawn(uncertain: InputUncertainty, part: float) -> Callable[[float], float]:
    """Args: `part`: of the half-width, a normal deviate."""
    if uncertain.relative:
        return lambda value: value * math.exp(math.log1p(uncertain.half_width) * part)
    return lambda value: value + uncertain.half_width * part


def effects(value: float, moved: Mapping[str, list[Judged]], name: str) -> dict[str, tuple[float, float]]:
    """By how much each cause alone lowers and raises a number, both at least zero."""
    found = {}
    for path, runs in moved.items():
        if changes := [number - value for run in runs if (number := run[name]) is not None]:
            found[path] = (max(0.0, -min(changes)), max(0.0, *changes))
    return found


def lost(moved: Mapping[str, list[Judged]], name: str) -> tuple[str, ...]:
    """Causes with which at least one run does not come to a number at all."""
    return tuple(path for path, runs in moved.items() if any(run[name] is None for run in runs))
