"""Manufactured solutions of the pressure problem: chosen outside the discrete space, errors over levels.

The pressure is p = P [sin(3 x/R2 + 0.4) exp(0.7 y/R2) cos(1.8 z/B + 0.2) + r^2/(2 R2^2)]; its Laplacian, its
normal derivative on every wall and its values on the free surface go into the same record that the physical
problem uses, so every term of the problem is exercised and none vanishes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.mesh.chamber import ChamberMesh, Geometry, chamber_mesh
from ringbalance.mesh.geometry import half_angle, surface_radius
from ringbalance.physics.pressure.assembly import facet_points
from ringbalance.physics.pressure.solve import PressureProblem, PressureSolution, solve_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc
from ringbalance.verification.evidence import Convergence, Evidence, Found
from ringbalance.verification.orders import OrderStudy, field_error, order_figure, order_study

_SCALE: Final = 1e5
"""P, Pa."""
_SLOPES: Final = (3.0, 0.7, 1.8)
_SHIFTS: Final = (0.4, 0.2)
_GAUSS: Final = 40
_FIELD_ORDER: Final = 3.0
_WALL_ORDER: Final = {"curved": 4.0, "straight": 2.0}
_FILL_SHARE: Final = 0.8
"""Of the largest fill: a ring deep enough to show every direction."""


@dataclass(frozen=True, kw_only=True)
class Manufactured:
    """The chosen pressure and its derivatives at any place, lengths in metres."""

    length: float
    """R2, m."""
    width: float
    """B, m."""
    half_angle: float
    """theta/2, rad; where the plate lies that a fault may leave dry."""

    def _factors(self, places: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        x, y = places[0] / self.length, places[1] / self.length
        z = places[2] / self.width if len(places) == 3 else np.zeros_like(x)
        return _SLOPES[0] * x + _SHIFTS[0], np.exp(_SLOPES[1] * y), _SLOPES[2] * z + _SHIFTS[1]

    def pressure(self, places: FloatArray) -> FloatArray:
        """The chosen pressure, Pa, at places in m, shape (dimension, ...)."""
        wave, growth, axial = self._factors(places)
        square = (places[0] ** 2 + places[1] ** 2) / (2 * self.length**2)
        return np.asarray(_SCALE * (np.sin(wave) * growth * np.cos(axial) + square))

    def gradient(self, places: FloatArray) -> FloatArray:
        """Its gradient, Pa/m, the shape of `places`."""
        wave, growth, axial = self._factors(places)
        a, b, c = _SLOPES
        parts = [
            a * np.cos(wave) * growth * np.cos(axial) + places[0] / self.length,
            b * np.sin(wave) * growth * np.cos(axial) + places[1] / self.length,
            -c * np.sin(wave) * growth * np.sin(axial) * (self.length / self.width),
        ]
        return np.asarray(np.stack(parts[: len(places)]) * _SCALE / self.length)

    def laplacian(self, places: FloatArray) -> FloatArray:
        """Its Laplacian, Pa/m^2, in as many dimensions as the places have."""
        wave, growth, axial = self._factors(places)
        a, b, c = _SLOPES
        axial_part = (c * self.length / self.width) ** 2 if len(places) == 3 else 0.0
        curvature = -(a**2) + b**2 - axial_part
        return np.asarray(_SCALE / self.length**2 * (curvature * np.sin(wave) * growth * np.cos(axial) + 2))

    def problem(self, defect: str | None = None) -> PressureProblem:
        """The right-hand sides that make this pressure the solution, with a deliberate error built in."""
        exact = PressureProblem(
            source=self.laplacian,
            wall_flux=lambda places, normals: np.einsum("i...,i...->...", self.gradient(places), normals),
            surface_pressure=self.pressure,
        )
        return _spoiled(exact, defect, across=(-np.sin(self.half_angle), np.cos(self.half_angle)))


def _spoiled(exact: PressureProblem, defect: str | None, *, across: tuple[float, float]) -> PressureProblem:
    if defect == "source_off_by_a_percent":
        return replace(exact, source=lambda places: 1.01 * exact.source(places))
    if defect == "wall_flux_dropped":
        return replace(exact, wall_flux=partial(_without_one_plate, exact, across))
    if defect == "surface_pressure_shifted":
        return replace(exact, surface_pressure=lambda places: exact.surface_pressure(places) + 1e-3 * _SCALE)
    if defect is not None:
        raise ValueError(f"unknown defect {defect}")
    return exact


def _without_one_plate(
    exact: PressureProblem, across: tuple[float, float], places: FloatArray, normals: FloatArray
) -> FloatArray:
    """The plate at the larger angle has its normal across its bounding radius; no other wall has."""
    on_plate = across[0] * normals[0] + across[1] * normals[1] > 0.9
    return np.where(on_plate, 0.0, exact.wall_flux(places, normals))


@dataclass(frozen=True, kw_only=True)
class _Study:
    """Errors of one geometry over all levels."""

    geometry: Geometry
    cells: Sequence[tuple[int, ...]]
    unknowns: int
    """On the finest mesh."""
    field: OrderStudy
    """Root mean square of the pressure's error over the liquid, relative."""
    wall: OrderStudy
    """Error of the integral of the pressure over the outer wall, relative."""

    def tables(self) -> tuple[Convergence, Convergence]:
        """Both errors beside their formal orders."""
        cells = ", ".join(" x ".join(map(str, count)) for count in self.cells)
        note = f"cells {cells}; up to {self.unknowns} unknowns"
        shape, force = self.geometry, "force on the outer wall, relative error"
        return (
            self.field.table("pressure field, relative error", _FIELD_ORDER, geometry=shape, note=note),
            self.wall.table(force, _WALL_ORDER[shape], geometry=shape, note=note),
        )


