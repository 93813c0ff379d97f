"""Manufactured solutions of the pressure problem: chosen outside the discrete space, errors over levels.

The pressure is p = P [sin(3 x/R2 + 0.4) exp(0.7 y/R2) cos(1.8 z/B + 0.2) + r^2/(2 R2^2)]; its Laplacian, its
normal derivative on every wall and its values on the free surface go into the same record that the physical
problem uses, so every term of the problem is exercised and none vanishes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.mesh.chamber import ChamberMesh, Geometry, chamber_mesh
from ringbalance.mesh.geometry import half_angle, surface_radius
from ringbalance.physics.pressure.assembly import facet_points
from ringbalance.physics.pressure.solve import PressureProblem, PressureSolution, solve_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Convergence, Evidence, Level, as_found
from ringbalance.verification.orders import OrderStudy, field_error, order_figure, refined_cells

_SCALE: Final = 1e5
"""P, Pa."""
_SLOPES: Final = (3.0, 0.7, 1.8)
_SHIFTS: Final = (0.4, 0.2)
_GAUSS: Final = 40
_FIELD_ORDER: Final = {"quadratic": 3.0, "straight": 3.0, "quartic": 5.0}
_WALL_ORDER: Final = {"quadratic": 4.0, "straight": 2.0}
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


def study(
    scene: Scene, level: Level, defect: str | None, *, dimension: int, levels: Mapping[Level, Sequence[int]]
) -> Evidence:
    """Orders and finest errors on ever finer meshes.

    Quadratic cells with curved and with straight sides, and quartic ones with curved sides, whose integrals
    soon meet rounding.
    Args: `levels`: of `refined_cells`.
    Raises: ValueError: an unknown defect.
    """
    disc, cells = scene.disc, refined_cells(scene.disc, levels[level], dimension=dimension)
    exact = Manufactured(length=disc.outer_radius, width=disc.axial_width, half_angle=disc.central_angle / 2)
    solved = partial(_solutions, disc, exact.problem(defect), cells)
    quadratic, straight, quartic = solved(2, "curved"), solved(2, "straight"), solved(4, "curved")
    of_sizes = partial(OrderStudy.of, size=[cells[0][0] / count[0] for count in cells])
    fields = {
        name: of_sizes(error=[field_error(s, exact.pressure) for s in solutions])
        for name, solutions in (("quadratic", quadratic), ("straight", straight), ("quartic", quartic))
    }
    wall = _exact_wall_integral(disc, exact, dimension=dimension)
    walls = {
        name: of_sizes(error=[abs(_wall_integral(s) / wall - 1) for s in solutions])
        for name, solutions in (("quadratic", quadratic), ("straight", straight))
    }
    orders = {f"field_order_{name}": found.settled_order for name, found in fields.items()}
    errors = {f"field_error_{name}": fields[name].finest_error for name in ("quadratic", "quartic")}
    orders |= {f"wall_order_{name}": found.settled_order for name, found in walls.items()}
    errors |= {f"wall_error_{name}": found.finest_error for name, found in walls.items()}
    unknowns = quartic[-1].pressure.size
    note = f"cells {', '.join(' x '.join(map(str, count)) for count in cells)}; up to {unknowns} unknowns"
    return Evidence(
        found=as_found(**orders | errors),
        numbers={
            "curving": walls["straight"].finest_error / walls["quadratic"].finest_error,
            "unknowns": float(unknowns),
        },
        series=(
            order_figure(
                {f"pressure field, {name}": found for name, found in fields.items()}
                | {f"wall force, {name}": found for name, found in walls.items()}
            ),
        ),
        convergence=(
            *_tables(fields, "pressure field, relative error", _FIELD_ORDER, note),
            *_tables(walls, "force on the outer wall, relative error", _WALL_ORDER, note),
        ),
    )


def _tables(
    studies: Mapping[str, OrderStudy], quantity: str, formal: Mapping[str, float], note: str
) -> list[Convergence]:
    return [found.table(quantity, formal[name], geometry=name, note=note) for name, found in studies.items()]


def _solutions(
    disc: Disc,
    problem: PressureProblem,
    cells: Sequence[tuple[int, ...]],
    order: int,
    geometry: Geometry,
) -> list[PressureSolution]:
    """A wrong wall integral is seen against the true arc, so straight sides show in it."""
    radius = float(surface_radius(disc=disc, fill_ratio=_FILL_SHARE * disc.max_fill_ratio))
    return [
        solve_pressure(
            chamber=chamber_mesh(
                disc=disc, surface_radius=radius, cells=count, order=order, geometry=geometry
            ),
            problem=problem,
        )
        for count in cells
    ]


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
