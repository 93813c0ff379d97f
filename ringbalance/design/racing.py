"""One design in closed loop: few drawn devices race its controllers' settings.

Settings stand in units of a design's own loop and dead time, so that what served one design is a good start
for another.  A design that serves few of the first devices is left; only good ones run on a whole block.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import Balancer, Demand, Draws, Outcomes, Settings, quick_balancer
from ringbalance.controller.judging.judge import CHOOSING, FRESH, Judgement, judged_all
from ringbalance.controller.judging.search import searched
from ringbalance.controller.trials import Trials
from ringbalance.design.axes import Point
from ringbalance.design.static import FAULTS, point_scene
from ringbalance.results.requirements import OPEN
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import SceneFile

Place = tuple[int, tuple[float, ...]]
"""Kind of controller, by its number among the balancer's trials, and places among the levels on its axes."""
HEATS: Final = (4, 8, 24, 64)
"""Devices after each heat of a race; at last a whole block of draws, whose inputs are spread evenly."""
DEVICES: Final = HEATS[-1]
"""Of a design that stays in the race."""
STEP: Final = 0.5
"""Levels, between settings that race beside each other."""
_WATCHED: Final = 10.0
"""s, for which a race watches a device that has held its limit; a verdict watches longer."""
_KEPT: Final = (39, 8, 1)
"""Settings at most that go on after each heat but the last."""
_CHOSEN: Final = 256
"""Devices of a verdict that choose between settings; the best goes on."""
_SURELY: Final = 3.0
"""Standard deviations, from which on fewer devices than all decide."""
_BEHIND: Final = 2
"""Devices by which settings may be behind the best after a heat."""
_LEFT: Final = 0.2
"""By so much below the fraction asked for after a heat, a design is left: three of four devices must do."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Race:
    """What a design comes to under the best settings that raced."""

    place: Place | None
    """None: under the scene's own settings."""
    settings: Settings
    """By path, SI."""
    meets: BoolArray
    """Of each device that ran."""
    times: FloatArray
    """s; infinite where not settled."""
    energy: FloatArray
    """J, of the gas that was let in."""

    @property
    def met(self) -> int:
        """Devices that meet every demand."""
        return int(np.count_nonzero(self.meets))

    @property
    def fraction(self) -> float:
        """Of the devices that ran."""
        return self.met / self.meets.size if self.meets.size else 0.0

    @cached_property
    def gas(self) -> float:
        """Median over the devices that ran, J; infinite where none did."""
        ran = self.energy[np.isfinite(self.energy)]
        return float(np.median(ran)) if ran.size else math.inf

    def time(self, fraction: float) -> float:
        """By which a fraction of the devices has settled, s."""
        if not self.times.size:
            return math.inf
        return float(np.sort(self.times)[max(math.ceil(fraction * self.times.size), 1) - 1])

    @property
    def settled(self) -> float:
        """Fraction of the devices that settle at all."""
        return float(np.mean(np.isfinite(self.times))) if self.times.size else 0.0

    @property
    def order(self) -> tuple[float, ...]:
        """Most devices first that meet what is required, then that settle, then soonest."""
        return (-self.fraction, -self.settled, self.time(0.9), self.time(0.5), self.gas)

    def joined(self, other: Race) -> Race:
        """With the outcomes of further devices."""
        return replace(
            self,
            meets=np.concatenate([self.meets, other.meets]),
            times=np.concatenate([self.times, other.times]),
            energy=np.concatenate([self.energy, other.energy]),
        )


def race(
    scene: SceneFile,
    point: Point,
    *,
    places: Sequence[Place] | None,
    asked: float,
    settings: bool,
    block: int = 0,
) -> Race | None:
    """The best settings of a design; None: its scene is refused, or it breaks down.

    Args: `places`: settings that race, such as those that raced best on another design; None: all that are
        tried at first. `asked`: fraction of devices. `settings`: whether any are raced but the scene's own.
        `block`: whose devices run.
    """
    try:
        balancer = quick_balancer(point_scene(scene, point))
        field = _field(balancer.trials(), places) if settings else [(None, {})]
        return _raced(balancer, field, asked, block) if field else None
    except (SceneError, *FAULTS):
        return None


def _field(trials: Sequence[Trials], places: Sequence[Place] | None) -> list[tuple[Place | None, Settings]]:
    """Settings to race; those of the scene where it offers none."""
    wanted = _all_first(trials) if places is None else places
    found = [(place, _settings(trials[place[0]], place[1])) for place in wanted]
    return [(place, each) for place, each in found if each is not None] if trials else [(None, {})]


def _all_first(trials: Sequence[Trials]) -> list[Place]:
    return [
        (kind, levels)
        for kind, each in enumerate(trials)
        for levels in product(*(axis.first for axis in each.axes))
    ]


def near(trials: Sequence[Trials], place: Place) -> list[Place]:
    """Settings one step away on one axis."""
    kind, levels = place
    return [
        (kind, (*levels[:axis], level, *levels[axis + 1 :]))
        for axis, at in enumerate(levels)
        for level in (at - STEP, at + STEP)
        if 0 <= level <= len(trials[kind].axes[axis].levels) - 1
    ]


