"""Pressure fields for the report: of a sector, of an imported chamber and of the tube; drawn elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from ringbalance.mesh.chamber import chamber_mesh, default_cells
from ringbalance.mesh.export import write_vtu
from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.mesh.liquid_body import liquid_body
from ringbalance.mesh.quadratic_tetrahedra import scikit_fem_mesh, tetrahedra
from ringbalance.physics.pressure.solve import (
    LinearSolution,
    PressureSolution,
    RotatingLiquid,
    quadratic_basis,
    solve_on,
    solve_pressure,
)
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.pressure_profile import HumpProfile
from ringbalance.results.numbers import given
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Scene
from ringbalance.verification.loops import calibration_of

Record = dict[str, Any]
_RADII = 17
"""At which a profile is shown."""
_POINTS: Final = 241
_FILLS: Final = {
    Regime.SIPHON: "liquid fills it all the way",
    Regime.SEPARATED: "the column is separated at the siphon crest, and a cavity follows",
    Regime.UNDECIDED: "whether liquid fills it all the way or separates at the siphon crest is undecided",
    Regime.BLOCKED: "gas stands over the siphon crest and nothing flows",
}


class _ShownField(Protocol):
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
        """Write gauge pressure, Pa, and depth below the free surface, m, to a VTU file. Raises: OSError."""
        ...


def _profile(scene: Scene, fill_ratio: float, radius: FloatArray, pressure: FloatArray) -> Record:
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
        chamber, solution = self.solution.chamber, self.solution
        jacobian, aspect = chamber.quality()
        return {
            "cells": list(chamber.cells),
            "unknowns": chamber.grid.size,
            "minimum_scaled_jacobian": jacobian,
            "largest_aspect": aspect,
            "relative_residual": solution.statistics.relative_residual,
            "status": solution.status.text,
        }

    def pressure_profile(self, *, scene: Scene) -> Record:
        """Nodal pressure along the middle of the chamber, and the profile that Eq. 12 implies, SI."""
        chamber = self.solution.chamber
        line = chamber.grid[:, chamber.grid.shape[1] // 2, chamber.grid.shape[2] // 2]
        radius = np.hypot(*chamber.places[:2, line])
        return _profile(scene, self.fill_ratio, radius, self.solution.pressure[line])

    def write(self, *, path: Path) -> Path:
        chamber = self.solution.chamber
        radius = np.hypot(*chamber.places[:2])
        fields = {
            "pressure_Pa": self.solution.pressure,
            "depth_m": np.maximum(radius - self.surface_radius, 0.0),
        }
        return write_vtu(path, mesh=chamber.mesh.scaled(chamber.length_scale), fields=fields)


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


@dataclass(frozen=True, kw_only=True)
class ImportedField:
    """On the chamber's own mesh, cut along the free surface."""

    fill_ratio: float
    surface_radius: float
    """m."""
    mesh: Any
    """`skfem.MeshTet2`, m."""
    solution: LinearSolution

    def record(self) -> Record:
        return {
            "cells": [self.mesh.nelements],
            "unknowns": self.solution.values.size,
            "relative_residual": self.solution.statistics.relative_residual,
            "status": self.solution.status.text,
        }

    def pressure_profile(self, *, scene: Scene) -> Record:
        """Pressure at the nodes nearest to even radii, and the profile that Eq. 12 implies, SI."""
        radius = np.hypot(*self.mesh.doflocs[:2])
        order = np.argsort(radius)
        even = np.linspace(radius[order[0]], radius[order[-1]], _RADII)
        nearest = order[np.minimum(np.searchsorted(radius[order], even), radius.size - 1)]
        return _profile(scene, self.fill_ratio, radius[nearest], self.solution.values[nearest])

    def write(self, *, path: Path) -> Path:
        depth = np.maximum(np.hypot(*self.mesh.doflocs[:2]) - self.surface_radius, 0.0)
        fields = {"pressure_Pa": self.solution.values, "depth_m": depth}
        return write_vtu(path, mesh=self.mesh, fields=fields)


def _imported_field(scene: Scene, geometry: ChamberGeometry, *, fill_ratio: float) -> ImportedField:
    """Solve the pressure of the liquid in one chamber, gravity left out.

    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem.
    """
    radius = float(surface_radius(disc=scene.disc, fill_ratio=fill_ratio))
    mesh = scikit_fem_mesh(liquid_body(tetrahedra(geometry), radius))
    liquid = RotatingLiquid(density=scene.liquid.density, angular_velocity=scene.rotor.speed)
    solution = solve_on(quadratic_basis(mesh), liquid.problem())
    return ImportedField(fill_ratio=fill_ratio, surface_radius=radius, mesh=mesh, solution=solution)


def shown_field(scene: Scene, *, fill_ratio: float) -> _ShownField:
    """Of a sector between plates, or of an imported chamber. Args: `fill_ratio`: x, within (0, 1)."""
    if scene.disc.geometry is None:
        return chamber_field(scene, fill_ratio=fill_ratio)
    return _imported_field(scene, scene.disc.geometry, fill_ratio=fill_ratio)


def tube_field(scene: Scene) -> Record | None:
    """Centre line and pressure of the tube at equal fills under the scene's gas.

    Returns: Points of the centre line (m, shape (n, 3) as lists), pressure (Pa), whether liquid fills the
    bore there, and the picture's text; None for a tube without a crest.
    Raises: SceneError: a scene that cannot be calibrated.
    """
    if scene.tube.hump_radius is None:
        return None
    calibration = calibration_of(scene)
    scene, law = calibration.scene, calibration.flow_law
    equal = law.max_fill_ratio / 2
    found = HumpProfile.of(scene=scene, law=law, fill_ratio=equal, opposite_fill_ratio=equal, points=_POINTS)
    # Where a step stands twice, the later entry is kept: a line may not stand still.
    last = np.append(np.diff(found.path) > 0, True)
    share = found.path[last] / scene.tube.length
    return {
        "points": _spiral(share=share, radius=found.radius[last]).tolist(),
        "pressure": found.pressure[last].tolist(),
        "full": found.full[last].astype(int).tolist(),
        "hump": int(np.argmin(found.radius[last])),
        "text": _FILLS.get(found.regime, "the column flows back"),
        "gas": given(scene.gas.pressure, "Pa"),
    }


def _spiral(*, share: FloatArray, radius: FloatArray) -> FloatArray:
    """Half a turn about the shaft at a given radius, from the first chamber to the opposite one.

    Args: `share`: s/L, shape (n,). `radius`: r, m, shape (n,).
    Returns: Points, m, shape (n, 3), in the plane across the shaft.
    """
    angle = np.pi * share
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(angle.size)], axis=1)
