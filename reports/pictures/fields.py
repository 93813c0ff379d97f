"""The pressure field of a sector or of an imported chamber in three dimensions, and VTU files of meshes with
their boundary names and fields.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import meshio
import numpy as np
import numpy.typing as npt
from skfem.io.meshio import to_meshio

from ringbalance.mesh.chamber import chamber_mesh, default_cells
from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.mesh.liquid_body import liquid_body
from ringbalance.mesh.quadratic_tetrahedra import scikit_fem_mesh, tetrahedra
from ringbalance.physics.pressure.solve import RotatingLiquid, quadratic_basis, solve_on, solve_pressure
from ringbalance.reduced_model import paper
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.files import draft_folder, write_whole

Record = dict[str, Any]
_PROFILE_RADII: Final = 17
"""Number of radii of an imported chamber's profile."""


@dataclass(frozen=True, kw_only=True)
class _ChamberField:
    """The liquid's gauge pressure in one chamber, gravity left out, at the nodes of a mesh."""

    fill_ratio: float
    surface_radius: float
    """Radius of the free surface, m."""
    mesh: Any
    """Mesh of scikit-fem, m."""
    pressure: FloatArray
    """Gauge pressure, Pa, shape (nodes,)."""
    profile: tuple[FloatArray, FloatArray]
    """Radius, m, rising from the free surface to the wall, and pressure, Pa."""
    record: Record
    """Sizes of the mesh, and status of the solve."""

    def pressure_profile(self, *, scene: Scene) -> Record:
        """Pressure from the free surface to the wall, and the profile that Eq. 12 implies, SI.

        Eq. 12's wall pressure is that of a ring whose surface lies at sqrt(R2^2 - 2 V'/(B theta)).
        Source: Eq. 12 of the liquid-ring paper.
        """
        disc, liquid, speed = scene.disc, scene.liquid, scene.rotor.speed
        volume = self.fill_ratio * chamber_volume(disc=disc)
        implied = math.sqrt(disc.outer_radius**2 - 2 * volume / (disc.axial_width * disc.central_angle))
        radius, pressure = self.profile
        paper_radius = np.linspace(implied, disc.outer_radius, radius.size)
        wall = paper.wall_pressure_paper(
            disc=disc, density=liquid.density, angular_velocity=speed, liquid_volume=volume
        )
        below = liquid.density * speed**2 / 2 * (paper_radius[:-1] ** 2 - implied**2)
        return {
            "fill_ratio": self.fill_ratio,
            "radius_m": radius.tolist(),
            "pressure_Pa": pressure.tolist(),
            "paper_radius_m": paper_radius.tolist(),
            "paper_pressure_Pa": [*below.tolist(), float(wall)],
        }

    def write(self, *, path: Path) -> Path:
        """Write gauge pressure, Pa, and depth below the free surface, m, to a VTU file. Raises: OSError."""
        depth = np.maximum(np.hypot(*self.mesh.doflocs[:2]) - self.surface_radius, 0.0)
        return _write_vtu(path, mesh=self.mesh, fields={"pressure_Pa": self.pressure, "depth_m": depth})


def shown_fill(scene: Scene) -> float:
    """Fill ratio, positive, of the fields shown: that of the start, or equal fills where it is zero."""
    return scene.disc.initial_fill or scene.disc.max_fill_ratio / 2


def chamber_field(scene: Scene, *, fill_ratio: float) -> _ChamberField:
    """Solve the pressure of the liquid in one chamber in three dimensions, gravity left out.

    Args: `fill_ratio`: x, within (0, 1).
    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem.
    """
    disc = scene.disc
    mesh_record: Record
    surface = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
    liquid = RotatingLiquid(density=scene.liquid.density, angular_velocity=scene.rotor.speed)
    if disc.geometry is None:
        # A structured mesh; the profile along the middle of the chamber.
        chamber = chamber_mesh(disc=disc, surface_radius=surface, cells=default_cells(disc=disc, dimension=3))
        solution = solve_pressure(chamber=chamber, problem=liquid.problem())
        mesh, pressure = chamber.mesh.scaled(chamber.length_scale), solution.pressure
        middle = chamber.grid[:, chamber.grid.shape[1] // 2, chamber.grid.shape[2] // 2]
        profile = (np.hypot(*chamber.places[:2, middle]), pressure[middle])
        jacobian, aspect = chamber.quality()
        mesh_record = {
            "cells": list(chamber.cells),
            "unknowns": chamber.grid.size,
            "minimum_scaled_jacobian": jacobian,
            "largest_aspect": aspect,
        }
        residual, status = solution.statistics.relative_residual, solution.status
    else:
        # The chamber's own mesh, cut along the free surface; the profile at nodes nearest to even radii.
        mesh = scikit_fem_mesh(liquid_body(tetrahedra(disc.geometry), surface))
        solved = solve_on(quadratic_basis(mesh), liquid.problem())
        radius, pressure = np.hypot(*mesh.doflocs[:2]), solved.values
        order = np.argsort(radius)
        even = np.linspace(radius[order[0]], radius[order[-1]], _PROFILE_RADII)
        nearest = order[np.minimum(np.searchsorted(radius[order], even), radius.size - 1)]
        profile = (radius[nearest], pressure[nearest])
        mesh_record = {"cells": [mesh.nelements], "unknowns": pressure.size}
        residual, status = solved.statistics.relative_residual, solved.status
    return _ChamberField(
        fill_ratio=fill_ratio,
        surface_radius=surface,
        mesh=mesh,
        pressure=pressure,
        profile=profile,
        record={**mesh_record, "relative_residual": residual, "status": status.text},
    )


def _write_vtu(path: Path, *, mesh: Any, fields: Mapping[str, npt.ArrayLike] | None = None) -> Path:
    """Write a mesh of scikit-fem in metres with its boundary names and nodal fields, whole or not at all.

    Args: `path`: of the file, ending in .vtu. `fields`: nodal values by name, shape (nodes,) each, SI.
    Raises: ValueError: another ending, or a field that is not one finite value per node.
    Raises: OSError: the file cannot be written.
    Source: VTK XML through meshio; scikit-fem stores each boundary as cell data "skfem:b:<name>".
    """
    if path.suffix != ".vtu":
        raise ValueError(f"the name of a VTU file must end in .vtu, not {path.suffix!r}")
    nodal = {name: np.asarray(value, dtype=np.float64) for name, value in (fields or {}).items()}
    for name, value in nodal.items():
        if value.shape != mesh.doflocs.shape[1:] or not np.all(np.isfinite(value)):
            raise ValueError(f"field {name!r} must hold one finite value per node")
    stored = to_meshio(mesh, nodal)
    # VTK has no points in the plane; meshio would say so on the console.
    stored.points = np.pad(stored.points, ((0, 0), (0, 3 - stored.points.shape[1])))
    return write_mesh(path, stored)


def write_mesh(path: Path, stored: meshio.Mesh) -> Path:
    """Write a mesh in metres to a VTU file, whole or not at all. Raises: OSError: it cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with draft_folder(path.parent) as folder:
        draft = folder / path.name
        meshio.write(draft, stored)
        return write_whole(path, draft.read_bytes())
