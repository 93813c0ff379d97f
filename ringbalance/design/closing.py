"""Last step of a search: verdicts on designs near the required fraction, all on the same devices.

No design was selected on these devices, so the fraction that a design serves has no selection bias.  The
difference of two designs on equal devices is several times more precise than either fraction.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np
from scipy.special import expit, logit, ndtr

from ringbalance.controller.balancer import Settings
from ringbalance.design.hunt import Hunt
from ringbalance.design.races import RacedDesign, Races, WorkablePoint, deal
from ringbalance.design.racing import Race, judged_design, tuned_settings
from ringbalance.scene.arrays import FloatArray

AS_SMALL: Final = 0.01
"""Relative difference in size below which two designs count as equal: resolution of the search."""
_MAX_JUDGED: Final = 10
"""Number of judged designs of a list after which no further pair is judged."""
_MAX_ROUNDS: Final = 4
"""Largest number of rounds; two designs are judged in each."""
_BETWEEN: Final = (0.2, 0.6)
"""Sizes that are judged at last, as parts of the way from the estimated smallest size to the smallest that
meets the requirement, on a logarithmic scale."""
_STEP_SIGMAS: Final = (0.06, 0.03, 0.015)
"""Standard deviations of the points about the best designs, in the unit cube, and about the best of these."""
_SIZE_STEPS: Final = (-12, 21)
"""Range of sizes to judge about the expected one, in steps of `AS_SMALL`."""
_POINTS_PER_SIZE: Final = 16
_GROWTH_FACTOR: Final = 1.05
"""Ratio of sizes over which the growth of the fraction is taken."""
_FIRST_LIMIT: Final = 1.05
"""Size to improve on while no design meets the requirement, relative to the expected size."""
_SIGMA_FACTOR: Final = 1.5
"""Measured ratio of the surface's error near the required fraction to its stated standard deviation."""
_MIN_GAIN: Final = 0.002
"""Smallest expected relative decrease of the size for which a design is judged."""
_NEAR_FRACTION: Final = 0.03
"""Margin below the required fraction for errors of the surface; listed designs within it are judged."""


def judged_designs(hunt: Hunt) -> list[RacedDesign]:
    """Judge the promising designs of a search; the race of each then contains only its judged settings."""
    if not hunt.races.candidates:
        return []
    if hunt.complete or not hunt.races.space.sized:
        return _judge_listed(hunt)
    # Two designs a round, by expected decrease of the size, until the surface predicts no decrease; every
    # verdict improves the surface.
    races, size = hunt.races, hunt.size
    judged: list[RacedDesign] = []
    settings: Settings | None = None
    for round_number in range(_MAX_ROUNDS):
        smallest = min((each.size for each in judged if each.race.succeeded), default=math.inf)
        points, logits, sigmas = _most_promising_by_size(races, size, below=smallest / (1 + AS_SMALL))
        limit = min(smallest, _FIRST_LIMIT * size)
        p_met = ndtr((logits - logit(races.threshold)) / (_SIGMA_FACTOR * sigmas))
        gains = p_met * np.log(limit / np.array([each.size for each in points]))
        two = np.lexsort((-logits, -np.maximum(gains, _MIN_GAIN)))[:2]
        chosen = [points[i] for i in two]
        if not (gains[two] > _MIN_GAIN).any():
            if math.isfinite(smallest):
                break
            if judged:
                # Nothing about this size promises to meet the requirement: larger ones.
                size *= _FIRST_LIMIT
                continue
            # No design promises to meet the requirement: judge the two that came nearest.
            chosen = [*sorted(races.candidates, key=lambda each: each.race.order)[:2]]
        if round_number == 0 and not races.space.sets_controller:
            races.report_progress("settings of the designs that are judged")
            (settings,) = deal(races.executor, [partial(tuned_settings, races.space.hasty, chosen[0].point)])
        races.report_progress(f"judging designs {len(judged) + 1} and on, about {1e6 * size:.4g} ml")
        grid_points = races.nearest_grid_points(chosen)
        calls = [
            partial(judged_design, races.space.hasty, each.point, grid_point=grid_point, settings=settings)
            for each, grid_point in zip(chosen, grid_points, strict=True)
        ]
        for each, grid_point, judgement in zip(chosen, grid_points, deal(races.executor, calls), strict=True):
            if judgement is not None:
                judged.append(races.add(each, Race(grid_point=grid_point, judgement=judgement)))
        # Designs that missed at a small size say nothing against the expected one.
        largest = max(size, *(each.size for each in chosen))
        size = min((each.size for each in judged if each.race.succeeded), default=largest)
    return _sharpened(races, judged)


