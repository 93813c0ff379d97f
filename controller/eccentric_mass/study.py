"""One scene with eccentric masses as a report needs it: balanced and locked run, loops, requirements.

Intervals follow from the scene's stated uncertainties and its sensors' noise: the plant is moved, not what
the controller is configured with, which does not know what is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, asdict, dataclass, field, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.eccentric_mass.document import eccentric_document
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.controller.eccentric_mass.run import locked_run, simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.sampled_loops import GAIN_MARGIN, RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import (
    EccentricScene,
    eccentric_drawn,
    eccentric_moved,
)
from ringbalance.controller.eccentric_mass.strategy.plan import STAGE_NAMES, Stage
from ringbalance.controller.eccentric_mass.strategy.settings import StrategySettings
from ringbalance.controller.eccentric_mass.strategy.targets import target_angles
from ringbalance.controller.eccentric_mass.tuning import (
    EccentricTuning,
    eccentric_tuning_document,
    tune_eccentric,
)
from ringbalance.scene.origins import InputUncertainty

_AT_LEAST: Final = "at least"
_AT_MOST: Final = "at most"
_LIMIT: Final = "supervisor.limit"
_ROUNDING: Final = 1e-12
_FEWEST: Final = 3
Interval = tuple[float, float]
Judged = Mapping[str, float | None]
"""Numbers that a run comes to, by name; None: it does not come to it."""
NOISE: Final = "sensor.noise"
_SEEDS: Final = 2
DRAWS: Final = 39
"""Of so many: 95 % of further ones lie between least and greatest, or between an end and the second."""


@dataclass(frozen=True)
class EccentricRequirement:
    """What is asked of the balancer and what it comes to; intervals are 95 %, from stated uncertainties."""

    quantity: str
    unit: str
    """SI; empty for a ratio."""
    sense: str
    """ "at least" or "at most"."""
    required: float
    set_by: str
    """Where the requirement comes from."""
    achieved: float | None
    """None: the run did not come to it."""
    _: KW_ONLY
    required_interval: Interval | None = None
    achieved_interval: Interval | None = None
    """None: no uncertainty is stated, or it does not move the number."""
    effects: Mapping[str, Interval] = field(default_factory=dict)
    """By how much each cause alone lowers and raises `excess`, by the input's path."""
    lost: tuple[str, ...] = ()
    """Causes with which a run does not come to it at all."""
    excess_interval: Interval | None = None
    """None: as `achieved_interval`."""
    reached: float = 1.0
    """Fraction of the drawn runs that come to it at all."""
    held: float = 1.0
    """Fraction of the drawn runs that meet the requirement."""

    @property
    def excess(self) -> float:
        """By which the requirement is more than met; minus infinity where the run does not come to it."""
        if self.achieved is None:
            return -math.inf
        more = self.achieved - self.required
        return more if self.sense == _AT_LEAST else -more

    @property
    def met(self) -> bool:
        """Whether it is, as the scene says."""
        return self.excess >= 0

    @property
    def verdict(self) -> str:
        """Whether it is with 95 % of what the inputs may be: met, not met, cannot be told.

        It is not where none of the drawn runs meets it, though the run as the scene says may.
        """
        least, most = self.excess_interval or (self.excess, self.excess)
        if most < 0 or self.held == 0.0:
            return "not met"
        always = self.reached == 1.0 and not self.lost
        return "met" if least >= 0 and always else "cannot be told"


@dataclass(frozen=True, kw_only=True)
class _EccentricStudy:
    """What a report shows of one scene."""

    scene: EccentricScene
    run: EccentricRun
    """As the scene says."""
    locked: EccentricRun
    """With the masses clamped where they start: the same rotor without balancing."""
    tuning: EccentricTuning
    """The loops alone, without runs."""
    requirements: tuple[EccentricRequirement, ...]

    def document(self) -> dict[str, Any]:
        """Plain numbers in SI: both runs as `simulate --json` gives them, the loops as `tune --json` does."""
        return {
            "run": eccentric_document(self.run),
            "locked": eccentric_document(self.locked),
            "tuning": eccentric_tuning_document(self.tuning),
            "requirements": [
                {**asdict(row), "met": row.met, "verdict": row.verdict} for row in self.requirements
            ],
        }


