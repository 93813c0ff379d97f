"""What a scene demands of its eccentric masses, as fractions of the devices that it may be."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.targets import target_angles
from ringbalance.controller.judging.judge import Judgement
from ringbalance.results.proportion import Proportion
from ringbalance.results.requirements import AT_LEAST, Requirement
from ringbalance.scene.arrays import BoolArray

FEWEST, MOST = 16, 64
"""Drawn devices of a verdict, doubled until it is known: a run takes a thousand times as long as a liquid
ring's."""
_QUANTITIES: Final = {"settling_time": "settled in time", "residual": "amplitude at the end allowed"}


def drawn_requirements(judgement: Judgement) -> Iterator[Requirement]:
    """Of all demands together, of each where there are several, and of the capacity."""
    outcomes, demands = judgement.outcomes, judgement.demands
    yield _row("devices that meet every requirement", judgement.meets, judgement.asked)
    if len(demands) > 1:
        for each in demands:
            yield _row(f"devices: {_QUANTITIES[each.code]}", each.met(outcomes), judgement.asked)
    within = np.asarray(outcomes.usable_moment >= outcomes.unbalance)
    yield _row("devices: imbalance within reach", within, judgement.asked)


def _row(quantity: str, met: BoolArray, asked: float) -> Requirement:
    fraction = Proportion(count=int(np.count_nonzero(met)), of=met.size)
    ends = (fraction.low, fraction.high)
    return Requirement(
        quantity,
        "",
        AT_LEAST,
        asked,
        "requirement.fraction",
        fraction.value,
        achieved_interval=ends,
        excess_interval=(ends[0] - asked, ends[1] - asked),
    )


def reach_of(scene: EccentricScene) -> float:
    """Largest imbalance that the masses cancel, kg m."""
    moment = PlantParameters.of(scene).moment
    gap = scene.masses.arc_length / scene.masses.guide_radius
    # Of an imbalance beyond all reach, what the masses side by side leave is what they lack.
    beyond = 4 * moment
    return beyond - target_angles(beyond, 0.0, moment, gap).residual
