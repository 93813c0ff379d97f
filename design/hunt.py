"""The search for a design: points of a Sobol sequence, those that can work without a run, races of a few
drawn devices, then points about the best, closer and closer.

Smallest is the volume of the cylinder around the chambers; where the disc's size does not vary, or differs by
less than `AS_SMALL`, the gas that is used decides.  Everything is counted and nothing timed, so that the same
scene gives the same design on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import Any, Final

import numpy as np
from scipy.interpolate import RBFInterpolator

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.trials import Trials
from ringbalance.design.axes import Axis, Point, Range
from ringbalance.design.racing import BLOCK, DEVICES, SURE, Place, Race, near, race, raced_longer
from ringbalance.design.space import Space
from ringbalance.design.static import Record, static_rows
from ringbalance.results.requirements import MET, Proportion
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.registry import registered

Told = Callable[[str], None]

AS_SMALL: Final = 0.01
"""Relative difference in size up to which two designs count as equally small."""
POINTS: Final = 2048
"""Of the Sobol sequence."""
_WHOLE: Final = 256
"""Points up to which a space of lists is tried whole."""
_TOGETHER: Final = 256
_SMALLEST, _SPREAD = 18, 18
"""Of the points that can work: the smallest, and as many over all sizes, that race at first."""
_ROUNDS: Final = 9
_CHILDREN: Final = 17
"""Points that race in a round."""
_TRIED: Final = 16
"""Drawn for each of them: of those that can work the one races that promises most."""
_SMOOTHING: Final = 0.01
"""Of the surface through the fractions of designs that raced."""
_PARENTS: Final = 5
_ROOM: Final = 1.06
"""Times the smallest size: of these, the designs that serve most devices have room to become smaller."""
_SURE: Final = 2
"""Times in a round that the two smallest designs are run as more devices."""
_STEP: Final = 0.15
"""Standard deviation of the first steps in the unit cube."""
_SHRINK: Final = 0.85
"""Times the smallest size: that of the first points about the best ones."""
_SLOWER, _FASTER = 0.6, 1.3
"""Factors of the steps and of the shrinking after a round without a better design, and with one."""
_LIKE: Final = 16
"""Designs that say which devices run first in a round."""
_BESIDE: Final = 1
"""Settings that race beside those of the parent."""
_SWITCH: Final = 0.2
"""Probability that a step takes another entry of a list, such as a valve."""
_MOST: Final = 1024
"""Devices of a verdict."""
_REACH: Final = 0.9
"""Of the initial unbalance, that a design must be able to cancel before it runs: its devices differ."""
_REACH_ONE_WAY: Final = 0.6
"""The same where the unbalance lies in one direction: pairs of chambers at right angles cancel up to
1.41 times as much there as in every direction."""
_EVERY_WAY: Final = 3.0
"""rad to both sides, from which on it lies in any direction."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A point that raced."""

    shares: FloatArray
    """Its place in the unit cube."""
    point: Point
    size: float
    """m^3."""
    race: Race


