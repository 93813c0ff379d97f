"""The pressure field that a report shows, in three dimensions: of a sector, or of an imported chamber; and
meshes with their boundary names and fields as VTU files.
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
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.files import draft_folder, write_whole

Record = dict[str, Any]
_RADII: Final = 17
"""At which a profile is shown of an imported chamber."""


@dataclass(frozen=True, kw_only=True)
class _ChamberField:
    """The liquid's gauge pressure in one chamber, gravity left out, at the nodes of a mesh."""

    fill_ratio: float
    surface_radius: float
    """m."""
    mesh: Any
    """Of scikit-fem, m."""
    pressure: FloatArray
    """Pa, shape (nodes,)."""
    profile: tuple[FloatArray, FloatArray]
    """Radius, m, rising from the free surface to the wall, and pressure, Pa."""
    record: Record
    """Sizes of the mesh, and how the solve ended."""

    def pressure_profile(self, *, scene: Scene) -> Record:
        """Pressure from the free surface to the wall, and the profile that Eq. 12 implies, SI.

        Eq. 12's wall pressure is that of a ring whose surface lies at sqrt(R2^2 - 2 V'/(B theta)).
        Source: Eq. 12 of the liquid-ring paper.
        """
        disc, liquid, speed = scene.disc, scene.liquid, scene.rotor.speed
        volume = self.fill_ratio * chamber_volume(disc=disc)
        implied = math.sqrt(disc.outer_radius**2 - 2 * volume / (disc.axial_width * disc.central_angle))
        radius, pressure = self.profile
        drawn = np.linspace(implied, disc.outer_radius, radius.size)
        wall = paper.wall_pressure_paper(
            disc=disc, density=liquid.density, angular_velocity=speed, liquid_volume=volume
        )
        below = liquid.density * speed**2 / 2 * (drawn[:-1] ** 2 - implied**2)
        return {
            "fill_ratio": self.fill_ratio,
            "radius_m": radius.tolist(),
            "pressure_Pa": pressure.tolist(),
            "paper_radius_m": drawn.tolist(),
            "paper_pressure_Pa": [*below.tolist(), float(wall)],
        }

    def write(self, *, path: Path) -> Path:
        """Write gauge pressure, Pa, and depth below the free surface, m, to a VTU file. Raises: OSError."""
        depth = np.maximum(np.hypot(*self.mesh.doflocs[:2]) - self.surface_radius, 0.0)
        return _write_vtu(path, mesh=self.mesh, fields={"pressure_Pa": self.pressure, "depth_m": depth})


def shown_fill(scene: Scene) -> float:
    """Fill ratio, positive, at which fields are shown: of the start, or equal ones where it is zero."""
    return scene.disc.initial_fill or scene.disc.max_fill_ratio / 2


def chamber_field(scene: Scene, *, fill_ratio: float) -> _ChamberField:
    """Solve the pressure of the liquid in one chamber in three dimensions, gravity left out.

    Args: `fill_ratio`: x, within (0, 1).
    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem.
    """
    radius = float(surface_radius(disc=scene.disc, fill_ratio=fill_ratio))
    liquid = RotatingLiquid(density=scene.liquid.density, angular_velocity=scene.rotor.speed)
    parts = (
        _in_sector(scene, radius, liquid)
        if scene.disc.geometry is None
        else _in_imported(scene.disc.geometry, radius, liquid)
    )
    return _ChamberField(fill_ratio=fill_ratio, surface_radius=radius, **parts)


def _in_sector(scene: Scene, surface: float, liquid: RotatingLiquid) -> Record:
    """On a structured mesh; the profile along the middle of the chamber."""
    disc = scene.disc
    chamber = chamber_mesh(disc=disc, surface_radius=surface, cells=default_cells(disc=disc, dimension=3))
    solution = solve_pressure(chamber=chamber, problem=liquid.problem())
    middle = chamber.grid[:, chamber.grid.shape[1] // 2, chamber.grid.shape[2] // 2]
    jacobian, aspect = chamber.quality()
    return {
        "mesh": chamber.mesh.scaled(chamber.length_scale),
        "pressure": solution.pressure,
        "profile": (np.hypot(*chamber.places[:2, middle]), solution.pressure[middle]),
        "record": {
            "cells": list(chamber.cells),
            "unknowns": chamber.grid.size,
            "minimum_scaled_jacobian": jacobian,
            "largest_aspect": aspect,
            "relative_residual": solution.statistics.relative_residual,
            "status": solution.status.text,
        },
    }


def _in_imported(geometry: ChamberGeometry, surface: float, liquid: RotatingLiquid) -> Record:
    """On the chamber's own mesh, cut along the free surface; the profile at nodes nearest to even radii."""
    mesh = scikit_fem_mesh(liquid_body(tetrahedra(geometry), surface))
    solution = solve_on(quadratic_basis(mesh), liquid.problem())
    radius = np.hypot(*mesh.doflocs[:2])
    order = np.argsort(radius)
    even = np.linspace(radius[order[0]], radius[order[-1]], _RADII)
    nearest = order[np.minimum(np.searchsorted(radius[order], even), radius.size - 1)]
    return {
        "mesh": mesh,
        "pressure": solution.values,
        "profile": (radius[nearest], solution.values[nearest]),
        "record": {
            "cells": [mesh.nelements],
            "unknowns": solution.values.size,
            "relative_residual": solution.statistics.relative_residual,
            "status": solution.status.text,
        },
    }


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
    return _written(path, stored)


def write_cells(path: Path, *, kind: CellKind, points: FloatArray, cells: IntArray) -> Path:
    """Write cells of one kind in metres to a VTU file, whole or not at all.

    Args: `cells`: in meshio's order.
    Raises: OSError: the file cannot be written.
    """
    return _written(path, meshio.Mesh(points, {str(kind): cells}))


def _written(path: Path, stored: meshio.Mesh) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with draft_folder(path.parent) as folder:
        draft = folder / path.name
        meshio.write(draft, stored)
        return write_whole(path, draft.read_bytes())
