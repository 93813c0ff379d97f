"""Imported chambers against closed forms: totals, pressure with its loads, and walls cut by the surface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.mesh.liquid_body import liquid_body
from ringbalance.mesh.quadratic_tetrahedra import scikit_fem_mesh, tetrahedra
from ringbalance.mesh.wall_integrals import (
    LONGEST_SIDE_RATIO,
    integrals,
    split_patches,
    wall_patches,
    walls_about,
)
from ringbalance.physics.convergence import gci
from ringbalance.physics.pressure.loads import ImportedRing, solved_ring
from ringbalance.physics.pressure.solve import quadratic_basis, side, solve_on
from ringbalance.reduced_model.chamber.values import chamber_closed_forms
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import (
    Convergence,
    Evidence,
    Found,
    Level,
    as_found,
    order_figure,
    orders_found,
)
from ringbalance.verification.finite_elements import relative_rms
from ringbalance.verification.reference.chambers import block_chamber, disc_chamber, exact_totals
from ringbalance.verification.reference.pressure import Manufactured

_CELLS: Final = ((8, 32, 2), (4, 16, 1), (2, 8, 1))
"""Finest first; the arcs alone are approximated, so the cells along the angle decide."""
_SIZES: Final = (1.0, 2.0, 4.0)
_ARC_ORDER: Final = 4.0
"""Order of the area that an arc of quadratic edges encloses."""
_MANUFACTURED: Final = ("force_off_by_a_percent", "force_across_dropped", "surface_pressure_shifted")
"""Mutations of the manufactured problem; all others are of the physical one."""
_LEVELS: Final = {"light": (3, 6, 12), "heavy": (4, 8, 16, 24)}
"""Radial cells; half of them lie in the liquid."""
_FILL: Final = 0.4
_SQUARES: Final = {"light": (2, 4, 8, 16), "heavy": (2, 4, 8, 16, 32)}
"""Cells along each side of the square that becomes the cylinder: a quarter of the facets around it."""
_DEPTHS: Final = np.array([0.07, 0.31, 0.52, 0.77, 0.96])
"""Depths of the free surface, from 0 at its first contact with the cylinder to 1 at its last."""
_TILT: Final = 0.05
"""g/(omega^2 R2), far above that of the running disc."""
_TILT_DIRECTIONS: Final = 4


def totals(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The built-in chamber as a mesh file would give it, against closed forms."""
    records = [disc_chamber(scene.disc, cells) for cells in _CELLS]
    if defect == "drawn_too_large":
        records = [
            replace(record, points=record.points * 1.0001, digest=f"large {record.digest}")
            for record in records
        ]
    # Volume, moment at the largest fill, and lambda at equal fills, by integrals over the walls.
    by_walls = []
    for record in records:
        disc = replace(scene.disc, geometry=record)
        fills = np.array([disc.max_fill_ratio, disc.max_fill_ratio / 2])
        _, moment, ratio = chamber_closed_forms(scene=replace(scene, disc=disc), fill_ratio=fills)
        by_walls.append((chamber_volume(disc=disc), float(moment[0]), float(ratio[1])))
    ring = solved_ring(
        geometry=records[0],
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        surface_radius=float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio)),
    )
    exact = exact_totals(scene)
    exact["lever"] = exact.pop("lambda")
    numbers = {}
    for name, values in zip(("volume", "moment", "lever"), np.transpose(by_walls), strict=True):
        study = gci(values=values.tolist(), sizes=_SIZES, formal_order=_ARC_ORDER)
        # Plus the error of a table of integrals.
        numbers[name] = Found.within(values[0], study.uncertainty + 1e-8 * abs(values[0]))
    numbers["wall_pressure"] = Found.within(
        ring.wall_pressure.value, ring.wall_pressure.uncertainty, conclusive=ring.status.ok
    )
    return Evidence(
        quantities={name: number.against(exact[name]) for name, number in numbers.items()},
        numbers={"cells": float(len(records[0].cells))},
    )


