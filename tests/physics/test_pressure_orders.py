"""Orders of convergence with a made-up pressure, judged by rate and finest error.

    p = P [ s^2/2 + exp(x/L) sin(2 y/L + 0.3) cos(1.5 z/L + 0.2) ],   s^2 = (x^2 + y^2)/L^2

No polynomial represents it, the source varies from place to place, every wall has its own flux, and the
surface carries a pressure of its own: each term takes part.  In two dimensions the cosine is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from ringbalance.mesh.chamber import Geometry, SurfaceFunction, chamber_mesh
from ringbalance.physics.pressure.assembly import facet_points, volume_points
from ringbalance.physics.pressure.solve import PressureProblem, PressureSolution, solve_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene

_RATES = (1.0, 2.0, 1.5)
_SHIFTS = (0.3, 0.2)


@dataclass(frozen=True, kw_only=True)
class ManufacturedPressure:
    """The made-up pressure, its gradient and its Laplacian."""

    amplitude: float
    """P, Pa."""
    length: float
    """L, m."""
    dimension: int
    """2 or 3."""

    def _factors(self, places: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Each factor of the product and its derivative along its own axis, in units of L."""
        scaled = np.asarray(places, dtype=np.float64) / self.length
        growth = np.exp(_RATES[0] * scaled[0])
        wave = _RATES[1] * scaled[1] + _SHIFTS[0]
        factors = [(growth, _RATES[0] * growth), (np.sin(wave), _RATES[1] * np.cos(wave))]
        if self.dimension == 3:
            along = _RATES[2] * scaled[2] + _SHIFTS[1]
            factors.append((np.cos(along), -_RATES[2] * np.sin(along)))
        return factors

    def value(self, places: FloatArray) -> FloatArray:
        """Pressure."""
        product = np.prod(np.stack([factor for factor, _ in self._factors(places)]), axis=0)
        square = (places[0] ** 2 + places[1] ** 2) / self.length**2
        return np.asarray(self.amplitude * (square / 2 + product))

    def gradient(self, places: FloatArray) -> FloatArray:
        """Gradient of the pressure."""
        factors = self._factors(places)
        parts = []
        for axis in range(self.dimension):
            part = np.ones(places.shape[1:])
            for other, (factor, slope) in enumerate(factors):
                part = part * (slope if other == axis else factor)
            parts.append(part + (places[axis] / self.length if axis < 2 else 0.0))
        return np.asarray(self.amplitude / self.length * np.stack(parts))

    def laplacian(self, places: FloatArray) -> FloatArray:
        """Laplacian of the pressure, the source of its problem."""
        product = np.prod(np.stack([factor for factor, _ in self._factors(places)]), axis=0)
        rate = _RATES[0] ** 2 - _RATES[1] ** 2 - (_RATES[2] ** 2 if self.dimension == 3 else 0.0)
        return np.asarray(self.amplitude / self.length**2 * (2.0 + rate * product))

    def problem(
        self,
        *,
        arcs: tuple[float, float] | None = None,
        source_factor: float = 1.0,
        wall_factor: float = 1.0,
    ) -> PressureProblem:
        """The pressure problem that this pressure solves."""

        def wall_flux(places: FloatArray, normals: FloatArray) -> FloatArray:
            if arcs is not None:
                places, normals = _onto_wall(places, normals, arcs[1])
            return np.asarray(wall_factor * np.sum(self.gradient(places) * normals, axis=0))

        def surface_pressure(places: FloatArray) -> FloatArray:
            return self.value(places if arcs is None else _onto_arc(places, arcs[0]))

        return PressureProblem(
            source=lambda places: source_factor * self.laplacian(places),
            wall_flux=wall_flux,
            surface_pressure=surface_pressure,
        )

    def relative_error(self, solution: PressureSolution) -> float:
        """Error of a solution over its own mesh, |p_h - p| / |p| in the norm of L2."""
        volume = volume_points(solution.chamber)
        exact = self.value(solution.chamber.length_scale * volume.points)
        difference = volume.at_points(solution.pressure) - exact
        return float(np.sqrt(np.sum(volume.weights * difference**2) / np.sum(volume.weights * exact**2)))


