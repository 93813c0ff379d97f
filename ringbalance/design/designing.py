"""Design for a scene's table [design]: the smallest disc, with bore, pressure, valve and settings, of whose
random devices a sufficient fraction meets the requirements; or the reason why there is none.

Candidates of the search are judged as in `tune`, on devices that selected no design, the smallest first.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from scipy.special import logit

from ringbalance.controller.balancer import Draws, Settings, balancer_of
from ringbalance.controller.judging.holding import Endurance, endurance
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, Judgement
from ringbalance.controller.judging.ranking import Ranking, ranked
from ringbalance.design.axes import Point
from ringbalance.design.closing import AS_SMALL, enlarged, growth, judged_designs
from ringbalance.design.hunt import Static, hunt
from ringbalance.design.races import RacedDesign, Races, deal
from ringbalance.design.racing import DEVICES, devices_row, judged_design
from ringbalance.design.space import OF_SCENE, VALVE, Space
from ringbalance.design.static import row_reach, static_rows
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.results.requirements import MET, Paired, Proportion
from ringbalance.results.result import Presentation, PresentedResult
from ringbalance.scene.faults import SceneError
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.platform.processes import beside

_MOVE_FRACTION: Final = 0.05
"""Relative change of a key, up and down, for its effect."""
_EFFECT_DEVICES: Final = 256
_MAX_VERDICTS: Final = 3
"""Largest number of designs, in order of size, that are judged on devices that selected no design."""
_MAX_FRONT: Final = 6
_NOTABLE_FRACTION: Final = 0.05
"""Relative difference in size, time or gas beyond which an alternative design is reported."""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Effect of a change of one key on a design, with all other keys unchanged."""

    path: str
    changes: Point
    """Changes of the scene, SI; with those that follow."""
    met: Proportion | None
    """Fraction of the devices that meet every demand; None: the changed scene is refused."""
    compared: Paired | None = None
    """Comparison with the unchanged design on the same devices."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Design(PresentedResult):
    """Design with its verdict, its neighbours and the effects of its keys.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("spindle_design"))
        >>> design = rb.find_design(scene, workers=2)
        >>> design.recommended_scene.tube.bore < 2e-3
        True
    """

    given: SceneFile
    space: Space
    static: Static
    """Counts of the points that were evaluated without a run."""
    raced: int
    """Number of designs that ran on few devices."""
    needed: float
    """Unbalance to be cancelled, kg m."""
    reach: float | None
    """Unbalance that the design cancels in any direction, kg m."""
    point: Point
    """Changes of the scene, SI; those of the nearest design if none meets the requirements."""
    judgement: Judgement | None
    """Verdict on the design with its best settings; None: no design can work."""
    smaller: tuple[float, Proportion] | None
    """Size, m^3, of the next smaller judged design, and the fraction of devices that it serves; None: no
    smaller design was judged, or the size does not vary."""
    doubt: float | None
    """Relative half-width (95 %) of the size by the random choice of devices and the search's resolution;
    None: the fraction of devices does not grow with the size, or the size does not vary."""
    tried: tuple[RacedDesign, ...]
    """Designs that ran on a block of devices or more, each with its last judgement."""
    front: tuple[RacedDesign, ...]
    """Alternative designs that should meet the requirements, Pareto-optimal in size, time and gas."""
    effects: tuple[Effect, ...]
    ranking: Ranking
    unchanged: tuple[Judgement, float | None] | None = None
    """Judgement of the scene's own disc and settings, and the unbalance that it cancels, kg m; None: the size
    varies."""
    holding: Holding | None
    """Stability of the fullest chamber's liquid with the gas off, as of a calibration of the design; None:
    no design can work."""
    endurance: Endurance | None
    """Devices over the hours of holding; None: the loss of liquid is not known, or not required."""

    @property
    def succeeded(self) -> bool:
        """True if the design meets the requirements."""
        return self.judgement is not None and self.judgement.verdict == MET

    @property
    def size(self) -> float:
        """Volume of the cylinder around its chambers, m^3."""
        return self.space.size(self.point)

    @property
    def assumed(self) -> tuple[str, ...]:
        """Paths of `point` whose values the program assumes: the lag of a valve that states none."""
        name = self.space.names(self.point).get(VALVE)
        at_hand = (each.assumes_lag for each in self.space.scene.design.valves if each.name == name)
        of_scene = name == OF_SCENE and self.given.origin_of("gas.valve_lag") == "assumed"
        return ("gas.valve_lag",) if any(at_hand) or of_scene else ()

    @property
    def recommended_scene(self) -> SceneFile:
        """Checked scene with the design's values. Raises: SceneError: no design can work."""
        if self.judgement is None:
            problem, allowed = "no design can work", "more space, pressure or a smaller unbalance"
            raise SceneError.of_file(self.given.file, problem, allowed)
        scene = self.given.with_values({**self.point, **self.judgement.settings})
        return scene.with_values({path: self.point[path] for path in self.assumed}, origin="assumed")


