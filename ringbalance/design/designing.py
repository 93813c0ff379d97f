"""A design for a scene's table [design]: the smallest disc, with its bore, pressure, valve and settings, of
whose drawn devices enough meet what is required; or what stands against it.

What the search finds is judged as `tune` judges: on devices on which nothing was chosen, the smallest first.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from scipy.special import logit

from ringbalance.controller.balancer import Draws, Settings, balancer_of
from ringbalance.controller.judging.judge import FRESH, Judgement
from ringbalance.controller.judging.ranking import Ranking, ranked
from ringbalance.design.axes import Axis, Point
from ringbalance.design.closing import Judged, growth, judged_designs
from ringbalance.design.hunt import Static, hunt
from ringbalance.design.races import Candidate, Races, deal
from ringbalance.design.racing import DEVICES, devices_row, judged_design
from ringbalance.design.space import Space
from ringbalance.design.static import point_scene, reach_of, static_rows
from ringbalance.results.requirements import MET, Paired, Proportion
from ringbalance.results.result import Presentation, PresentedResult
from ringbalance.scene.faults import SceneError
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.platform.processes import beside

VALVE: Final = "valve"
"""Stands for the keys of a thing with a name."""
_MOVED: Final = 0.05
"""By which a key is moved to either side, relative."""
_DEVICES: Final = 256
"""On which a moved key is answered."""
_TAKEN: Final = 3
"""Designs at most, each the next larger, of which the verdict is asked on devices that have chosen none."""
_FRONT: Final = 6
_APART: Final = 0.05
"""Relative difference in size, time or gas that makes another design worth a line."""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """What a change of one key, with everything else as it is, makes of a design."""

    path: str
    changes: Point
    """SI; with what follows from it."""
    met: Proportion | None
    """Of the devices; None: no such design."""
    compared: Paired | None = None
    """With the design as it is, on the same devices."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Design(PresentedResult):
    """A design and what it rests on.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("spindle_design"))
        >>> design = rb.find_design(scene, workers=2)
        >>> design.recommended_scene.tube.bore < 2e-3
        True
    """

    given: SceneFile
    space: Space
    static: Static
    """Of the points that were answered without a run."""
    raced: int
    """Designs that ran as few devices."""
    needed: float
    """Unbalance that is to be cancelled, kg m."""
    reach: float | None
    """What the design cancels in any direction, kg m."""
    point: Point
    """Changes of the scene; of the design that comes nearest where none meets what is required."""
    judgement: Judgement | None
    """Of it under its best settings; None: no design can work."""
    smaller: tuple[float, Proportion] | None
    """Size, m^3, of the next smaller design that was judged, with the fraction of devices that it served;
    None: none was, or the size does not vary."""
    doubt: float | None
    """By how much other drawn devices would move the size, relative (95 %); None: the fraction of devices
    does not grow with the size, or that does not vary."""
    front: tuple[Candidate, ...]
    """Others that should meet what is required, none better than another in size, time and gas."""
    effects: tuple[Effect, ...]
    ranking: Ranking

    @property
    def succeeded(self) -> bool:
        """Whether the design meets what is required."""
        return self.judgement is not None and self.judgement.verdict == MET

    @property
    def size(self) -> float:
        """Volume of the cylinder around its chambers, m^3."""
        return self.space.size(self.point)

    @property
    def recommended_scene(self) -> SceneFile:
        """The scene as designed, checked. Raises: SceneError: no design can work."""
        if self.judgement is None:
            problem, allowed = "no design can work", "more space, pressure or a smaller unbalance"
            raise SceneError.of_file(self.given.file, problem, allowed)
        return self.given.with_values({**self.point, **self.judgement.settings})


def run_design(
    scene: SceneFile,
    *,
    presentation: Presentation,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[str], None] | None = None,
    start: int = 0,
) -> Design:
    """Design what a scene leaves open; see `ringbalance.design`.

    Args: `executor`: who computes; default `workers` processes, default one for each processor. `start`:
        seed of the points that are tried.
    Raises: SceneError: a scene without [design], or one that leaves nothing to choose or to cancel.
    """
    space, told = Space.of(liquid_ring_scene(scene)), progress or (lambda _: None)
    balancer = balancer_of(space.scene)
    needed = abs(balancer.rotor().unbalance)
    if needed == 0.0:
        problem = "the rotor has no unbalance that a disc could cancel"
        raise SceneError.of_file(scene.file, problem, "an amplitude above 0 of rotor.initial_vibration")
    workers = workers or os.cpu_count() or 1
    with beside(workers + 1 if executor is None and workers > 1 else 1) as pool:
        crew = executor or pool
        asked = balancer.asked_fraction()
        found = hunt(space, asked=asked, needed=needed, executor=crew, told=told, seed=start)
        races, raced = found.races, len(found.races.candidates)
        judged = judged_designs(found)
        best: Judged | None = None
        judgement: Judgement | None = None
        effects: tuple[Effect, ...] = ()
        for best in _taken(judged, sized=space.sized):
            told("the verdict, and what changes of it would do")
            settings = best.judgement.settings
            whole = partial(judged_design, scene, best.point, settings=settings, whole=True)
            effects, judgement = _effects(space, best, settings, crew, whole)
            if judgement is not None and judgement.verdict == MET:
                break
        sized = best if space.sized else None
        doubt = _doubt(races, sized) if sized else None
    return Design(
        presentation=presentation,
        given=scene,
        space=space,
        static=found.static,
        raced=raced,
        needed=needed,
        reach=None if best is None else _reach(space, best.point),
        point=found.static.reach_point if best is None else best.point,
        judgement=judgement,
        smaller=_smaller(judged, sized) if sized else None,
        doubt=doubt,
        front=_front(races, asked, best),
        effects=effects,
        ranking=_ranked(scene, best, judgement),
    )


