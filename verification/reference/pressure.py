"""Exact pressures, and finite elements compared with them over several levels.

The quasi-static ring under gravity, whose surface is a circle about -g/omega^2, or a paraboloid about the
shaft:

p = rho omega^2 (|r + g/omega^2|^2 - c^2)/2 across the shaft, p = rho (omega^2 (r^2 - c^2)/2 - g z) along it;
c from the liquid's volume, by quadrature of the closed-form area.  And a manufactured pressure, in closed
form, with right-hand sides for the solver.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq
from skfem import MeshHex1, MeshHex2, MeshQuad1, MeshQuad2

from ringbalance.mesh.chamber import ChamberMesh, chamber_mesh
from ringbalance.mesh.geometry import half_angle, liquid_area, surface_radius
from ringbalance.physics.pressure.solve import (
    PressureProblem,
    PressureSolution,
    RotatingLiquid,
    quadratic_basis,
    solve_pressure,
)
from ringbalance.physics.pressure.surface import solve_with_gravity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.loop_models import Shaft
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
from ringbalance.verification.finite_elements import field_error, mutated_force, refined_cells, slopes

_RING_GAUSS_POINTS: Final = 60
_MAX_TILT: Final = 0.1
"""Largest g/(omega^2 R1): the tilt is large enough to expose a concentric surface as wrong."""
_MAX_GAP_FRACTION: Final = 0.3
"""Fraction of the gaps between surface and walls that the tilt may take."""
_DIRECTION_RAD: Final = 0.6
"""Angle of gravity from the chamber's centre line, off every axis of symmetry."""
_GRAVITY: Final = 9.80665
_GRAVITY_FLIPPED: Final = "gravity_sign_flipped"
_FACTORS: Final[Mapping[str | None, Mapping[str, float]]] = MappingProxyType(
    {
        "force_off_by_a_percent": {"x_factor": 1.01, "y_factor": 1.01},
        "force_across_off_by_a_percent": {"y_factor": 1.01},
    }
)
"""Mutations of the body force."""
_FILL_OF_MAX: Final = 0.8
"""Fill of the study over the largest fill."""


@dataclass(frozen=True, kw_only=True)
class _ExactRing:
    """Exact free surface, and exact pressure in the liquid."""

    density: float
    """rho, kg/m^3."""
    angular_velocity: float
    """omega, rad/s."""
    offset: tuple[float, float]
    """g/omega^2 across the shaft in the chamber's axes, m."""
    axial: float
    """g/omega^2 along the negative z axis, m; zero across the shaft."""
    level: float
    """c, m."""

    def radius(self, angle: npt.ArrayLike, axial_position: npt.ArrayLike = 0.0) -> FloatArray:
        """Radius of the free surface, m.

        r^2 + 2 r G.e_r + |G|^2 = c^2 with G = g/omega^2 across the shaft, r^2 = c^2 + 2 G z along it.
        """
        phi, z = np.asarray(angle, dtype=np.float64), np.asarray(axial_position, dtype=np.float64)
        radial = self.offset[0] * np.cos(phi) + self.offset[1] * np.sin(phi)
        square = self.offset[0] ** 2 + self.offset[1] ** 2
        return np.asarray(-radial + np.sqrt(radial**2 + self.level**2 - square + 2 * self.axial * z))

    def pressure(self, points: FloatArray) -> FloatArray:
        """Pressure of the liquid, Pa, the gas counted as zero, at points in m, shape (2 or 3, ...)."""
        square = (points[0] + self.offset[0]) ** 2 + (points[1] + self.offset[1]) ** 2
        depth = self.axial * points[2] if len(points) == 3 else 0.0
        scale = self.density * self.angular_velocity**2
        return np.asarray(scale * ((square - self.level**2) / 2 - depth))


