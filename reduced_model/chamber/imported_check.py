"""Finite elements of the liquid in an imported chamber, beside the integrals over its walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics import deferred
from ringbalance.physics.results import Estimate, Statistics, Status
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Scene

_CUT: Final = 1e-6
"""Relative, of totals: walls that the surface cuts are drawn again by the parts of their cells."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ImportedElements:
    """Totals of one chamber's liquid without gravity, on the scene's own mesh cut along the free surface."""

    fill_ratio: FloatArray
    wall_pressure: Estimate
    """Pa, shape (n,)."""
    moment: Estimate
    """kg m, shape (n,)."""
    volume: FloatArray
    """Of the liquid as it is drawn, m^3, shape (n,)."""
    cells: tuple[tuple[int, ...], ...]
    """Of the scene's mesh."""
    status: Status
    statistics: Statistics


def imported_elements(scene: Scene, geometry: ChamberGeometry, *, fill_ratio: FloatArray) -> ImportedElements:
    """Solve the pressure at a few fills; uncertainties hold the elements' error and the drawn volume's."""
    disc, density = scene.disc, scene.liquid.density
    rings = [
        deferred.solved_ring(
            geometry=geometry,
            density=density,
            angular_velocity=scene.rotor.speed,
            surface_radius=float(radius),
        )
        for radius in surface_radius(disc=disc, fill_ratio=fill_ratio)
    ]
    pressure = np.array([float(ring.wall_pressure.value) for ring in rings])
    moment = np.array([ring.first_moment[0] for ring in rings])
    volume = np.array([ring.volume for ring in rings])
    wanted = fill_ratio * chamber_volume(disc=disc)
    drawn = np.abs(volume / wanted - 1)
    status = next((ring.status for ring in rings if not ring.status.ok), Status())
    return ImportedElements(
        fill_ratio=fill_ratio,
        wall_pressure=Estimate(
            value=pressure,
            uncertainty=np.array([float(ring.wall_pressure.uncertainty) for ring in rings]) + _CUT * pressure,
        ),
        # A free surface drawn by quadratic facets takes liquid off or adds some, all of it at the surface.
        moment=Estimate(value=moment, uncertainty=(_CUT + 2 * drawn) * np.abs(moment)),
        volume=volume,
        cells=((len(geometry.cells),),),
        status=status,
        statistics=rings[-1].statistics,
    )