def _onto_arc(places: FloatArray, radius: float) -> FloatArray:
    moved = np.array(places)
    moved[:2] *= radius / np.hypot(places[0], places[1])
    return moved


def _onto_wall(places: FloatArray, normals: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Outer wall alone: its points lie where the normal is nearly radial."""
    radial = np.zeros_like(normals)
    radial[:2] = places[:2] / np.hypot(places[0], places[1])
    on_arc = np.sum(radial * normals, axis=0) > 0.5
    return np.where(on_arc, _onto_arc(places, radius), places), np.where(on_arc, radial, normals)


SURFACE = 35e-3


@pytest.fixture(scope="module")
def disc(paper_scene: Scene) -> Disc:
    return paper_scene.disc


def levels(dimension: int) -> list[tuple[int, ...]]:
    """Four levels; in three dimensions the coarsest is two cells deep."""
    counts = (2, 4, 8, 16) if dimension == 2 else (1, 2, 4, 8)
    return [(n, 3 * n, n)[:dimension] for n in counts]


def errors(
    disc: Disc,
    dimension: int,
    geometry: Geometry,
    *,
    surface: float | SurfaceFunction = SURFACE,
    order: int = 2,
    source_factor: float = 1.0,
    wall_factor: float = 1.0,
) -> FloatArray:
    """Relative errors over the levels; data of the true arcs when the surface is one."""
    made_up = ManufacturedPressure(amplitude=1e6, length=disc.outer_radius, dimension=dimension)
    arcs = None if callable(surface) else (surface, disc.outer_radius)
    problem = made_up.problem(arcs=arcs, source_factor=source_factor, wall_factor=wall_factor)
    found = []
    for cells in levels(dimension)[: 4 if order == 2 else 3]:
        chamber = chamber_mesh(disc=disc, surface_radius=surface, cells=cells, order=order, geometry=geometry)
        solution = solve_pressure(chamber=chamber, problem=problem)
        assert solution.status.ok
        found.append(made_up.relative_error(solution))
    return np.array(found)


def rates(found: FloatArray) -> FloatArray:
    return np.asarray(np.log2(found[:-1] / found[1:]))


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_derivatives_are_those_of_the_pressure(dimension: int) -> None:
    made_up = ManufacturedPressure(amplitude=3.0, length=1.0, dimension=dimension)
    places = np.random.default_rng(1).uniform(0.3, 1.0, (dimension, 20))
    step, laplacian = 1e-4, np.zeros(20)
    for axis in range(dimension):
        shift = step * np.eye(dimension)[:, [axis]]
        ahead, behind = made_up.value(places + shift), made_up.value(places - shift)
        slope = made_up.gradient(places)[axis]
        np.testing.assert_allclose((ahead - behind) / (2 * step), slope, rtol=1e-6, atol=1e-6)
        laplacian += (ahead - 2 * made_up.value(places) + behind) / step**2
    np.testing.assert_allclose(laplacian, made_up.laplacian(places), rtol=1e-5, atol=1e-5)


def bound(disc: Disc, dimension: int, geometry: Geometry, order: int = 2) -> float:
    """What the finest error may be, known before solving.

    Curved geometry: twice the error of the nodal interpolant on the same mesh.  Straight: an arc's chord
    leaves it by R h^2/8 at most, times the largest gradient, over the mean pressure.
    """
    made_up = ManufacturedPressure(amplitude=1e6, length=disc.outer_radius, dimension=dimension)
    cells = levels(dimension)[-1 if order == 2 else -2]
    chamber = chamber_mesh(disc=disc, surface_radius=SURFACE, cells=cells, order=order, geometry=geometry)
    volume = volume_points(chamber)
    points = chamber.length_scale * volume.points
    exact, nodal = made_up.value(points), made_up.value(chamber.length_scale * chamber.nodes)
    if geometry == "curved":
        error = volume.at_points(nodal) - exact
        return 2 * float(np.sqrt(np.sum(volume.weights * error**2) / np.sum(volume.weights * exact**2)))
    chord = disc.outer_radius * (disc.central_angle / cells[1]) ** 2 / 8
    steepest = np.linalg.norm(made_up.gradient(points), axis=0).max()
    return float(chord * steepest / np.sqrt(np.average(exact**2, weights=volume.weights)))


# Third order in L2 is what quadratic elements give; straight sides draw an arc to second order.
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("geometry", "order"), [("curved", 3.0), ("straight", 2.0)])
def test_order_and_finest_error(disc: Disc, dimension: int, geometry: Geometry, order: float) -> None:
    found = errors(disc, dimension, geometry)
    # Three cells across a quarter are not yet asymptotic: in three dimensions the first pair has some room.
    assert rates(found)[-1] == pytest.approx(order, abs=0.15)
    assert rates(found)[-2] == pytest.approx(order, abs=0.3)
    assert rates(found)[0] > order - 1.1
    assert found[-1] < bound(disc, dimension, geometry)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("order", [1, 3, 4, 5])
def test_cells_of_any_order_converge_with_one_more(disc: Disc, dimension: int, order: int) -> None:
    found = errors(disc, dimension, "curved", order=order)
    assert rates(found)[-1] == pytest.approx(order + 1, abs=0.2)
    assert found[-1] < bound(disc, dimension, "curved", order)


@pytest.mark.parametrize("dimension", [2, 3])
def test_two_orders_more_take_the_error_down_by_fifty_on_one_mesh(disc: Disc, dimension: int) -> None:
    """A pressure without singularities: with half the cell's length H and the wave's rate c the error falls
    by (c H)^2/(4 (p + 2) (p + 3)), at p = 2 by 1/70 along the chamber, where c H = 1.5 x 0.7."""
    made_up = ManufacturedPressure(amplitude=1e6, length=disc.outer_radius, dimension=dimension)
    cells, found = (1, 3, 1)[:dimension], []
    for order in (2, 4, 6, 8, 10):
        chamber = chamber_mesh(disc=disc, surface_radius=SURFACE, cells=cells, order=order)
        solution = solve_pressure(chamber=chamber, problem=made_up.problem())
        found.append(made_up.relative_error(solution))
    assert np.all(np.array(found[1:]) < 2e-2 * np.array(found[:-1]))
    assert found[-1] < 1e-10


@pytest.mark.parametrize("dimension", [2, 3])
def test_an_uneven_surface_keeps_the_order(disc: Disc, dimension: int) -> None:
    def surface(angle: FloatArray, axial: FloatArray) -> FloatArray:
        return np.asarray(SURFACE + 2e-3 * np.cos(2 * angle + 0.5) + 0.04 * axial)

    found = errors(disc, dimension, "curved", surface=surface)
    assert rates(found)[-1] == pytest.approx(3.0, abs=0.2)
    assert found[-1] < 1.5 * bound(disc, dimension, "curved")


@pytest.mark.parametrize(("source", "wall"), [(1.01, 1.0), (1.0, 1.01)])
@pytest.mark.parametrize("dimension", [2, 3])
def test_a_fault_of_a_hundredth_stops_convergence(
    disc: Disc, dimension: int, source: float, wall: float
) -> None:
    found = errors(disc, dimension, "curved", source_factor=source, wall_factor=wall)
    assert rates(found)[-1] < 1.0
    assert found[-1] > bound(disc, dimension, "curved")


@pytest.mark.parametrize("wall", ["outer_wall", "plate_left", "plate_right", "end_front", "end_back"])
def test_every_wall_has_its_say(disc: Disc, wall: str) -> None:
    """Leaving out the flux of any one wall is noticed."""
    made_up = ManufacturedPressure(amplitude=1e6, length=disc.outer_radius, dimension=3)
    chamber = chamber_mesh(disc=disc, surface_radius=SURFACE, cells=(4, 12, 4))
    there = facet_points(chamber, wall).points * chamber.length_scale
    whole = made_up.problem()

    def without(places: FloatArray, normals: FloatArray) -> FloatArray:
        same = places.shape == there.shape and bool(np.all(places == there))
        return whole.wall_flux(places, normals) * (0.0 if same else 1.0)

    faulty = PressureProblem(source=whole.source, wall_flux=without, surface_pressure=whole.surface_pressure)
    sound = made_up.relative_error(solve_pressure(chamber=chamber, problem=whole))
    missing = made_up.relative_error(solve_pressure(chamber=chamber, problem=faulty))
    assert missing > 10 * sound
