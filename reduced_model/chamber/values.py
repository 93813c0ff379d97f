"""Wall pressure, moment and lambda of a chamber at one fill, by every model there is, one function each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ringbalance.mesh.chamber import default_cells
from ringbalance.physics import deferred
from ringbalance.physics.pressure.ring import RingQuantities
from ringbalance.reduced_model.chamber.inputs import chamber_closed_forms
from ringbalance.reduced_model.chamber.scene_ring import scene_ring
from ringbalance.reduced_model.chamber.tilted_ring import tilted_ring
from ringbalance.reduced_model.paper import formulas as paper
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True)
class ChamberValues:
    """Both quantities of a chamber at one fill ratio."""

    wall_pressure: float
    wall_pressure_ripple: float
    moment: float
    moment_ripple: float
    moment_per_mass: float
    """lambda for liquid added at this fill: 2 (dU/dV')/rho, m."""

    def pressures(self) -> FloatArray:
        """Mean and largest over a turn, Pa."""
        return np.array([self.wall_pressure, self.wall_pressure + self.wall_pressure_ripple])

    def moments(self) -> FloatArray:
        """Mean and largest over a turn, kg m, and lambda, m."""
        return np.array([self.moment, self.moment + self.moment_ripple, self.moment_per_mass])


def by_paper(scene: Scene, fill: float) -> ChamberValues:
    """Eqs. 3, 4, 7 and 12, and lambda = 72 mm.

    Source: the liquid-ring paper.
    """
    disc, rho = scene.disc, scene.liquid.density
    volume = fill * paper.chamber_volume_paper(disc=disc)
    radius = paper.surface_radius_paper(disc=disc, liquid_volume=volume)
    pressure = paper.wall_pressure_paper(
        disc=disc, density=rho, angular_velocity=scene.rotor.speed, liquid_volume=volume
    )
    moment = paper.moment_paper(disc=disc, density=rho, surface_radius=radius)
    return ChamberValues(
        wall_pressure=float(pressure),
        wall_pressure_ripple=0.0,
        moment=float(moment),
        moment_ripple=0.0,
        moment_per_mass=paper.PAPER_LAMBDA,
    )


def by_closed_form(scene: Scene, fill: float) -> ChamberValues:
    """P = rho omega^2 (R2^2 - a^2)/2, U = rho B int x dA, lambda = 2 a sin(alpha)/alpha; no gravity.

    Returns: ChamberValues without any ripple; exact but for gravity.
    Source: hydrostatics with the chamber's exact geometry.
    """
    pressure, moment, ratio = chamber_closed_forms(scene=scene, fill_ratio=fill)
    return ChamberValues(
        wall_pressure=float(pressure),
        wall_pressure_ripple=0.0,
        moment=float(moment),
        moment_ripple=0.0,
        moment_per_mass=float(ratio),
    )


def by_quadrature(scene: Scene, fill: float) -> ChamberValues:
    """The tilted free surface found, and integrated over, without a mesh.

    Returns: ChamberValues, exact for liquid at rest in the rotating frame at every instant.
    Source: `tilted_ring`.
    """
    found = tilted_ring(
        disc=scene.disc,
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        gravity=scene.environment.gravity,
        shaft=scene.environment.shaft,
        fill_ratio=np.array([fill]),
    )
    return ChamberValues(
        wall_pressure=float(found.wall_pressure[0]),
        wall_pressure_ripple=float(found.wall_pressure_ripple[0]),
        moment=float(found.moment[0]),
        moment_ripple=float(found.moment_ripple[0]),
        moment_per_mass=2 * float(found.moment_per_volume[0]) / scene.liquid.density,
    )


def by_elements(scene: Scene, fill: float, *, cells: tuple[int, ...], gravity: bool) -> ChamberValues:
    """Finite elements on a mesh and the two coarser ones that its grid convergence needs.

    Source: `ring_quantities`.
    """
    found = _elements_at(scene, fill, cells=cells, gravity=gravity)
    return ChamberValues(
        wall_pressure=float(found.wall_pressure.value[0]),
        wall_pressure_ripple=float(found.ripple["wall_pressure"][0]),
        moment=float(found.moment.value[0]),
        moment_ripple=float(found.ripple["moment"][0]),
        moment_per_mass=2 * float(found.moment_per_volume.value[0]) / scene.liquid.density,
    )


def with_sloshing(
    scene: Scene, fill: float, *, still: Callable[[Scene, float], ChamberValues]
) -> ChamberValues:
    """Values of a quasi-static model with its ripples as the swinging liquid makes them.

    Returns: ChamberValues; the ripples times their amplifications.
    Source: `sloshing_response`.
    """
    found = still(scene, fill)
    of_pressure, of_moment = _sloshing_factors(scene, fill)
    return replace(
        found,
        wall_pressure_ripple=of_pressure * found.wall_pressure_ripple,
        moment_ripple=of_moment * found.moment_ripple,
    )


def forget_solves() -> None:
    """Do every solve again when it is next asked for, so that it can be timed."""
    _elements_at.cache_clear()
    _sloshing_factors.cache_clear()


def sloshing_meshes(scene: Scene) -> tuple[tuple[int, int], ...]:
    """Meshes on which the swinging liquid is solved, finest first: half as fine as for frequencies."""
    radial, angular = default_cells(disc=scene.disc)
    return tuple((radial // k, angular // k) for k in (1, 2, 4))


@lru_cache(maxsize=256)
def _sloshing_factors(scene: Scene, fill: float) -> tuple[float, float]:
    """How much the swinging liquid enlarges gravity's ripples, by finite elements.

    Returns: Amplifications of the wall pressure and of the moment.
    Source: `sloshing_response`.
    """
    found = deferred.sloshing_response(
        disc=scene.disc,
        fill_ratio=[fill],
        angular_velocity=abs(scene.rotor.speed),
        kinematic_viscosity=scene.liquid.kinematic_viscosity,
        gravity=scene.environment.gravity,
        cells=sloshing_meshes(scene),
    )
    return float(found.pressure_amplification.value[0]), float(found.amplification.value[0])


@lru_cache(maxsize=256)
def _elements_at(scene: Scene, fill: float, *, cells: tuple[int, ...], gravity: bool) -> RingQuantities:
    """The finite elements of `by_elements`, with all they tell."""
    meshes = tuple(tuple(max(1, n // k) for n in cells) for k in (1, 2, 4))
    return scene_ring(scene, fill_ratio=[fill], gravity=gravity, cells=meshes)
