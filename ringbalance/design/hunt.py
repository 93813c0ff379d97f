"""Search for a design: a Sobol sequence, races over a few random devices, then rounds about the best.

First, some of the points that can work according to their values without a run take part in races.  In every
further round, points ever closer to the best designs race; they are selected by a surface fitted to the
counts of devices of all raced designs.

The size is the volume of the cylinder around the chambers; if it does not vary, the gas consumption decides,
and among listed designs within `closing.AS_SMALL` the surface.  Decisions depend on counts, not on computing
time, so that a scene gives the same design on every machine.
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
from ringbalance.design.races import RacedDesign, Races, ReportProgress, WorkablePoint, threshold
from ringbalance.design.space import Space
from ringbalance.design.static import row_reach
from ringbalance.design.surface import Surface
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.registry import registered

POINTS: Final = 2048
"""Number of points of the Sobol sequence."""
_MAX_LISTED: Final = 256
"""Points up to which a space of lists is tried in full."""
_FIRST_SMALLEST, _FIRST_SPREAD = 12, 14
"""Numbers of points in the first races: smallest points that can work, and points over all sizes."""
_STEP_SIGMAS: Final = (0.15, 0.15, 0.12, 0.1, 0.08, 0.06)
"""Standard deviation of the steps in the unit cube, by round."""
_MIN_ROUNDS: Final = 2
"""Number of rounds for a space without axes; every axis adds one, up to the number of `_STEP_SIGMAS`."""
_SIZE_RANGES: Final = ((0.6, 1.1), (0.7, 1.15), (0.8, 1.1), (0.85, 1.1), (0.88, 1.08), (0.9, 1.06))
"""Range of sizes relative to the expected one, by round."""
_ANYWHERE_SHARES: Final = (0.5, 0.5, 0.3, 0.3, 0.3, 0.3)
"""Fraction of the points that start at any workable point of the first sample, by round."""
_RACES_PER_ROUND: Final = 16
_POINTS_PER_RACE: Final = 24
"""Number of points drawn for each race of a round; the most promising one races."""
_HOPE_SIGMA: Final = 0.7
"""Standard deviations of the surface that are added to its prediction when points are ranked."""
_GAS_SMOOTHING: Final = 0.01
_MIN_GAS_J: Final = 1e-6
"""Energy of the gas that counts as none, J."""
_ABOVE_LOGITS: Final = 1e3
"""Number larger than any logit plus any logarithm of an energy."""
_REACH: Final = 0.9
"""Fraction of the initial unbalance that a nominal design must cancel to be run; devices scatter about it."""
_REACH_ONE_WAY: Final = 0.6
"""Required fraction if the unbalance has a known direction: pairs of chambers at right angles cancel up to
1.41 times as much in one direction as in every direction."""
_EVERY_WAY_RAD: Final = 3.0
"""Half-range of the phase beyond which the unbalance may have any direction, rad."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Static:
    """Counts of the first sample, evaluated without a run."""

    points: int
    refusals: tuple[str, ...]
    """Reason for each point that the checks of a scene refuse."""
    blocked: int
    """Number of points without any flow."""
    able: int
    """Number of points that cancel the unbalance."""
    reach: float
    """Largest unbalance that any point cancels in every direction, kg m; NaN: no point has a flow."""
    reach_point: Point


@dataclass(frozen=True, kw_only=True, eq=False)
class Hunt:
    """Result of a search."""

    static: Static
    races: Races
    complete: bool
    """True if every design that can work took part in a race."""
    size: float
    """Expected size of the smallest design that meets the requirement, m^3."""


def hunt(
    space: Space,
    *,
    required_fraction: float,
    needed: float,
    executor: Executor | None,
    report_progress: ReportProgress,
    seed: int = 0,
) -> Hunt:
    """Search a space for the smallest design.

    Args: `required_fraction`: fraction of devices that must meet every demand. `needed`: initial unbalance,
        kg m. `executor`: any executor; default this process. `seed`: seed of the points.
    """
    one_way = space.scene.requirement.phase_range < _EVERY_WAY_RAD
    races = Races(
        space=space,
        needed=needed,
        least=_REACH_ONE_WAY if one_way else _REACH,
        threshold=threshold(required_fraction),
        executor=executor,
        report_progress=report_progress,
        trials=balancer_of(space.scene).trials(),
        random=np.random.default_rng(seed),
    )
    static, complete = _race_first_sample(races)
    if not races.candidates:
        return Hunt(static=static, races=races, complete=complete, size=math.nan)

    def served(candidate: RacedDesign) -> float:
        """Fraction of devices, reduced by one device: 4 of 4 rank below 60 of 64."""
        return candidate.race.judgement.fraction.value - 1.0 / max(candidate.race.judgement.meets.size, 1)

    enough = [each.size for each in races.candidates if served(each) >= races.threshold]
    size = min(enough) if enough else max(races.candidates, key=served).size
    last = len(_STEP_SIGMAS) - 1
    count = 0 if complete else min(_MIN_ROUNDS + len(space.axes), len(_STEP_SIGMAS))
    for number, index in enumerate(np.linspace(0, last, count), start=1):
        about = f", about {1e6 * size:.4g} ml" if space.sized else ""
        report_progress(f"round {number} of {count}{about}")
        size = _race_round(races, size, round(index))
    return Hunt(static=static, races=races, complete=complete, size=size)


