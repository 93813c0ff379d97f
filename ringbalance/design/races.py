"""All designs of a space that raced, the surface through them, and points about the best of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.controller.judging.judge import MOST_DRAWS
from ringbalance.controller.trials import Trials
from ringbalance.design.axes import Point
from ringbalance.design.racing import DEVICES, Place, Race, near, race
from ringbalance.design.space import Space
from ringbalance.design.static import Record, reach_of, static_rows
from ringbalance.design.surface import Surface
from ringbalance.results.requirements import MET, Proportion
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.processes import dealt

Told = Callable[[str], None]

_TOGETHER: Final = 256
_BLOCKS: Final = 8
"""Blocks of devices over which designs are spread: what one block has by chance does not lead the search."""
_PARENTS: Final = 6
_BESIDE: Final = 2
"""Settings that race beside those of the parent."""
_SWITCH: Final = 0.1
"""Probability that a step takes another entry of a list, such as a valve."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A point that raced."""

    shares: FloatArray
    """Its place in the unit cube."""
    reach: float
    """Unbalance that it cancels in any direction, of what is needed."""
    point: Point
    size: float
    """m^3."""
    race: Race


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Designs that can work."""

    shares: FloatArray
    """Places in the unit cube, shape (n, axes)."""
    points: list[Point]
    reach: FloatArray
    """Unbalance that each cancels in any direction, of what is needed, shape (n,)."""

    def some(self, places: Sequence[int]) -> Points:
        """Choose some of them by number."""
        chosen = np.asarray(places, dtype=np.intp)
        points = [self.points[i] for i in chosen.tolist()]
        return Points(shares=self.shares[chosen], points=points, reach=self.reach[chosen])


def threshold(asked: float) -> float:
    """Least fraction of the devices of a verdict whose lower 95 % bound is the fraction asked for."""
    count = math.ceil(asked * MOST_DRAWS)
    while count < MOST_DRAWS and Proportion(count=count, of=MOST_DRAWS).verdict(asked) != MET:
        count += 1
    return count / MOST_DRAWS


def deal(executor: Executor | None, calls: Sequence[Callable[[], Any]]) -> list[Any]:
    """Their answers, in their order. Args: `executor`: who computes; None: this process."""
    if executor is None:
        return [call() for call in calls]
    answers = dict(dealt(executor, calls))
    return [answers[place] for place in range(len(calls))]


@dataclass(kw_only=True)
class Races:
    """State that the steps of a search share."""

    space: Space
    needed: float
    """Unbalance that is to be cancelled, kg m."""
    least: float
    """Part of it that a design must cancel before it runs: its devices differ."""
    threshold: float
    """Fraction of the devices from which on a design counts as one that meets what is required."""
    executor: Executor | None
    told: Told
    trials: Sequence[Trials]
    random: np.random.Generator
    wide: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """Places in the unit cube that can work, of the first sample."""
    candidates: list[Candidate] = field(default_factory=list)
    raced: set[str] = field(default_factory=set)
    fitted: Surface | None = None
    """The surface through the counts of all candidates; None: one came since, or none is fitted."""

    def answered(self, points: Sequence[Point]) -> list[Record]:
        """Answer points without a run."""
        batches = [points[start : start + _TOGETHER] for start in range(0, len(points), _TOGETHER)]
        calls = [partial(static_rows, self.space.scene, each, intervals=False) for each in batches]
        return [row for part in deal(self.executor, calls) for row in part or ()]

    def able(self, shares: FloatArray, rows: Sequence[Record] | None = None) -> Points:
        """Keep the places in the unit cube that can work. Args: `rows`: their answers without a run."""
        points = self.space.points(shares)
        rows = self.answered(points) if rows is None else rows
        reach = [(reach_of(row) or 0.0) * (row["status"] == "ok") / self.needed for row in rows]
        chosen = [i for i, each in enumerate(reach) if each >= self.least]
        return Points(
            shares=shares[chosen], points=[points[i] for i in chosen], reach=np.array(reach)[chosen]
        )

    def race(self, points: Points, places: Sequence[Sequence[Place] | None]) -> None:
        """Race points that have not yet, and keep those that have an answer."""
        keys = [repr(sorted(point.items())) for point in points.points]
        fresh = [i for i, key in enumerate(keys) if key not in self.raced and key not in keys[:i]]
        calls = [
            partial(
                race,
                self.space.hasty,
                points.points[i],
                places=places[i],
                asked=self.threshold,
                settings=not self.space.sets_controller,
                block=(len(self.raced) + number) % _BLOCKS,
            )
            for number, i in enumerate(fresh)
        ]
        self.raced |= set(keys)
        for i, raced in zip(fresh, deal(self.executor, calls), strict=True):
            if raced is not None:
                self.add(points, i, raced)

    def add(self, points: Points, number: int, race: Race) -> Candidate:
        """Add one of some points with its race to the candidates."""
        self.fitted = None
        self.candidates.append(
            Candidate(
                shares=points.shares[number],
                reach=float(points.reach[number]),
                point=points.points[number],
                size=self.space.size(points.points[number]),
                race=race,
            )
        )
        return self.candidates[-1]

    @property
    def points(self) -> Points:
        """Points that raced."""
        return Points(
            shares=np.array([each.shares for each in self.candidates]),
            points=[each.point for each in self.candidates],
            reach=np.array([each.reach for each in self.candidates]),
        )

    def coordinates(self, points: Points) -> FloatArray:
        """Coordinates of the surface: places in the unit cube, and the unbalance that a design cancels, on
        which the fraction depends more simply than on all that it follows from."""
        return np.column_stack([self.space.coordinates(points.shares), np.log(points.reach)])

    def surface(self) -> Surface:
        """Through the counts of all designs."""
        if self.fitted is None:
            self.fitted = Surface.of(
                self.coordinates(self.points),
                met=np.array([each.race.met for each in self.candidates]),
                devices=np.array([each.race.meets.size for each in self.candidates]),
            )
        return self.fitted

    @property
    def _well_known(self) -> list[Candidate]:
        """Candidates that ran many devices; all, where none has."""
        return [each for each in self.candidates if each.race.meets.size >= DEVICES] or self.candidates

    def nearest_places(self, shares: FloatArray) -> list[Place | None]:
        """By point the settings of the nearest design that ran many devices."""
        whole = self._well_known
        known = self.space.coordinates(np.array([each.shares for each in whole]))
        apart = np.linalg.norm(self.space.coordinates(shares)[:, np.newaxis] - known, axis=2)
        return [whole[at].race.place for at in np.argmin(apart, axis=1).tolist()]

    def places(self, shares: FloatArray) -> list[list[Place] | None]:
        """Settings to race for each point: those of the nearest design and a few beside them."""
        fields: list[list[Place] | None] = []
        for place in self.nearest_places(shares):
            if place is None:
                fields.append(None)
                continue
            neighbours = near(self.trials, place)
            chosen = self.random.permutation(len(neighbours))[:_BESIDE].tolist()
            fields.append([place, *(neighbours[at] for at in chosen)])
        return fields

    def parents(self, value: Callable[[Points], FloatArray], size: float) -> FloatArray:
        """Places of those that would be best if they had a size, m^3."""
        whole = self._well_known
        shares = np.array([each.shares for each in whole])
        if self.space.sized:
            shares = np.array([self.space.sized_at(each, size) for each in shares])
        able = self.able(shares)
        if not able.points:
            return shares[np.argsort([-each.race.fraction for each in whole], kind="stable")[:_PARENTS]]
        return able.shares[np.argsort(-value(able), kind="stable")[:_PARENTS]]

    def cloud(self, parents: FloatArray, step: float, sizes: FloatArray, *, anywhere: float = 0.0) -> Points:
        """Points about some places that can work, one for each size.

        Args: `step`: standard deviation in the unit cube. `anywhere`: part of them about any place that can
            work at some size.
        """
        drawn = parents[self.random.integers(0, len(parents), sizes.size)]
        free = self.random.random(sizes.size) < anywhere
        drawn[free] = self.wide[self.random.integers(0, len(self.wide), int(np.count_nonzero(free)))]
        fixed = [number for number, axis in enumerate(self.space.axes) if not axis.ranges]
        shares = np.empty_like(drawn)
        for row, start in zip(shares, drawn, strict=True):
            moved = start + step * self.random.standard_normal(start.size)
            fresh = self.random.random(start.size)
            switch = self.random.random(start.size) < _SWITCH
            moved[fixed] = np.where(switch, fresh, start)[fixed]
            row[:] = np.clip(moved, 0.0, 1.0)
        if self.space.sized:
            pairs = zip(shares, sizes, strict=True)
            shares = np.array([self.space.sized_at(each, size) for each, size in pairs])
        return self.able(shares)