def eccentric_study(scene: EccentricScene) -> _EccentricStudy:
    """Run a scene balanced and locked, and judge its loops and requirements.

    A scene that states uncertainties is run again with all inputs drawn, which gives the intervals, and with
    each input at both ends of its own, which tells what they come from.
    """
    tuning = tune_eccentric(scene, runs=0)
    run, locked = simulate_eccentric(scene), locked_run(scene)
    moved, drawn = _moved_runs(scene), _drawn_runs(scene)
    rows = (_with_intervals(row, moved, drawn) for row in _of_run(scene, run))
    requirements = (*rows, *_of_loops(tuning.gains))
    return _EccentricStudy(scene=scene, run=run, locked=locked, tuning=tuning, requirements=requirements)


def _of_run(scene: EccentricScene, run: EccentricRun) -> Sequence[EccentricRequirement]:
    plant = PlantParameters.of(scene)
    gap = scene.masses.arc_length / scene.masses.guide_radius
    # Of an imbalance beyond all reach, what the masses side by side leave is what they lack.
    beyond = 4 * plant.moment
    capacity = beyond - target_angles(beyond, 0.0, plant.moment, gap).residual
    deviation = float(np.sqrt(np.max(np.linalg.eigvalsh(run.estimates.imbalance_covariance[-1]))))
    estimate = float(np.hypot(*run.estimates.imbalance[-1]))
    limit, gate = scene.supervisor.limit, scene.imbalance_filter.gate
    until, why = _deadline(scene)
    return [
        EccentricRequirement(
            "balancing moment", "kg m", _AT_LEAST, plant.unbalance, "the imbalance to cancel", capacity
        ),
        EccentricRequirement("amplitude at the end", "m", _AT_MOST, limit, _LIMIT, run.final_amplitude),
        EccentricRequirement(
            "largest amplitude after balancing", "m", _AT_MOST, limit, _LIMIT, _largest_balanced(run)
        ),
        EccentricRequirement("settling time", "s", _AT_MOST, until, why, run.settling_time),
        EccentricRequirement(
            "standard deviation of the imbalance, from noise",
            "kg m",
            _AT_MOST,
            gate * plant.unbalance,
            f"imbalance_filter.gate, {100 * gate:g} % of the imbalance",
            deviation if estimate > 0 else None,
        ),
    ]


def _deadline(scene: EccentricScene) -> tuple[float, str]:
    """Time by which the rotor must be balanced, s, and what sets it."""
    change = scene.steady_until
    if change is not None:
        return change, "the speed begins to change"
    return scene.run.time_limit, "run.time_limit, the end of the run"


def _of_loops(gains: RecommendedGains) -> Sequence[EccentricRequirement]:
    why = "half the gain at which the loop is unstable"
    return [
        EccentricRequirement(
            f"gain margin of the {loop.name}", "", _AT_LEAST, GAIN_MARGIN, why, loop.gain_margin
        )
        for loop in gains.loops
    ]


def _judged(scene: EccentricScene, run: EccentricRun) -> Judged:
    """Both sides of each row, and its excess, by the row's name and the side's."""
    return {
        f"{row.quantity}.{side}": value if row.achieved is not None or side == "required" else None
        for row in _of_run(scene, run)
        for side, value in (
            ("achieved", row.achieved),
            ("required", row.required),
            ("excess", row.excess),
        )
    }


def _with_intervals(
    row: EccentricRequirement, moved: Mapping[str, list[Judged]], drawn: Sequence[Judged]
) -> EccentricRequirement:
    if not drawn or row.achieved is None:
        return row
    excess = [run[f"{row.quantity}.excess"] for run in drawn]
    return replace(
        row,
        required_interval=_interval(row.required, drawn, f"{row.quantity}.required"),
        achieved_interval=_interval(row.achieved, drawn, f"{row.quantity}.achieved"),
        excess_interval=_interval(row.excess, drawn, f"{row.quantity}.excess"),
        effects=_effects(row.excess, moved, f"{row.quantity}.excess"),
        lost=_lost(moved, f"{row.quantity}.achieved"),
        reached=sum(run[f"{row.quantity}.achieved"] is not None for run in drawn) / len(drawn),
        held=sum(more is not None and more >= 0.0 for more in excess) / len(drawn),
    )


