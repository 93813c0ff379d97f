"""The search for a design: points of a Sobol sequence, those that can work without a run, races of a few
drawn devices, then points about the best, closer and closer, led by a surface through the counts of all.

Smallest is the volume of the cylinder around the chambers; where the disc's size does not vary, or differs by
less than `AS_SMALL`, the gas that is used decides.  Everything is counted and nothing timed, so that the same
scene gives the same design on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from typing import Any, Final

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.special import expit, logit

from ringbalance.controller.balancer import Settings, balancer_of
from ringbalance.controller.trials import Trials
from ringbalance.design.axes import Point
from ringbalance.design.racing import DEVICES, Place, Race, near, race, tuned_settings
from ringbalance.design.space import Space
from ringbalance.design.static import Record, reach_of, static_rows
from ringbalance.design.surface import Surface
from ringbalance.results.requirements import MET, Proportion
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.registry import registered

Told = Callable[[str], None]

AS_SMALL: Final = 0.01
"""Relative difference in size up to which two designs count as equally small."""
POINTS: Final = 2048
"""Of the Sobol sequence."""
_WHOLE: Final = 256
"""Points up to which a space of lists is tried whole."""
_TOGETHER: Final = 256
_SMALLEST, _SPREAD = 12, 14
"""Of the points that can work: the smallest, and as many over all sizes, that race at first."""
_BLOCKS: Final = 8
"""Of devices, over which designs are spread: what one block has by chance does not lead the search."""
_STEPS: Final = (0.15, 0.15, 0.1, 0.08, 0.06, 0.05)
"""Standard deviations of the steps in the unit cube, round by round."""
_SIZES: Final = ((0.6, 1.1), (0.7, 1.15), (0.8, 1.15), (0.85, 1.15), (0.88, 1.12), (0.9, 1.1))
"""Times the size that is looked for: between which points are tried."""
_ANYWHERE: Final = (0.5, 0.3, 0.1, 0.0, 0.0, 0.0)
"""Part of the points that lie anywhere in the unit cube, round by round."""
_CHILDREN: Final = 16
"""Points that race in a round."""
_TRIED: Final = 16
"""Drawn for each of them: of those that can work the one races that promises most."""
_BOLD: Final = 0.5
"""Standard deviations of the surface that are added where a point is chosen to race."""
_NEAR: Final = 0.35
"""Logarithm of the sizes' ratio, standard deviation of the weights by which designs make the surface."""
_PARENTS: Final = 6
_BESIDE: Final = 2
"""Settings that race beside those of the parent."""
_SWITCH: Final = 0.1
"""Probability that a step takes another entry of a list, such as a valve."""
_MOST: Final = 1024
"""Devices of a verdict."""
_FINER: Final = 0.02
"""Relative difference in size between designs that are judged."""
_SIZES_JUDGED: Final = (-8, 13)
"""Of these, from smaller ones than the surface promises to larger ones."""
_CLOUD: Final = 48
"""Points of each such size of which the most promising is judged."""
_SMOOTHING: Final = 0.01
"""Of the surface through the logarithms of the gas."""
_NO_GAS: Final = 1e-6
"""J, which counts as none."""
_FIRST: Final = 1e3
"""Above every logit and logarithm."""
_NEARLY: Final = 0.03
"""Below the fraction of devices that is looked for, from which on the surface may be wrong."""
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
class Finalist:
    """A design that may be judged."""

    point: Point
    size: float
    """m^3."""
    place: Place | None
    """Its settings; None: the scene's own."""
    settings: Settings | None = None
    """Others, that `tune` finds for a design near it."""
    promise: float
    """Fraction of the devices by the surface."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Hunt:
    """All that raced, and what is to be judged."""

    static: Static
    candidates: tuple[Candidate, ...]
    whole: bool
    """Whether every design that can work did."""
    threshold: float
    """Fraction of few devices from which on a design counts as one that meets what is required."""
    finalists: tuple[Finalist, ...] = ()
    """The one to prefer first."""

    @property
    def start(self) -> int:
        """Place of the first finalist that promises to meet what is required; else of the one that comes
        nearest; where their sizes are alike that of the first."""
        if not self.finalists or self.finalists[0].size == self.finalists[-1].size:
            return 0
        promises = [each.promise for each in self.finalists]
        enough = (i for i, promise in enumerate(promises) if promise >= self.threshold)
        return next(enough, int(np.argmax(promises)))


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
    threshold: float
    executor: Executor | None
    told: Told
    trials: Sequence[Trials]
    random: np.random.Generator
    candidates: list[Candidate] = field(default_factory=list)
    raced: set[str] = field(default_factory=set)

    def able(self, points: Sequence[Point]) -> tuple[list[Record], BoolArray]:
        """Static answers, and which points can work."""
        batches = [points[start : start + _TOGETHER] for start in range(0, len(points), _TOGETHER)]
        calls = [partial(static_rows, self.space.scene, each, intervals=False) for each in batches]
        rows = [row for part in deal(self.executor, calls) for row in part or ()]
        reach = [reach_of(row) for row in rows]
        enough = [
            row["status"] == "ok" and most is not None and most >= self.needed
            for row, most in zip(rows, reach, strict=True)
        ]
        return rows, np.array(enough, dtype=np.bool_)

    def race(
        self, shares: FloatArray, points: Sequence[Point], places: Sequence[Sequence[Place] | None]
    ) -> None:
        """Race points that have not yet, and keep those that have an answer."""
        keys = [repr(sorted(point.items())) for point in points]
        fresh = [i for i, key in enumerate(keys) if key not in self.raced and key not in keys[:i]]
        calls = [
            partial(
                race,
                self.space.hasty,
                points[i],
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
                size = self.space.size(points[i])
                self.candidates.append(Candidate(shares=shares[i], point=points[i], size=size, race=raced))

    def surface(self, about: float) -> Surface:
        """Through the counts of all designs, the nearer in size the more."""
        races = [each.race for each in self.candidates]
        apart = np.log([each.size / about for each in self.candidates]) / _NEAR
        return Surface.of(
            self.space.coordinates(np.array([each.shares for each in self.candidates])),
            met=np.array([each.met for each in races]),
            devices=np.array([each.meets.size for each in races]),
            blocks=np.array([each.block for each in races]),
            weights=np.exp(-0.5 * apart**2) + 1e-6,
        )

    def places(self, shares: FloatArray) -> list[list[Place] | None]:
        """By point the settings of the nearest design that served many devices, and others beside them."""
        whole = [each for each in self.candidates if each.race.meets.size == DEVICES] or self.candidates
        known = self.space.coordinates(np.array([each.shares for each in whole]))
        apart = np.linalg.norm(self.space.coordinates(shares)[:, np.newaxis] - known, axis=2)
        return [self._beside(whole[at].race.place) for at in np.argmin(apart, axis=1).tolist()]

    def _beside(self, place: Place | None) -> list[Place] | None:
        if place is None:
            return None
        beside = near(self.trials, place)
        chosen = self.random.permutation(len(beside))[:_BESIDE].tolist()
        return [place, *(beside[at] for at in chosen)]

    def parents(self, surface: Surface, size: float) -> list[Candidate]:
        """Those that would be best if they had a size."""
        shares = np.array([each.shares for each in self.candidates])
        if self.space.sized:
            shares = np.array([self.space.sized_at(each, size) for each in shares])
        places = self.space.coordinates(shares)
        value = surface.logits(places)[0] if self.space.sized else _worth(self, surface, places)
        order = np.argsort(-value, kind="stable").tolist()
        whole = [i for i in order if self.candidates[i].race.meets.size == DEVICES]
        return [self.candidates[i] for i in (whole or order)[:_PARENTS]]

    def cloud(
        self, parents: Sequence[Candidate], step: float, sizes: FloatArray, *, anywhere: float = 0.0
    ) -> tuple[FloatArray, list[Point]]:
        """Points about some designs that can work, one for each size.

        Args: `anywhere`: part of them that lie anywhere.
        """
        drawn = self.random.integers(0, len(parents), sizes.size).tolist()
        shares = np.array([_stepped(self, parents[at].shares, step) for at in drawn])
        free = self.random.random(sizes.size) < anywhere
        shares[free] = self.random.random((int(np.count_nonzero(free)), shares.shape[1]))
        if self.space.sized:
            pairs = zip(shares, sizes, strict=True)
            shares = np.array([self.space.sized_at(each, size) for each, size in pairs])
        points = self.space.points(shares)
        able = np.flatnonzero(self.able(points)[1]).tolist()
        return shares[able], [points[i] for i in able]


def hunt(
    space: Space, *, asked: float, needed: float, executor: Executor | None, told: Told, seed: int = 0
) -> Hunt:
    """Search a space.

    Args: `asked`: fraction of devices. `needed`: initial unbalance, kg m. `executor`: who computes; None:
        this process. `seed`: of the points that are tried.
    """
    one_way = space.scene.requirement.phase_range < _EVERY_WAY
    share = _REACH_ONE_WAY if one_way else _REACH
    state = _State(
        space=space,
        needed=share * needed,
        threshold=threshold(asked),
        executor=executor,
        told=told,
        trials=balancer_of(space.scene).trials(),
        random=np.random.default_rng(seed),
    )
    static, whole = _first(state)
    if not state.candidates:
        return Hunt(static=static, whole=whole, candidates=(), threshold=state.threshold)
    size = _size_at_first(state)
    for number in range(0 if whole else len(_STEPS)):
        told(f"round {number + 1} of {len(_STEPS)}, about {1e6 * size:.4g} ml")
        size = _round(state, size, number)
    finalists = _all(state, size) if whole or not space.sized else _by_size(state, size)
    return Hunt(
        static=static,
        whole=whole,
        candidates=tuple(state.candidates),
        threshold=state.threshold,
        finalists=tuple(finalists),
    )


def _first(state: _State) -> tuple[Static, bool]:
    """The whole space: static answers of every point, and races of some that can work; whether of all."""
    space = state.space
    shares, whole = _sample(space)
    state.told(f"{len(shares)} designs without a run")
    points = space.points(shares)
    rows, enough = state.able(points)
    able = sorted(np.flatnonzero(enough).tolist(), key=lambda i: space.size(points[i]))
    rest = able[_SMALLEST:]
    spread = [rest[at] for at in np.linspace(0, len(rest) - 1, min(_SPREAD, len(rest))).astype(int)]
    chosen = able if whole else able[:_SMALLEST] + spread
    state.told(f"{len(chosen)} of {len(able)} designs that can work, few devices each")
    state.race(shares[chosen], [points[i] for i in chosen], [None] * len(chosen))
    return _static(points, rows, len(able)), whole


def _size_at_first(state: _State) -> float:
    """Of the smallest that serves enough devices; else of the one that serves most."""
    enough = [each.size for each in state.candidates if _served(each) >= state.threshold]
    return min(enough) if enough else max(state.candidates, key=_served).size


def _served(candidate: Candidate) -> float:
    """Fraction of the devices; one of them is taken for failed: 4 of 4 are worth less than 60 of 64."""
    return candidate.race.fraction - 1.0 / max(candidate.race.meets.size, 1)


def _round(state: _State, size: float, number: int) -> float:
    """Race points about the best. Returns: the size from which on they serve enough devices."""
    surface, (low, high) = state.surface(size), _SIZES[number]
    sizes = size * np.exp(np.linspace(math.log(low), math.log(high), _CHILDREN * _TRIED))
    parents = state.parents(surface, size)
    shares, points = state.cloud(parents, _STEPS[number], sizes, anywhere=_ANYWHERE[number])
    if points:
        value = _worth(state, surface, state.space.coordinates(shares))
        slices = np.array_split(np.arange(len(points)), min(_CHILDREN, len(points)))
        chosen = [int(each[np.argmax(value[each])]) for each in slices]
        state.race(shares[chosen], [points[i] for i in chosen], state.places(shares[chosen]))
    surface = state.surface(size)
    shares = np.array([each.shares for each in state.candidates])
    logits, spread = surface.logits(state.space.coordinates(shares))
    able = [
        each.size
        for each, value, doubt in zip(state.candidates, logits, spread, strict=True)
        if value - _BOLD * doubt >= logit(state.threshold)
    ]
    if not able:
        return size * high
    return min(max(min(able), low * size), high * size)


def _worth(state: _State, surface: Surface, places: FloatArray) -> FloatArray:
    """What decides which points race: the fraction of devices, with some of its doubt; of one size, among
    those that may serve enough, the gas."""
    logits, spread = surface.logits(places)
    hoped = np.asarray(logits + _BOLD * spread)
    if state.space.sized:
        return hoped
    known = state.space.coordinates(np.array([each.shares for each in state.candidates]))
    energy = np.log([max(each.race.gas, _NO_GAS) for each in state.candidates])
    gas = RBFInterpolator(known, energy, kernel="linear", smoothing=_SMOOTHING)(places)
    return np.where(hoped >= logit(state.threshold), _FIRST - gas, hoped)


def _by_size(state: _State, size: float) -> list[Finalist]:
    """Of every size, in equal steps, the point that promises most; all with the settings that serve best."""
    state.told("settings of the designs that are judged")
    surface = state.surface(size)
    parents = state.parents(surface, size)
    steps = size * (1 + _FINER) ** np.arange(*_SIZES_JUDGED)
    shares, points = state.cloud(parents, _STEPS[-1], np.repeat(steps, _CLOUD))
    if not points:
        return _all(state, size)
    logits, _ = surface.logits(state.space.coordinates(shares))
    steps_away = np.rint(np.log([state.space.size(each) / size for each in points]) / math.log1p(_FINER))
    best = [
        int(rows[np.argmax(logits[rows])])
        for at in np.unique(steps_away)
        for rows in [np.flatnonzero(steps_away == at)]
    ]
    enough = [i for i in best if logits[i] >= logit(state.threshold)]
    settings = _tuned(state, points[enough[0] if enough else best[-1]])
    places = state.places(shares[best])
    return [
        Finalist(
            point=points[i],
            size=state.space.size(points[i]),
            place=around[0] if around else None,
            settings=settings,
            promise=float(expit(logits[i])),
        )
        for i, around in zip(best, places, strict=True)
    ]


def _tuned(state: _State, point: Point) -> Settings | None:
    """As `tune` finds them; None where the scene sets them."""
    if state.space.sets_controller:
        return None
    (settings,) = deal(state.executor, [partial(tuned_settings, state.space.hasty, point)])
    found: Settings | None = settings
    return found


def _all(state: _State, size: float) -> list[Finalist]:
    """What raced: of sizes that are nearly alike the one that promises most; of one size those that may serve
    enough devices, by their gas."""
    shares = np.array([each.shares for each in state.candidates])
    promises = expit(state.surface(size).logits(state.space.coordinates(shares))[0]).tolist()
    rows = [
        (each, Finalist(point=each.point, size=each.size, place=each.race.place, promise=promise))
        for each, promise in zip(state.candidates, promises, strict=True)
    ]
    rows.sort(key=lambda row: (row[1].size, row[0].race.gas))
    finalists = [finalist for _, finalist in rows]
    if not state.space.sized:
        least = min(max(promises), state.threshold - _NEARLY)
        return [each for each in finalists if each.promise >= least]
    kept: list[Finalist] = []
    for each in finalists:
        if not kept or each.size > (1 + AS_SMALL) * kept[-1].size:
            kept.append(each)
        elif each.promise > kept[-1].promise:
            kept[-1] = each
    return kept


def _sample(space: Space) -> tuple[FloatArray, bool]:
    """Places of the first points; and whether these are all that there are."""
    counts = [len(axis.choices) for axis in space.axes]
    if all(counts) and math.prod(counts) <= _WHOLE:
        levels = [(np.arange(count) + 0.5) / count for count in counts]
        return np.array(list(product(*levels))), True
    shares: FloatArray = registered("function", "sobol")(len(space.axes), POINTS)
    return shares, False


def _static(points: Sequence[Point], rows: Sequence[Record], able: int) -> Static:
    reach = [(reach_of(row) or 0.0) * (row["status"] == "ok") for row in rows]
    best = int(np.argmax(reach))
    return Static(
        points=len(points),
        refused=sum(not row["sha256"] for row in rows),
        blocked=sum(row["status"] == "blocked" for row in rows),
        able=able,
        reach=reach[best] or math.nan,
        reach_point=points[best],
    )


def _stepped(state: _State, shares: FloatArray, step: float) -> FloatArray:
    moved = shares + step * state.random.standard_normal(shares.size)
    fresh = state.random.random(shares.size)
    switch = state.random.random(shares.size) < _SWITCH
    for place, axis in enumerate(state.space.axes):
        if not axis.ranges:
            moved[place] = fresh[place] if switch[place] else shares[place]
    return np.clip(moved, 0.0, 1.0)
