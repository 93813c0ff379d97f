"""The search for a design: points of a Sobol sequence, those that can work without a run, races of a few
drawn devices, then points about the best, closer and closer, led by a surface through the counts of all.

Smallest is the volume of the cylinder around the chambers; where the disc's size does not vary, the gas that
is used decides, and among listed designs within `closing.AS_SMALL` the promise.  Everything is counted and
nothing timed, so that the same scene gives the same design on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Final

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.special import logit

from ringbalance.controller.balancer import balancer_of
from ringbalance.design.axes import Point
from ringbalance.design.races import Candidate, Points, Races, Told, threshold
from ringbalance.design.space import Space
from ringbalance.design.static import Record, reach_of
from ringbalance.design.surface import Surface
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.registry import registered

POINTS: Final = 2048
"""Of the Sobol sequence."""
_WHOLE: Final = 256
"""Points up to which a space of lists is tried whole."""
_SMALLEST, _SPREAD = 12, 14
"""Of the points that can work: the smallest, and as many over all sizes, that race at first."""
_STEPS: Final = (0.15, 0.15, 0.12, 0.1, 0.08, 0.06)
"""Standard deviations of the steps in the unit cube, round by round."""
_FEWEST: Final = 2
"""Rounds, and one more for every axis, up to all."""
_SIZES: Final = ((0.6, 1.1), (0.7, 1.15), (0.8, 1.1), (0.85, 1.1), (0.88, 1.08), (0.9, 1.06))
"""Times the size that is looked for: between which points are tried."""
_ANYWHERE: Final = (0.5, 0.5, 0.3, 0.3, 0.3, 0.3)
"""Part of the points that lie anywhere in the unit cube, round by round."""
_CHILDREN: Final = 16
"""Points that race in a round."""
_TRIED: Final = 32
"""Drawn for each of them: of those that can work the one races that promises most."""
_BOLD: Final = 0.7
"""Standard deviations of the surface that are added where a point is chosen to race."""
_SURE: Final = 0.5
"""The same, that are taken away where a design that raced is taken for one that meets what is required."""
_SMOOTHING: Final = 0.01
"""Of the surface through the logarithms of the gas."""
_NO_GAS: Final = 1e-6
"""J, which counts as none."""
_FIRST: Final = 1e3
"""Above every logit and logarithm."""
_REACH: Final = 0.9
"""Of the initial unbalance, that a design must be able to cancel before it runs: its devices differ."""
_REACH_ONE_WAY: Final = 0.6
"""The same where the unbalance lies in one direction: pairs of chambers at right angles cancel up to
1.41 times as much there as in every direction."""
_EVERY_WAY: Final = 3.0
"""rad to both sides, from which on it lies in any direction."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Static:
    """What the points of the first sample come to without a run."""

    points: int
    refusals: tuple[str, ...]
    """Of each point that the checks of a scene refuse, the reason."""
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
    races: Races
    whole: bool
    """Whether every design that can work did."""
    size: float
    """About which the smallest design that meets what is required is expected, m^3."""


def hunt(
    space: Space, *, asked: float, needed: float, executor: Executor | None, told: Told, seed: int = 0
) -> Hunt:
    """Search a space.

    Args: `asked`: fraction of devices. `needed`: initial unbalance, kg m. `executor`: who computes; None:
        this process. `seed`: of the points that are tried.
    """
    one_way = space.scene.requirement.phase_range < _EVERY_WAY
    share = _REACH_ONE_WAY if one_way else _REACH
    races = Races(
        space=space,
        needed=needed,
        least=share,
        threshold=threshold(asked),
        executor=executor,
        told=told,
        trials=balancer_of(space.scene).trials(),
        random=np.random.default_rng(seed),
    )
    static, whole = _first(races)
    size = _size_at_first(races) if races.candidates else math.nan
    rounds = [] if whole or not races.candidates else _rounds(len(space.axes))
    for place, number in enumerate(rounds):
        about = f", about {1e6 * size:.4g} ml" if space.sized else ""
        told(f"round {place + 1} of {len(rounds)}{about}")
        size = _round(races, size, number)
    return Hunt(static=static, races=races, whole=whole, size=size)