def pressure(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Pressure in an imported chamber: a manufactured solution on ever finer meshes, and exact loads."""
    disc, sizes, omega = scene.disc, _LEVELS[level], scene.rotor.speed
    field, wall = _studies(disc, sizes, defect if defect in _MANUFACTURED else None)
    a = float(surface_radius(disc=disc, fill_ratio=_FILL))
    exact = scene.liquid.density * omega**2 * (disc.outer_radius**2 - a**2) / 2
    cut = 1.01 * a if defect == "surface_off_by_a_percent" else a
    curved, straight = (_ring(scene, sizes[1], kind, cut) for kind in ("hexahedron27", "hexahedron"))
    off = [abs(float(ring.wall_pressure.value) - exact) for ring in (curved, straight)]
    widths = [float(ring.wall_pressure.uncertainty) for ring in (curved, straight)]
    if defect == "facets_taken_for_the_wall":
        widths[1] = widths[0]
    # All forces on the walls together against the centrifugal force of the liquid.
    total = np.sum([load.force.value for load in curved.loads.values()], axis=0)
    centrifugal = omega**2 * curved.first_moment * np.array([1.0, 1.0, 0.0])
    return Evidence(
        quantities=as_found(
            field_order=field.settled_order,
            field_error=field.finest_error,
            wall_error=wall.finest_error,
            pressure=off[0] / exact,
            held=max(np.divide(off, widths)),
            loads=np.linalg.norm(total - centrifugal) / np.linalg.norm(centrifugal),
        ),
        numbers={"straight": off[1] / exact, "unknowns": float(curved.statistics.unknowns)},
        series=(order_figure({"pressure field": field, "force on the outer wall": wall}),),
        convergence=(field, wall),
    )


@lru_cache(maxsize=8)
def _ring(scene: Scene, size: int, kind: CellKind, a: float) -> ImportedRing:
    return solved_ring(
        geometry=disc_chamber(scene.disc, (size, 2 * size, size), kind=kind),
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        surface_radius=a,
    )


@lru_cache(maxsize=8)
def _studies(disc: Disc, sizes: tuple[int, ...], defect: str | None) -> tuple[Convergence, Convergence]:
    """Errors of the manufactured field, root mean square, and of its force on the outer wall."""
    exact = Manufactured(length=disc.outer_radius, width=disc.axial_width)
    radius = float(surface_radius(disc=disc, fill_ratio=_FILL))
    errors = []
    for size in sizes:
        chamber = tetrahedra(disc_chamber(disc, (size, 2 * size, size)))
        basis = quadratic_basis(scikit_fem_mesh(liquid_body(chamber, radius)))
        values = solve_on(basis, exact.problem(defect)).values
        true = exact.pressure(np.asarray(basis.global_coordinates()))
        field = relative_rms(np.asarray(basis.interpolate(values)), true, basis.dx)
        wall = side(basis.mesh, "outer_wall")
        force = np.sum(wall.weights * exact.pressure(wall.points))
        errors.append((field, abs(np.sum(wall.weights * wall.at_points(values)) / force - 1)))
    field, wall = np.transpose(errors).tolist()
    study, steps = Convergence.of_errors, [1 / size for size in sizes]
    return (
        study("pressure field, relative error", 3.0, size=steps, error=field),
        study("force on the outer wall, relative error", 4.0, size=steps, error=wall),
    )


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
        first_moment = np.pi * self.radius**2 * distance - first - (distance * far - second)
        half = np.arccos(chord / b)
        unit, slope = away / distance, np.array([-half, -b * np.sin(half)])
        moments = centre[:, None] * area + unit[:, None] * first_moment
        slopes = centre[:, None] * slope[0] + unit[:, None] * slope[1]
        return self.width * np.stack([area, *moments, slope[0], *slopes])


def _segment(radius: FloatArray | float, chord: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Area of a circle beyond a chord at a distance from its centre, and its moment about the centre."""
    half = np.sqrt(radius**2 - chord**2)
    area = radius**2 * np.arccos(chord / radius) - chord * half
    return np.asarray(area), np.asarray(2 / 3 * half**3)


def round_chamber(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """A cylinder beside the shaft as an imported chamber: integrals over its walls against lenses."""
    disc, cells = scene.disc, _SQUARES[level]
    curved: CellKind = "hexahedron" if defect == "middle_nodes_ignored" else "hexahedron27"
    quadratic, straight = (
        np.array([_round_chamber_errors(disc, n, kind, defect) for n in cells])
        for kind in (curved, "hexahedron")
    )
    size = [1 / n for n in cells]
    studies = {
        name: Convergence.of_errors(
            "volume and moment", order, size=size, error=errors[:, 0].tolist(), geometry=geometry
        )
        for name, errors, order, geometry in (
            ("round", quadratic, 4.0, "quadratic"),
            ("straight", straight, 2.0, "straight"),
        )
    }
    return Evidence(
        quantities=orders_found(studies)
        | as_found(tilted_error=quadratic[-1, 2], lever_error=quadratic[-1, 1]),
        numbers={"facets": 4.0 * cells[-1]},
        convergence=tuple(studies.values()),
    )


def _round_chamber_errors(
    disc: Disc, cells: int, kind: CellKind, defect: str | None
) -> tuple[float, float, float]:
    """Largest errors of volume and moment, of the lever arm, and of volume and moment under gravity."""
    true = _Round(
        centre=(disc.outer_radius + disc.inner_radius) / 2,
        radius=(disc.outer_radius - disc.inner_radius) / 2,
        width=disc.axial_width,
    )

    def mapping(cube: FloatArray) -> FloatArray:
        # Squares become circles; along each the angle is even, so that middle nodes halve their arcs.
        u, v = 2 * cube[..., 0] - 1, 2 * cube[..., 1] - 1
        size, flat = np.maximum(np.abs(u), np.abs(v)), np.abs(u) >= np.abs(v)
        share = np.divide(np.where(flat, v, u), np.where(size > 0, np.where(flat, u, v), 1.0))
        long, short = np.cos(np.pi / 4 * share), np.sin(np.pi / 4 * share)
        sign = np.where(flat, np.sign(u), np.sign(v)) * size * true.radius
        x, y = sign * np.where(flat, long, short), sign * np.where(flat, short, long)
        return np.stack([true.centre + x, y, true.width * (cube[..., 2] - 0.5)], axis=-1)

    block = block_chamber((cells, cells, 1), mapping, kind=kind)
    patches, outer = split_patches(*wall_patches(block), longest=LONGEST_SIDE_RATIO)
    full = np.pi * true.radius**2 * true.width * np.array([1.0, true.centre, true.centre])

    def errors(centre: FloatArray) -> tuple[float, float]:
        distance = float(np.hypot(true.centre - centre[0], centre[1]))
        radii = distance + (2 * _DEPTHS - 1) * true.radius
        walls = walls_about(patches, outer, centre=centre)
        if defect == "crossed_walls_not_cut":
            middle = (walls.lowest + walls.highest) / 2
            walls = replace(walls, lowest=middle, highest=middle)
        elif defect == "moment_about_the_shifted_axis":
            walls = replace(walls, centre=np.zeros(2))
        result = integrals(walls, radii**2)[[0, 1, 2, 4, 5, 6]]
        expected = true.outside(radii**2, centre)
        # Difference of the ratios to the exact values: a coarse mesh may have no surface to divide by.
        lever = (result[4] * expected[3] - expected[4] * result[3]) / (expected[4] * expected[3])
        return float(np.max(np.abs(result - expected)[:3].T / full)), float(np.max(np.abs(lever)))

    plain, lever = errors(np.zeros(2))
    angles = 2 * np.pi * (np.arange(_TILT_DIRECTIONS) + 0.2) / _TILT_DIRECTIONS
    length = _TILT * disc.outer_radius
    tilted = max(errors(-length * np.array([np.cos(p), np.sin(p)]))[0] for p in angles)
    return plain, lever, tilted