def _in_order(space: Space, designs: Sequence[RacedDesign]) -> list[RacedDesign]:
    """Designs by size; if no size varies, by the energy of the gas, those last that a weak supply stalls."""
    if space.sized:
        return sorted(designs, key=lambda each: each.size)

    def cost(each: RacedDesign) -> tuple[bool, float]:
        return each.weak_reach < 1.0, float(np.nanmedian(each.race.judgement.outcomes.energy))

    return sorted(designs, key=cost)


def _size_half_width(fraction: Proportion, slope: float) -> float | None:
    """Relative half-width (95 %) of a design's size: that of the difference of two fractions over `slope`,
    their growth with the logarithm of the size, and the resolution of the search; None without growth."""
    apart = (fraction.high - fraction.low) / math.sqrt(2.0)
    return math.hypot(apart / slope, AS_SMALL) if slope > 0 else None


def run_design(
    scene: SceneFile,
    *,
    presentation: Presentation,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[str], None] | None = None,
    start: int = 0,
) -> Design:
    """Choose the values that a scene leaves open in [design].

    Args: `executor`: any executor; default `workers` processes, default one for each processor. `start`:
        seed of the tried points.
    Raises: SceneError: a scene without [design], or one that leaves nothing to choose or to cancel.
    """
    space, report_progress = Space.of(liquid_ring_scene(scene)), progress or (lambda _: None)
    balancer = balancer_of(space.scene)
    needed = abs(balancer.rotor().unbalance)
    if needed == 0.0:
        problem = "the rotor has no unbalance that a disc could cancel"
        raise SceneError.of_file(scene.file, problem, "an amplitude above 0 of rotor.initial_vibration")
    workers = workers or os.cpu_count() or 1
    doubt: float | None = None
    with beside(workers + 1 if executor is None and workers > 1 else 1) as pool:
        crew = executor or pool
        required_fraction = balancer.required_fraction()
        search = hunt(
            space,
            required_fraction=required_fraction,
            needed=needed,
            executor=crew,
            report_progress=report_progress,
            seed=start,
        )
        races, raced = search.races, len(search.races.candidates)
        judged = judged_designs(search)
        best, judgement, effects = _verdict(scene, races, judged, crew)
        if best is not None and space.sized:
            doubt = _size_half_width(best.race.judgement.fraction, growth(races, best))
    reach, smaller, ranking, held, holding = None, None, Ranking(), None, None
    if best is not None:
        row = static_rows(space.scene, [best.point], intervals=False)[0]
        reach = row_reach(row)
        lowest = max(row["values"][name][0] or 0.0 for name in ("residual_fill_ratio", "stalled_fill_ratio"))
        designed_scene = liquid_ring_scene(scene.with_values(best.point))
        holding = Holding.of(designed_scene, fill_ratio=2 * designed_scene.disc.initial_fill - lowest)
        below = [each for each in judged if each.size < best.size]
        if space.sized and below:
            next_smaller = max(below, key=lambda each: each.size)
            smaller = next_smaller.size, next_smaller.race.judgement.fraction
        if judgement is not None:
            designed = balancer_of(designed_scene)
            ranking, held = ranked(designed, judgement), endurance(designed, judgement, report_progress)
    return Design(
        presentation=presentation,
        given=scene,
        space=space,
        static=search.static,
        raced=raced,
        needed=needed,
        reach=reach,
        point=search.static.reach_point if best is None else best.point,
        judgement=judgement,
        smaller=smaller,
        doubt=doubt,
        tried=tuple(
            {
                repr(each.point): each
                for each in (*races.candidates, *judged, *([] if best is None else [best]))
                if each.race.judgement.meets.size >= DEVICES
            }.values()
        ),
        front=() if best is None else _front(races, required_fraction, best),
        effects=effects,
        ranking=ranking,
        holding=holding,
        endurance=held,
    )