def _rounds(axes: int) -> list[int]:
    """Places of the rounds among `_STEPS`: fewer where little varies."""
    return [round(at) for at in np.linspace(0, len(_STEPS) - 1, min(_FEWEST + axes, len(_STEPS)))]


def _first(races: Races) -> tuple[Static, bool]:
    """The whole space: static answers of every point, and races of some that can work; whether of all."""
    space = races.space
    shares, whole = _sample(space)
    races.told(f"{len(shares)} designs without a run")
    points = space.points(shares)
    rows = races.answered(points)
    able = races.able(shares, rows)
    races.wide = able.shares
    order = sorted(range(len(able.points)), key=lambda i: space.size(able.points[i]))
    rest = order[_SMALLEST:]
    spread = [rest[at] for at in np.linspace(0, len(rest) - 1, min(_SPREAD, len(rest))).astype(int)]
    chosen = able.some(order if whole else order[:_SMALLEST] + spread)
    races.told(f"{len(chosen.points)} of {len(order)} designs that can work, few devices each")
    races.race(chosen, [None] * len(chosen.points))
    return _static(points, rows, len(order)), whole


def _size_at_first(races: Races) -> float:
    """Of the smallest that serves enough devices; else of the one that serves most."""
    enough = [each.size for each in races.candidates if _served(each) >= races.threshold]
    return min(enough) if enough else max(races.candidates, key=_served).size


def _served(candidate: Candidate) -> float:
    """Fraction of the devices; one of them is taken for failed: 4 of 4 are worth less than 60 of 64."""
    return candidate.race.fraction - 1.0 / max(candidate.race.meets.size, 1)


def _round(races: Races, size: float, number: int) -> float:
    """Race points about the best. Returns: the size from which on they serve enough devices."""
    low, high = _SIZES[number]
    worth = partial(_worth, races, races.surface())
    sizes = size * np.exp(np.linspace(math.log(low), math.log(high), _CHILDREN * _TRIED))
    points = races.cloud(races.parents(worth, size), _STEPS[number], sizes, anywhere=_ANYWHERE[number])
    if points.points:
        value = worth(points)
        slices = np.array_split(np.arange(value.size), min(_CHILDREN, value.size))
        chosen = points.some([int(each[np.argmax(value[each])]) for each in slices])
        races.race(chosen, races.places(chosen.shares))
    logits, spread = races.surface().logits(races.coordinates(races.points))
    enough = logits - _SURE * spread >= logit(races.threshold)
    able = [each.size for each, serves in zip(races.candidates, enough, strict=True) if serves]
    return min(max(min(able, default=math.inf), low * size), high * size)


def _worth(races: Races, surface: Surface, points: Points) -> FloatArray:
    """What decides which points race: the fraction of devices, with some of its doubt; of one size, among
    those that may serve enough, the gas."""
    places = races.coordinates(points)
    logits, spread = surface.logits(places)
    hoped = np.asarray(logits + _BOLD * spread)
    if races.space.sized:
        return hoped
    used = np.array([each.race.gas for each in races.candidates])
    measured = np.isfinite(used)
    known, energy = races.coordinates(races.points)[measured], np.log(np.maximum(used[measured], _NO_GAS))
    gas = RBFInterpolator(known, energy, kernel="linear", smoothing=_SMOOTHING)(places)
    return np.where(hoped >= logit(races.threshold), _FIRST - gas, hoped)


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
        refusals=tuple(row["finding"]["values"]["text"] for row in rows if not row["sha256"]),
        blocked=sum(row["status"] == "blocked" for row in rows),
        able=able,
        reach=reach[best] or math.nan,
        reach_point=points[best],
    )