def _ranked(scene: SceneFile, best: Judged | None, judgement: Judgement | None) -> Ranking:
    if best is None or judgement is None:
        return Ranking()
    return ranked(balancer_of(point_scene(scene, best.point)), judgement)


def _reach(space: Space, point: Point) -> float | None:
    (row,) = static_rows(space.scene, [point], intervals=False)
    return reach_of(row)


def _taken(judged: Sequence[Judged], *, sized: bool) -> list[Judged]:
    """The first that meet what is required, the smallest first, of one size that with the least gas; else the
    one that serves most devices."""

    def order(each: Judged) -> float:
        return each.size if sized else float(np.nanmedian(each.judgement.outcomes.energy))

    met = sorted((each for each in judged if each.met), key=order)[:_TAKEN]
    return met or sorted(judged, key=lambda each: -each.judgement.fraction.value)[:1]


def _smaller(judged: Sequence[Judged], best: Judged) -> tuple[float, Proportion] | None:
    below = [each for each in judged if each.size < best.size]
    next_one = max(below, key=lambda each: each.size, default=None)
    return None if next_one is None else (next_one.size, next_one.judgement.fraction)


def _doubt(races: Races, best: Judged) -> float | None:
    """Half-width of the fraction over its growth with the logarithm of the size."""
    share, rise = best.judgement.fraction, growth(races, best)
    return (share.high - share.low) / 2 / rise if rise > 0 else None


def _effects(
    space: Space,
    best: Judged,
    settings: Settings,
    executor: Executor | None,
    whole: Callable[[], Judgement | None],
) -> tuple[tuple[Effect, ...], Judgement | None]:
    """Of every key moved alone; and beside them the verdict on the design itself, which takes longest."""
    moves = [(path, change) for axis in space.axes for path, change in _moves(axis, best.point)]
    base = {path: value for path, value in best.point.items() if path in space.paths}
    points = [best.point, *(space.followed({**base, **change}) for _, change in moves)]
    draws = Draws.block(FRESH, _DEVICES, whole=False)
    calls = [partial(devices_row, space.hasty, point, settings=settings, draws=draws) for point in points]
    judgement, now, *moved = deal(executor, [whole, *calls])
    effects = [
        Effect(
            path=path,
            changes=change,
            met=None if then is None else Proportion(count=int(np.count_nonzero(then)), of=then.size),
            compared=None if then is None or now is None else Paired.of(then, now),
        )
        for (path, change), then in zip(moves, moved, strict=True)
    ]
    return tuple(effects), judgement


def _moves(axis: Axis, point: Point) -> Sequence[tuple[str, dict[str, Any]]]:
    """A number to both sides, another entry of a list instead."""
    if axis.ranges:
        return [
            (path, {path: float(f"{(1 + by) * float(point[path]):.4g}")})
            for path in axis.ranges
            for by in (-_MOVED, _MOVED)
        ]
    now = {path: point.get(path) for path in axis.paths}
    return [
        (VALVE if any(axis.names) else axis.paths[0], dict(each))
        for each in axis.choices
        if any(now[path] != value for path, value in each.items())
    ]


def _front(races: Races, asked: float, best: Judged | None) -> tuple[Candidate, ...]:
    """The smallest first; of those that are nearly alike the first.

    Args: `best`: the design itself: smaller ones met what is required on few devices alone.
    """
    if best is None:
        return ()
    promises = races.surface().logits(races.coordinates(races.points))[0]
    passing = [
        each
        for each, promise in sorted(zip(races.candidates, promises, strict=True), key=lambda row: row[0].size)
        if each.size >= best.size and each.race.meets.size >= DEVICES and promise >= logit(races.threshold)
    ]

    def of(each: Candidate) -> tuple[float, float, float]:
        return each.size, each.race.time(asked), each.race.gas

    kept: list[Candidate] = []
    for each in passing:
        beaten = any(
            all(b <= a for a, b in zip(of(each), of(other), strict=True)) and of(other) != of(each)
            for other in passing
        )
        alike = any(
            all(abs(a - b) <= _APART * b for a, b in zip(of(each), of(other), strict=True)) for other in kept
        )
        if not beaten and not alike:
            kept.append(each)
    kept = [each for each in kept if each.point != best.point]
    places = {round(i * (len(kept) - 1) / max(_FRONT - 1, 1)) for i in range(_FRONT)} if kept else set()
    return tuple(each for i, each in enumerate(kept) if i in places)