def _sharpened(races: Races, judged: list[RacedDesign]) -> list[RacedDesign]:
    """Judged designs with two between the smallest that meets the requirement and one that nearly does.

    The fraction grows with the size of a design, so each judged design, scaled until its fraction would be
    the required one, estimates the smallest size; the best of them is judged again there.
    """
    smallest = min((each for each in judged if each.race.succeeded), key=lambda each: each.size, default=None)
    slope = 0.0 if smallest is None else growth(races, smallest)
    if smallest is None or slope <= 0:
        return judged
    scaled = [_size_with(races.threshold, each, each.race.judgement.fraction.value, slope) for each in judged]
    near = judged[int(np.argmin(scaled))]
    sizes = min(scaled) * (smallest.size / min(scaled)) ** np.array(_BETWEEN)
    if smallest.size < (1 + AS_SMALL / 2) * sizes[0]:
        return judged
    points = races.able(np.array([races.space.sized_at(near.shares, each) for each in sizes]))
    # Sizes in a drawing have few digits: both may be one.
    points = [each for i, each in enumerate(points) if each.point not in [p.point for p in points[:i]]]
    races.report_progress(f"judging designs {len(judged) + 1} and on, about {1e6 * sizes[0]:.4g} ml")
    judge = partial(judged_design, races.space.hasty, settings=near.race.judgement.settings)
    judgements = deal(races.executor, [partial(judge, each.point) for each in points])
    for each, judgement in zip(points, judgements, strict=True):
        if judgement is not None:
            judged.append(races.add(each, replace(near.race, judgement=judgement)))
    return judged


def enlarged(races: Races, design: RacedDesign, fraction: float) -> RacedDesign | None:
    """Design that missed the requirement with a fraction of its devices, larger by what that lacks.

    None where its size does not vary further, or the fraction does not grow with it.
    """
    slope = growth(races, design)
    if slope <= 0:
        return None
    size = max(_size_with(races.threshold, design, fraction, slope), (1 + AS_SMALL / 2) * design.size)
    points = races.able(races.space.sized_at(design.shares, size)[np.newaxis])
    return replace(design, **vars(points[0])) if points and points[0].size > design.size else None


def growth(races: Races, best: RacedDesign) -> float:
    """Growth of the fraction of devices with the logarithm of the size, from the surface, over a step that is
    long against its errors.
    """
    ends = best.size * np.array([1.0, _GROWTH_FACTOR])
    points = races.able(np.array([races.space.sized_at(best.shares, size) for size in ends]))
    fractions = expit(races.surface().logits(races.coordinates(points))[0])
    sizes = [each.size for each in points]
    return float(np.diff(fractions)[0]) / math.log(sizes[1] / sizes[0]) if len(set(sizes)) == 2 else 0.0


def _size_with(required: float, design: RacedDesign, fraction: float, slope: float) -> float:
    """Size, m^3, at which a design would serve the required fraction. Args: `slope`: as from `growth`."""
    return design.size * math.exp((required - fraction) / slope)


