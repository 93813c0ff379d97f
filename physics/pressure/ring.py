"""What the liquid ring in one chamber does to its disc: volume, wall pressure, moment and force.

Every number comes from finite elements on three meshes and carries the half-width that the grid
convergence of exactly this number gives it, with what that cannot see: rounding, and liquid that gravity
moves unmodelled.  With gravity across the shaft each number is the mean over a turn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.chamber import default_cells
from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.physics.convergence import GridConvergence, gci
from ringbalance.physics.pressure.hydrostatics import displaced_by_gravity, hydrostatic_pressure
from ringbalance.physics.pressure.loads import liquid_integrals
from ringbalance.physics.pressure.solve import RotatingLiquid
from ringbalance.physics.pressure.surface import refined_surface, solve_at_rest
from ringbalance.physics.results import Estimate, Statistics, Status
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.loop_models import Shaft
from ringbalance.scene.models import Disc

FORMAL_ORDER = 4.0
"""Of integrals on quadratic geometry: twice the order of the elements, and that of an arc's drawing."""

_SHALLOWEST = 1e-10
"""Depth over outer radius at which coordinates still resolve the nodes of a film."""
_AVERAGING = 1e-8
"""Left-over harmonics in the mean over a turn, relative; decides the number of samples."""
_EPSILON = float(np.finfo(np.float64).eps)
_CANCELLED = MappingProxyType({2: 20.0, 3: 1000.0})
"""Rounding of a film's coordinates, by dimension, over eps R2/depth."""
QUANTITIES = ("liquid_volume", "wall_pressure", "moment", "moment_per_volume", "resultant_force")
"""In the order of `_Sample.values`."""
_WIDTH = len(QUANTITIES)


@dataclass(frozen=True, kw_only=True)
class _Turn:
    """Gravity as a chamber sees it over a turn."""

    gravity: float
    """m/s^2; zero: left out."""
    shaft: Shaft
    samples: int
    """Even number of angles over a turn, for a horizontal shaft."""


@dataclass(frozen=True, kw_only=True)
class _Sample:
    """Means over a turn on one mesh."""

    values: FloatArray
    """In the order of `QUANTITIES`, SI totals, shape (5,)."""
    ripple: FloatArray
    """First harmonic of wall pressure (Pa) and moment (kg m), zero-to-peak, shape (2,)."""
    surfaces: tuple[FloatArray, ...] = ()
    """Found surfaces, one per angle, m; empty without gravity."""
    status: Status
    unknowns: int = 0
    residual: float = 0.0
    """Largest relative residual of the linear systems."""
    flux_mismatch: float = 0.0
    """Largest mismatch of flux and force on a found surface, relative."""
    rounding: float = 0.0
    """Largest rounding of a found surface's place, in mean depths."""


