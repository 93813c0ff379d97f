"""Pressures known exactly, and finite elements compared with them over several levels.

The quasi-static ring under gravity, whose surface is a circle about -g/omega^2, or a paraboloid about the
shaft:

p = rho omega^2 (|r + g/omega^2|^2 - c^2)/2 across the shaft, p = rho (omega^2 (r^2 - c^2)/2 - g z) along it;
c from the liquid's volume, by quadrature of the closed-form area.  And a manufactured pressure, in closed
form, whose right-hand sides are put into the solver.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
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

_GAUSS_RING: Final = 60
_TILT: Final = 0.1
"""Largest g/(omega^2 R1): a surface so tilted that a concentric one would be visibly wrong."""
_ROOM: Final = 0.3
"""Share of the room between surface and walls that the tilt may take."""
_DIRECTION: Final = 0.6
"""Of gravity from the chamber's centre line, rad: no axis of symmetry."""
_GRAVITY: Final = 9.80665
_GRAVITY_FLIPPED: Final = "gravity_sign_flipped"
_FACTORS: Final[Mapping[str | None, Mapping[str, float]]] = MappingProxyType(
    {
        "force_off_by_a_percent": {"x_factor": 1.01, "y_factor": 1.01},
        "force_across_off_by_a_percent": {"y_factor": 1.01},
    }
)
"""Mutations of the body force."""
_FILL_SHARE: Final = 0.8
"""Of the largest fill, in the study."""


@dataclass(frozen=True, kw_only=True)
class _ExactRing:
    """The free surface and the pressure below it, exactly."""

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

    def radius(self, angle: npt.ArrayLike, axial_place: npt.ArrayLike = 0.0) -> FloatArray:
        """Radius of the free surface, m.

        r^2 + 2 r G.e_r + |G|^2 = c^2 with G = g/omega^2 across the shaft, r^2 = c^2 + 2 G z along it.
        """
        phi, z = np.asarray(angle, dtype=np.float64), np.asarray(axial_place, dtype=np.float64)
        along = self.offset[0] * np.cos(phi) + self.offset[1] * np.sin(phi)
        across = self.offset[0] ** 2 + self.offset[1] ** 2
        return np.asarray(-along + np.sqrt(along**2 + self.level**2 - across + 2 * self.axial * z))

    def pressure(self, places: FloatArray) -> FloatArray:
        """Pressure of the liquid, Pa, the gas counted as zero, at places in m, shape (2 or 3, ...)."""
        square = (places[0] + self.offset[0]) ** 2 + (places[1] + self.offset[1]) ** 2
        depth = self.axial * places[2] if len(places) == 3 else 0.0
        scale = self.density * self.angular_velocity**2
        return np.asarray(scale * ((square - self.level**2) / 2 - depth))


def _exact_ring(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    fill_ratio: float,
    across: tuple[float, float] = (0.0, 0.0),
    along: float = 0.0,
) -> _ExactRing:
    """The ring that holds a fill ratio under gravity, m/s^2.

    Args: `across`: across the shaft in the chamber's axes. `along`: along the negative z axis.
    Raises: ValueError: gravity so strong that no closed ring holds the liquid.
    """
    square = angular_velocity**2
    target = fill_ratio * float(liquid_area(disc=disc, surface_radius=disc.inner_radius))
    middle = float(surface_radius(disc=disc, fill_ratio=fill_ratio))

    def ring(level: float) -> _ExactRing:
        return _ExactRing(
            density=density,
            angular_velocity=angular_velocity,
            offset=(across[0] / square, across[1] / square),
            axial=along / square,
            level=level,
        )

    area = _mean_area_along if along else _area_across
    reach = 1.5 * float(np.hypot(*across)) / square + 1.5 * along / square * disc.axial_width / middle
    level = brentq(
        lambda c: area(disc, ring(c)) - target, middle - reach, middle + reach, xtol=1e-17, rtol=1e-15
    )
    return ring(float(level))


def _rule() -> tuple[FloatArray, FloatArray]:
    abscissa, weight = np.polynomial.legendre.leggauss(_GAUSS_RING)
    return np.asarray(abscissa), np.asarray(weight)


def _on_rays(disc: Disc, radius: Callable[[FloatArray], FloatArray], eta: FloatArray) -> FloatArray:
    """Surface radius on the rays phi = eta alpha(r), whose angle depends on the radius through the plates."""
    r = np.full(eta.shape, disc.outer_radius)
    for _ in range(100):
        update = radius(eta * half_angle(disc=disc, radius=r))
        if np.max(np.abs(update - r)) < 1e-16:
            break
        r = update
    return r


def _area_across(disc: Disc, ring: _ExactRing) -> float:
    """With phi = eta alpha(r) the area element is alpha r dr d eta, so each ray holds half of A(r_s)."""
    eta, weight = _rule()
    return float(weight @ liquid_area(disc=disc, surface_radius=_on_rays(disc, ring.radius, eta)) / 2)


