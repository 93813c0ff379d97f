"""A chamber at one fill by finite elements, at rest and with the swinging liquid; errors of meshes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.chamber import default_cells
from ringbalance.mesh.cut.tilted import tilted_liquid
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics import deferred
from ringbalance.physics.pressure.ring import RingQuantities
from ringbalance.reduced_model.chamber.imported_check import imported_elements
from ringbalance.reduced_model.chamber.imported_walls import drawing_shares
from ringbalance.reduced_model.chamber.scene_ring import scene_ring
from ringbalance.reduced_model.chamber.values import ChamberValues
from ringbalance.reduced_model.contribution import Contribution
from ringbalance.scene.models import Scene

COARSE_MESH: Final = "coarse mesh"
FINE_MESH: Final = "fine mesh"
_STEP: Final = 0.01
"""Of the fill ratio, for the slope of the moment."""


def _mesh_error(scene: Scene, angular_cells: int) -> float:
    """Discretisation error of a mesh, relative: an arc drawn by cells of angle h, (h/2)^4/32 R2/depth.

    Returns: Share of the wall pressure at a fifth of the largest fill.
    Source: remainder of a quadratic interpolation of a circle.
    """
    outer = scene.disc.outer_radius
    surface = float(surface_radius(disc=scene.disc, fill_ratio=0.2 * scene.disc.max_fill_ratio))
    h = scene.disc.central_angle / angular_cells
    return (h / 2) ** 4 / 32 * outer / (outer - surface)


def mesh_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """Contributions of the meshes' errors, by name; of an imported chamber what its facets leave."""
    if scene.disc.geometry is not None:
        shares = drawing_shares(scene.disc, np.array([0.2 * scene.disc.max_fill_ratio]))
        return {
            FINE_MESH: Contribution(
                term=FINE_MESH,
                value=float(max(shares.wall_pressure[0], shares.moment[0])),
                formula="h delta/12",
                source="an arc of angle delta over a facet",
            )
        }
    cells = default_cells(disc=scene.disc)[1]
    return {
        term: Contribution(
            term=term,
            value=_mesh_error(scene, angular),
            formula="(h/2)^4/32 R2/depth",
            source="a circle's interpolation",
        )
        for term, angular in ((COARSE_MESH, max(4, cells // 2)), (FINE_MESH, cells))
    }


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


def by_imported_elements(scene: Scene, fill: float) -> ChamberValues:
    """Finite elements on an imported chamber's own mesh, gravity left out.

    Returns: ChamberValues; lambda as the change of the moment between two neighbouring fills.
    Source: `imported_elements`.
    """
    geometry = scene.disc.geometry
    if geometry is None:
        raise ValueError("the scene's chamber is not imported")
    step = min(_STEP, fill / 2, (1 - fill) / 2)
    found = imported_elements(scene, geometry, fill_ratio=np.array([fill, fill - step, fill + step]))
    at, low, high = found.moment.value
    mass = scene.liquid.density * float(found.volume[2] - found.volume[1])
    return ChamberValues(
        wall_pressure=float(found.wall_pressure.value[0]),
        wall_pressure_ripple=0.0,
        moment=float(at),
        moment_ripple=0.0,
        moment_per_mass=2 * float(high - low) / mass,
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
    for kept in (_elements_at, _sloshing_factors, tilted_liquid, deferred.wave_system):
        kept.cache_clear()


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
