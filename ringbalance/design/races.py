"""Raced designs of a space, the surface fitted to them, and points about the best of them."""

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
from ringbalance.design.racing import DEVICES, STEP, GridPoint, Race, race
from ringbalance.design.space import Space
from ringbalance.design.static import Record, row_reach, static_rows
from ringbalance.design.surface import Surface
from ringbalance.results.requirements import MET, Proportion
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.processes import dealt

ReportProgress = Callable[[str], None]

PRESSURE: Final = "gas.pressure"
_WEAK_SUPPLY: Final = 0.95
"""Fraction of the gas pressure that a weak supply leaves."""
_PRESSURES: Final = 8
"""Number of pressures tried for the largest reach, first of all, then between the neighbours of the best."""
_POINTS_PER_BATCH: Final = 256
_DEVICE_BLOCKS: Final = 8
"""Number of blocks of devices that designs use in turn, so that chance in one does not bias the search."""
_MAX_PARENTS: Final = 6
_MAX_PARENTS_ALIKE: Final = 2
"""Parents of each combination of the lists' entries, beside the best of all; three times `_MAX_PARENTS` are
the most."""
_NEIGHBOURS_PER_POINT: Final = 2
"""Number of settings that race in addition to those of the nearest design."""
_SWITCH_PROBABILITY: Final = 0.1
"""Probability that a step replaces an entry of a list, such as a valve."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WorkablePoint:
    """Point of the space that can work according to its values without a run."""

    shares: FloatArray
    """Coordinates in the unit cube."""
    reach: float
    """Ratio of the unbalance that it cancels in any direction to the needed one."""
    weak_reach: float
    """Ratio of both with a weak supply; less than `reach` where liquid then stalls."""
    point: Point
    size: float
    """Volume of the cylinder around the chambers, m^3."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RacedDesign(WorkablePoint):
    """Design with the result of its race."""

    race: Race


def threshold(required_fraction: float) -> float:
    """Smallest fraction of a verdict's devices whose lower 95 % bound reaches the required fraction."""
    count = math.ceil(required_fraction * MOST_DRAWS)
    while count < MOST_DRAWS and Proportion(count=count, of=MOST_DRAWS).verdict(required_fraction) != MET:
        count += 1
    return count / MOST_DRAWS


def deal(executor: Executor | None, calls: Sequence[Callable[[], Any]]) -> list[Any]:
    """Results of calls, in their order. Args: `executor`: any executor; None: this process."""
    if executor is None:
        return [call() for call in calls]
    answers = dict(dealt(executor, calls))
    return [answers[number] for number in range(len(calls))]


