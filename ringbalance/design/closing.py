"""The last step of a search: designs at the edge of what is asked are judged, all on the same devices, on
which nothing was chosen before.

The fraction of devices that a design serves is then one number for a design, whatever led to it; and what two
designs differ by is known several times better than what each serves of all devices that may be drawn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from scipy.special import expit, logit, ndtr

from ringbalance.controller.balancer import Settings
from ringbalance.controller.judging.judge import Judgement
from ringbalance.design.axes import Point
from ringbalance.design.hunt import Hunt
from ringbalance.design.races import Points, Races, deal
from ringbalance.design.racing import Place, judged_design, judged_race, tuned_settings
from ringbalance.results.requirements import MET

AS_SMALL: Final = 0.01
"""Relative difference in size up to which two designs count as equally small: the search's resolution."""
_MOST: Final = 10
"""Listed designs from which on no further pair is judged."""
_TURNS: Final = 6
"""In which two designs are judged."""
_STEP: Final = 0.06
"""Standard deviation of the points that may be judged about the best, in the unit cube."""
_SIZES: Final = (-12, 21)
"""Steps of `AS_SMALL`, from smaller ones than is expected to larger ones, of which designs may be judged."""
_CLOUD: Final = 24
"""Points of each such size of which the most promising is judged."""
_LARGER: Final = 1.05
"""Times the size that is expected: what a design is compared with where none is known yet."""
_WIDER: Final = 1.5
"""Times its own standard deviation, by which the surface errs near the edge, as measured."""
_WORTH: Final = 0.002
"""Expected relative decrease of the size from which on a design is judged."""
_NEARLY: Final = 0.03
"""Below the fraction of devices that is looked for, from which on the surface may be wrong."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Judged:
    """A design and its verdict."""

    point: Point
    size: float
    """m^3."""
    judgement: Judgement

    @property
    def met(self) -> bool:
        """Whether enough devices meet what is required."""
        return self.judgement.verdict == MET


@dataclass(frozen=True, kw_only=True, eq=False)
class _Option:
    """A design that may be judged."""

    points: Points
    """Itself alone."""
    size: float
    logit: float
    """Of the fraction of the devices, by the surface."""
    spread: float
    """Its standard deviation."""
    place: Place | None = None
    """Its settings, where it raced; None: the scene's own."""
    gain: float = 0.0
    """Expected decrease of the logarithm of the size, by judging it."""

    @property
    def point(self) -> Point:
        """Changes of the scene."""
        return self.points.points[0]


def judged_designs(hunt: Hunt) -> list[Judged]:
    """Those that were judged, in the order in which they were."""
    if not hunt.races.candidates:
        return []
    return _in_order(hunt) if hunt.whole or not hunt.races.space.sized else _closed_in(hunt.races, hunt.size)


def growth(races: Races, best: Judged) -> float:
    """Of the fraction of devices with the logarithm of the size, by the surface about a design."""
    shares = next(each.shares for each in races.candidates if each.point == best.point)
    ends = best.size * np.array([1 - AS_SMALL, 1 + AS_SMALL])
    points = races.able(np.array([races.space.sized_at(shares, size) for size in ends]))
    fractions = expit(races.surface().logits(races.coordinates(points))[0])
    sizes = [races.space.size(each) for each in points.points]
    return float(np.diff(fractions)[0]) / math.log(sizes[1] / sizes[0]) if len(set(sizes)) == 2 else 0.0


def _closed_in(races: Races, size: float) -> list[Judged]:
    """Smaller and smaller designs, two at a time; each verdict makes the surface better, until it promises
    nothing that is smaller."""
    judged: list[Judged] = []
    settings: Settings | None = None
    for turn in range(_TURNS):
        least = min((each.size for each in judged if each.met), default=math.inf)
        options = _options(races, size, below=least / (1 + AS_SMALL))
        chosen = _chosen(races, options, size, least)
        if not any(each.gain > _WORTH for each in chosen):
            if judged:
                break
            chosen = _nearest(races)
        if turn == 0 and not races.space.sets_controller:
            races.told("settings of the designs that are judged")
            (settings,) = deal(races.executor, [partial(tuned_settings, races.space.hasty, chosen[0].point)])
        races.told(f"judging designs {len(judged) + 1} and on, about {1e6 * size:.4g} ml")
        judged += _judged(races, chosen, settings)
        size = min((each.size for each in judged if each.met), default=max(each.size for each in chosen))
    return judged


def _options(races: Races, size: float, *, below: float) -> list[_Option]:
    """Of every size, in equal steps, the point that promises most to the judging devices."""
    surface = races.surface()
    steps = size * (1 + AS_SMALL) ** np.arange(*_SIZES)
    steps = steps[steps <= below]
    if not steps.size:
        return []
    parents = races.parents(lambda points: surface.logits(races.coordinates(points))[0], size)
    points = races.cloud(parents, _STEP, np.repeat(steps, _CLOUD))
    best: dict[float, _Option] = {}
    logits, spreads = surface.logits(races.coordinates(points)) if points.points else (np.zeros(0),) * 2
    for i, (point, value) in enumerate(zip(points.points, logits.tolist(), strict=True)):
        at = races.space.size(point)
        if at <= below and (at not in best or value > best[at].logit):
            best[at] = _Option(points=points.some([i]), size=at, logit=value, spread=float(spreads[i]))
    return [best[at] for at in sorted(best)]