def _most_promising_by_size(
    races: Races, size: float, *, below: float
) -> tuple[list[WorkablePoint], FloatArray, FloatArray]:
    """Draw points of every size, in equal steps, and keep the most promising of each size.

    Returns: Points, the logits of their fractions by the surface, and the standard deviations of these.
    """
    surface = races.surface()
    steps = size * (1 + AS_SMALL) ** np.arange(*_SIZE_STEPS)
    steps = steps[steps <= below]
    nothing = np.zeros(0)
    if not steps.size:
        return [], nothing, nothing
    parents = races.parents(lambda points: surface.logits(races.coordinates(points))[0], size)
    points: list[WorkablePoint] = []
    for step in _STEP_SIGMAS:
        points += races.cloud(parents, step, np.repeat(steps, _POINTS_PER_SIZE))
        sizes = np.array([each.size for each in points])
        if not (sizes <= below).any():
            return [], nothing, nothing
        logits, sigmas = surface.logits(races.coordinates(points))
        best = [
            max(np.flatnonzero(sizes == each).tolist(), key=lambda i: logits[i])
            for each in np.unique(sizes[sizes <= below])
        ]
        points, logits, sigmas = [points[i] for i in best], logits[best], sigmas[best]
        parents = np.array([each.shares for each in points])
    return points, logits, sigmas


def _judge_listed(hunt: Hunt) -> list[RacedDesign]:
    """Judge designs that raced, two at a time, in the order of their size and gas.

    Start at the first that is predicted to meet the requirement; continue with smaller ones until two miss
    it, or with larger ones until one meets it.
    """
    races = hunt.races
    sized, enough = races.space.sized, float(logit(races.threshold))
    logits = races.surface().logits(races.coordinates(races.candidates))[0]
    order = sorted(range(len(logits)), key=lambda i: (races.candidates[i].size, races.candidates[i].race.gas))
    listed: list[int] = []
    if sized:
        # The most promising of nearly equal sizes.
        for i in order:
            if not listed or races.candidates[i].size > (1 + AS_SMALL) * races.candidates[listed[-1]].size:
                listed.append(i)
            elif logits[i] > logits[listed[-1]]:
                listed[-1] = i
    else:
        least = min(float(expit(logits.max())), races.threshold - _NEAR_FRACTION)
        listed = [i for i in order if expit(logits[i]) >= least]
    designs = [races.candidates[i] for i in listed]
    promises = logits[listed]
    search = hunt.complete and not races.space.sets_controller
    judged: dict[int, RacedDesign | None] = {}

    def judge(*numbers: int) -> list[int]:
        """Judge designs by number. Returns: Numbers of all designs that meet the requirement."""
        new = [i for i in numbers if 0 <= i < len(designs) and i not in judged]
        races.report_progress(f"judging designs {len(judged) + 1} and on")
        judge_one = partial(judged_design, races.space.hasty, search=search)
        calls = [partial(judge_one, designs[i].point, grid_point=designs[i].race.grid_point) for i in new]
        for i, judgement in zip(new, deal(races.executor, calls), strict=True):
            judged[i] = None
            if judgement is not None:
                judged[i] = replace(designs[i], race=replace(designs[i].race, judgement=judgement))
        return [i for i, each in judged.items() if each is not None and each.race.succeeded]

    top = 0
    if designs[0].size != designs[-1].size:
        promising = np.flatnonzero(promises >= enough)
        top = int(promising[0] if promising.size else np.argmax(promises))
    met = judge(top, top - 1)
    while sized and met and (least_met := min(met)) > 0 and len(judged) < _MAX_JUDGED:
        met = judge(least_met - 1, least_met - 2)
        if min(met) == least_met:
            break
    while not met and top + 1 < len(designs) and len(judged) < _MAX_JUDGED:
        met = judge(top + 1, top + 2)
        top += 2
    if not sized:
        # The gas in the search is that of few devices: two more designs may need less.
        judge(top + 1, top + 2)
    return [each for each in judged.values() if each is not None]