def _settings(trials: Trials, levels: tuple[float, ...]) -> Settings | None:
    """At places among the levels, straight between two of them."""
    return trials.settings(
        {
            axis.name: float(np.interp(at, range(len(axis.levels)), axis.levels))
            for axis, at in zip(trials.axes, levels, strict=True)
        }
    )


def _raced(
    balancer: Balancer, field: Sequence[tuple[Place | None, Settings]], asked: float, block: int
) -> Race:
    running = [Race(place=place, settings=settings, **_NOBODY) for place, settings in field]
    first, start = 0, block * DEVICES
    for heat, last in enumerate(HEATS):
        running = sorted(
            _heat(balancer, running, range(start + first, start + last)), key=lambda each: each.order
        )
        if running[0].fraction < asked - _LEFT:
            break
        running = [each for each in running if each.met > running[0].met - _BEHIND]
        first, running = last, running[: _KEPT[heat]] if heat < len(_KEPT) else running
    return running[0]


def _heat(balancer: Balancer, races: Sequence[Race], numbers: Sequence[int]) -> list[Race]:
    draws, demands = Draws(numbers=tuple(numbers), whole=False), balancer.demands()
    ran = balancer.run_all([each.settings for each in races], draws, further=_WATCHED)
    return [
        each.joined(replace(each, **_outcome(demands, outcomes)))
        for each, outcomes in zip(races, ran, strict=True)
    ]


def _meets(demands: Sequence[Demand], outcomes: Outcomes) -> BoolArray:
    return np.asarray(np.all([demand.met(outcomes) for demand in demands], axis=0))


def _outcome(demands: Sequence[Demand], outcomes: Outcomes) -> dict[str, Any]:
    return {
        "meets": _meets(demands, outcomes),
        "times": outcomes.settling_time,
        "energy": outcomes.energy,
    }


_NOBODY: Final[dict[str, Any]] = {
    "meets": np.zeros(0, dtype=np.bool_),
    "times": np.zeros(0),
    "energy": np.zeros(0),
}


def judged_design(
    scene: SceneFile,
    point: Point,
    *,
    place: Place | None = None,
    settings: Settings | None = None,
    search: bool = False,
    whole: bool = False,
) -> Judgement | None:
    """The settings that serve most devices of a design; None: it breaks down.

    Judged on devices on which no settings were chosen, the same for every design.
    Args: `place`, `settings`: some to judge; without any the scene's own. `search`: whether others
        are looked for as `tune` does. `whole`: as `Draws`, and on devices that have chosen no design either.
    """
    try:
        balancer = quick_balancer(point_scene(scene, point))
        tried = [each for _, each in _field(balancer.trials(), [place])] if place is not None else []
        tried += [] if settings is None else [settings]
        tried += [searched(balancer)] if search else []
        fresh = [each for i, each in enumerate(tried or [{}]) if each not in tried[:i]]
        return _judged(balancer, fresh, whole=whole)
    except (SceneError, *FAULTS):
        return None


def judged_race(judgement: Judgement, place: Place | None) -> Race:
    """A judgement as a race of one setting."""
    outcome = _outcome(judgement.demands, judgement.outcomes)
    return Race(place=place, settings=judgement.settings, **outcome)


def _judged(balancer: Balancer, settings: Sequence[Settings], *, whole: bool) -> Judgement | None:
    """The best of some settings, on as many devices as a verdict takes.

    A look before the last ends only what is three standard deviations from what is asked, so that a design at
    the edge is decided by all devices and not by the first look at which it happens to be above.
    Source: Haybittle, "Repeated Assessment of Results in Clinical Trials of Cancer Treatment", British
        Journal of Radiology 44 (1971).
    """
    few, most = balancer.verdict_draws
    best, running, first = None, list(settings), 0
    done: list[Judgement] = []
    for last in sorted({few, min(_CHOSEN, most), most}):
        count, start = last - first, (FRESH if whole else CHOOSING) + first
        ran = judged_all(balancer, running, first=count, most=count, start=start, whole=whole)
        done = [a.joined(b) for a, b in zip(done, ran, strict=True)] if done else list(ran)
        best = max(done, key=lambda each: each.fraction.value, default=None)
        if best is None or best.fraction.verdict(best.asked, deviations=_SURELY) != OPEN:
            break
        if last >= _CHOSEN:
            done, running = [best], [best.settings]
        first = last
    return best


def tuned_settings(scene: SceneFile, point: Point) -> Settings | None:
    """Settings of a design as `tune` finds them; None: it breaks down."""
    try:
        return searched(quick_balancer(point_scene(scene, point)))
    except (SceneError, *FAULTS):
        return None


def devices_row(scene: SceneFile, point: Point, *, settings: Settings, draws: Draws) -> BoolArray | None:
    """Which devices meet what is required; None: the point is refused or breaks down."""
    try:
        balancer = quick_balancer(point_scene(scene, point))
        (outcomes,) = balancer.run_all([settings], draws, further=_WATCHED)
        return _meets(balancer.demands(), outcomes)
    except (SceneError, *FAULTS):
        return None
