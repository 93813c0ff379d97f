"""Manufactured solutions of the pressure problem: chosen outside the discrete space, errors over levels.

The pressure is p = P [sin(3 x/R2 + 0.4) exp(0.7 y/R2) cos(1.8 z/B + 0.2) + r^2/(2 R2^2)]; its gradient as the
body force and its values on the free surface go into the same record that the physical problem uses, so every
term of the problem is exercised and none vanishes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from skfem import MeshHex1, MeshHex2, MeshQuad1, MeshQuad2

from ringbalance.mesh.chamber import ChamberMesh, chamber_mesh
from ringbalance.mesh.geometry import half_angle, surface_radius
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
_FIELD_ORDER: Final = {"quadratic": 3.0, "straight": 3.0}
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

    def problem(self, defect: str | None = None) -> PressureProblem:
        """The right-hand sides that make this pressure the solution, with a deliberate error built in."""
        exact = PressureProblem(force=self.gradient, surface_pressure=self.pressure)
        if defect == "force_off_by_a_percent":
            return replace(exact, force=lambda places: 1.01 * self.gradient(places))
        if defect == "force_across_dropped":
            return replace(exact, force=self._without_across)
        if defect == "surface_pressure_shifted":
            return replace(exact, surface_pressure=lambda places: self.pressure(places) + 1e-3 * _SCALE)
        if defect is not None:
            raise ValueError(f"unknown defect {defect}")
        return exact

    def _without_across(self, places: FloatArray) -> FloatArray:
        force = self.gradient(places)
        force[1] = 0.0
        return force


def study(
    scene: Scene, level: Level, defect: str | None, *, dimension: int, levels: Mapping[Level, Sequence[int]]
) -> Evidence:
    """Orders and finest errors on ever finer meshes.

    Quadratic cells with curved and with straight sides.
    Args: `levels`: of `refined_cells`.
    Raises: ValueError: an unknown defect.
    """
    disc, cells = scene.disc, refined_cells(scene.disc, levels[level], dimension=dimension)
    exact = Manufactured(length=disc.outer_radius, width=disc.axial_width)
    quadratic, straight = (
        _solutions(disc, exact.problem(defect), cells, straight=straight) for straight in (False, True)
    )
    of_sizes = partial(OrderStudy.of, size=[cells[0][0] / count[0] for count in cells])
    fields = {
        name: of_sizes(error=[field_error(s, exact.pressure) for s in solutions])
        for name, solutions in (("quadratic", quadratic), ("straight", straight))
    }
    wall = _exact_wall_integral(disc, exact, dimension=dimension)
    walls = {
        name: of_sizes(error=[abs(_wall_integral(s) / wall - 1) for s in solutions])
        for name, solutions in (("quadratic", quadratic), ("straight", straight))
    }
    orders = {f"field_order_{name}": found.settled_order for name, found in fields.items()}
    errors = {"field_error_quadratic": fields["quadratic"].finest_error}
    orders |= {f"wall_order_{name}": found.settled_order for name, found in walls.items()}
    errors |= {f"wall_error_{name}": found.finest_error for name, found in walls.items()}
    unknowns = quadratic[-1].pressure.size
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
    disc: Disc, problem: PressureProblem, cells: Sequence[tuple[int, ...]], *, straight: bool
) -> list[PressureSolution]:
    """A wrong wall integral is seen against the true arc, so straight sides show in it."""
    radius = float(surface_radius(disc=disc, fill_ratio=_FILL_SHARE * disc.max_fill_ratio))
    meshes = (chamber_mesh(disc=disc, surface_radius=radius, cells=count) for count in cells)
    return [
        solve_pressure(chamber=_straightened(mesh) if straight else mesh, problem=problem) for mesh in meshes
    ]


def _straightened(chamber: ChamberMesh) -> ChamberMesh:
    """The same mesh with nodes within cells on straight lines between the corners."""
    first, second = (MeshQuad1, MeshQuad2) if chamber.dimension == 2 else (MeshHex1, MeshHex2)
    mesh = chamber.mesh
    flat = second.from_mesh(first(mesh.p, mesh.t))
    return replace(chamber, mesh=second(flat.doflocs, mesh.t, mesh.boundaries))


def _wall_integral(solution: PressureSolution) -> float:
    """Integral of the pressure over the outer wall, N or N/m."""
    wall = solution.side("outer_wall")
    total = float(np.sum(wall.weights * wall.at_points(solution.pressure)))
    return total * solution.chamber.length_scale ** (solution.chamber.dimension - 1)


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
