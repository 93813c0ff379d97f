"""Race of controller settings on one design, over few random devices.

Settings are points of the balancer's search space, whose axes are normalised by loop and dead time of the
design, so that the best settings of one design are a good start for another.  A design that serves few of the
first devices is dropped; the best settings run on a whole block of devices, whose inputs are evenly spread.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from ringbalance.controller.balancer import Draws, Settings, quick_balancer
from ringbalance.controller.judging.judge import (
    FIRST_CHOOSING_DEVICE,
    FIRST_VERDICT_DEVICE,
    Judgement,
    judged_all,
)
from ringbalance.controller.judging.search import searched
from ringbalance.controller.trials import Indices
from ringbalance.design.axes import Point
from ringbalance.design.static import BREAKDOWNS
from ringbalance.results.requirements import MET, OPEN
from ringbalance.scene.arrays import BoolArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import SceneFile

GridPoint = tuple[int, Indices]
"""Point of the search spaces: index of the space, and the levels on its axes."""
HEATS: Final = (4, 8, 24, 64)
"""Numbers of devices after each heat of a race."""
DEVICES: Final = HEATS[-1]
STEP: Final = 0.5
"""Distance between neighbouring settings, levels."""
_SURVIVORS: Final = (39, 8, 1)
"""Largest numbers of settings that continue after each heat but the last."""
_MAX_BEHIND_DEVICES: Final = 2
"""Deficit of served devices, compared with the best settings, at which settings drop out."""
_MAX_SHORTFALL_FRACTION: Final = 0.2
"""Shortfall of the fraction of devices, below the required one, beyond which a design is dropped."""
_WATCH_TIME_S: Final = 10.0
"""Time for which a settled device is watched in a race; a verdict watches longer."""
_CHOICE_DEVICES: Final = 256
"""Number of devices of a verdict after which only the best settings continue."""
_STOP_SIGMA: Final = 3.0
"""Standard deviations from the required fraction beyond which a verdict ends before all devices ran."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Race:
    """Best settings of a design, with the judgement on the devices of their runs."""

    grid_point: GridPoint | None
    """Point of the search spaces; None: the scene's own settings."""
    judgement: Judgement

    @property
    def succeeded(self) -> bool:
        """True if the verdict on the settings is `MET`."""
        return self.judgement.verdict == MET

    @cached_property
    def gas(self) -> float:
        """Median energy of the injected gas over the devices, J; infinite: no device ran."""
        energy = self.judgement.outcomes.energy
        ran = energy[np.isfinite(energy)]
        return float(np.median(ran)) if ran.size else math.inf

    @property
    def order(self) -> tuple[float, ...]:
        """Sort key: most devices that meet every demand, most settled, shortest times, least gas first."""
        judgement, settled = self.judgement, float(np.mean(self.judgement.outcomes.settled))
        times = judgement.time(0.9), judgement.time(0.5)
        return (-judgement.fraction.value, -settled, *times, self.gas)