@dataclass(kw_only=True)
class Races:
    """State of a search, shared by its steps."""

    space: Space
    needed: float
    """Unbalance to be cancelled, kg m."""
    least: float
    """Fraction of `needed` that a nominal design must cancel to be run; devices scatter about it."""
    threshold: float
    """Smallest fraction of the devices with which a design counts as meeting the requirements."""
    executor: Executor | None
    report_progress: ReportProgress
    trials: Sequence[Trials]
    random: np.random.Generator
    wide: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """Coordinates in the unit cube of the first sample's points that can work."""
    candidates: list[RacedDesign] = field(default_factory=list)
    raced: set[str] = field(default_factory=set)
    fitted: Surface | None = None
    """Surface fitted to the counts of all candidates; None: not fitted since the last candidate was added."""

    def answered(self, points: Sequence[Point]) -> list[Record]:
        """Rows of points without a run."""
        batches = [
            points[start : start + _POINTS_PER_BATCH] for start in range(0, len(points), _POINTS_PER_BATCH)
        ]
        calls = [partial(static_rows, self.space.scene, each, intervals=False) for each in batches]
        return [row for part in deal(self.executor, calls) for row in part or ()]

    def able(self, shares: FloatArray, rows: Sequence[Record] | None = None) -> list[WorkablePoint]:
        """Points that can work. Args: `shares`: coordinates in the unit cube. `rows`: rows without a run."""
        points = self.space.points(shares)
        reaches = self._reaches(self.answered(points) if rows is None else rows)
        able = np.flatnonzero(reaches >= self.least).tolist()
        weak_reaches = self._weak_reaches([points[i] for i in able]).tolist()
        return [
            WorkablePoint(
                shares=shares[i],
                reach=float(reaches[i]),
                weak_reach=weak_reach,
                point=points[i],
                size=self.space.size(points[i]),
            )
            for i, weak_reach in zip(able, weak_reaches, strict=True)
        ]

    def _reaches(self, rows: Sequence[Record]) -> FloatArray:
        """Unbalance that designs cancel, relative to the needed one, from rows without a run."""
        return np.array([(row_reach(row) or 0.0) * (row["status"] == "ok") / self.needed for row in rows])

    def at_best_pressure(self, shares: FloatArray) -> FloatArray:
        """Coordinates in the unit cube with the pressure at which the reach with a weak supply is largest."""
        at = next((i for i, axis in enumerate(self.space.axes) if PRESSURE in axis.ranges), None)
        if at is None or not len(shares):
            return shares
        best = shares.copy()
        low, high = np.zeros(len(shares)), np.ones(len(shares))
        for _ in range(2):
            tried = np.linspace(low, high, _PRESSURES)
            some = np.repeat(shares[np.newaxis], _PRESSURES, axis=0)
            some[:, :, at] = tried
            weak = self._weak_reaches(self.space.points(some.reshape(-1, shares.shape[1])))
            top = np.argmax(weak.reshape(tried.shape), axis=0)
            each = np.arange(len(shares))
            best[:, at] = tried[top, each]
            low = tried[np.maximum(top - 1, 0), each]
            high = tried[np.minimum(top + 1, _PRESSURES - 1), each]
        return best

    def _weak_reaches(self, points: Sequence[Point]) -> FloatArray:
        supply = self.space.scene.gas.pressure
        weak = [{**each, PRESSURE: _WEAK_SUPPLY * float(each.get(PRESSURE, supply))} for each in points]
        return self._reaches(self.answered(weak))

    def race(
        self, points: Sequence[WorkablePoint], grid_points: Sequence[Sequence[GridPoint] | None]
    ) -> None:
        """Race points that have not raced yet, and add those with a result to the candidates."""
        keys = [repr(sorted(each.point.items())) for each in points]
        fresh = [i for i, key in enumerate(keys) if key not in self.raced and key not in keys[:i]]
        calls = [
            partial(
                race,
                self.space.hasty,
                points[i].point,
                grid_points=grid_points[i],
                required_fraction=self.threshold,
                settings=not self.space.sets_controller,
                block=(len(self.raced) + number) % _DEVICE_BLOCKS,
            )
            for number, i in enumerate(fresh)
        ]
        self.raced |= set(keys)
        for i, raced in zip(fresh, deal(self.executor, calls), strict=True):
            if raced is not None:
                self.add(points[i], raced)

    def add(self, point: WorkablePoint, race: Race) -> RacedDesign:
        """Add a point with its race to the candidates."""
        self.fitted = None
        self.candidates.append(RacedDesign(**{**vars(point), "race": race}))
        return self.candidates[-1]

    def coordinates(self, points: Sequence[WorkablePoint]) -> FloatArray:
        """Coordinates of the surface: those in the unit cube, the logarithm of the reach, and the reach with
        a weak supply.

        The fraction depends more simply on what a design cancels than on the keys behind it.  The smallest
        discs have the least pressure at which no liquid stalls: there the fraction of devices, whose
        pressures scatter, drops within a few per cent of the pressure, and so does the reach with a weak one.
        """
        shares = np.array([each.shares for each in points]).reshape(len(points), len(self.space.axes))
        reach = [np.log([each.reach for each in points]), np.array([each.weak_reach for each in points])]
        return np.column_stack([self.space.coordinates(shares), *reach])

    def surface(self) -> Surface:
        """Surface fitted to the counts of all candidates."""
        if self.fitted is None:
            self.fitted = Surface.of(
                self.coordinates(self.candidates),
                met=np.array([each.race.judgement.fraction.count for each in self.candidates]),
                devices=np.array([each.race.judgement.meets.size for each in self.candidates]),
            )
        return self.fitted

    @property
    def _well_known(self) -> list[RacedDesign]:
        """Candidates that ran at least `DEVICES` devices; all candidates if there are none."""
        return [
            each for each in self.candidates if each.race.judgement.meets.size >= DEVICES
        ] or self.candidates

    def nearest_grid_points(self, points: Sequence[WorkablePoint]) -> list[GridPoint | None]:
        """Settings of the nearest design that ran many devices, for each point."""
        measured = self._well_known
        fresh, raced = (
            self.space.coordinates(np.array([each.shares for each in some])) for some in (points, measured)
        )
        distance = np.linalg.norm(fresh[:, np.newaxis] - raced, axis=2)
        return [measured[i].race.grid_point for i in np.argmin(distance, axis=1).tolist()]

    def grid_points(self, points: Sequence[WorkablePoint]) -> list[list[GridPoint] | None]:
        """Settings to race for each point: those of the nearest design and a few neighbours."""
        fields: list[list[GridPoint] | None] = []
        for grid_point in self.nearest_grid_points(points):
            if grid_point is None:
                fields.append(None)
                continue
            kind, indices = grid_point
            neighbours = self.trials[kind].neighbours(indices, STEP)
            chosen = self.random.permutation(len(neighbours))[:_NEIGHBOURS_PER_POINT].tolist()
            fields.append([grid_point, *((kind, neighbours[i]) for i in chosen)])
        return fields

    def parents(self, value: Callable[[Sequence[WorkablePoint]], FloatArray], size: float) -> FloatArray:
        """Coordinates in the unit cube of the best designs, rescaled to a size, m^3, if it varies; each also
        with the pressure at which it cancels most.
        """
        measured = self._well_known
        shares = np.array([each.shares for each in measured])
        if self.space.sized:
            shares = np.array([self.space.sized_at(each, size) for each in shares])
        able = self.able(shares)
        if able:
            shares, values = np.array([each.shares for each in able]), value(able)
        else:
            values = np.array([each.race.judgement.fraction.value for each in measured])
        order = np.argsort(-values, kind="stable")
        numbers = self.space.combinations(shares[order])
        alike = [np.flatnonzero(numbers == number)[:_MAX_PARENTS_ALIKE] for number in np.unique(numbers)]
        chosen = np.unique([*range(min(_MAX_PARENTS, order.size)), *np.concatenate(alike)])
        best = shares[order[chosen[: 3 * _MAX_PARENTS]]]
        return np.concatenate([best, self.at_best_pressure(best)])

    def cloud(
        self, parents: FloatArray, step: float, sizes: FloatArray, *, anywhere: float = 0.0
    ) -> list[WorkablePoint]:
        """Draw points about parents, one for each size, and keep those that can work.

        Args: `step`: standard deviation in the unit cube. `anywhere`: fraction of points drawn about a random
            workable point of the first sample, not about a parent.
        """
        centres = parents[self.random.integers(0, len(parents), sizes.size)]
        free = self.random.random(sizes.size) < anywhere
        centres[free] = self.wide[self.random.integers(0, len(self.wide), int(np.count_nonzero(free)))]
        fixed = [number for number, axis in enumerate(self.space.axes) if not axis.ranges]
        shares = np.empty_like(centres)
        for row, start in zip(shares, centres, strict=True):
            moved = start + step * self.random.standard_normal(start.size)
            fresh = self.random.random(start.size)
            switch = self.random.random(start.size) < _SWITCH_PROBABILITY
            moved[fixed] = np.where(switch, fresh, start)[fixed]
            row[:] = np.clip(moved, 0.0, 1.0)
        if self.space.sized:
            pairs = zip(shares, sizes, strict=True)
            shares = np.array([self.space.sized_at(each, size) for each, size in pairs])
        return self.able(shares)