def _exact_ring(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    fill_ratio: float,
    transverse: tuple[float, float] = (0.0, 0.0),
    axial: float = 0.0,
) -> _ExactRing:
    """The ring of a fill ratio under gravity, m/s^2.

    Args: `transverse`: across the shaft in the chamber's axes. `axial`: along the negative z axis.
    Raises: ValueError: gravity so strong that no closed ring holds the liquid.
    """
    square = angular_velocity**2
    target = fill_ratio * float(liquid_area(disc=disc, surface_radius=disc.inner_radius))
    middle = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
    abscissa, weight = map(np.asarray, np.polynomial.legendre.leggauss(_RING_GAUSS_POINTS))

    def ring(level: float) -> _ExactRing:
        return _ExactRing(
            density=density,
            angular_velocity=angular_velocity,
            offset=(transverse[0] / square, transverse[1] / square),
            axial=axial / square,
            level=level,
        )

    def excess(level: float) -> float:
        """Mean area of the liquid's section less that of the fill."""
        if axial:
            radii = ring(level).radius(np.zeros_like(abscissa), disc.axial_width / 2 * abscissa)
        else:
            # With phi = eta alpha(r) the area element is alpha r dr d eta, so each ray holds half of A(r_s).
            # The angle of a ray depends on the radius through the plates.
            radii = np.full(abscissa.shape, disc.outer_radius)
            for _ in range(100):
                update = ring(level).radius(abscissa * half_angle(disc=disc, radius=radii))
                if np.max(np.abs(update - radii)) < 1e-16:
                    break
                radii = update
        return float(weight @ liquid_area(disc=disc, surface_radius=radii) / 2) - target

    reach = 1.5 * float(np.hypot(*transverse)) / square + 1.5 * axial / square * disc.axial_width / middle
    return ring(float(brentq(excess, middle - reach, middle + reach, xtol=1e-17, rtol=1e-15)))


def gravity_study(
    scene: Scene, level: Level, defect: str | None, *, shaft: Shaft, levels: Mapping[Level, Sequence[int]]
) -> Evidence:
    """Solve for the free surface on ever finer meshes, and compare it with the exact one.

    Gravity acts across a horizontal shaft, on two-dimensional meshes, or along a vertical one.
    Args: `levels`: of `refined_cells`.
    Raises: ValueError: a search or solve that failed on some level.
    """
    cells = refined_cells(scene.disc, levels[level], dimension=3 if shaft == "vertical" else 2)
    disc, fill = scene.disc, _FILL_OF_MAX * scene.disc.max_fill_ratio
    true = tilted_liquid(disc=disc, density=scene.liquid.density, fill_ratio=fill, shaft=shaft)
    exact = _exact_ring(
        disc=disc,
        density=true.density,
        angular_velocity=true.angular_velocity,
        fill_ratio=fill,
        transverse=(true.gravity[0], true.gravity[1]),
        axial=-sum(true.gravity[2:]),
    )
    liquid = replace(true, gravity=tuple(-g for g in true.gravity)) if defect == _GRAVITY_FLIPPED else true
    with mutated_force(**_FACTORS.get(defect, {})):
        solutions = [solve_with_gravity(disc=disc, liquid=liquid, fill_ratio=fill, cells=c) for c in cells]
    for solution in solutions:
        if not solution.status.ok:
            raise ValueError(solution.status.text)
    study = partial(
        Convergence.of_errors,
        formal_order=3.0,
        size=[cells[0][0] / count[0] for count in cells],
        geometry="quadratic",
        note=f"cells {_listed(cells)}",
    )
    surface_errors = []
    for solution in solutions:
        nodes = solution.chamber.places[:, solution.chamber.grid[0]]
        angle = np.arctan2(nodes[1], nodes[0])
        axial = nodes[2] if len(nodes) == 3 else np.zeros_like(angle)
        away = np.hypot(nodes[0], nodes[1]) - exact.radius(angle, axial)
        depth = disc.outer_radius - float(np.mean(solution.chamber.surface_radius))
        surface_errors.append(float(np.max(np.abs(away))) / depth)
    surface = study("place of the free surface, over the depth", error=surface_errors)
    field = study("pressure field, relative error", error=[field_error(s, exact.pressure) for s in solutions])
    volume = max(abs(s.statistics.extra["volume_error"]) for s in solutions)
    middle = float(surface_radius(disc=disc, fill_ratio=fill))
    return Evidence(
        quantities={
            **orders_found({"surface": surface, "field": field}),
            "volume_error": Found(value=volume),
        },
        numbers={"tilt": _GRAVITY / (true.angular_velocity**2 * middle), "direction": _DIRECTION_RAD},
        series=(order_figure({"free surface": surface, "pressure field": field}),),
        convergence=(surface, field),
    )


