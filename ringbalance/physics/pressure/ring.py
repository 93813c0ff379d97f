"""Totals of the liquid ring in one chamber: volume, wall pressure, moment and force on the disc.

Every number comes from finite elements on three meshes, with a half-width by its own grid convergence and by
the rounding that convergence does not show.  With gravity across the shaft each number is the mean over a
turn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.chamber import chamber_mesh, default_cells
from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.physics.convergence import GridConvergence, gci
from ringbalance.physics.pressure.loads import liquid_integrals
from ringbalance.physics.pressure.solve import RotatingLiquid, solve_pressure
from ringbalance.physics.pressure.surface import refined_surface, solve_with_gravity
from ringbalance.physics.results import Estimate, Statistics, Status
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.loop_models import Shaft
from ringbalance.scene.models import Disc

QUANTITIES: Final = ("liquid_volume", "wall_pressure", "moment", "moment_per_volume", "resultant_force")
_FORMAL_ORDER: Final = 4.0
"""Order of integrals on quadratic geometry: twice that of the elements, and that of an arc's drawing."""
_LEAST_DEPTH: Final = 1e-10
"""Depth over outer radius at which coordinates still resolve the nodes of a film."""
_AVERAGING_ERROR: Final = 1e-8
"""Left-over harmonics in the mean over a turn, relative; decides the number of samples."""
_EPSILON: Final = float(np.finfo(np.float64).eps)
_ROUNDING_FACTORS: Final = MappingProxyType({2: 20.0, 3: 1000.0})
"""Rounding of a film's coordinates, by dimension, over eps R2/depth."""


@dataclass(frozen=True, kw_only=True)
class RingQuantities:
    """Totals of the liquid in one chamber along an array of fill ratios, SI; arrays start with that axis.

    Axes: x outward through the middle of the chamber, y with the rotation, z along the shaft.
    """

    fill_ratio: FloatArray
    """x, shape (n,)."""
    liquid_volume: Estimate
    """Volume of the liquid, m^3, shape (n,)."""
    wall_pressure: Estimate
    """Mean liquid pressure on the outer wall (gas pressure zero), Pa, shape (n,)."""
    moment: Estimate
    """U = rho times the integral of x over the liquid, kg m, shape (n,)."""
    moment_per_volume: Estimate
    """dU/dV' as liquid is added, kg/m^2, shape (n,)."""
    resultant_force: Estimate
    """Force of the liquid on all walls along x, N, shape (n,)."""
    ripple: Mapping[str, FloatArray]
    """First harmonic over a turn of "wall_pressure" (Pa) and "moment" (kg m), zero-to-peak, shape (n,)."""
    convergence: Mapping[str, tuple[GridConvergence, ...]]
    """Grid convergence of each quantity by its name, one record per fill ratio."""
    mesh_values: Mapping[str, FloatArray]
    """Each quantity on every mesh, finest first, shape (meshes, n)."""
    cells: tuple[tuple[int, ...], ...]
    """Cells of the meshes, finest first."""
    solved: BoolArray
    """True where there are values, shape (n,); elsewhere, without a closed ring or after a failed solve, they
    are zeros."""
    status: Status
    statistics: Statistics


