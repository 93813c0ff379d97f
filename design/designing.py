"""A design for a scene's table [design]: the smallest disc, with its bore, pressure, valve and settings, of
whose drawn devices enough meet what is required; or what stands against it.

What the search finds is judged as `tune` judges: on devices on which nothing was chosen, the smallest first.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import Draws, Settings, balancer_of
from ringbalance.controller.judging.judge import FRESH, Judgement
from ringbalance.controller.judging.ranking import Ranking, ranked
from ringbalance.design.axes import Axis, Point
from ringbalance.design.hunt import Candidate, Finalist, Hunt, Static, deal, hunt
from ringbalance.design.racing import DEVICES, devices_row, judged_design
from ringbalance.design.space import Space
from ringbalance.design.static import point_scene, reach_of, static_rows
from ringbalance.results.requirements import MET, Proportion
from ringbalance.results.result import Presentation, PresentedResult
from ringbalance.scene.faults import SceneError
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.platform.processes import beside

VALVE: Final = "valve"
"""Stands for the keys of a thing with a name."""
_MOST: Final = 10
"""Designs that are judged at the most, but for one."""
_SLOPE: Final = 3
"""Designs to both sides over which the growth of the fraction is taken."""
_MOVED: Final = 0.05
"""By which a key is moved to either side, relative."""
_DEVICES: Final = 64
"""On which a moved key is answered."""
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
    """Of those that meet it on the devices of the search, none better than another in size, time and gas."""
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
) -> Design:
    """Design what a scene leaves open; see `ringbalance.design`.

    Args: `executor`: who computes; default `workers` processes, default one for each processor.
    Raises: SceneError: a scene without [design], or one that leaves nothing to choose.
    """
    space, told = Space.of(liquid_ring_scene(scene)), progress or (lambda _: None)
    balancer = balancer_of(space.scene)
    needed = abs(balancer.rotor().unbalance)
    workers = workers or os.cpu_count() or 1
    with beside(workers + 1 if executor is None and workers > 1 else 1) as pool:
        crew = executor or pool
        asked = balancer.asked_fraction()
        found = hunt(space, asked=asked, needed=needed, executor=crew, told=told)
        place, judged = _best(space, found, crew, told)
        best, judgement = (found.finalists[place], judged[place]) if judged else (None, None)
        effects: tuple[Effect, ...] = ()
        smaller = _smaller(found, place, judged) if judged and space.sized else None
        if best is not None and judgement is not None:
            told("the verdict, and what changes of it would do")
            whole = partial(judged_design, scene, best.point, settings=judgement.settings)
            effects, judgement = _effects(space, best, judgement.settings, crew, whole)
    ranking, reach = Ranking(), None
    if best is not None and judgement is not None:
        ranking = ranked(balancer_of(point_scene(scene, best.point)), judgement)
        reach = _reach(space, best.point)
    return Design(
        presentation=presentation,
        given=scene,
        space=space,
        static=found.static,
        raced=len(found.candidates),
        needed=needed,
        reach=reach,
        point=found.static.reach_point if best is None else best.point,
        judgement=judgement,
        smaller=smaller,
        doubt=_doubt(found, place, judgement) if judgement is not None and space.sized else None,
        front=_front(found, asked, least=0.0 if best is None else best.size),
        effects=effects,
        ranking=ranking,
    )


def _reach(space: Space, point: Point) -> float | None:
    (row,) = static_rows(space.scene, [point], intervals=False)
    return reach_of(row)


def _best(
    space: Space, found: Hunt, executor: Executor | None, told: Callable[[str], None]
) -> tuple[int, dict[int, Judgement]]:
    """Place of the finalist to take, and all that were judged on fresh devices by their places.

    From the first one that promises to meet what is required: on to better ones until two miss, or to others
    until one meets it; else the one that serves most devices.
    """
    judged: dict[int, Judgement] = {}
    missing = set[int]()

    def judge(*places: int) -> None:
        some = [
            at for at in places if 0 <= at < len(found.finalists) and at not in judged and at not in missing
        ]
        told(f"judging designs {len(judged) + 1} and on of at most {_MOST}")
        calls = [_judging(space, found, at) for at in some]
        for at, answer in zip(some, deal(executor, calls), strict=True):
            missing.update([at] if answer is None else [])
            judged.update({} if answer is None else {at: answer})

    def met() -> list[int]:
        return [at for at, each in judged.items() if each.verdict == MET]

    top = found.start
    judge(top, top - 1)
    while space.sized and met() and (least := min(met())) > 0 and len(judged) < _MOST:
        judge(least - 1, least - 2)
        if min(met()) == least:
            break
    while not met() and top + 1 < len(found.finalists) and len(judged) < _MOST:
        judge(top + 1, top + 2)
        top += 2
    if not space.sized:
        # The search knows the gas of few devices alone.
        judge(top + 1, top + 2)

    def order(at: int) -> float:
        return at if space.sized else float(np.nanmedian(judged[at].outcomes.energy))

    best = min(met(), key=order, default=None)
    return max(judged, key=lambda at: judged[at].fraction.value, default=-1) if best is None else best, judged


def _judging(space: Space, found: Hunt, at: int) -> Callable[[], Judgement | None]:
    finalist = found.finalists[at]
    search = found.whole and not space.sets_controller
    return partial(
        judged_design,
        space.hasty,
        finalist.point,
        place=finalist.place,
        settings=finalist.settings,
        search=search,
    )


def _smaller(found: Hunt, place: int, judged: Mapping[int, Judgement]) -> tuple[float, Proportion] | None:
    below = [at for at in judged if found.finalists[at].size < found.finalists[place].size]
    if not below:
        return None
    at = max(below, key=lambda each: found.finalists[each].size)
    return found.finalists[at].size, judged[at].fraction


def _doubt(found: Hunt, place: int, judgement: Judgement) -> float | None:
    """Half-width of the fraction over its growth per logarithm of the size, by the surface."""
    rows, share = found.finalists, judgement.fraction
    low, high = rows[max(place - _SLOPE, 0)], rows[min(place + _SLOPE, len(rows) - 1)]
    rise = high.promise - low.promise
    return (share.high - share.low) / 2 * math.log(high.size / low.size) / rise if rise > 0 else None


def _effects(
    space: Space,
    best: Finalist,
    settings: Settings,
    executor: Executor | None,
    whole: Callable[[], Judgement | None],
) -> tuple[tuple[Effect, ...], Judgement | None]:
    """Of every key moved alone; and beside them the verdict on the design itself, which takes longest."""
    moves = [(path, change) for axis in space.axes for path, change in _moves(axis, best.point)]
    base = {path: value for path, value in best.point.items() if path in space.paths}
    points = [space.followed({**base, **change}) for _, change in moves]
    draws = Draws.block(FRESH, _DEVICES)
    calls = [partial(devices_row, space.hasty, point, settings=settings, draws=draws) for point in points]
    judgement, *counts = deal(executor, [whole, *calls])
    effects = [
        Effect(
            path=path,
            changes=change,
            met=None if count is None else Proportion(count=count, of=_DEVICES),
        )
        for (path, change), count in zip(moves, counts, strict=True)
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


def _front(found: Hunt, asked: float, *, least: float) -> tuple[Candidate, ...]:
    """The smallest first; of those that are nearly alike the first.

    Args: `least`: size of the design, m^3: smaller ones met what is required on few devices alone.
    """
    passing = [
        each
        for each in sorted(found.candidates, key=lambda each: each.size)
        if each.size >= least and each.race.meets.size == DEVICES and each.race.fraction >= found.threshold
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
    places = {round(i * (len(kept) - 1) / max(_FRONT - 1, 1)) for i in range(_FRONT)} if kept else set()
    return tuple(each for i, each in enumerate(kept) if i in places)