def _mean_area_along(disc: Disc, ring: _ExactRing) -> float:
    zeta, weight = _rule()
    radius = ring.radius(np.zeros_like(zeta), disc.axial_width / 2 * zeta)
    return float(weight @ liquid_area(disc=disc, surface_radius=radius) / 2)


def gravity_study(
    scene: Scene, level: Level, defect: str | None, *, shaft: Shaft, levels: Mapping[Level, Sequence[int]]
) -> Evidence:
    """Find the free surface on ever finer meshes; compare it with the exact one.

    Gravity points across the chamber of a horizontal shaft, on flat meshes, and along a vertical one.
    Args: `levels`: of `refined_cells`.
    Raises: ValueError: a search or solve that failed on some level.
    """
    cells = refined_cells(scene.disc, levels[level], dimension=3 if shaft == "vertical" else 2)
    disc, fill = scene.disc, _FILL_SHARE * scene.disc.max_fill_ratio
    true = tilted_liquid(disc=disc, density=scene.liquid.density, fill_ratio=fill, shaft=shaft)
    exact = _exact_ring(
        disc=disc,
        density=true.density,
        angular_velocity=true.angular_velocity,
        fill_ratio=fill,
        across=(true.gravity[0], true.gravity[1]),
        along=-sum(true.gravity[2:]),
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
    surface = study(
        "place of the free surface, over the depth",
        error=[_surface_error(disc, s, exact) for s in solutions],
    )
    field = study("pressure field, relative error", error=[field_error(s, exact.pressure) for s in solutions])
    volume = max(abs(s.statistics.extra["volume_error"]) for s in solutions)
    middle = float(surface_radius(disc=disc, fill_ratio=fill))
    return Evidence(
        quantities={
            **orders_found({"surface": surface, "field": field}),
            "volume_error": Found(value=volume),
        },
        numbers={"tilt": _GRAVITY / (true.angular_velocity**2 * middle), "direction": _DIRECTION},
        series=(order_figure({"free surface": surface, "pressure field": field}),),
        convergence=(surface, field),
    )


def _listed(cells: Sequence[Sequence[int]]) -> str:
    return ", ".join(" x ".join(map(str, count)) for count in cells)


def tilted_liquid(*, disc: Disc, density: float, fill_ratio: float, shaft: Shaft) -> RotatingLiquid:
    """Liquid that turns so slowly that gravity tilts its surface far, yet leaves the ring closed.

    Gravity has two components across a horizontal shaft, at no angle of symmetry, three along a vertical one.
    """
    middle = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
    speed = float(np.sqrt(_GRAVITY / _offset(disc, middle, shaft)))
    across = (_GRAVITY * float(np.cos(_DIRECTION)), _GRAVITY * float(np.sin(_DIRECTION)))
    gravity = (0.0, 0.0, -_GRAVITY) if shaft == "vertical" else across
    return RotatingLiquid(density=density, angular_velocity=speed, gravity=gravity)


def _offset(disc: Disc, middle: float, shaft: Shaft) -> float:
    """g/omega^2, so large that the surface is far from concentric and still closed."""
    inner, outer = disc.inner_radius, disc.outer_radius
    if shaft == "horizontal":
        return min(_TILT * inner, _ROOM * min(middle - inner, outer - middle))
    return _ROOM * min(middle**2 - inner**2, outer**2 - middle**2) / disc.axial_width


def _surface_error(disc: Disc, solution: PressureSolution, exact: _ExactRing) -> float:
    nodes = solution.chamber.places[:, solution.chamber.grid[0]]
    angle = np.arctan2(nodes[1], nodes[0])
    axial = nodes[2] if len(nodes) == 3 else np.zeros_like(angle)
    away = np.hypot(nodes[0], nodes[1]) - exact.radius(angle, axial)
    depth = disc.outer_radius - float(np.mean(solution.chamber.surface_radius))
    return float(np.max(np.abs(away))) / depth


_SCALE: Final = 1e5
"""P, Pa."""
_SLOPES: Final = (3.0, 0.7, 1.8)
_SHIFTS: Final = (0.4, 0.2)
_GAUSS: Final = 40
_WALL_ORDER: Final = {"quadratic": 4.0, "straight": 2.0}


@dataclass(frozen=True, kw_only=True)
class Manufactured:
    """The chosen pressure and its derivatives at any place, lengths in metres."""

    length: float
    """R2, m."""
    width: float
    """B, m."""

    def pressure(self, places: Any) -> FloatArray:
        """The chosen pressure, Pa, at places in m, shape (dimension, ...)."""
        x, y = places[0] / self.length, places[1] / self.length
        z = places[2] / self.width if len(places) == 3 else np.zeros_like(x)
        wave = np.sin(_SLOPES[0] * x + _SHIFTS[0]) * np.exp(_SLOPES[1] * y)
        return np.asarray(_SCALE * (wave * np.cos(_SLOPES[2] * z + _SHIFTS[1]) + (x**2 + y**2) / 2))

    def gradient(self, places: FloatArray) -> FloatArray:
        """Its gradient, Pa/m, the shape of `places`."""
        return slopes(self.pressure, places)

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
        solutions = _solutions(disc, exact.problem(defect), cells, straight=name == "straight")
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