def ring_quantities(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    fill_ratio: npt.ArrayLike,
    gravity: float = 0.0,
    shaft: Shaft = "horizontal",
    dimension: int | None = None,
    cells: Sequence[tuple[int, ...]] | None = None,
) -> RingQuantities:
    """Finite-element totals of one chamber's liquid over fill ratios, each with its uncertainty.

    laplace(p) = 2 rho omega^2, n.grad p = rho (omega^2 r e_r + g).n on walls, p = 0 on the free surface; then
    volume, mean p on the outer wall, U = int rho x, dU/dV' = rho int x/|n.grad p| / int 1/|n.grad p|, and
    the force int p n.
    Args:
        fill_ratio: x, any shape, flattened to (n,), within [0, 1]; an empty chamber is exact.
        gravity: g, m/s^2; zero leaves it out.
        shaft: "horizontal" turns gravity across the chamber, "vertical" points it along -z.
        dimension: 2 or 3; default 2, or 3 for a vertical shaft with gravity, which 2 cannot describe.
        cells: three meshes, finest first, each with half the cells of the one before; default `default_cells`
            and two coarser ones; they decide the dimension when given.
    Returns: The totals; status is that of the first fill that is not solved.
    Raises: ValueError: fill ratios outside [0, 1], or above 0 but too small for a mesh; invalid density or
        speed; two dimensions for gravity along the shaft; not three meshes.
    Source: Eqs. 3 to 12 of the liquid-ring paper, with exact plates; Celik et al. (2008),
        doi:10.1115/1.2960953.
    """
    fills = np.atleast_1d(np.asarray(fill_ratio, dtype=np.float64)).ravel()
    _check(disc, fills, density, angular_velocity, gravity)
    axial = gravity > 0 and shaft == "vertical"
    finest = default_cells(disc=disc, dimension=dimension or (3 if axial else 2))
    meshes = tuple(cells) if cells else tuple(tuple(n // k for n in finest) for k in (1, 2, 4))
    if len(meshes) != 3 or any(len(c) != len(meshes[0]) for c in meshes):
        raise ValueError("cells must list three meshes of one dimension, finest first")
    if axial and len(meshes[0]) == 2:
        raise ValueError("gravity along the shaft needs dimension 3")
    liquid = RotatingLiquid(density=density, angular_velocity=angular_velocity)
    angles, turn = np.zeros(1), [liquid]
    if axial:
        turn = [replace(liquid, gravity=(0.0, 0.0, -gravity))]
    elif gravity:
        angles = _angles(disc, liquid, gravity)
        turn = [replace(liquid, gravity=(gravity * np.cos(a), gravity * np.sin(a))) for a in angles.tolist()]
    samples = [_on_meshes(disc, turn, angles, float(x), meshes) for x in fills]
    return _collected(disc, liquid, fills, meshes, samples)


def _check(disc: Disc, fills: FloatArray, density: float, omega: float, gravity: float) -> None:
    if fills.size == 0 or not np.all((fills >= 0) & (fills <= 1)):
        raise ValueError("fill_ratio must lie within [0, 1], and there must be at least one")
    if not (density > 0 and np.isfinite(density) and np.isfinite(omega) and omega != 0):
        raise ValueError("density must be positive and angular_velocity not zero, both finite")
    if not (gravity >= 0 and np.isfinite(gravity)):
        raise ValueError("gravity must be zero or positive")
    depth = 1 - surface_radius(disc=disc, fill_ratio=fills) / disc.outer_radius
    if (thin := fills[(fills > 0) & (depth < _LEAST_DEPTH)]).size:
        raise ValueError(
            f"fill_ratio {thin[0]:.3g} leaves a ring shallower than {_LEAST_DEPTH:g} of the outer radius, "
            "which no mesh resolves; give zero instead"
        )


def _angles(disc: Disc, liquid: RotatingLiquid, gravity: float) -> FloatArray:
    """Angles of gravity over half a turn, both ends included; the other half is the mirror image.

    Enough for a mean within 1e-8: the trapezoidal rule over a period is exact up to harmonics of the order of
    the number of samples.
    """
    tilt = gravity / (liquid.angular_velocity**2 * disc.inner_radius)
    harmonics = np.log(_AVERAGING_ERROR) / np.log(min(tilt, 0.3))
    return np.linspace(0, np.pi, max(2, int(np.ceil(harmonics / 2))) + 1)


@dataclass(frozen=True, kw_only=True)
class _TurnMeans:
    """Means over a turn on one mesh; zeros where a solve failed."""

    values: FloatArray
    """In the order of `QUANTITIES`, SI totals, shape (5,)."""
    ripple: FloatArray = field(default_factory=lambda: np.zeros(2))
    """First harmonic of wall pressure (Pa) and moment (kg m), zero-to-peak, shape (2,)."""
    surfaces: tuple[FloatArray, ...] = ()
    """Radii of the computed surfaces, one array per angle, m."""
    status: Status = field(default_factory=Status)
    statistics: Statistics = field(default_factory=Statistics)
    rounding: float = 0.0
    """Largest rounding of a computed surface's position, in mean depths."""


def _on_meshes(
    disc: Disc,
    turn: Sequence[RotatingLiquid],
    angles: FloatArray,
    x: float,
    meshes: tuple[tuple[int, ...], ...],
) -> tuple[_TurnMeans, ...]:
    """Samples on every mesh, finest first, each starting from the surfaces of the coarser one."""
    if x == 0:
        half = float(half_angle(disc=disc, radius=disc.outer_radius))
        drop = turn[0].density * disc.outer_radius * np.sin(half) / half
        return (_TurnMeans(values=np.array([0.0, 0.0, 0.0, drop, 0.0])),) * len(meshes)
    samples: list[_TurnMeans] = []
    for cells, coarser in zip(meshes[::-1], (None, *meshes[:0:-1]), strict=True):
        halves = coarser is not None and all(n == 2 * m for n, m in zip(cells, coarser, strict=True))
        samples.append(_turn_mean(disc, turn, angles, x, cells, samples[-1].surfaces if halves else ()))
    return tuple(reversed(samples))


def _turn_mean(
    disc: Disc,
    turn: Sequence[RotatingLiquid],
    angles: FloatArray,
    x: float,
    cells: tuple[int, ...],
    starts: Sequence[FloatArray],
) -> _TurnMeans:
    """Solve on one mesh at every angle of gravity over half a turn and take the mean over the whole turn.

    Args: `starts`: surfaces on half the cells, one per angle, or none.
    """
    solutions = []
    for k, liquid in enumerate(turn):
        # The free surface is concentric, or computed where there is gravity.
        if liquid.gravity:
            start = refined_surface(starts[k]) if starts else None
            solution = solve_with_gravity(disc=disc, liquid=liquid, fill_ratio=x, cells=cells, start=start)
        else:
            radius = surface_radius(disc=disc, fill_ratio=x)
            chamber = chamber_mesh(disc=disc, surface_radius=radius, cells=cells)
            solution = solve_pressure(chamber=chamber, problem=liquid.problem())
        if not solution.status.ok:
            return _TurnMeans(values=np.zeros(len(QUANTITIES)), status=solution.status)
        solutions.append(solution)
    rows = np.array(
        [
            liquid_integrals(solution=s, density=turn[0].density, axial_width=disc.axial_width).mirrored_alike
            for s in solutions
        ]
    )
    weights = np.full(angles.size, 1.0 / max(angles.size - 1, 1))
    if angles.size > 1:
        weights[[0, -1]] /= 2
    extra = [s.statistics.extra for s in solutions]
    return _TurnMeans(
        values=weights @ rows,
        ripple=np.abs(2 * (weights * np.cos(angles)) @ rows[:, 1:3]) if angles.size > 1 else np.zeros(2),
        surfaces=tuple(s.chamber.surface_radius for s in solutions) if turn[0].gravity else (),
        statistics=Statistics(
            unknowns=solutions[0].statistics.unknowns,
            relative_residual=max(s.statistics.relative_residual for s in solutions),
            extra={"surface_flux_mismatch": max(e.get("surface_flux_mismatch", 0.0) for e in extra)},
        ),
        rounding=max(e.get("surface_rounding", 0.0) for e in extra),
    )


def _collected(
    disc: Disc,
    liquid: RotatingLiquid,
    fills: FloatArray,
    meshes: tuple[tuple[int, ...], ...],
    samples: Sequence[tuple[_TurnMeans, ...]],
) -> RingQuantities:
    values = np.array([[sample.values for sample in levels] for levels in samples])
    sizes = [float(np.prod(cells)) ** (-1 / len(cells)) for cells in meshes]
    failed = [next((s.status for s in levels if not s.status.ok), Status()) for levels in samples]
    records, widths = [], np.zeros((fills.size, len(QUANTITIES)))
    for k, x in enumerate(fills):
        natural = _natural_sizes(disc, liquid, float(x))
        noise = natural * _rounding(disc, meshes[0], float(x), max(s.rounding for s in samples[k]))
        records.append(
            [
                gci(values=v, sizes=sizes, formal_order=_FORMAL_ORDER, round_off=float(n))
                for v, n in zip(values[k].T, noise, strict=True)
            ]
        )
        widths[k] = [record.uncertainty for record in records[k]] if failed[k].ok else natural
    widths[fills == 0] = 0.0
    first = next(((x, each) for x, each in zip(fills, failed, strict=True) if not each.ok), None)
    status = Status()
    if first is not None:
        x, reason = first
        status = Status(code=reason.code, text=f"at a fill ratio of {x:.4g}: {reason.text}")
    estimates = {
        name: Estimate(value=values[:, 0, k].copy(), uncertainty=widths[:, k].copy(), status=status)
        for k, name in enumerate(QUANTITIES)
    }
    finest, ripple = [levels[0].statistics for levels in samples], np.array([s[0].ripple for s in samples])
    mismatch = max(each.extra.get("surface_flux_mismatch", 0.0) for each in finest)
    return RingQuantities(
        fill_ratio=fills,
        **estimates,
        ripple={"wall_pressure": ripple[:, 0], "moment": ripple[:, 1]},
        convergence={name: tuple(row[k] for row in records) for k, name in enumerate(QUANTITIES)},
        mesh_values={name: values[:, :, k].T.copy() for k, name in enumerate(QUANTITIES)},
        cells=meshes,
        solved=np.array([each.ok for each in failed]),
        status=status,
        statistics=Statistics(
            unknowns=max(each.unknowns for each in finest),
            relative_residual=max(s.statistics.relative_residual for levels in samples for s in levels),
            extra={"surface_flux_mismatch": mismatch},
        ),
    )


def _rounding(disc: Disc, cells: tuple[int, ...], x: float, moved: float) -> float:
    """Bound of the rounding of every total over its natural size; zero for an empty chamber, which is exact.

    eps [c R2/depth + 0.2 max(nodes along the depth, depth over the nodes' distance along the arc)^2], plus
    the rounding of a computed surface's position, in mean depths.
    Source: coordinates of a film cancel (c = 20, in three dimensions 1000: a hexahedron's polynomials have
        large coefficients), and narrow cells make the matrix stiff; the factors are five to ten times the
        deviations seen from closed forms between 1 and 180 degrees and depths down to 10 nm.
    """
    if x == 0:
        return 0.0
    a = float(surface_radius(disc=disc, fill_ratio=x))
    depth, arc = disc.outer_radius - a, 2 * a * float(half_angle(disc=disc, radius=a))
    stiffness = max(2 * cells[0], 2 * cells[1] * depth / arc) ** 2
    return _EPSILON * (_ROUNDING_FACTORS[len(cells)] * disc.outer_radius / depth + 0.2 * stiffness) + moved


def _natural_sizes(disc: Disc, liquid: RotatingLiquid, x: float) -> FloatArray:
    """Sizes that the totals would have without symmetry; the force is the pressure on the largest wall."""
    outer, volume = disc.outer_radius, x * chamber_volume(disc=disc)
    a = float(surface_radius(disc=disc, fill_ratio=x))
    pressure = liquid.density * liquid.angular_velocity**2 * (outer - a) * (outer + a) / 2
    force = pressure * disc.central_angle * outer * (disc.axial_width + outer)
    return np.array([volume, pressure, liquid.density * volume * outer, liquid.density * outer, force])