def _listed(cells: Sequence[Sequence[int]]) -> str:
    return ", ".join(" x ".join(map(str, count)) for count in cells)


def tilted_liquid(*, disc: Disc, density: float, fill_ratio: float, shaft: Shaft) -> RotatingLiquid:
    """Liquid that turns slowly enough for gravity to tilt its surface far, yet with a closed ring.

    Gravity has two components across a horizontal shaft, in a direction without symmetry, else three.
    """
    inner, outer = disc.inner_radius, disc.outer_radius
    middle = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
    gravity: tuple[float, ...]
    if shaft == "horizontal":
        offset = min(_MAX_TILT * inner, _MAX_GAP_FRACTION * min(middle - inner, outer - middle))
        gravity = (_GRAVITY * float(np.cos(_DIRECTION_RAD)), _GRAVITY * float(np.sin(_DIRECTION_RAD)))
    else:
        gaps = min(middle**2 - inner**2, outer**2 - middle**2)
        offset = _MAX_GAP_FRACTION * gaps / disc.axial_width
        gravity = (0.0, 0.0, -_GRAVITY)
    speed = float(np.sqrt(_GRAVITY / offset))
    return RotatingLiquid(density=density, angular_velocity=speed, gravity=gravity)


_SCALE_PA: Final = 1e5
_SLOPES: Final = (3.0, 0.7, 1.8)
_SHIFTS: Final = (0.4, 0.2)
_WALL_GAUSS_POINTS: Final = 40
_WALL_ORDER: Final = {"quadratic": 4.0, "straight": 2.0}


@dataclass(frozen=True, kw_only=True)
class Manufactured:
    """The chosen pressure and its derivatives at any point, lengths in metres."""

    length: float
    """R2, m."""
    width: float
    """B, m."""

    def pressure(self, points: Any) -> FloatArray:
        """The chosen pressure, Pa, at points in m, shape (dimension, ...)."""
        x, y = points[0] / self.length, points[1] / self.length
        z = points[2] / self.width if len(points) == 3 else np.zeros_like(x)
        wave = np.sin(_SLOPES[0] * x + _SHIFTS[0]) * np.exp(_SLOPES[1] * y)
        return np.asarray(_SCALE_PA * (wave * np.cos(_SLOPES[2] * z + _SHIFTS[1]) + (x**2 + y**2) / 2))

    def gradient(self, points: FloatArray) -> FloatArray:
        """Pressure gradient, Pa/m, the shape of `points`."""
        return slopes(self.pressure, points)

    def problem(self, defect: str | None = None) -> PressureProblem:
        """The right-hand sides that make this pressure the solution, with a deliberate error built in."""

        def force_along(points: FloatArray) -> FloatArray:
            force = self.gradient(points)
            force[1] = 0.0
            return force

        exact = PressureProblem(force=self.gradient, surface_pressure=self.pressure)
        if defect == "force_off_by_a_percent":
            return replace(exact, force=lambda points: 1.01 * self.gradient(points))
        if defect == "force_across_dropped":
            return replace(exact, force=force_along)
        if defect == "surface_pressure_shifted":
            return replace(exact, surface_pressure=lambda points: self.pressure(points) + 1e-3 * _SCALE_PA)
        if defect is not None:
            raise ValueError(f"unknown defect {defect}")
        return exact


