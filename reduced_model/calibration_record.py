"""What `calibrate` finds out about a balancer, as one record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ringbalance.physics.tube.loss import TubeLoss
from ringbalance.reduced_model.budget import Budget, budgets
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration
from ringbalance.reduced_model.gas_line import LineAnswer
from ringbalance.reduced_model.instability import AsynchronousInstability
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.operating.point import OperatingPoint
from ringbalance.reduced_model.operating.residual import Holding, ResidualLiquid
from ringbalance.reduced_model.operating.tube_liquid import TubeLiquid
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.results.result import PresentedResult
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Calibration(PresentedResult):
    """Everything that `calibrate` finds out about a scene's balancer."""

    scene: Scene
    chamber: ChamberCalibration
    """Wall pressure, moment and lambda."""
    tube: TubeLoss
    """k over `VELOCITIES`."""
    flow_law: CalibratedLaw
    """The law distilled from both."""
    paper_law: PaperLaw
    """Eq. 19 of the liquid-ring paper, for comparison."""
    operating_point: OperatingPoint
    """At equal fills under the scene's gas pressure."""
    residual: ResidualLiquid
    """Of a chamber emptied under the scene's gas pressure, and what a pair can use."""
    tube_liquid: TubeLiquid
    """In the tube of a pair around its first injection, and what it does to the vibration."""
    gas_line: tuple[LineAnswer, ...]
    """What the gas line can deliver, or both ends of a default range of lines."""
    instability: AsynchronousInstability | None
    """Whirl that surface waves lock to; None where there is no such wave."""
    models_used: tuple[ModelUsed, ...]
    """Every physical term, with its model and its estimated contribution."""
    statistics: Mapping[str, float]
    """Counted work and measured interpolation errors; no wall times, so they reproduce."""

    @cached_property
    def budgets(self) -> Mapping[str, Budget]:
        """Uncertainty budget of every main quantity, made when it is first asked for."""
        return budgets(scene=self.scene, calibration=self)

    @property
    def holding(self) -> Holding:
        """Whether the fullest chamber that runs reach keeps its liquid with the gas off."""
        return Holding.of(self.scene, fill_ratio=self.residual.largest_fill_ratio)

    @property
    def model(self) -> BalancerModel:
        """The balancer as the closed loop takes it."""
        return BalancerModel.of(self.flow_law)

    def lambda_over_fill(self, *, fill_ratio: FloatArray) -> FloatArray:
        """lambda(x) per transferred mass, [U(x) - U(x_max - x)]/(rho V (x - x_max/2)).

        Returns: lambda, m, shape (n,); its limit at the centre.
        Source: definition; per difference of the two chambers' masses it is half of that.
        """
        law, chamber = self.flow_law, self.chamber
        largest = law.max_fill_ratio
        away = fill_ratio - largest / 2
        # Nearer than this the difference of two moments would be mostly interpolation error.
        centre = np.abs(away) < 0.02 * largest
        pair = law.moment.pair_moment(
            fill_ratio=fill_ratio, opposite_fill_ratio=np.clip(largest - fill_ratio, 0.0, largest)
        )
        mass = law.density * law.chamber_volume * np.where(centre, 1.0, away)
        return np.where(centre, float(chamber.moment_per_mass.value), pair / mass)

    @property
    def lambda_variation(self) -> float:
        """Variation of lambda over the fill range, (largest - smallest)/value at the centre.

        Source: definition; the liquid-ring paper states 0.7 %.
        """
        x = np.linspace(0.0, self.flow_law.max_fill_ratio, 101)
        values = self.lambda_over_fill(fill_ratio=x)
        return float(np.ptp(values) / self.chamber.moment_per_mass.value)