def manufactured_evidence(*, disc: Disc, cells: Sequence[tuple[int, ...]], defect: str | None) -> Evidence:
    """Orders and finest errors on curved and on straight-sided meshes, coarse to fine, halving h each time.

    Raises: ValueError: an unknown defect.
    """
    curved, straight = (_study(disc, cells, geometry, defect) for geometry in ("curved", "straight"))
    found = {
        "field_order_quadratic": curved.field.settled_order,
        "field_error_quadratic": curved.field.finest_error,
        "wall_order_quadratic": curved.wall.settled_order,
        "wall_error_quadratic": curved.wall.finest_error,
        "field_order_straight": straight.field.settled_order,
        "wall_order_straight": straight.wall.settled_order,
        "wall_error_straight": straight.wall.finest_error,
    }
    curves = {
        "pressure field, curved": curved.field,
        "wall force, curved": curved.wall,
        "pressure field, straight": straight.field,
        "wall force, straight": straight.wall,
    }
    return Evidence(
        found={name: Found(value=value) for name, value in found.items()},
        numbers={
            "curving": straight.wall.finest_error / curved.wall.finest_error,
            "unknowns": float(curved.unknowns),
        },
        series=(order_figure(curves),),
        convergence=(*curved.tables(), *straight.tables()),
    )


def _study(disc: Disc, cells: Sequence[tuple[int, ...]], geometry: Geometry, defect: str | None) -> _Study:
    """A wrong wall integral is seen against the true arc, so straight sides show in it."""
    exact = Manufactured(length=disc.outer_radius, width=disc.axial_width, half_angle=disc.central_angle / 2)
    radius = float(surface_radius(disc=disc, fill_ratio=_FILL_SHARE * disc.max_fill_ratio))
    solutions = [
        solve_pressure(
            chamber=chamber_mesh(disc=disc, surface_radius=radius, cells=count, geometry=geometry),
            problem=exact.problem(defect),
        )
        for count in cells
    ]
    size = [cells[0][0] / count[0] for count in cells]
    wall = _exact_wall_integral(disc, exact, dimension=len(cells[0]))
    return _Study(
        geometry=geometry,
        cells=cells,
        unknowns=solutions[-1].pressure.size,
        field=order_study(size=size, error=[field_error(s, exact.pressure) for s in solutions]),
        wall=order_study(size=size, error=[abs(_wall_integral(s) / wall - 1) for s in solutions]),
    )


def _wall_integral(solution: PressureSolution) -> float:
    """Integral of the pressure over the outer wall, N or N/m."""
    chamber: ChamberMesh = solution.chamber
    facets = facet_points(chamber, "outer_wall")
    total = float(np.sum(facets.weights * facets.at_points(solution.pressure)))
    return total * chamber.length_scale ** (chamber.dimension - 1)


def _exact_wall_integral(disc: Disc, exact: Manufactured, *, dimension: int) -> float:
    abscissa, weight = np.polynomial.legendre.leggauss(_GAUSS)
    alpha = float(half_angle(disc=disc, radius=disc.outer_radius))
    arc = disc.outer_radius * np.exp(1j * alpha * abscissa)
    area = disc.outer_radius * alpha * weight
    if dimension == 2:
        return float(area @ exact.pressure(np.stack([arc.real, arc.imag])))
    axial = disc.axial_width / 2 * abscissa
    places = np.stack(np.broadcast_arrays(arc.real[:, None], arc.imag[:, None], axial[None, :]))
    return float(area @ exact.pressure(places) @ (disc.axial_width / 2 * weight))