def _interval(value: float, drawn: Sequence[Judged], name: str) -> Interval | None:
    """None where nothing moves it, or too few runs come to it."""
    known = [number for run in drawn if (number := run[name]) is not None]
    if len(known) < _FEWEST:
        return None
    low, high = interval(value, known)
    return (low, high) if high - low > _ROUNDING * abs(value) else None


def _largest_balanced(run: EccentricRun) -> float | None:
    """From the strategy's rest on, m; None when it did not come to that."""
    last = run.stages[-1]
    if last.name != STAGE_NAMES[Stage.REST]:
        return None
    return float(np.max(run.amplitude[run.time >= last.start]))


def _moved_runs(scene: EccentricScene) -> dict[str, list[Judged]]:
    """What a run comes to with one input at either end of its stated interval, by the input's path.

    With any uncertainty stated, `NOISE` has the runs with further seeds. Empty: none is stated.
    """
    if not scene.uncertainty:
        return {}
    settings, seed = StrategySettings.of(scene), scene.run.seed

    def came_to(plant: EccentricScene, number: int) -> Judged:
        return _judged(plant, simulate_eccentric(plant, seed=number, settings=settings))

    moved = {
        each.quantity: [came_to(plant, seed) for plant in _both_ends(scene, each)]
        for each in scene.uncertainty
    }
    return moved | {NOISE: [came_to(scene, seed + more) for more in range(1, _SEEDS + 1)]}


def _drawn_runs(scene: EccentricScene) -> list[Judged]:
    """What runs come to with all stated inputs, and the noise, drawn at once; empty: none is stated."""
    if not scene.uncertainty and not scene.fitted.quantities:
        return []
    settings, seed = StrategySettings.of(scene), scene.run.seed
    plants = (
        (
            eccentric_drawn(scene, np.random.default_rng(np.random.SeedSequence(number, spawn_key=(1,)))),
            number,
        )
        for number in range(seed + 1, seed + 1 + DRAWS)
    )
    return [_judged(plant, simulate_eccentric(plant, seed=n, settings=settings)) for plant, n in plants]


def interval(value: float, drawn: Sequence[float]) -> tuple[float, float]:
    """Both ends between which 95 % of what is drawn lies; the value as the scene says is among them.

    An amplitude is least where nothing is wrong: such a value lies at the end of what is drawn, not in its
    middle, and a sum of squares of the effects of single inputs would count an end that nothing reaches.
    Source: order statistics; of n draws, a further one falls between two with i others between them with
        probability (i + 1)/(n + 1), whatever the distribution.
    """
    low, *_, high = ordered = sorted(drawn)
    if value < low:
        return value, ordered[-2]
    return (ordered[1], value) if value > high else (low, high)


def _both_ends(scene: EccentricScene, uncertain: InputUncertainty) -> Iterator[EccentricScene]:
    def at(sign: int) -> Callable[[float], float]:
        return lambda value: value + sign * uncertain.absolute(value)

    for sign in (-1, 1):
        yield eccentric_moved(scene, uncertain.quantity, at(sign))


def _effects(value: float, moved: Mapping[str, list[Judged]], name: str) -> dict[str, tuple[float, float]]:
    """By how much each cause alone lowers and raises a number, both at least zero."""
    found = {}
    for path, runs in moved.items():
        if changes := [number - value for run in runs if (number := run[name]) is not None]:
            found[path] = (max(0.0, -min(changes)), max(0.0, *changes))
    return found


def _lost(moved: Mapping[str, list[Judged]], name: str) -> tuple[str, ...]:
    """Causes with which at least one run does not come to a number at all."""
    return tuple(path for path, runs in moved.items() if any(run[name] is None for run in runs))