def manufactured_study(
    scene: Scene, level: Level, defect: str | None, *, dimension: int, levels: Mapping[Level, Sequence[int]]
) -> Evidence:
    """Orders and finest errors on ever finer meshes.

    Quadratic cells with curved and with straight sides.
    Args: `levels`: of `refined_cells`.
    Raises: ValueError: an unknown defect.
    """
    disc, cells = scene.disc, refined_cells(scene.disc, levels[level], dimension=dimension)
    exact = Manufactured(length=disc.outer_radius, width=disc.axial_width)
    wall, fields, walls = _exact_wall_integral(disc, exact, dimension=dimension), {}, {}
    for name, wall_order in _WALL_ORDER.items():
        liquids = [_liquid(disc, count, name == "straight") for count in cells]
        problem = exact.problem(defect)
        solutions = [solve_pressure(chamber=each, problem=problem, basis=basis) for each, basis in liquids]
        unknowns = solutions[-1].pressure.size
        study = partial(
            Convergence.of_errors,
            size=[cells[0][0] / count[0] for count in cells],
            geometry=name,
            note=f"cells {_listed(cells)}; up to {unknowns} unknowns",
        )
        fields[name] = study(
            "pressure field, relative error", 3.0, error=[field_error(s, exact.pressure) for s in solutions]
        )
        walls[name] = study(
            "force on the outer wall, relative error",
            wall_order,
            error=[abs(_wall_integral(s) / wall - 1) for s in solutions],
        )
    return Evidence(
        quantities=as_found(
            **{f"field_order_{name}": each.settled_order for name, each in fields.items()},
            field_error_quadratic=fields["quadratic"].finest_error,
            **{f"wall_order_{name}": each.settled_order for name, each in walls.items()},
            **{f"wall_error_{name}": each.finest_error for name, each in walls.items()},
        ),
        numbers={
            "curving": walls["straight"].finest_error / walls["quadratic"].finest_error,
            "unknowns": unknowns,
        },
        series=(
            order_figure(
                {f"pressure field, {name}": each for name, each in fields.items()}
                | {f"wall force, {name}": each for name, each in walls.items()}
            ),
        ),
        convergence=(*fields.values(), *walls.values()),
    )


@lru_cache(maxsize=12)
def _liquid(disc: Disc, count: tuple[int, ...], straight: bool) -> tuple[ChamberMesh, Any]:
    """A mesh with its quadratic elements, the same for all mutations; `straight`: cells with straight sides.

    Straight sides make the wall integral differ from that over the true arc.
    """
    radius = float(surface_radius(disc=disc, fill_ratio=_FILL_OF_MAX * disc.max_fill_ratio))
    chamber = chamber_mesh(disc=disc, surface_radius=radius, cells=count)
    if straight:
        mesh = chamber.mesh
        first, second = (MeshQuad1, MeshQuad2) if chamber.dimension == 2 else (MeshHex1, MeshHex2)
        flat = second.from_mesh(first(mesh.p, mesh.t))
        chamber = replace(chamber, mesh=second(flat.doflocs, mesh.t, mesh.boundaries))
    return chamber, quadratic_basis(chamber.mesh)


def _wall_integral(solution: PressureSolution) -> float:
    """Integral of the pressure over the outer wall, N or N/m."""
    wall = solution.side("outer_wall")
    total = float(np.sum(wall.weights * wall.at_points(solution.pressure)))
    return total * solution.chamber.length_scale ** (solution.chamber.dimension - 1)


def _exact_wall_integral(disc: Disc, exact: Manufactured, *, dimension: int) -> float:
    abscissa, weight = np.polynomial.legendre.leggauss(_WALL_GAUSS_POINTS)
    alpha = float(half_angle(disc=disc, radius=disc.outer_radius))
    arc = disc.outer_radius * np.exp(1j * alpha * abscissa)
    area = disc.outer_radius * alpha * weight
    if dimension == 2:
        return float(area @ exact.pressure(np.stack([arc.real, arc.imag])))
    axial = disc.axial_width / 2 * abscissa
    points = np.stack(np.broadcast_arrays(arc.real[:, None], arc.imag[:, None], axial[None, :]))
    return float(area @ exact.pressure(points) @ (disc.axial_width / 2 * weight))