def _chosen(races: Races, options: Sequence[_Option], size: float, least: float) -> list[_Option]:
    """The two by which most is gained; where nothing is, those that promise most.

    Args: `size`: that is expected, m^3. `least`: of the smallest design that meets what is asked; infinite:
        none is known.
    """
    enough, limit = float(logit(races.threshold)), min(least, _LARGER * size)
    rated = [
        replace(
            each,
            gain=float(ndtr((each.logit - enough) / (_WIDER * each.spread))) * math.log(limit / each.size),
        )
        for each in options
    ]
    return sorted(rated, key=lambda each: (-max(each.gain, _WORTH), -each.logit))[:2]


def _nearest(races: Races) -> list[_Option]:
    """The two whose devices come nearest to what is required, where none promises to meet it."""
    points = races.points
    order = sorted(range(len(points.points)), key=lambda at: races.candidates[at].race.order)[:2]
    return [
        _Option(points=points.some([at]), size=races.candidates[at].size, logit=-math.inf, spread=0.0)
        for at in order
    ]


def _judged(races: Races, options: Sequence[_Option], settings: Settings | None) -> list[Judged]:
    """Verdicts, which the surface learns."""
    firsts = [races.nearest_places(each.points.shares)[0] for each in options]
    judge = partial(judged_design, races.space.hasty, settings=settings)
    calls = [partial(judge, each.point, place=place) for each, place in zip(options, firsts, strict=True)]
    judged: list[Judged] = []
    for option, place, judgement in zip(options, firsts, deal(races.executor, calls), strict=True):
        if judgement is not None:
            judged.append(Judged(point=option.point, size=option.size, judgement=judgement))
            races.add(option.points, 0, judged_race(judgement, place))
    return judged


def _in_order(hunt: Hunt) -> list[Judged]:
    """Of what raced: from the first that promises to meet what is asked on to better ones until two miss, or
    to others until one meets it."""
    races, options = hunt.races, _listed(hunt)
    search = hunt.whole and not races.space.sets_controller
    judged: dict[int, Judged | None] = {}

    def judge(*places: int) -> None:
        some = [at for at in places if 0 <= at < len(options) and at not in judged]
        races.told(f"judging designs {len(judged) + 1} and on")
        calls = [
            partial(
                judged_design, races.space.hasty, options[at].point, place=options[at].place, search=search
            )
            for at in some
        ]
        for at, judgement in zip(some, deal(races.executor, calls), strict=True):
            option = options[at]
            judged[at] = judgement and Judged(point=option.point, size=option.size, judgement=judgement)

    def met() -> list[int]:
        return [at for at, each in judged.items() if each is not None and each.met]

    top = _start(options, float(logit(races.threshold)))
    judge(top, top - 1)
    while races.space.sized and met() and (least := min(met())) > 0 and len(judged) < _MOST:
        judge(least - 1, least - 2)
        if min(met()) == least:
            break
    while not met() and top + 1 < len(options) and len(judged) < _MOST:
        judge(top + 1, top + 2)
        top += 2
    if not races.space.sized:
        # The search knows the gas of few devices alone.
        judge(top + 1, top + 2)
    return [each for each in judged.values() if each is not None]


def _start(options: Sequence[_Option], enough: float) -> int:
    """Place of the first that promises to meet what is asked; else of the one that comes nearest; where their
    sizes are alike that of the first."""
    if options[0].size == options[-1].size:
        return 0
    nearest = max(range(len(options)), key=lambda at: options[at].logit)
    return next((at for at, each in enumerate(options) if each.logit >= enough), nearest)


def _listed(hunt: Hunt) -> list[_Option]:
    """What raced: of sizes that are nearly alike the one that promises most; of one size those that may serve
    enough devices, by their gas."""
    races = hunt.races
    logits, spreads = races.surface().logits(races.coordinates(races.points))
    options = [
        _Option(
            points=races.points.some([i]),
            size=each.size,
            logit=float(logits[i]),
            spread=float(spreads[i]),
            place=each.race.place,
        )
        for i, each in sorted(enumerate(races.candidates), key=lambda row: (row[1].size, row[1].race.gas))
    ]
    if not races.space.sized:
        best = max(float(expit(each.logit)) for each in options)
        return [each for each in options if expit(each.logit) >= min(best, races.threshold - _NEARLY)]
    kept: list[_Option] = []
    for each in options:
        if not kept or each.size > (1 + AS_SMALL) * kept[-1].size:
            kept.append(each)
        elif each.logit > kept[-1].logit:
            kept[-1] = each
    return kept