@dataclass(frozen=True, kw_only=True)
class RingQuantities:
    """Totals of the liquid in one chamber along an array of fill ratios, SI; arrays start with that axis.

    Axes: x outward through the middle of the chamber, y with the rotation, z along the shaft.
    """

    fill_ratio: FloatArray
    """x, shape (n,)."""
    surface_radius: FloatArray
    """Radius of the concentric free surface that holds the same volume, m, shape (n,)."""
    liquid_volume: Estimate
    """m^3, shape (n,)."""
    wall_pressure: Estimate
    """Mean over the outer wall, of the liquid alone (gas counted as zero), Pa, shape (n,)."""
    moment: Estimate
    """U = rho times the integral of x over the liquid, kg m, shape (n,)."""
    moment_per_volume: Estimate
    """dU/dV' as liquid is added, kg/m^2, shape (n,)."""
    resultant_force: Estimate
    """Force of the liquid on all walls along x, N, shape (n,)."""
    ripple: Mapping[str, FloatArray]
    """First harmonic over a turn of "wall_pressure" (Pa) and "moment" (kg m), zero-to-peak, shape (n,)."""
    convergence: Mapping[str, tuple[GridConvergence, ...]]
    """Judgement on each quantity by its name, one per fill ratio."""
    mesh_values: Mapping[str, FloatArray]
    """Each quantity on every mesh, finest first, shape (meshes, n)."""
    cells: tuple[tuple[int, ...], ...]
    """Cells of the meshes, finest first."""
    closed: BoolArray
    """Whether gravity leaves a closed ring, shape (n,); where not, values are those without gravity."""
    solved: BoolArray
    """Whether there are values at all, shape (n,); where not, zeros stand for them, which are no result."""
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
    Returns: The totals. Where gravity leaves no closed ring, or its surface is not found, status says so,
        `closed` is False and the values are those without gravity, their half-widths widened by all that
        gravity could do to the liquid there.
    Raises: ValueError: fill ratios outside [0, 1], or above 0 but too small for a mesh; density or speed
        that make no sense; two dimensions for gravity along the shaft; not three
        meshes.
    Source: Eqs. 3 to 12 of the liquid-ring paper, with exact plates; Celik et al. (2008),
        doi:10.1115/1.2960953.
    """
    fills = np.atleast_1d(np.asarray(fill_ratio, dtype=np.float64)).ravel()
    _check(fills, density, angular_velocity, gravity)
    _check_depth(disc, fills)
    axial = gravity > 0 and shaft == "vertical"
    meshes = _meshes(disc, cells, dimension or (3 if axial else 2))
    if axial and len(meshes[0]) == 2:
        raise ValueError("gravity along the shaft needs dimension 3")
    liquid = RotatingLiquid(density=density, angular_velocity=angular_velocity)
    turn = _Turn(gravity=gravity, shaft=shaft, samples=_turn_samples(disc, liquid, gravity))
    case = _Case(disc=disc, liquid=liquid, fills=fills, meshes=meshes, turn=turn)
    return _collect(case, [_on_meshes(case, float(x), turn) for x in fills])


def _check(fills: FloatArray, density: float, omega: float, gravity: float) -> None:
    if fills.size == 0 or not np.all((fills >= 0) & (fills <= 1)):
        raise ValueError("fill_ratio must lie within [0, 1], and there must be at least one")
    if not (density > 0 and np.isfinite(density) and np.isfinite(omega) and omega != 0):
        raise ValueError("density must be positive and angular_velocity not zero, both finite")
    if not (gravity >= 0 and np.isfinite(gravity)):
        raise ValueError("gravity must be zero or positive")


def _check_depth(disc: Disc, fills: FloatArray) -> None:
    depth = 1 - surface_radius(disc=disc, fill_ratio=fills) / disc.outer_radius
    thin = fills[(fills > 0) & (depth < _SHALLOWEST)]
    if thin.size:
        raise ValueError(
            f"fill_ratio {thin[0]:.3g} leaves a ring shallower than {_SHALLOWEST:g} of the outer radius, "
            "which no mesh resolves; give zero instead"
        )


def _meshes(
    disc: Disc, cells: Sequence[tuple[int, ...]] | None, dimension: int
) -> tuple[tuple[int, ...], ...]:
    finest = default_cells(disc=disc, dimension=dimension)
    meshes = tuple(cells) if cells else tuple(tuple(n // k for n in finest) for k in (1, 2, 4))
    if len(meshes) != 3 or any(len(c) != len(meshes[0]) for c in meshes):
        raise ValueError("cells must list three meshes of one dimension, finest first")
    return meshes


def _turn_samples(disc: Disc, liquid: RotatingLiquid, gravity: float) -> int:
    """Angles of gravity over a turn, an even number, enough for a mean within 1e-8."""
    tilt = gravity / (liquid.angular_velocity**2 * disc.inner_radius)
    if tilt == 0:
        return 2
    harmonics = np.log(_AVERAGING) / np.log(min(tilt, 0.3))
    return 2 * max(2, int(np.ceil(harmonics / 2)))


def _on_meshes(case: _Case, x: float, turn: _Turn) -> tuple[_Sample, ...]:
    """Samples on every mesh, finest first, each starting from the surfaces of the coarser one."""
    disc, liquid, meshes = case.disc, case.liquid, case.meshes
    if x == 0:
        half = float(half_angle(disc=disc, radius=disc.outer_radius))
        drop = liquid.density * disc.outer_radius * np.sin(half) / half
        return (_empty_sample(moment_per_volume=drop),) * len(meshes)
    found: list[_Sample] = []
    for k, cells in reversed(list(enumerate(meshes))):
        halves = found and all(n == 2 * m for n, m in zip(cells, meshes[k + 1], strict=True))
        sample = _turn_mean(
            disc=disc,
            liquid=liquid,
            fill_ratio=x,
            cells=cells,
            turn=turn,
            coarser=found[-1] if halves else None,
        )
        found.append(sample)
    return tuple(reversed(found))


def _collect(case: _Case, samples: Sequence[tuple[_Sample, ...]]) -> RingQuantities:
    failed = [next((s.status for s in levels if not s.status.ok), Status()) for levels in samples]
    still = _Turn(gravity=0.0, shaft="horizontal", samples=2)
    kept = [
        levels if status.ok else _on_meshes(case, float(x), still)
        for levels, status, x in zip(samples, failed, case.fills, strict=True)
    ]
    missing = [next((s.status for s in levels if not s.status.ok), Status()) for levels in kept]
    values = np.array([[sample.values for sample in levels] for levels in kept])
    records = _judge(case, kept, values)
    closed = np.array([status.ok for status in failed])
    widths = np.array([[record.uncertainty for record in row] for row in records])
    widths = case.stated_widths(samples=kept, widths=widths, closed=closed)
    status = _status(case, failed) if all(s.ok for s in missing) else _status(case, missing, solved=False)
    estimates = {
        name: Estimate(value=values[:, 0, k].copy(), uncertainty=widths[:, k].copy(), status=status)
        for k, name in enumerate(QUANTITIES)
    }
    return RingQuantities(
        fill_ratio=case.fills,
        surface_radius=surface_radius(disc=case.disc, fill_ratio=case.fills),
        **estimates,
        ripple=_ripple(kept),
        convergence={name: tuple(row[k] for row in records) for k, name in enumerate(QUANTITIES)},
        mesh_values={name: values[:, :, k].T.copy() for k, name in enumerate(QUANTITIES)},
        cells=case.meshes,
        closed=closed,
        solved=np.array([status.ok for status in missing]),
        status=status,
        statistics=_statistics(kept),
    )


def _ripple(samples: Sequence[tuple[_Sample, ...]]) -> dict[str, FloatArray]:
    ripple = np.array([levels[0].ripple for levels in samples])
    return {"wall_pressure": ripple[:, 0], "moment": ripple[:, 1]}


def _statistics(samples: Sequence[tuple[_Sample, ...]]) -> Statistics:
    finest = [levels[0] for levels in samples]
    return Statistics(
        unknowns=max(sample.unknowns for sample in finest),
        relative_residual=max(sample.residual for levels in samples for sample in levels),
        extra={"surface_flux_mismatch": max(sample.flux_mismatch for sample in finest)},
    )


def _judge(
    case: _Case, samples: Sequence[tuple[_Sample, ...]], values: FloatArray
) -> list[list[GridConvergence]]:
    sizes = [float(np.prod(cells)) ** (-1 / len(cells)) for cells in case.meshes]
    rows = []
    for x, levels, found in zip(case.fills, samples, values, strict=True):
        noise = case.rounding_bound(fill_ratio=float(x), samples=levels)
        row = zip(found.T, noise, strict=True)
        rows.append(
            [gci(values=v, sizes=sizes, formal_order=FORMAL_ORDER, round_off=float(n)) for v, n in row]
        )
    return rows


def _status(case: _Case, failed: Sequence[Status], *, solved: bool = True) -> Status:
    for x, status in zip(case.fills, failed, strict=True):
        if not status.ok:
            said = "; values there are without gravity" if case.turn.gravity and solved else ""
            return Status(code=status.code, text=f"at a fill ratio of {x:.4g}: {status.text}{said}")
    return Status()


@dataclass(frozen=True, kw_only=True)
class _Case:
    """What ring quantities are asked for."""

    disc: Disc
    liquid: RotatingLiquid
    """Without gravity, which `turn` holds."""
    fills: FloatArray
    """Fill ratios, shape (n,)."""
    meshes: tuple[tuple[int, ...], ...]
    """Cells, finest first."""
    turn: _Turn

    def rounding_bound(self, *, fill_ratio: float, samples: Sequence[_Sample]) -> FloatArray:
        """Bound of the rounding in every column of `_Sample.values` on the finest mesh.

        eps [c R2/depth + 0.2 max(nodes along the depth, depth over the nodes' distance along the arc)^2],
        plus the rounding of a found surface, times the natural size of the column.
        Returns: Bound in the unit of each column, shape (5,); zero for an empty chamber, which is exact.
        Source: coordinates of a film cancel (c = 20, in three dimensions 1000: a hexahedron's polynomials
            have large coefficients), and narrow cells make the matrix stiff; the factors are five to ten
            times what was seen against closed forms between 1 and 180 degrees and depths down to 10 nm.
        """
        if fill_ratio == 0:
            return np.zeros(_WIDTH)
        disc, cells = self.disc, self.meshes[0]
        a = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
        depth, arc = disc.outer_radius - a, 2 * a * float(half_angle(disc=disc, radius=a))
        stiffness = max(2 * cells[0], 2 * cells[1] * depth / arc) ** 2
        moved = max(sample.rounding for sample in samples)
        cancelled = _CANCELLED[len(cells)] * disc.outer_radius / depth
        relative = _EPSILON * (cancelled + 0.2 * stiffness) + moved
        return relative * _natural_size(case=self, fill_ratio=fill_ratio)

    def stated_widths(
        self, *, samples: Sequence[tuple[_Sample, ...]], widths: FloatArray, closed: BoolArray
    ) -> FloatArray:
        """Half-widths of grid convergence, corrected where it does not cover the whole.

        Args: `samples`: that the values come from, by fill ratio and mesh. `widths`: of grid convergence,
            shape (n, 5). `closed`: whether gravity leaves a closed ring, shape (n,).
        Returns: Half-widths, shape (n, 5): zero for an empty chamber but for where its first drop goes; wider
            by all that gravity could do where it breaks the ring; the natural size where a solve failed.
        """
        stated = widths.copy()
        for k, x in enumerate(self.fills):
            displaced = _displaced(self, float(x))
            if x == 0:
                first_drop = QUANTITIES.index("moment_per_volume")
                stated[k] = 0.0
                stated[k, first_drop] = displaced[first_drop]
            elif not all(sample.status.ok for sample in samples[k]):
                stated[k] = _natural_size(case=self, fill_ratio=float(x))
            elif not closed[k]:
                stated[k] += displaced
        return stated


def _natural_size(*, case: _Case, fill_ratio: float) -> FloatArray:
    """Size that every column of `_Sample.values` would have without symmetry, shape (5,)."""
    disc, density = case.disc, case.liquid.density
    a, outer = float(surface_radius(disc=disc, fill_ratio=fill_ratio)), disc.outer_radius
    volume = fill_ratio * chamber_volume(disc=disc)
    pressure = hydrostatic_pressure(
        density=density, angular_velocity=case.liquid.angular_velocity, inner=a, outer=outer
    )
    moment = density * volume * outer
    return _columns(disc, volume=volume, pressure=pressure, moment=moment, moment_per_volume=density * outer)


def _displaced(case: _Case, x: float) -> FloatArray:
    if case.turn.gravity == 0:
        return np.zeros(_WIDTH)
    pressure, moment, moment_per_volume = displaced_by_gravity(
        disc=case.disc, density=case.liquid.density, gravity=case.turn.gravity, fill_ratio=np.array([x])
    )[:, 0].tolist()
    return _columns(
        case.disc, volume=0.0, pressure=pressure, moment=moment, moment_per_volume=moment_per_volume
    )


def _columns(
    disc: Disc, *, volume: float, pressure: float, moment: float, moment_per_volume: float
) -> FloatArray:
    """These in their columns, and as force the pressure on the largest wall."""
    force = pressure * disc.central_angle * disc.outer_radius * (disc.axial_width + disc.outer_radius)
    return np.array([volume, pressure, moment, moment_per_volume, force])


def _turn_mean(
    *,
    disc: Disc,
    liquid: RotatingLiquid,
    fill_ratio: float,
    cells: tuple[int, ...],
    turn: _Turn,
    coarser: _Sample | None = None,
) -> _Sample:
    """Solve on one mesh at every angle of gravity over half a turn and take the mean over the whole turn.

    The other half of the turn is the mirror image of the first.
    Args: `liquid`: without gravity. `coarser`: sample on half the cells, whose surfaces are a good start.
    Source: trapezoidal rule over a period, exact up to harmonics of the order of the number of samples.
    """
    angles, weights = _angles(turn)
    solutions = []
    for k, angle in enumerate(angles):
        start = refined_surface(coarser.surfaces[k]) if coarser and coarser.surfaces else None
        frozen = replace(liquid, gravity=_gravity(turn, float(angle)))
        solution = solve_at_rest(disc=disc, liquid=frozen, fill_ratio=fill_ratio, cells=cells, start=start)
        if not solution.status.ok:
            return _failed(solution.status)
        solutions.append(solution)
    totals = (
        liquid_integrals(solution=s, density=liquid.density, axial_width=disc.axial_width) for s in solutions
    )
    rows = np.array([total.mirrored_alike for total in totals])
    ripple = 2 * (weights * np.cos(angles)) @ rows[:, 1:3] if len(angles) > 1 else np.zeros(2)
    return _Sample(
        values=weights @ rows,
        ripple=np.abs(ripple),
        surfaces=tuple(s.chamber.surface_radius for s in solutions) if turn.gravity else (),
        status=Status(),
        unknowns=solutions[0].statistics.unknowns,
        residual=max(s.statistics.relative_residual for s in solutions),
        flux_mismatch=max(s.statistics.extra.get("surface_flux_mismatch", 0.0) for s in solutions),
        rounding=max(s.statistics.extra.get("surface_rounding", 0.0) for s in solutions),
    )


def _empty_sample(*, moment_per_volume: float) -> _Sample:
    """A chamber without liquid: all zero but the moment that the first drop would bring, kg/m^2."""
    values = np.zeros(_WIDTH)
    values[QUANTITIES.index("moment_per_volume")] = moment_per_volume
    return replace(_failed(Status()), values=values)


def _angles(turn: _Turn) -> tuple[FloatArray, FloatArray]:
    if turn.gravity == 0 or turn.shaft == "vertical":
        return np.zeros(1), np.ones(1)
    half = turn.samples // 2
    weights = np.full(half + 1, 2.0 / turn.samples)
    weights[[0, -1]] /= 2
    return np.linspace(0, np.pi, half + 1), weights


def _gravity(turn: _Turn, angle: float) -> tuple[float, ...]:
    if turn.gravity == 0:
        return ()
    if turn.shaft == "vertical":
        return (0.0, 0.0, -turn.gravity)
    return (turn.gravity * np.cos(angle), turn.gravity * np.sin(angle))


def _failed(status: Status) -> _Sample:
    return _Sample(values=np.zeros(_WIDTH), ripple=np.zeros(2), status=status)
