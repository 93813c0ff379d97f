"""Pressure fields for the report: solved here, written as VTU, drawn elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ringbalance.mesh.chamber import chamber_mesh, default_cells
from ringbalance.mesh.export import write_vtu
from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid, solve_pressure
from ringbalance.reduced_model import paper
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.models import Scene

Record = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Outside:
    """Faces that bound the liquid, for drawing."""

    places: FloatArray
    """Of all nodes, m, shape (n, 3)."""
    faces: IntArray
    """Corners in order, shape (faces, 4); a triangle repeats its last."""
    pressure: FloatArray
    """At the nodes, Pa, shape (n,)."""


class ShownField(Protocol):
    """Pressure of the liquid in one chamber, gravity left out, as a report shows it."""

    @property
    def fill_ratio(self) -> float:
        """x."""
        ...

    def record(self) -> Record:
        """Sizes of the mesh, and how the solve ended."""
        ...

    def pressure_profile(self, *, scene: Scene) -> Record:
        """Pressure from the free surface to the wall, and the profile that Eq. 12 implies, SI."""
        ...

    def write(self, *, path: Path) -> Path:
        """Write gauge pressure, Pa, and depth below the free surface, m. Raises: OSError."""
        ...

    def outside(self) -> Outside:
        """What bounds the liquid."""
        ...


def profile(scene: Scene, fill_ratio: float, radius: FloatArray, pressure: FloatArray) -> Record:
    """Pressure over the radius, and the profile that Eq. 12 implies, SI.

    Eq. 12's wall pressure is that of a ring whose surface lies at sqrt(R2^2 - 2 V'/(B theta)).
    Source: Eq. 12 of the liquid-ring paper.
    """
    disc = scene.disc
    volume = fill_ratio * chamber_volume(disc=disc)
    implied = math.sqrt(disc.outer_radius**2 - 2 * volume / (disc.axial_width * disc.central_angle))
    drawn = np.linspace(implied, disc.outer_radius, radius.size)
    factor = scene.liquid.density * scene.rotor.speed**2 / 2
    wall = paper.wall_pressure_paper(
        disc=disc, density=scene.liquid.density, angular_velocity=scene.rotor.speed, liquid_volume=volume
    )
    return {
        "fill_ratio": fill_ratio,
        "radius_m": radius.tolist(),
        "pressure_Pa": pressure.tolist(),
        "paper_radius_m": drawn.tolist(),
        "paper_pressure_Pa": [*(factor * (drawn[:-1] ** 2 - implied**2)).tolist(), float(wall)],
    }


@dataclass(frozen=True, kw_only=True)
class ChamberField:
    """The liquid's pressure in one chamber, gravity left out."""

    fill_ratio: float
    surface_radius: float
    """m."""
    solution: PressureSolution
    """On the three-dimensional mesh."""

    def record(self) -> Record:
        """Sizes and quality of the mesh, and how the solve ended."""
        chamber, solution = self.solution.chamber, self.solution
        quality = chamber.quality()
        return {
            "cells": list(chamber.cells),
            "unknowns": quality.nodes,
            "minimum_scaled_jacobian": quality.minimum_scaled_jacobian,
            "largest_aspect": quality.maximum_aspect,
            "relative_residual": solution.statistics.relative_residual,
            "status": solution.status.text,
        }

    def pressure_profile(self, *, scene: Scene) -> Record:
        """Nodal pressure along the middle of the chamber, and the profile that Eq. 12 implies, SI."""
        chamber = self.solution.chamber
        line = chamber.grid[:, chamber.grid.shape[1] // 2, chamber.grid.shape[2] // 2]
        radius = np.hypot(*chamber.places[:2, line])
        return profile(scene, self.fill_ratio, radius, self.solution.pressure[line])

    def outside(self) -> Outside:
        """What bounds the liquid."""
        chamber = self.solution.chamber
        corners = chamber.grid[(slice(None, None, chamber.order),) * 3]
        sides = [np.take(corners, end, axis=axis) for axis in range(3) for end in (0, -1)]
        faces = [
            np.stack([side[:-1, :-1], side[1:, :-1], side[1:, 1:], side[:-1, 1:]], axis=-1).reshape(-1, 4)
            for side in sides
        ]
        return Outside(places=chamber.places.T, faces=np.concatenate(faces), pressure=self.solution.pressure)

    def write(self, *, path: Path) -> Path:
        """Write the field to a VTU file: gauge pressure in Pa and depth below the free surface in m.

        Raises: OSError: the file cannot be written.
        """
        chamber = self.solution.chamber
        radius = np.hypot(*chamber.places[:2])
        fields = {
            "pressure_Pa": self.solution.pressure,
            "depth_m": np.maximum(radius - self.surface_radius, 0.0),
        }
        return write_vtu(path, chamber=chamber, fields=fields)


def shown_fill(scene: Scene) -> float:
    """Fill ratio at which fields are shown: that of the start, or of equal chambers when that is none.

    Returns: Fill ratio, positive.
    """
    return scene.disc.initial_fill or scene.disc.max_fill_ratio / 2


def chamber_field(scene: Scene, *, fill_ratio: float) -> ChamberField:
    """Solve the pressure of the liquid in one chamber in three dimensions, gravity left out.

    Args: `fill_ratio`: x, within (0, 1).
    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem.
    """
    disc = scene.disc
    radius = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
    chamber = chamber_mesh(disc=disc, surface_radius=radius, cells=default_cells(disc=disc, dimension=3))
    liquid = RotatingLiquid(density=scene.liquid.density, angular_velocity=scene.rotor.speed)
    solution = solve_pressure(chamber=chamber, problem=liquid.problem())
    return ChamberField(fill_ratio=fill_ratio, surface_radius=radius, solution=solution)
