"""Pressure of the liquid in an imported chamber, as a report shows it; and the field of any chamber."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ringbalance.mesh.export import write_cells
from ringbalance.mesh.geometry import surface_radius
from ringbalance.mesh.liquid_body import Level, liquid_body
from ringbalance.mesh.quadratic_tetrahedra import FACES, Tetrahedra, tetrahedra
from ringbalance.physics.pressure.imported import solve_on
from ringbalance.physics.pressure.linear import LinearSolution
from ringbalance.physics.pressure.solve import RotatingLiquid
from ringbalance.physics.pressure.tetrahedra import TetrahedronSpace
from ringbalance.reports.pictures.fields import Outside, ShownField, chamber_field, profile
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Scene

Record = dict[str, Any]
_RADII = 17
"""At which a profile is shown."""


@dataclass(frozen=True, kw_only=True)
class ImportedField:
    """On the chamber's own mesh, cut along the free surface."""

    fill_ratio: float
    surface_radius: float
    """m."""
    body: Tetrahedra
    solution: LinearSolution

    def record(self) -> Record:
        return {
            "cells": [len(self.body.cells)],
            "unknowns": len(self.body.nodes),
            "relative_residual": self.solution.statistics.relative_residual,
            "status": self.solution.status.text,
        }

    def pressure_profile(self, *, scene: Scene) -> Record:
        """Pressure at the nodes nearest to even radii, and the profile that Eq. 12 implies, SI."""
        radius = np.hypot(self.body.nodes[:, 0], self.body.nodes[:, 1])
        order = np.argsort(radius)
        even = np.linspace(radius[order[0]], radius[order[-1]], _RADII)
        nearest = order[np.minimum(np.searchsorted(radius[order], even), radius.size - 1)]
        return profile(scene, self.fill_ratio, radius[nearest], self.solution.values[nearest])

    def write(self, *, path: Path) -> Path:
        radius = np.hypot(self.body.nodes[:, 0], self.body.nodes[:, 1])
        fields = {
            "pressure_Pa": self.solution.values,
            "depth_m": np.maximum(radius - self.surface_radius, 0.0),
        }
        return write_cells(path, kind="tetra10", points=self.body.nodes, cells=self.body.cells, fields=fields)

    def outside(self) -> Outside:
        cell, face = np.nonzero(self.body.faces >= 0)
        corners = np.take_along_axis(self.body.cells[cell], FACES[face], axis=1)
        faces = np.concatenate([corners, corners[:, -1:]], axis=1)
        return Outside(places=self.body.nodes, faces=faces, pressure=self.solution.values)


def imported_field(scene: Scene, geometry: ChamberGeometry, *, fill_ratio: float) -> ImportedField:
    """Solve the pressure of the liquid in one chamber, gravity left out.

    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem.
    """
    radius = float(surface_radius(disc=scene.disc, fill_ratio=fill_ratio))
    body = liquid_body(tetrahedra(geometry), Level(constant=radius**2 / 2))
    liquid = RotatingLiquid(density=scene.liquid.density, angular_velocity=scene.rotor.speed)
    solution = solve_on(TetrahedronSpace(body=body), liquid.problem())
    return ImportedField(fill_ratio=fill_ratio, surface_radius=radius, body=body, solution=solution)


def shown_field(scene: Scene, *, fill_ratio: float) -> ShownField:
    """Of a sector between plates, or of an imported chamber. Args: `fill_ratio`: x, within (0, 1)."""
    if scene.disc.geometry is None:
        return chamber_field(scene, fill_ratio=fill_ratio)
    return imported_field(scene, scene.disc.geometry, fill_ratio=fill_ratio)
