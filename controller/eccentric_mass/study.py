"""One scene with eccentric masses as a report needs it: balanced and locked run, loops, requirements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from ringbalance.controller.eccentric_mass.document import eccentric_document
from ringbalance.controller.eccentric_mass.plant.open_loop import Progress
from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.controller.eccentric_mass.run import locked_run, simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.sampled_loops import (
    GAIN_MARGIN,
    RecommendedGains,
    recommended_gains,
)
from ringbalance.controller.eccentric_mass.strategy.plan import STAGE_NAMES, Stage
from ringbalance.controller.eccentric_mass.strategy.targets import target_angles
from ringbalance.controller.tuning.eccentric import eccentric_tuning_document
from ringbalance.scene.eccentric_models import EccentricScene

_AT_LEAST: Final = "at least"
_AT_MOST: Final = "at most"


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """What is asked of the balancer, beside what it comes to."""

    quantity: str
    unit: str
    """SI; empty for a ratio."""
    sense: str
    """ "at least" or "at most"."""
    required: float
    achieved: float | None
    """None: the run did not come to it."""

    @property
    def met(self) -> bool:
        """Whether it is."""
        if self.achieved is None:
            return False
        more = self.achieved - self.required
        return more >= 0 if self.sense == _AT_LEAST else more <= 0


@dataclass(frozen=True, kw_only=True)
class EccentricStudy:
    """What a report shows of one scene."""

    scene: EccentricScene
    run: EccentricRun
    """As the scene says."""
    locked: EccentricRun
    """With the masses clamped where they start: the same rotor without balancing."""
    gains: RecommendedGains
    requirements: tuple[Requirement, ...]

    def document(self) -> dict[str, Any]:
        """Plain numbers in SI: both runs as `simulate --json` gives them, the loops as `tune --json` does."""
        return {
            "run": eccentric_document(self.run),
            "locked": eccentric_document(self.locked),
            "tuning": eccentric_tuning_document(self.scene, self.gains),
            "requirements": [{**asdict(row), "met": row.met} for row in self.requirements],
        }


def eccentric_study(
    scene: EccentricScene, *, seed: int | None = None, progress: Progress | None = None
) -> EccentricStudy:
    """Run a scene balanced and locked, and judge its loops and requirements; seed as in the run."""
    gains = recommended_gains(scene)
    run = simulate_eccentric(scene, seed=seed, progress=progress)
    locked = locked_run(scene, progress=progress)
    requirements = tuple(_requirements(scene, run, gains))
    return EccentricStudy(scene=scene, run=run, locked=locked, gains=gains, requirements=requirements)


def _requirements(scene: EccentricScene, run: EccentricRun, gains: RecommendedGains) -> Sequence[Requirement]:
    plant = plant_parameters(scene)
    gap = scene.masses.arc_length / scene.masses.guide_radius
    # Of an imbalance beyond all reach, what the masses side by side leave is what they lack.
    beyond = 4 * plant.moment
    capacity = beyond - target_angles(beyond, 0.0, plant.moment, gap).residual
    deviation = float(np.sqrt(np.max(np.linalg.eigvalsh(run.estimates.imbalance_covariance[-1]))))
    estimate = float(np.hypot(*run.estimates.imbalance[-1]))
    limit, margin = scene.supervisor.limit, "gain margin of the "
    return [
        _row("balancing moment", "kg m", _AT_LEAST, plant.unbalance, capacity),
        _row("amplitude at the end", "m", _AT_MOST, limit, run.final_amplitude),
        _row("largest amplitude after balancing", "m", _AT_MOST, limit, _largest_balanced(run)),
        _row("settling time", "s", _AT_MOST, scene.run.time_limit, run.settling_time),
        _row(
            "standard deviation of the imbalance",
            "kg m",
            _AT_MOST,
            scene.imbalance_filter.gate * plant.unbalance,
            deviation if estimate > 0 else None,
        ),
        *(_row(margin + loop.name, "", _AT_LEAST, GAIN_MARGIN, loop.gain_margin) for loop in gains.loops),
    ]


def _row(quantity: str, unit: str, sense: str, required: float, achieved: float | None) -> Requirement:
    return Requirement(quantity=quantity, unit=unit, sense=sense, required=required, achieved=achieved)


def _largest_balanced(run: EccentricRun) -> float | None:
    """From the strategy's rest on, m; None when it did not come to that."""
    last = run.stages[-1]
    if last.name != STAGE_NAMES[Stage.REST]:
        return None
    return float(np.max(run.amplitude[run.time >= last.start]))
