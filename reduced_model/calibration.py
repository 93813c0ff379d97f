"""Calibration of a scene: lambda, k(u) and the flow law, each with its uncertainty and what it is made of.

Asynchronous instability, surface waves that lock to the whirl of a supercritical rotor, is estimated at the
end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.tube.loss import VELOCITIES, TubeLoss, tube_loss
from ringbalance.reduced_model.budget import Budget, budgets
from ringbalance.reduced_model.calibration_rows import calibration_rows
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration, calibrate_chamber
from ringbalance.reduced_model.chamber.gravity import check_ring
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.gas_line import LineAnswer, line_answers
from ringbalance.reduced_model.law.building import calibrated_law
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.loading import load_law
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_law, paper_model
from ringbalance.reduced_model.operating.point import OperatingPoint
from ringbalance.reduced_model.operating.residual import Holding, ResidualLiquid
from ringbalance.reduced_model.operating.tube_liquid import TubeLiquid
from ringbalance.reduced_model.terms import ModelUsed, models_used
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.results.findings import Finding
from ringbalance.results.result import Result, Rows
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene

VELOCITY_POINTS: Final = 47


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Calibration(Result):
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

    def to_dict(self) -> dict[str, Any]:
        return calibration_document(self)

    def rows(self) -> Rows:
        return calibration_rows(self)

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


def calibrate(scene: AnyScene) -> Calibration:
    """Calibrate a scene's balancer: lambda, k(u) and the flow law, with uncertainties.

    Raises: SceneError: a rotor too slow for the liquid to form a ring, or a balancer without liquid.
    Raises: ValueError: a tube whose bends do not fit into its length.
    Source: closed forms for the chamber, checked by finite elements; tables of finite elements for the
        laminar tube, correlations beyond; see the parts.
    """
    scene = liquid_ring_scene(scene)
    chamber, law = chamber_and_law(scene)
    heads, point = law.heads, OperatingPoint.of(scene=scene, law=law)
    return Calibration(
        scene=scene,
        chamber=chamber,
        tube=tube_loss(scene, np.geomspace(*VELOCITIES, VELOCITY_POINTS)),
        flow_law=law,
        paper_law=paper_law(scene),
        operating_point=point,
        residual=ResidualLiquid.of(scene, law=law),
        tube_liquid=TubeLiquid.of(scene, law=law),
        gas_line=line_answers(scene, BalancerModel.of(law)),
        instability=AsynchronousInstability.of(scene),
        models_used=models_used(scene),
        statistics={
            "closed_form_fills": float(np.count_nonzero(chamber.fill_ratio)),
            "finite_element_solves": float(chamber.check.solves),
            "unknowns": float(chamber.statistics.unknowns),
            "relative_residual": chamber.statistics.relative_residual,
            "tube_table_nodes": float(heads.head.value.size),
            "tube_table_error": heads.interpolation_error,
            "wall_pressure_table_error_Pa": float(np.max(chamber.wall_pressure.interpolation)),
            "hydrostatic_pressure_table_error_Pa": float(np.max(chamber.hydrostatic_pressure.interpolation)),
            "moment_table_error_kg_m": float(np.max(chamber.moment.interpolation)),
        },
    )


def calibrated_model(scene: Scene) -> BalancerModel:
    """The balancer that `calibrate` finds, without what it reports beside: half the work.

    Raises: SceneError, ValueError: as `calibrate`.
    """
    return BalancerModel.of(chamber_and_law(scene)[1])


def law_by_name(scene: Scene, law: str) -> BalancerModel:
    """Model of a scene under the law "calibrated", "paper", or that of a saved file.

    Raises: SceneError: a scene that cannot be calibrated, or a file that holds no law.
    """
    if law == "calibrated":
        return calibrated_model(scene)
    return paper_model(scene) if law == "paper" else BalancerModel.of(load_law(Path(law)))


def chamber_and_law(scene: Scene) -> tuple[ChamberCalibration, CalibratedLaw]:
    """The chamber, and the law.

    Raises: SceneError, ValueError: as `calibrate`.
    """
    check_ring(scene)
    chamber = calibrate_chamber(scene)
    return chamber, calibrated_law(scene=scene, chamber=chamber, heads=TubeHeads.of(scene))


DAMPING: Final = 0.01
"""Damping ratio that a rotor has at least, about: a growth below it is not worth a warning."""
_FILLS: Final = np.linspace(0.1, 1.0, 19)
"""Shares of max_fill_ratio."""


@dataclass(frozen=True, kw_only=True)
class AsynchronousInstability:
    """Critical speed that would be hit worst, and the growth of whirl there; orders of magnitude."""

    fill_ratio: float
    """Of all chambers."""
    critical_speed: float
    """(1 - s) omega, rad/s."""
    growth: float
    """Over that critical speed: the damping ratio that would stop it."""

    @classmethod
    def of(cls, scene: Scene) -> AsynchronousInstability | None:
        """Estimate at the worst fill; None where every wave is faster than the rotor, s >= 1.

        In the disc's frame the lowest wave of a chamber turns backwards at s omega, s^2 = k T,
        T = tanh(k ln(R2/a)), k = pi/theta; seen from outside at (1 - s) omega. With its effective mass
        m = rho B a^2 I^2 s^2/(theta/2), I = int sin(k phi) sin(phi) dphi, n chambers and M = 1/K of the
        rotor, (w_c^2 - w^2) (s^2 omega^2 - (w - omega)^2) = (n m/2M) w^4, which at w_c = (1 - s) omega
        grows with Im(w)/w_c = 0.5 ((n m/2M) (1 - s)/s)^(1/2).
        Range: order of magnitude. No Coriolis force on the wave (s is 3 % higher with it), no damping, equal
            fills, M from an influence coefficient K taken well above the critical speed.
        Source: derived; the mechanism after Wolf, J. Appl. Mech. 35 (1968) 676.
        """
        disc, omega = scene.disc, abs(scene.rotor.speed)
        fills = _FILLS * disc.max_fill_ratio
        k, radius = math.pi / disc.central_angle, surface_radius(disc=disc, fill_ratio=fills)
        square = k * np.tanh(k * np.log(disc.outer_radius / radius))
        slow = square < 1
        if not np.any(slow):
            return None
        s = np.sqrt(square[slow])
        sides = 2 * _overlap(k, disc) ** 2 / disc.central_angle
        mass = scene.liquid.density * disc.axial_width * radius[slow] ** 2 * sides * s**2
        ratio = disc.chambers / 2 * mass * scene.rotor.influence_coefficient
        growth = np.sqrt(ratio * (1 - s) / s) / 2
        worst = int(np.argmax(growth))
        return cls(
            fill_ratio=float(fills[slow][worst]),
            critical_speed=float((1 - s[worst]) * omega),
            growth=float(growth[worst]),
        )

    @property
    def finding(self) -> Finding | None:
        """Where the growth exceeds what rotors damp; None elsewhere."""
        if self.growth <= DAMPING:
            return None
        numbers = {"critical_speed": self.critical_speed, "fill_ratio": self.fill_ratio}
        return Finding(code="asynchronous_instability", values={**numbers, "damping_ratio": self.growth})


def _overlap(k: float, disc: Disc) -> float:
    """I, closed form."""
    if abs(k - 1) < 1e-6:
        return math.pi / 2
    return 2 * math.cos(disc.central_angle / 2) / (k**2 - 1)
