"""What the stated uncertainties of a scene with eccentric masses, and its sensors' noise, do to a run.

The plant is moved, not what the controller is configured with: it does not know what is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
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
_SEEDS: Final = 4
_STUDENT: Final = 2.776
"""97.5 % quantile of Student's t with four degrees of freedom: of five runs."""


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
    """By how much each cause alone lowers and raises a number, both at least zero; of noise at 95 %."""
    found = {}
    for path, runs in moved.items():
        changes = [number - value for run in runs if (number := run[name]) is not None]
        if path == NOISE and changes:
            width = _STUDENT * float(np.std([0.0, *changes], ddof=1))
            found[path] = (width, width)
        elif changes:
            found[path] = (max(0.0, -min(changes)), max(0.0, *changes))
    return found


def lost(moved: Mapping[str, list[Judged]], name: str) -> tuple[str, ...]:
    """Causes with which at least one run does not come to a number at all."""
    return tuple(path for path, runs in moved.items() if any(run[name] is None for run in runs))
