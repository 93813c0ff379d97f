"""A cylinder beside the shaft as an imported chamber: integrals over its walls against lenses of circles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.mesh.wall_integrals import (
    LONGEST,
    Walls,
    integrals,
    split_patches,
    wall_patches,
    walls_about,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Evidence, Found, Level
from ringbalance.verification.orders import OrderStudy, orders_found
from ringbalance.verification.reference.block_chambers import block_chamber

_LEVELS: Final = {"light": (2, 4, 8, 16), "heavy": (2, 4, 8, 16, 32)}
"""Cells along each side of the square that becomes the cylinder: a quarter of the facets around it."""
_DEPTHS: Final = np.array([0.07, 0.31, 0.52, 0.77, 0.96])
"""Of the free surface, from where it touches the cylinder to where it leaves it."""
_TILT: Final = 0.05
"""g/(omega^2 R2), far above that of the running disc."""
_TURN: Final = 4


@dataclass(frozen=True, kw_only=True)
class _Round:
    """A cylinder parallel to the shaft."""

    centre: float
    radius: float
    width: float

    def outside(self, level: FloatArray, centre: FloatArray) -> FloatArray:
        """V, its moments along x and y about the shaft, and their slopes by b^2, outside |r - c|^2 = b^2."""
        away = np.array([self.centre, 0.0]) - centre
        distance = float(np.hypot(*away))
        b = np.sqrt(level)
        chord = (distance**2 + level - self.radius**2) / (2 * distance)
        near, first = _segment(b, chord)
        far, second = _segment(self.radius, distance - chord)
        area = np.pi * self.radius**2 - near - far
        along = np.pi * self.radius**2 * distance - first - (distance * far - second)
        half = np.arccos(chord / b)
        unit, slope = away / distance, np.array([-half, -b * np.sin(half)])
        moments = centre[:, None] * area + unit[:, None] * along
        slopes = centre[:, None] * slope[0] + unit[:, None] * slope[1]
        return self.width * np.stack([area, *moments, slope[0], *slopes])


def _segment(radius: FloatArray | float, chord: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Area of a circle beyond a chord at a distance from its centre, and its moment about the centre."""
    half = np.sqrt(radius**2 - chord**2)
    area = radius**2 * np.arccos(chord / radius) - chord * half
    return np.asarray(area), np.asarray(2 / 3 * half**3)


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    disc, cells = scene.disc, _LEVELS[level]
    curved: CellKind = "hexahedron" if defect == "middle_nodes_ignored" else "hexahedron27"
    errors = {
        kind: np.array([_errors(disc, n, kind, defect) for n in cells]) for kind in (curved, "hexahedron")
    }
    size = [1 / n for n in cells]
    studies = {
        "round": OrderStudy.of(size=size, error=errors[curved][:, 0].tolist()),
        "straight": OrderStudy.of(size=size, error=errors["hexahedron"][:, 0].tolist()),
    }
    found = orders_found(studies)
    found["tilted_error"] = Found(value=float(errors[curved][-1, 2]))
    found["lever_error"] = Found(value=float(errors[curved][-1, 1]))
    return Evidence(
        found=found,
        numbers={"facets": 4.0 * cells[-1]},
        convergence=(
            studies["round"].table("volume and moment", 4.0, geometry="quadratic"),
            studies["straight"].table("volume and moment", 2.0, geometry="straight"),
        ),
    )


def _errors(disc: Disc, cells: int, kind: CellKind, defect: str | None) -> tuple[float, float, float]:
    """Largest errors of volume and moment, of the lever arm, and of both first ones under gravity."""
    true = _Round(
        centre=(disc.outer_radius + disc.inner_radius) / 2,
        radius=(disc.outer_radius - disc.inner_radius) / 2,
        width=disc.axial_width,
    )
    patches, outer = _walls(true, cells, kind)
    whole = np.pi * true.radius**2 * true.width * np.array([1.0, true.centre, true.centre])

    def found(centre: FloatArray) -> tuple[float, float]:
        distance = float(np.hypot(true.centre - centre[0], centre[1]))
        radii = distance + (2 * _DEPTHS - 1) * true.radius
        walls = _with_defect(walls_about(patches, outer, centre=centre), defect)
        result = integrals(walls, radii**2)[[0, 1, 2, 4, 5, 6]]
        expected = true.outside(radii**2, centre)
        # As the quotient of the ratios, where a coarse mesh has no surface left to divide by.
        lever = (result[4] * expected[3] - expected[4] * result[3]) / (expected[4] * expected[3])
        return float(np.max(np.abs(result - expected)[:3].T / whole)), float(np.max(np.abs(lever)))

    plain, lever = found(np.zeros(2))
    angles = 2 * np.pi * (np.arange(_TURN) + 0.2) / _TURN
    length = _TILT * disc.outer_radius
    tilted = max(found(-length * np.array([np.cos(p), np.sin(p)]))[0] for p in angles)
    return plain, lever, tilted


def _walls(true: _Round, cells: int, kind: CellKind) -> tuple[FloatArray, np.ndarray]:
    def place(cube: FloatArray) -> FloatArray:
        # Squares become circles; along each the angle is even, so that middle nodes halve their arcs.
        u, v = 2 * cube[..., 0] - 1, 2 * cube[..., 1] - 1
        size, flat = np.maximum(np.abs(u), np.abs(v)), np.abs(u) >= np.abs(v)
        share = np.divide(np.where(flat, v, u), np.where(size > 0, np.where(flat, u, v), 1.0))
        long, short = np.cos(np.pi / 4 * share), np.sin(np.pi / 4 * share)
        sign = np.where(flat, np.sign(u), np.sign(v)) * size * true.radius
        x, y = sign * np.where(flat, long, short), sign * np.where(flat, short, long)
        return np.stack([true.centre + x, y, true.width * (cube[..., 2] - 0.5)], axis=-1)

    return split_patches(*wall_patches(block_chamber((cells, cells, 1), place, kind=kind)), longest=LONGEST)


def _with_defect(walls: Walls, defect: str | None) -> Walls:
    if defect == "crossed_walls_not_cut":
        middle = (walls.lowest + walls.highest) / 2
        return replace(walls, lowest=middle, highest=middle)
    if defect == "moment_about_the_shifted_axis":
        return replace(walls, centre=np.zeros(2))
    return walls