@dataclass(frozen=True, kw_only=True, eq=False)
class Static:
    """What the points of the first sample come to without a run."""

    points: int
    refused: int
    """By the checks of a scene."""
    blocked: int
    """In which nothing flows."""
    able: int
    """That can work."""
    reach: float
    """Largest unbalance that one of them cancels in any direction, kg m; NaN: none flows."""
    reach_point: Point
    """That one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Hunt:
    """All that raced."""

    static: Static
    candidates: tuple[Candidate, ...]
    whole: bool
    """Whether every design that can work did."""
    threshold: float
    """Fraction of few devices from which on a design counts as one that meets what is required."""

    @property
    def passing(self) -> list[Candidate]:
        """The best first."""
        return _passing(self.candidates, self.threshold)

    def near_misses(self, count: int) -> list[Candidate]:
        """Smaller than all that pass, those that serve most devices; smallest first.

        None where rounds have looked about the smallest that passes.
        """
        if self.passing and not self.whole:
            return []
        limit = min((each.size for each in self.passing), default=math.inf)
        near = _nearest(each for each in self.candidates if each.size < limit)[:count]
        return sorted(near, key=lambda each: each.size)


def _passing(candidates: Iterable[Candidate], threshold: float) -> list[Candidate]:
    """Smallest first, of those as small as the smallest by the gas that they use."""
    met = [each for each in candidates if each.race.meets.size >= DEVICES and each.race.fraction >= threshold]
    rows = sorted(met, key=lambda each: (each.size, each.race.gas))
    small = [each for each in rows if each.size <= (1 + AS_SMALL) * rows[0].size]
    return [*sorted(small, key=lambda each: each.race.gas), *rows[len(small) :]]


def _nearest(candidates: Iterable[Candidate]) -> list[Candidate]:
    return sorted(candidates, key=lambda each: (-_served(each), each.race.time(0.5), each.size))


def _served(candidate: Candidate) -> float:
    """Fraction of the devices that meet every demand; one of them is taken for failed: 4 of 4 are worth less
    than 60 of 64."""
    race = candidate.race
    return race.fraction - 1.0 / max(race.meets.size + race.unseen, 1)


def threshold(asked: float) -> float:
    """Least fraction of `_MOST` devices whose lower 95 % bound is the fraction asked for."""
    count = math.ceil(asked * _MOST)
    while count < _MOST and Proportion(count=count, of=_MOST).verdict(asked) != MET:
        count += 1
    return count / _MOST


def deal(executor: Executor | None, calls: Sequence[Callable[[], Any]]) -> list[Any]:
    """Their answers, in their order. Args: `executor`: who computes; None: this process."""
    if executor is None:
        return [call() for call in calls]
    futures = [executor.submit(call) for call in calls]
    return [each.result() for each in futures]


@dataclass(kw_only=True)
class _State:
    """What the rounds share."""

    space: Space
    needed: float
    """Unbalance that every design must cancel, kg m."""
    asked: float
    executor: Executor | None
    told: Told
    trials: Sequence[Trials]
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    candidates: list[Candidate] = field(default_factory=list)
    raced: set[str] = field(default_factory=set)

    def static(self, points: Sequence[Point]) -> list[Record]:
        batches = [points[start : start + _TOGETHER] for start in range(0, len(points), _TOGETHER)]
        calls = [partial(static_rows, self.space.scene, each, intervals=False) for each in batches]
        return [row for rows in deal(self.executor, calls) for row in rows or ()]

    def able(self, row: Record) -> bool:
        reach = row["values"].get("reach", (None,))[0]
        return row["status"] == "ok" and reach is not None and reach >= self.needed

    def race(
        self, shares: FloatArray, points: Sequence[Point], places: Sequence[Sequence[Place] | None]
    ) -> None:
        """Race points that have not yet, and keep those that have an answer."""
        keys = [repr(sorted(point.items())) for point in points]
        fresh = [i for i, key in enumerate(keys) if key not in self.raced and key not in keys[:i]]
        self.raced |= set(keys)
        blocks = self.hard_blocks()
        calls = [
            partial(
                race,
                self.space.hasty,
                points[i],
                places=places[i],
                asked=threshold(self.asked),
                settings=not self.space.sets_controller,
                blocks=blocks if places[i] else (),
            )
            for i in fresh
        ]
        for i, found in zip(fresh, deal(self.executor, calls), strict=True):
            if found is not None:
                size = self.space.size(points[i])
                self.candidates.append(Candidate(shares=shares[i], point=points[i], size=size, race=found))

    def hard_blocks(self) -> tuple[int, ...]:
        """Blocks of devices, first the one in which most fail in the best designs."""
        whole = [each.race for each in _nearest(self.candidates) if each.race.meets.size >= DEVICES][:_LIKE]
        met = np.zeros(DEVICES // BLOCK)
        for each in whole:
            met += each.in_order()[:DEVICES].reshape(-1, BLOCK).sum(axis=1)
        return tuple(np.argsort(met, kind="stable").tolist())

    def promise(self, shares: FloatArray) -> FloatArray:
        """Fraction of the devices that designs may serve, after those that raced near them."""
        known = np.array([self.coordinates(each.shares) for each in self.candidates])
        served = np.array([_served(each) for each in self.candidates])
        surface = RBFInterpolator(known, served, kernel="linear", smoothing=_SMOOTHING)
        found: FloatArray = surface(np.array([self.coordinates(each) for each in shares]))
        return found

    def coordinates(self, shares: FloatArray) -> FloatArray:
        """Of a place: entries of a list are equally far from each other."""
        parts = [
            share[np.newaxis] if axis.ranges else 0.5 * np.eye(len(axis.choices))[_entry(axis, share)]
            for axis, share in zip(self.space.axes, shares, strict=True)
        ]
        return np.concatenate(parts)

    def places(self, parent: Candidate) -> list[Place] | None:
        """The settings of a parent, and others beside them."""
        place = parent.race.place
        if place is None:
            return None
        beside = near(self.trials, place)
        chosen = self.random.permutation(len(beside))[:_BESIDE].tolist()
        return [place, *(beside[at] for at in chosen)]

    def make_sure(self) -> None:
        """Run the smallest designs that pass as more devices, until one of them still does."""
        for _ in range(_SURE):
            unsure = [each for each in self.passing[:2] if each.race.meets.size < SURE]
            if not unsure or self.passing[0] not in unsure:
                return
            calls = [
                partial(
                    raced_longer,
                    self.space.hasty,
                    each.point,
                    before=each.race,
                    asked=threshold(self.asked),
                )
                for each in unsure
            ]
            for each, found in zip(unsure, deal(self.executor, calls), strict=True):
                self.candidates[self.candidates.index(each)] = replace(each, race=found)

    @property
    def passing(self) -> list[Candidate]:
        return _passing(self.candidates, threshold(self.asked))

    @property
    def best(self) -> tuple[float, float]:
        """Size and gas of the best that passes; before any does, minus the most devices that one serves."""
        for each in self.passing[:1]:
            return each.size, each.race.gas
        return math.inf, -_served(_nearest(self.candidates)[0])

    def parents(self) -> list[Candidate]:
        """Of the smallest designs those that serve most devices, and smaller ones that come near."""
        passing = self.passing
        nearest = _nearest(self.candidates)
        if not passing or not self.space.sized:
            return (passing or nearest)[:_PARENTS]
        roomy = _nearest(each for each in passing if each.size <= _ROOM * passing[0].size)
        smaller = [each for each in nearest if each.size < passing[0].size]
        return [*roomy[:_PARENTS], *smaller[:2]]


def hunt(space: Space, *, asked: float, needed: float, executor: Executor | None, told: Told) -> Hunt:
    """Search a space.

    Args: `asked`: fraction of devices. `needed`: initial unbalance, kg m. `executor`: who computes; None:
        this process.
    """
    one_way = space.scene.requirement.phase_range < _EVERY_WAY
    share = _REACH_ONE_WAY if one_way else _REACH
    trials = balancer_of(space.scene).trials()
    state = _State(
        space=space, needed=share * needed, asked=asked, executor=executor, told=told, trials=trials
    )
    static, whole = _first(state)
    step, shrink = _STEP, _SHRINK
    for number in range(_ROUNDS if state.candidates and not whole else 0):
        told(f"round {number + 1} of at most {_ROUNDS}, {_best_text(state)}")
        before = state.best
        _round(state, step, shrink)
        state.make_sure()
        factor = _SLOWER if state.best >= before else _FASTER
        step, shrink = min(factor * step, _STEP), 1 - min(factor * (1 - shrink), 1 - _SHRINK)
        if 1 - shrink < AS_SMALL:
            break
    return Hunt(static=static, whole=whole, candidates=tuple(state.candidates), threshold=threshold(asked))


def _best_text(state: _State) -> str:
    if state.passing:
        return f"best {1e6 * state.passing[0].size:.4g} ml"
    return f"best {_nearest(state.candidates)[0].race.fraction:.0%} of few devices"


def _first(state: _State) -> tuple[Static, bool]:
    """The whole space: static answers of every point, and races of some that can work; whether of all."""
    space = state.space
    shares, whole = _sample(space)
    state.told(f"{len(shares)} designs without a run")
    points = space.points(shares)
    rows = state.static(points)
    able = sorted((i for i, row in enumerate(rows) if state.able(row)), key=lambda i: space.size(points[i]))
    rest = able[_SMALLEST:]
    spread = [rest[at] for at in np.linspace(0, len(rest) - 1, min(_SPREAD, len(rest))).astype(int)]
    chosen = able if whole else able[:_SMALLEST] + spread
    state.told(f"{len(chosen)} of {len(able)} designs that can work, few devices each")
    state.race(shares[chosen], [points[i] for i in chosen], [None] * len(chosen))
    state.make_sure()
    return _static(points, rows, len(able)), whole


def _sample(space: Space) -> tuple[FloatArray, bool]:
    """Places of the first points; and whether these are all that there are."""
    counts = [len(axis.choices) for axis in space.axes]
    if all(counts) and math.prod(counts) <= _WHOLE:
        levels = [(np.arange(count) + 0.5) / count for count in counts]
        return np.array(list(product(*levels))), True
    shares: FloatArray = registered("function", "sobol")(len(space.axes), POINTS)
    return shares, False


def _static(points: Sequence[Point], rows: Sequence[Record], able: int) -> Static:
    reach = [(row["values"].get("reach", (None,))[0] or 0.0) * (row["status"] == "ok") for row in rows]
    best = int(np.argmax(reach))
    return Static(
        points=len(points),
        refused=sum(not row["sha256"] for row in rows),
        blocked=sum(row["status"] == "blocked" for row in rows),
        able=able,
        reach=reach[best] or math.nan,
        reach_point=points[best],
    )


def _round(state: _State, step: float, shrink: float) -> None:
    """Points about the best ones; on average smaller by a factor than the smallest that passes."""
    space, parents = state.space, state.parents()
    most = state.best[0] if space.sized else math.inf
    drawn = state.random.integers(0, len(parents), _CHILDREN * _TRIED).tolist()
    shares = np.array([_stepped(state, parents[at].shares, step) for at in drawn])
    if math.isfinite(most):
        sizes = np.repeat(most * (1 - 2 * (1 - shrink) * state.random.random(_CHILDREN)), _TRIED)
        shares = np.array([_sized(space, each, size) for each, size in zip(shares, sizes, strict=True)])
    points = space.points(shares)
    able = [
        state.able(row) and space.size(point) < most
        for row, point in zip(state.static(points), points, strict=True)
    ]
    promise = np.where(able, state.promise(shares), -math.inf).reshape(_CHILDREN, _TRIED)
    chosen = [
        child * _TRIED + int(np.argmax(row)) for child, row in enumerate(promise) if np.isfinite(row.max())
    ]
    if chosen:
        places = [state.places(parents[drawn[i]]) for i in chosen]
        state.race(shares[chosen], [points[i] for i in chosen], places)


def _stepped(state: _State, shares: FloatArray, step: float) -> FloatArray:
    moved = shares + step * state.random.standard_normal(shares.size)
    fresh = state.random.random(shares.size)
    switch = state.random.random(shares.size) < _SWITCH
    for place, axis in enumerate(state.space.axes):
        if not axis.ranges:
            moved[place] = fresh[place] if switch[place] else shares[place]
    return np.clip(moved, 0.0, 1.0)


def _sized(space: Space, shares: FloatArray, target: float) -> FloatArray:
    """A place with a design of a size, by its width where that varies, else by its outer radius."""
    for place, axis in enumerate(space.axes):
        for path, power in (("disc.axial_width", 1.0), ("disc.outer_radius", 0.5)):
            if path in axis.ranges and (power == 1.0 or "disc.axial_width" not in space.paths):
                (point,) = space.points(shares[np.newaxis])
                wanted = float(point[path]) * (target / space.size(point)) ** power
                shares[place] = _share_of(axis.ranges[path], wanted)
    return shares


def _entry(axis: Axis, share: float) -> int:
    return min(int(share * len(axis.choices)), len(axis.choices) - 1)


def _share_of(wanted: Range, value: float) -> float:
    low, high, value = (math.log(each) if wanted.log else each for each in (wanted.low, wanted.high, value))
    return min(max((value - low) / (high - low), 0.0), 1.0)
