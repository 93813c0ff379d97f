"""The pressure solver: exact where it must be, equal to independent routes, honest when it fails."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import skfem
from scipy.sparse import csr_matrix, diags_array, random_array
from skfem.models.poisson import laplace, mass, unit_load

from ringbalance.mesh.chamber import ChamberMesh, chamber_mesh
from ringbalance.physics.pressure import solve
from ringbalance.physics.pressure.solve import (
    PressureProblem,
    RotatingLiquid,
    WeakProblem,
    _solve_linear,
    quadratic_basis,
    side,
    solve_pressure,
    stiffness,
)
from ringbalance.physics.results import StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc
from ringbalance.verification.finite_elements import field_error
from ringbalance.verification.reference.pressure import Manufactured

WATER = RotatingLiquid(density=1000.0, angular_velocity=1047.2)


def wavy(disc: Disc, cells: tuple[int, ...]) -> ChamberMesh:
    """A chamber whose surface is uneven along the angle and, in three dimensions, the axis."""
    lines = np.ix_(*(np.linspace(-1, 1, 2 * n + 1) for n in cells[1:]))
    surface = 34e-3 + 2e-3 * np.cos(2.1 * lines[0] + 0.5) + sum(1e-3 * z for z in lines[1:])
    return chamber_mesh(disc=disc, surface_radius=surface, cells=cells)


@pytest.mark.parametrize("cells", [(2, 5), (2, 5, 2)])
def test_linear_functions_of_place_are_exact(disc: Disc, cells: tuple[int, ...]) -> None:
    """In the field, and in the flux through the uneven surface."""
    slope = np.array([1e6, -7e5, 4e5])[: len(cells)]
    problem = PressureProblem(
        force=lambda x: np.broadcast_to(slope.reshape(-1, *[1] * (x.ndim - 1)), x.shape),
        surface_pressure=lambda x: np.tensordot(slope, x, axes=1) + 2e4,
    )
    chamber = wavy(disc, cells)
    solution = solve_pressure(chamber=chamber, problem=problem)
    exact = problem.surface_pressure(chamber.places)
    np.testing.assert_allclose(solution.pressure, exact, atol=1e-11 * np.abs(exact).max())
    surface = solution.side("free_surface")
    total = np.sum(surface.weights * solution.surface_flux(surface))
    assert total == pytest.approx(np.sum(slope[:, None, None] * surface.area), rel=1e-10)


@pytest.mark.parametrize("cells", [(2, 5), (2, 5, 2)])
def test_stiffness_and_sides_are_those_of_scikit_fems_forms(disc: Disc, cells: tuple[int, ...]) -> None:
    mesh = wavy(disc, cells).mesh
    basis = quadratic_basis(mesh)
    expected = laplace.assemble(basis)
    assert abs(stiffness(basis) - expected).max() < 1e-13 * abs(expected).max()
    for name in mesh.boundaries:
        facets, own = skfem.FacetBasis(mesh, mesh.elem(), facets=name, intorder=4), side(mesh, name)
        normal = skfem.LinearForm(lambda v, w: (w.n[0] - 2 * w.n[1]) * w.x[1] * v).assemble(facets)
        density = (own.normals[0] - 2 * own.normals[1]) * own.points[1]
        np.testing.assert_allclose(own.load(density, unknowns=basis.N), normal, atol=1e-11)
        whole = own.load(np.ones_like(own.weights), unknowns=basis.N)
        np.testing.assert_allclose(whole, unit_load.assemble(facets), atol=1e-12)
        assert abs(own.mass(unknowns=basis.N) - mass.assemble(facets)).max() < 1e-12


def test_normals_point_out_of_the_liquid(disc: Disc) -> None:
    mesh = chamber_mesh(disc=disc, surface_radius=35e-3, cells=(2, 6, 2)).mesh
    sides = [side(mesh, name) for name in mesh.boundaries]
    np.testing.assert_allclose(sum(each.area.sum(axis=(1, 2)) for each in sides), 0, atol=1e-13)
    volume = sum(float(np.sum(each.points * each.area)) for each in sides) / 3
    assert volume == pytest.approx(float(quadratic_basis(mesh).dx.sum()), rel=1e-12)


@pytest.mark.parametrize("depth", [1e-8, 1e-6, 1e-3, 24e-3])
@pytest.mark.parametrize("cells", [(8, 24), (8, 24, 4)])
def test_pressure_of_a_ring_of_any_depth(disc: Disc, depth: float, cells: tuple[int, ...]) -> None:
    """Within 1e-6 of rho omega^2 (r^2 - a^2)/2 at the outer wall, on the default mesh."""
    a = disc.outer_radius - depth
    chamber = chamber_mesh(disc=disc, surface_radius=a, cells=cells)
    solution = solve_pressure(chamber=chamber, problem=WATER.problem())
    wall = 0.5 * 1000.0 * 1047.2**2 * (disc.outer_radius - a) * (disc.outer_radius + a)
    np.testing.assert_allclose(solution.pressure[chamber.grid[-1]], wall, rtol=1e-6)
    np.testing.assert_allclose(-solution.surface_gradient, 1000.0 * 1047.2**2 * a, rtol=1e-5)
    assert solution.status.ok
    assert solution.statistics.relative_residual < 1e-11


@pytest.mark.parametrize("dimension", [2, 3])
def test_an_uneven_surface_keeps_the_order(disc: Disc, dimension: int) -> None:
    """Of the case of a manufactured pressure, which has a concentric one."""
    exact = Manufactured(length=disc.outer_radius, width=disc.axial_width)
    errors = [
        field_error(
            solve_pressure(chamber=wavy(disc, (n, 3 * n, n)[:dimension]), problem=exact.problem()),
            exact.pressure,
        )
        for n in (2, 4)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.25)
    assert errors[-1] < 1e-3


def test_gas_pressure_adds_to_every_point(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=35e-3, cells=(2, 6))
    plain = solve_pressure(chamber=chamber, problem=WATER.problem())
    driven = solve_pressure(chamber=chamber, problem=replace(WATER, gas_pressure=7e5).problem())
    np.testing.assert_allclose(driven.pressure - plain.pressure, 7e5, rtol=1e-9)


def system(disc: Disc) -> tuple[csr_matrix, FloatArray]:
    """Without the nodes of the surface."""
    chamber = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(4, 12, 2))
    weak = WeakProblem.of(quadratic_basis(chamber.mesh), WATER.body_force, unit=chamber.length_scale)
    free = chamber.grid[1:].ravel()
    return csr_matrix(weak.stiffness[free][:, free]), weak.load[free]


def test_multigrid_agrees_with_factorisation_bit_for_bit_from_run_to_run(disc: Disc) -> None:
    matrix, right = system(disc)
    direct = _solve_linear(matrix, right)
    runs = [_solve_linear(matrix, right, multigrid=True) for _ in range(2)]
    assert runs[0].status.ok
    assert runs[0].statistics.iterations > 0
    np.testing.assert_allclose(runs[0].values, direct.values, atol=1e-9 * direct.values.max())
    np.testing.assert_array_equal(runs[0].values, runs[1].values)


def test_a_factorisation_follows_where_multigrid_fails(disc: Disc, monkeypatch: pytest.MonkeyPatch) -> None:
    matrix, right = system(disc)
    monkeypatch.setattr(solve, "_MULTIGRID_STEPS", 2)
    found = _solve_linear(matrix, right, multigrid=True)
    assert found.status.ok
    assert found.statistics.iterations == 0


def test_linear_solver_reports_the_true_residual() -> None:
    rng = np.random.default_rng(3)
    sparse = random_array((300, 300), density=0.02, rng=rng)
    matrix = (sparse + sparse.T + diags_array(np.full(300, 10.0))).tocsr()
    right = rng.standard_normal(300)
    found = _solve_linear(matrix, right)
    residual = np.linalg.norm(matrix @ found.values - right) / np.linalg.norm(right)
    assert found.statistics.relative_residual == pytest.approx(residual, rel=1e-12)
    assert found.statistics.unknowns == 300
    assert _solve_linear(matrix, np.zeros(300)).status.ok


def test_a_singular_matrix_is_a_status_and_not_an_exception() -> None:
    found = _solve_linear(csr_matrix(diags_array([1.0, 1.0, 0.0])), np.ones(3))
    assert found.status.code is StatusCode.NOT_CONVERGED
    assert "residual" in found.status.text
    assert np.all(np.isfinite(found.values))