def race(
    scene: SceneFile,
    point: Point,
    *,
    grid_points: Sequence[GridPoint] | None,
    required_fraction: float,
    settings: bool,
    block: int = 0,
) -> Race | None:
    """Race settings of a design and return the best; None: its scene is refused, or a run breaks down.

    Args: `grid_points`: settings to race, such as the best of another design; None: the coarse grid.
        `required_fraction`: of devices that meet every demand. `settings`: False races only the settings of
        the scene. `block`: index of the block of devices.
    """
    try:
        balancer = quick_balancer(scene.with_values(point))
        spaces = balancer.trials()
        field: list[tuple[GridPoint | None, Settings]] = [(None, {})]
        if settings and spaces:
            coarse = [(kind, indices) for kind, space in enumerate(spaces) for indices in space.first]
            field = [
                ((kind, indices), each)
                for kind, indices in (coarse if grid_points is None else grid_points)
                if (each := spaces[kind].at(indices)) is not None
            ]
        if not field:
            return None
        start = block * DEVICES
        draws = Draws.block(start, HEATS[0], complete=False)
        ran = balancer.run_all([each for _, each in field], draws, watch_time=_WATCH_TIME_S)
        running = [
            Race(grid_point=grid_point, judgement=Judgement.of(balancer, each, outcomes))
            for (grid_point, each), outcomes in zip(field, ran, strict=True)
        ]
        for (first, end), survivors in zip(pairwise(HEATS), _SURVIVORS, strict=True):
            running.sort(key=lambda each: each.order)
            first_served = running[0].judgement.fraction
            if first_served.value < required_fraction - _MAX_SHORTFALL_FRACTION:
                return running[0]
            least = first_served.count - _MAX_BEHIND_DEVICES
            running = [each for each in running if each.judgement.fraction.count > least][:survivors]
            draws = Draws.block(start + first, end - first, complete=False)
            ran = balancer.run_all(
                [each.judgement.settings for each in running], draws, watch_time=_WATCH_TIME_S
            )
            running = [
                replace(each, judgement=each.judgement.extended(outcomes))
                for each, outcomes in zip(running, ran, strict=True)
            ]
        return min(running, key=lambda each: each.order)
    except (SceneError, *BREAKDOWNS):
        return None


def judged_design(
    scene: SceneFile,
    point: Point,
    *,
    grid_point: GridPoint | None = None,
    settings: Settings | None = None,
    search: bool = False,
    verdict: bool = False,
) -> Judgement | None:
    """Judge the best of some settings of a design on many devices; None: the scene is refused or breaks down.

    The devices are the same for every design and took no part in the races.  An interim look ends the
    judgement only if the fraction is three standard deviations from the required one, so that a design near
    the limit is decided by all devices, not by the first look that happens to be favourable.
    Args: `grid_point`, `settings`: settings to judge; default those of the scene. `search`: True adds the
        result of `tune`. `verdict`: True judges on devices that selected no design, with complete runs.
    Source: Haybittle, "Repeated Assessment of Results in Clinical Trials of Cancer Treatment", British
        Journal of Radiology 44 (1971).
    """
    try:
        balancer = quick_balancer(scene.with_values(point))
        proposed = [
            None if grid_point is None else balancer.trials()[grid_point[0]].at(grid_point[1]),
            settings,
            searched(balancer) if search else None,
        ]
        running: list[Settings] = []
        for each in proposed:
            if each is not None and each not in running:
                running.append(each)
        running = running or [{}]
        few, most = balancer.verdict_draws
        judgements: list[Judgement] = []
        first = 0
        for last in sorted({few, min(_CHOICE_DEVICES, most), most}):
            count, start = last - first, (FIRST_VERDICT_DEVICE if verdict else FIRST_CHOOSING_DEVICE) + first
            ran = judged_all(balancer, running, first=count, most=count, start=start, complete=verdict)
            pairs = zip(judgements, ran, strict=True)
            judgements = [a.extended(b.outcomes) for a, b in pairs] if judgements else list(ran)
            best = max(judgements, key=lambda judgement: judgement.fraction.value)
            if best.fraction.verdict(best.required_fraction, deviations=_STOP_SIGMA) != OPEN:
                break
            if last >= _CHOICE_DEVICES:
                judgements, running = [best], [best.settings]
            first = last
        return best
    except (SceneError, *BREAKDOWNS):
        return None


def tuned_settings(scene: SceneFile, point: Point) -> Settings | None:
    """Settings of a design by the search of `tune`; None: the scene is refused or breaks down."""
    try:
        return searched(quick_balancer(scene.with_values(point)))
    except (SceneError, *BREAKDOWNS):
        return None


def devices_row(scene: SceneFile, point: Point, *, settings: Settings, draws: Draws) -> BoolArray | None:
    """True for each device of a design that meets every demand; None: the scene is refused or breaks down."""
    try:
        balancer = quick_balancer(scene.with_values(point))
        (outcomes,) = balancer.run_all([settings], draws, watch_time=_WATCH_TIME_S)
        return Judgement.of(balancer, settings, outcomes).meets
    except (SceneError, *BREAKDOWNS):
        return None