def _race_first_sample(races: Races) -> tuple[Static, bool]:
    """Evaluate a sample of the space without a run, and race some of the points that can work.

    Returns: Counts, and True if the sample contains every point of the space.
    """
    space = races.space
    counts = [len(axis.choices) for axis in space.axes]
    complete = all(counts) and math.prod(counts) <= _MAX_LISTED
    shares: FloatArray
    if complete:
        shares = np.array(list(product(*((np.arange(count) + 0.5) / count for count in counts))))
    else:
        shares = registered("function", "sobol")(len(space.axes), POINTS)
    races.report_progress(f"{len(shares)} designs without a run")
    points = space.points(shares)
    rows = races.answered(points)
    able = races.able(shares, rows)
    races.wide = np.array([each.shares for each in able])
    chosen = _first_races(races, able) if able and not complete else sorted(able, key=lambda each: each.size)
    races.report_progress(f"{len(chosen)} of {len(able)} designs that can work, few devices each")
    races.race(chosen, [None] * len(chosen))
    reach = [(row_reach(row) or 0.0) * (row["status"] == "ok") for row in rows]
    best = int(np.argmax(reach))
    static = Static(
        points=len(points),
        refusals=tuple(row["finding"]["values"]["text"] for row in rows if not row["sha256"]),
        blocked=sum(row["status"] == "blocked" for row in rows),
        able=len(able),
        reach=reach[best] or math.nan,
        reach_point=points[best],
    )
    return static, complete


def _first_races(races: Races, able: Sequence[WorkablePoint]) -> list[WorkablePoint]:
    """Smallest points, each with the pressure at which it cancels most, and points over all sizes.

    Of every combination of the lists' entries in turn; points that a weak supply stalls, which serve few
    devices, only where no other is left.
    """
    able = sorted(able, key=lambda each: (each.weak_reach < 1.0, each.size))
    numbers = races.space.combinations(np.array([each.shares for each in able])).tolist()
    ranks = [numbers[:i].count(number) for i, number in enumerate(numbers)]
    order = sorted(range(len(able)), key=lambda i: (able[i].weak_reach < 1.0, ranks[i]))
    smallest, rest = order[:_FIRST_SMALLEST], order[_FIRST_SMALLEST:]
    smallest.sort(key=lambda i: (ranks[i], numbers[i]))
    rest = [i for i in rest if able[i].weak_reach >= 1.0] or rest
    rest.sort(key=lambda i: (numbers[i], ranks[i]))
    spread = np.linspace(0, len(rest) - 1, min(_FIRST_SPREAD, len(rest))).astype(int).tolist()
    best = races.able(races.at_best_pressure(np.array([able[i].shares for i in smallest])))
    return [*best, *(able[rest[i]] for i in spread)]


def _race_round(races: Races, size: float, index: int) -> float:
    """Race points about the best designs, the most promising of each range of sizes.

    Args: `size`: expected smallest size, m^3. `index`: index of the round's constants.
    Returns: Smallest size that meets the requirement by the surface, m^3, within the round's range.
    """
    low, high = _SIZE_RANGES[index]
    promise = partial(_promise, races, races.surface())
    count = _RACES_PER_ROUND * _POINTS_PER_RACE
    sizes = size * np.exp(np.linspace(math.log(low), math.log(high), count))
    parents = races.parents(promise, size)
    points = races.cloud(parents, _STEP_SIGMAS[index], sizes, anywhere=_ANYWHERE_SHARES[index])
    if points:
        chosen = [points[i] for i in _most_promising(races, points, promise(points), size)]
        races.race(chosen, races.grid_points(chosen))
    designs = [*races.candidates, *points]
    enough = races.surface().logits(races.coordinates(designs))[0] >= logit(races.threshold)
    smallest = min((designs[i].size for i in np.flatnonzero(enough)), default=math.inf)
    return min(max(smallest, low * size), high * size)


def _most_promising(
    races: Races, points: Sequence[WorkablePoint], values: FloatArray, size: float
) -> list[int]:
    """Most promising point of each range of sizes: in every second range of the combination of the lists'
    entries whose turn it is, of those in which a disc no larger than expected may serve enough devices.

    Args: `points`: in the order of their sizes. `values`: promise of each. `size`: expected one, m^3.
    """
    numbers = races.space.combinations(np.array([each.shares for each in points]))
    hopes = (values >= logit(races.threshold)) & (np.array([each.size for each in points]) <= size)
    hopeful = np.unique(numbers[hopes]).tolist()
    chosen = []
    slices = np.array_split(np.arange(values.size), min(_RACES_PER_ROUND, values.size))
    for count, each in enumerate(slices):
        turn = numbers[each] == (hopeful[count // 2 % len(hopeful)] if count % 2 and hopeful else -1)
        eligible = each[turn] if turn.any() else each
        chosen.append(int(eligible[np.argmax(values[eligible])]))
    return chosen


def _promise(races: Races, surface: Surface, points: Sequence[WorkablePoint]) -> FloatArray:
    """Logit of the fraction of devices plus part of its standard deviation; for discs of one size, the gas.

    Points that may serve enough devices rank by gas, above all others.
    """
    coordinates = races.coordinates(points)
    logits, sigmas = surface.logits(coordinates)
    hoped = np.asarray(logits + _HOPE_SIGMA * sigmas)
    if races.space.sized:
        return hoped
    energy = np.array([each.race.gas for each in races.candidates])
    ran = np.isfinite(energy)
    raced, log_energy = races.coordinates(races.candidates)[ran], np.log(np.maximum(energy[ran], _MIN_GAS_J))
    gas = RBFInterpolator(raced, log_energy, kernel="linear", smoothing=_GAS_SMOOTHING)(coordinates)
    return np.where(hoped >= logit(races.threshold), _ABOVE_LOGITS - gas, hoped)
