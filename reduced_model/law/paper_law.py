"""The liquid-ring paper as a balancer model: Eq. 19 for the flow, one lambda for the moment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ringbalance.physics.gas import chamber_pressures
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.law.flow_law import (
    BalancerModel,
    Flow,
    Regime,
    checked_conditions,
    law_text,
    save_record,
)
from ringbalance.reduced_model.tube.flow import tube_path
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.typed_record import NotNegative, Positive


@dataclass(frozen=True, kw_only=True)
class PaperMoment:
    """Moment of a pair by one lambda: U = lambda rho V (x_A - x_C)/2, lambda per *transferred* mass.

    Eq. 21's mass is the difference of the two chambers, twice the transferred one; with 72 mm Eq. 22 taken
    literally would be twice Eq. 7.  The reading used here agrees with Eq. 7 and with Fig. 7.
    """

    moment_per_transferred_mass: float
    """lambda, m."""
    density: Positive
    """rho, kg/m^3."""
    chamber_volume: Positive
    """V, m^3."""

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        x, y = (np.asarray(v, dtype=np.float64) for v in (fill_ratio, opposite_fill_ratio))
        transferred = self.density * self.chamber_volume * (x - y) / 2
        return np.asarray(self.moment_per_transferred_mass * transferred, dtype=np.float64)

    def pair_vector(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> ComplexArray:
        moment = self.pair_moment(fill_ratio=fill_ratio, opposite_fill_ratio=opposite_fill_ratio)
        return np.asarray(moment, dtype=np.complex128)


@dataclass(frozen=True, kw_only=True)
class PaperLaw:
    """Eq. 19 as a flow law: u = sqrt(2/(rho (k+1)) [p0 + rho omega^2 V (x_A - x_C)/(B theta)]).

    With the gas on and the bracket positive the tube is a full siphon; otherwise it is blocked, because in
    the paper the column separates when the gas is off.  This needs a crest that holds the liquid: from a
    chamber with a level above `return_pressure` liquid runs back by the reversed equation.  The paper states
    no uncertainty, so none is returned.  Between events du/dt = -2 omega^2 S/((k+1) B theta).

    `table()` holds `velocity_squared_per_pressure` 2/(rho (k+1)), m^3/kg, and `pressure_per_fill_difference`
    rho omega^2 V/(B theta), Pa: u^2 = the first times (p0 + the second times (x_A - x_C)).
    """

    density: Positive
    """rho, kg/m^3."""
    angular_velocity: float
    """omega, rad/s."""
    axial_width: Positive
    """B, m."""
    central_angle: Positive
    """theta, rad."""
    chamber_volume: Positive
    """V of Eq. 4, m^3."""
    tube_area: Positive
    """S, m^2."""
    drag_coefficient: NotNegative
    """k."""
    max_fill_ratio: Positive
    """Liquid of the pair as a fraction of one chamber's volume; 0.5 in the paper."""
    ambient_pressure: NotNegative
    """Absolute, Pa."""
    moment: PaperMoment
    """Moment of a pair that goes with this law."""
    return_pressure: float | None = None
    """Hydrostatic pressure of a vented chamber above which liquid leaves it against a vented one, Pa; None:
    no liquid returns, as in the paper."""

    def __repr__(self) -> str:
        return law_text(self)

    @property
    def name(self) -> str:
        return "paper"

    @property
    def velocity_squared_per_pressure(self) -> float:
        """2/(rho (k + 1)), m^3/kg."""
        return 2 / (self.density * (self.drag_coefficient + 1))

    @property
    def pressure_per_fill_difference(self) -> float:
        """rho omega^2 V/(B theta), Pa."""
        head = self.density * self.angular_velocity**2
        return head * self.chamber_volume / (self.axial_width * self.central_angle)

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        """Flow by Eq. 19; blocked or reverse up to the stall pressure and with the gas off."""
        fill, opposite_fill, gas, _ = checked_conditions(
            self, fill_ratio, opposite_fill_ratio, gas_pressure, primed
        )
        level = self.pressure_per_fill_difference * (fill - opposite_fill)
        squared = self.velocity_squared_per_pressure * (gas + level)
        flows = (squared > 0) & (gas > 0)
        # The opposite chamber's liquid passes the crest against the driven one's gas.
        crest = math.inf if self.return_pressure is None else self.return_pressure
        opposite = self.pressure_per_fill_difference * opposite_fill
        returns = (squared < 0) & (opposite - crest > gas)
        velocity = np.where(flows | returns, np.sign(squared) * np.sqrt(np.abs(squared)), 0.0)
        regime = np.where(flows, Regime.SIPHON, np.where(returns, Regime.REVERSE, Regime.BLOCKED))
        return Flow(
            velocity=velocity,
            regime=regime.astype(np.int64),
            uncertainty=np.zeros_like(velocity),
            primed=np.asarray(flows | returns),
        )

    def holds(self, fill_ratio: float) -> bool:
        """True if a chamber keeps its liquid with the gas off, against a chamber with less."""
        level = self.pressure_per_fill_difference * fill_ratio
        return self.return_pressure is None or level <= self.return_pressure

    def table(self) -> Mapping[str, FloatArray]:
        names = ("velocity_squared_per_pressure", "pressure_per_fill_difference")
        return {name: np.array([getattr(self, name)]) for name in names}

    def save(self, path: Path | str) -> Path:
        return save_record(path=Path(path), record=self)


def paper_law(scene: AnyScene) -> PaperLaw:
    """The paper's flow law for a scene, with k = 50 unless the scene fixes it.

    The gas pressure counts as measured: Eq. 19 has no gas column, so `gas.measured_at` has no effect.  With
    the gas off the scene's tube decides what runs back, as under any law: without a crest all of it.

    Raises: SceneError: a balancer without liquid.
    Source: Eqs. 4 and 19; lambda = 72 mm.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> law = rb.paper_law(scene)
        >>> f"{law.evaluate(fill_ratio=0.25, gas_pressure=0.7e6).velocity:.2f} m/s"
        '5.24 m/s'
    """
    scene = liquid_ring_scene(scene)
    volume = paper.chamber_volume_paper(disc=scene.disc)
    drag = scene.tube.drag_coefficient
    return PaperLaw(
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        axial_width=scene.disc.axial_width,
        central_angle=scene.disc.central_angle,
        chamber_volume=volume,
        tube_area=scene.tube.area,
        drag_coefficient=paper.PAPER_DRAG_COEFFICIENT if drag is None else drag,
        max_fill_ratio=scene.disc.max_fill_ratio,
        ambient_pressure=chamber_pressures(scene.gas)[1],
        moment=PaperMoment(
            moment_per_transferred_mass=paper.PAPER_LAMBDA_M,
            density=scene.liquid.density,
            chamber_volume=volume,
        ),
        return_pressure=tube_path(scene).return_pressure,
    )


def paper_model(scene: Scene) -> BalancerModel:
    """Balancer of the paper: Eq. 19, V of Eq. 4, lambda = 72 mm per transferred mass.

    Source: sections 3 and 5 of the liquid-ring paper.
    """
    return BalancerModel.of(paper_law(scene))
