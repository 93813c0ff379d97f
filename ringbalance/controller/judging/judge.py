"""What is asked of a machine as functions of one run's outcome, and the fraction of devices that meets it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.controller.balancer import FURTHER, Balancer, Demand, Draws, Outcomes, Settings
from ringbalance.results.requirements import OPEN, Proportion
from ringbalance.scene.arrays import BoolArray

MOST_DRAWS: Final = 1024
"""Devices after which a verdict that is still open stays so, of a balancer whose runs are fast."""
FRESH: Final = 1 << 20
"""Number of the first device that judges: settings are chosen on the devices from 0 on."""
CHOOSING: Final = 1 << 19
"""Number of the first device that chooses between settings, remedies or designs that a search has found: the
best of several on the devices that judge them would promise too much."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """One setting over drawn devices."""

    settings: Settings
    """By path, where they differ from the scene's."""
    asked: float
    """Fraction of the devices that must meet every demand."""
    demands: tuple[Demand, ...]
    outcomes: Outcomes

    @cached_property
    def meets(self) -> BoolArray:
        """Whether each device meets every demand."""
        return np.asarray(np.all([each.met(self.outcomes) for each in self.demands], axis=0))

    def joined(self, more: Judgement) -> Judgement:
        """On these devices and further ones."""
        return replace(self, outcomes=self.outcomes.joined(more.outcomes))

    @property
    def fraction(self) -> Proportion:
        """Of the devices that meet every demand."""
        return _proportion(self.meets)

    @property
    def verdict(self) -> str:
        """Met, not met or undecided."""
        return self.fraction.verdict(self.asked)

    def fraction_of(self, demand: Demand) -> Proportion:
        """Of the devices that meet one."""
        return _proportion(demand.met(self.outcomes))

    def settling_time(self, fraction: float) -> tuple[float, float] | None:
        """Time within which a fraction of all devices has settled, and its upper 95 % bound, s.

        None where that bound is open: too few devices settle for it.
        """
        times, n = np.sort(self.outcomes.settling_time), self.outcomes.settled.size
        surely = [k for k in range(1, n + 1) if Proportion(count=k, of=n).low >= fraction]
        if not surely or not math.isfinite(times[surely[0] - 1]):
            return None
        return float(times[math.ceil(fraction * n) - 1]), float(times[surely[0] - 1])


def judged(
    balancer: Balancer,
    settings: Settings,
    *,
    most: int | None = None,
    start: int = FRESH,
    further: float = FURTHER,
    progress: Callable[[str], None] | None = None,
) -> Judgement:
    """One setting; see `judged_all`."""
    return judged_all(balancer, [settings], most=most, start=start, further=further, progress=progress)[0]


def best_of(
    balancer: Balancer, settings: Sequence[Settings], *, progress: Callable[[str], None] | None = None
) -> Settings:
    """Those that serve most of some devices that judge nothing; the earlier of equals."""
    if len(settings) == 1:
        return settings[0]
    few = balancer.verdict_draws[0]
    tried = judged_all(balancer, settings, first=few, most=few, start=CHOOSING, progress=progress)
    return max(tried, key=lambda each: each.fraction.value).settings


def judged_all(
    balancer: Balancer,
    settings: Sequence[Settings],
    *,
    first: int | None = None,
    most: int | None = None,
    start: int = FRESH,
    further: float = FURTHER,
    whole: bool = True,
    until: float = math.inf,
    progress: Callable[[str], None] | None = None,
) -> tuple[Judgement, ...]:
    """Settings over the same devices, twice as many each time until the verdict on each is known.

    Args: `first`, `most`: numbers of devices; default the balancer's. `start`: number of the first one.
    `further`: as `Balancer.run_all`. `whole`, `until`: as `Draws`. `progress`: told what is done.
    """
    asked, demands = balancer.asked_fraction(), balancer.demands()

    def judgement(place: int, outcomes: Outcomes) -> Judgement:
        return Judgement(settings=settings[place], asked=asked, demands=demands, outcomes=outcomes)

    done: dict[int, Judgement] = {}
    fewest, most = first or balancer.verdict_draws[0], most or balancer.verdict_draws[1]
    left, count, more = list(range(len(settings))), 0, min(fewest, most)
    while left and count < most:
        if progress is not None:
            progress(f"{count} of at most {most} drawn devices")
        draws = Draws.block(start + count, more, whole=whole, until=until)
        ran = balancer.run_all([settings[i] for i in left], draws, further=further)
        for place, outcomes in zip(left, ran, strict=True):
            before = done.get(place)
            ended = judgement(place, outcomes)
            done[place] = before.joined(ended) if before else ended
        left, count = [i for i in left if done[i].verdict == OPEN], count + more
        more = min(count, most - count)
    return tuple(done[i] for i in range(len(settings)))


def _proportion(met: BoolArray) -> Proportion:
    return Proportion(count=int(np.count_nonzero(met)), of=met.size)
