"""Wall pressure, moment and lambda of a chamber at one fill, by formula or quadrature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.chamber.inputs import chamber_closed_forms
from ringbalance.reduced_model.chamber.tilted_ring import tilted_ring
from ringbalance.reduced_model.paper import formulas as paper
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True)
class ChamberValues:
    """Both quantities of a chamber at one fill ratio."""

    wall_pressure: float
    moment: float
    moment_per_mass: float
    """lambda for liquid added at this fill: 2 (dU/dV')/rho, m."""
    wall_pressure_ripple: float = 0.0
    moment_ripple: float = 0.0

    def pressures(self) -> FloatArray:
        """Mean and largest over a turn, Pa."""
        return np.array([self.wall_pressure, self.wall_pressure + self.wall_pressure_ripple])

    def moments(self) -> FloatArray:
        """Mean and largest over a turn, kg m, and lambda, m."""
        return np.array([self.moment, self.moment + self.moment_ripple, self.moment_per_mass])


def paper_closed_forms(scene: Scene, fill_ratio: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Wall pressure, Pa, and moment, kg m, by the liquid-ring paper, with the paper's own volume.

    Source: Eqs. 3, 4, 7 and 12.
    """
    disc, rho = scene.disc, scene.liquid.density
    volume = np.asarray(fill_ratio) * paper.chamber_volume_paper(disc=disc)
    radius = paper.surface_radius_paper(disc=disc, liquid_volume=volume)
    pressure = paper.wall_pressure_paper(
        disc=disc, density=rho, angular_velocity=scene.rotor.speed, liquid_volume=volume
    )
    moment = paper.moment_paper(disc=disc, density=rho, surface_radius=radius)
    # A root and its square differ by rounding, of which an empty chamber shall have nothing.
    return pressure, np.where(volume > 0, moment, 0.0)


def by_paper(scene: Scene, fill: float) -> ChamberValues:
    """`paper_closed_forms`, and lambda = 72 mm."""
    pressure, moment = paper_closed_forms(scene, fill)
    return ChamberValues(
        wall_pressure=float(pressure), moment=float(moment), moment_per_mass=paper.PAPER_LAMBDA
    )


def by_closed_form(scene: Scene, fill: float) -> ChamberValues:
    """P = rho omega^2 (R2^2 - a^2)/2, U = rho B int x dA, lambda = 2 a sin(alpha)/alpha; no gravity.

    Returns: ChamberValues without any ripple; exact but for gravity.
    Source: hydrostatics with the chamber's exact geometry.
    """
    pressure, moment, ratio = chamber_closed_forms(scene=scene, fill_ratio=fill)
    return ChamberValues(wall_pressure=float(pressure), moment=float(moment), moment_per_mass=float(ratio))


def by_quadrature(scene: Scene, fill: float) -> ChamberValues:
    """The tilted free surface found, and integrated over, without a mesh.

    Returns: ChamberValues, exact for liquid at rest in the rotating frame at every instant.
    Source: `tilted_ring`.
    """
    found = tilted_ring(scene, np.array([fill]))
    return ChamberValues(
        wall_pressure=float(found.wall_pressure[0]),
        wall_pressure_ripple=float(found.wall_pressure_ripple[0]),
        moment=float(found.moment[0]),
        moment_ripple=float(found.moment_ripple[0]),
        moment_per_mass=2 * float(found.moment_per_volume[0]) / scene.liquid.density,
    )