def _verdict(
    scene: SceneFile, races: Races, judged: Sequence[RacedDesign], executor: Executor | None
) -> tuple[RacedDesign | None, Judgement | None, tuple[Effect, ...]]:
    """Design that meets the requirements on devices that selected none, its verdict, and effects of its keys;
    of designs that all miss them the last that was tried, and None where there are none.
    """
    space = races.space
    best: RacedDesign | None = None
    judgement: Judgement | None = None
    effects: tuple[Effect, ...] = ()
    promising = [each for each in _in_order(space, judged) if each.race.succeeded]
    # If none meets the requirements, the design that serves most devices.
    queue = promising or sorted(judged, key=lambda each: -each.race.judgement.fraction.value)[:1]
    for _ in range(_MAX_VERDICTS):
        if not queue:
            break
        best = queue.pop(0)
        races.report_progress("the verdict, and what changes of it would do")
        settings = best.race.judgement.settings
        judge = partial(judged_design, scene, best.point, settings=settings, verdict=True)
        effects, judgement = _effects(space, best, settings, executor, judge)
        if judgement is not None and judgement.verdict == MET:
            break
        # The next one in order, or the same one larger if that is smaller.
        larger = None
        if judgement is not None and space.sized:
            larger = enlarged(races, best, judgement.fraction.value)
        if larger is not None and (not queue or larger.size < queue[0].size):
            queue.insert(0, larger)
    return best, judgement, effects


def _effects(
    space: Space,
    best: RacedDesign,
    settings: Settings,
    executor: Executor | None,
    judge: Callable[[], Judgement | None],
) -> tuple[tuple[Effect, ...], Judgement | None]:
    """Effects of each key changed alone, and the verdict on the design, which starts first as the longest."""
    point = best.point
    moves: list[tuple[str, dict[str, Any]]] = []
    for axis in space.axes:
        # A number changes up and down; an entry of a list is replaced by each other entry.
        for path in axis.ranges:
            by = (1 - _MOVE_FRACTION, 1 + _MOVE_FRACTION)
            moves += [(path, {path: float(f"{factor * float(point[path]):.4g}")}) for factor in by]
        now = {path: point.get(path) for path in axis.paths}
        parts = [part for part, each in space.parts.items() if each is axis]
        name = parts[0] if parts else axis.paths[0]
        for choice in () if axis.ranges else axis.choices:
            if any(now[path] != value for path, value in choice.items()):
                moves.append((name, dict(choice)))
    base = {path: value for path, value in point.items() if path in space.paths}
    points = [point, *(space.followed({**base, **changes}) for _, changes in moves)]
    draws = Draws.block(FIRST_VERDICT_DEVICE, _EFFECT_DEVICES, complete=False)
    calls = [partial(devices_row, space.hasty, each, settings=settings, draws=draws) for each in points]
    judgement, now_met, *then_met = deal(executor, [judge, *calls])
    effects = [
        Effect(
            path=path,
            changes=changes,
            met=None if met is None else Proportion.where(met),
            compared=None if met is None or now_met is None else Paired.of(met, now_met),
        )
        for (path, changes), met in zip(moves, then_met, strict=True)
    ]
    return tuple(effects), judgement


def _front(races: Races, required_fraction: float, best: RacedDesign) -> tuple[RacedDesign, ...]:
    """Pareto-optimal alternatives, the smallest first; of nearly equal ones the first.

    Args: `best`: design with the verdict; smaller ones are left out, which met the requirements on few
        devices only.
    """
    promises = races.surface().logits(races.coordinates(races.candidates))[0]
    pairs = sorted(zip(races.candidates, promises, strict=True), key=lambda row: row[0].size)
    passing = [
        each
        for each, promise in pairs
        if each.size >= best.size
        and each.race.judgement.meets.size >= DEVICES
        and promise >= logit(races.threshold)
    ]

    def costs(each: RacedDesign) -> tuple[float, float, float]:
        return each.size, each.race.judgement.time(required_fraction), each.race.gas

    front: list[RacedDesign] = []
    for each in passing:
        cost = costs(each)
        beaten = any(
            costs(other) != cost and all(b <= a for a, b in zip(cost, costs(other), strict=True))
            for other in passing
        )
        alike = any(
            all(abs(a - b) <= _NOTABLE_FRACTION * b for a, b in zip(cost, costs(other), strict=True))
            for other in front
        )
        if not beaten and not alike:
            front.append(each)
    front = [each for each in front if each.point != best.point]
    numbers = {round(i * (len(front) - 1) / (_MAX_FRONT - 1)) for i in range(_MAX_FRONT)} if front else set()
    return tuple(each for i, each in enumerate(front) if i in numbers)
