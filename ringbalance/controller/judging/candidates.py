"""Candidates of a search for settings, and their comparison."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

from ringbalance.controller.balancer import Outcomes, Settings
from ringbalance.controller.judging.judge import Judgement
from ringbalance.controller.trials import Indices, Trials
from ringbalance.results.requirements import MET, MISSED, OPEN, Paired
from ringbalance.scene.arrays import BoolArray

DEVICES: Final = 32
"""Number of devices on which settings are chosen."""
_BEHIND: Final = 0.2
"""Significance level of the paired test that drops settings worse than the best before the next heat."""
_MORE: Final = 2 / DEVICES
"""Fraction of the devices that another kind of controller must serve beyond the scene's to replace it."""
_AS_FAST: Final = 1.3
"""Ratio of settling times up to which two settings count as equally fast."""
_SETTLED: Final = 0.9
"""Fraction of the served devices whose settling time decides between settings that serve as many."""
_CHANCE: Final = 0.05
"""Significance level of the paired test by which settings replace others that meet what is required."""
_WORST_FIRST: Final = (MISSED, OPEN, MET)


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchPoint:
    """Candidate settings of a balancer: a level on each axis of its trials."""

    trials: Trials
    places: Indices
    level: float | None
    """Level on the scan axis; None: the scene's."""

    @cached_property
    def settings(self) -> Settings | None:
        """Settings by path; None: there are none at this point."""
        return self.trials.at(self.places, self.level)

    @property
    def key(self) -> tuple[str, Indices, float | None]:
        """Hashable name of this point."""
        return self.trials.kind, self.places, self.level

    def neighbours(self) -> list[SearchPoint]:
        """Candidates one level away on one axis."""
        return [replace(self, places=each) for each in self.trials.neighbours(self.places)]

    def is_beside(self, other: SearchPoint) -> bool:
        """True if both are at most one level apart on every axis."""
        alike = self.trials.kind == other.trials.kind and self.level == other.level
        return alike and all(abs(a - b) <= 1 for a, b in zip(self.places, other.places, strict=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class Tried:
    """A candidate and its judgement."""

    candidate: SearchPoint
    judgement: Judgement

    @property
    def count(self) -> int:
        """Number of devices that meet every demand."""
        return self.judgement.fraction.count

    @property
    def fraction(self) -> float:
        """Fraction of the devices that meet every demand."""
        return self.judgement.fraction.value

    def joined(self, outcomes: Outcomes) -> Tried:
        """Add the outcomes of further devices."""
        return replace(self, judgement=self.judgement.extended(outcomes))

    def replaces(self, scenes: Tried) -> bool:
        """True if this candidate replaces the best of the scene's kind of controller.

        It must serve `_MORE` more of the devices; or, where the scene does not give its kind, no fewer and be
        `_AS_FAST` times as fast.
        """
        # Compared by fractions: a kind that serves no device has run on fewer.
        more, share = self.fraction - scenes.fraction, _SETTLED * scenes.fraction
        faster = _AS_FAST * self.judgement.time(share) < scenes.judgement.time(share)
        return more >= _MORE or (more >= 0 and faster and not scenes.candidate.trials.kind_stated)


def chosen(tried: Iterable[Tried]) -> Tried | None:
    """The candidate that serves most devices; among equals a fast one, with most good ones beside it."""
    every = list(tried)
    most = max((each.count for each in every), default=0)
    if most == 0:
        return every[0] if every else None
    best = [each for each in every if each.count == most]
    share = _SETTLED * best[0].fraction
    fastest = min(each.judgement.time(share) for each in best)
    plateau = [
        each
        for each in every
        if each.count >= most - 1 and each.judgement.time(share) <= _AS_FAST**2 * fastest
    ]
    fast = [each for each in best if each.judgement.time(share) <= _AS_FAST * fastest]
    return max(
        fast,
        key=lambda each: (
            sum(each.candidate.is_beside(other.candidate) for other in plateau),
            -each.judgement.time(share),
        ),
    )


def supersedes(judgement: Judgement, incumbent: Judgement) -> bool:
    """True if settings replace those that stand unless others are better, both judged on the same devices.

    They must have the better verdict; else serve more devices, beyond chance where the others meet what is
    required, or there no fewer, `_AS_FAST` times as fast.
    """
    ranks = [_WORST_FIRST.index(each.verdict) for each in (judgement, incumbent)]
    if ranks[0] != ranks[1]:
        return ranks[0] > ranks[1]
    # An undecided verdict has run on more devices.
    count = min(judgement.meets.size, incumbent.meets.size)
    pairs = Paired.of(judgement.meets[:count], incumbent.meets[:count])
    more, share = pairs.first_alone - pairs.second_alone, _SETTLED * incumbent.fraction.value
    if incumbent.verdict != MET:
        return more > 0
    return pairs.better(_CHANCE) == 0 or (
        more >= 0 and _AS_FAST * judgement.time(share) < incumbent.time(share)
    )


def is_worse(each: Tried, best: BoolArray) -> bool:
    """True if it serves significantly fewer of the same devices than the best does."""
    return Paired.of(best, each.judgement.meets).better(_BEHIND) == 0


def is_decided(tried: Iterable[Tried]) -> bool:
    """True if all but the best are significantly worse than it."""
    best = sorted(tried, key=lambda each: -each.fraction)
    return all(is_worse(each, best[0].judgement.meets) for each in best[1:])
