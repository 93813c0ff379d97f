"""The pressure solver: exact where it must be, equal to independent routes, honest when it fails."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import skfem
from scipy.sparse import csr_matrix, diags_array, random_array
from skfem.helpers import dot, grad

from ringbalance.mesh.chamber import Geometry, chamber_mesh
from ringbalance.mesh.export import scikit_fem_mesh
from ringbalance.physics.pressure import assembly as pressure_assembly
from ringbalance.physics.pressure import linear as pressure_linear
from ringbalance.physics.pressure.assembly import Facets, Stiffness, facet_points, volume_points
from ringbalance.physics.pressure.linear import solve_linear
from ringbalance.physics.pressure.solve import PressureProblem, RotatingLiquid, solve_pressure
from ringbalance.physics.pressure.sparse import stiffness_matrix
from ringbalance.physics.results import StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.rings import mutated_pressure

WATER = RotatingLiquid(density=1000.0, angular_velocity=1047.2)


@pytest.fixture(scope="module")
def disc(paper_scene: Scene) -> Disc:
    return paper_scene.disc


def wavy(angle: FloatArray, axial: FloatArray) -> FloatArray:
    return np.asarray(34e-3 + 2e-3 * np.cos(3 * angle + 0.5) + 0.03 * axial)


def polynomial(dimension: int, degree: int) -> PressureProblem:
    """All monomials of one degree at once, scaled to a disc of 44.5 mm."""
    unit = 44.5e-3
    rows = [np.array([1.0, -0.7, 0.4])[:dimension], np.array([0.3, 0.9, -0.5])[:dimension]]

    def factors(x: FloatArray) -> list[FloatArray]:
        return [np.tensordot(row, x, axes=1) / unit + 0.2 for row in rows[:degree]]

    def value(x: FloatArray) -> FloatArray:
        return np.asarray(1e5 * np.prod(np.stack(factors(x)), axis=0))

    def gradient(x: FloatArray) -> FloatArray:
        parts = factors(x)
        others = [np.ones_like(parts[0])] if degree == 1 else [parts[1], parts[0]]
        terms = [np.multiply.outer(row, other) for row, other in zip(rows, others, strict=False)]
        return np.asarray(1e5 / unit * sum(terms))

    laplacian = 0.0 if degree == 1 else 2e5 / unit**2 * float(rows[0] @ rows[1])
    return PressureProblem(
        source=lambda x: np.full(x.shape[1:], laplacian),
        wall_flux=lambda x, n: np.asarray(np.sum(gradient(x) * n, axis=0)),
        surface_pressure=value,
    )


@pytest.mark.parametrize("cells", [(2, 5), (2, 5, 2)])
@pytest.mark.parametrize(("geometry", "degree"), [("curved", 1), ("straight", 2)])
def test_polynomials_of_the_space_are_exact(
    disc: Disc, cells: tuple[int, ...], geometry: Geometry, degree: int
) -> None:
    """Curved cells hold all linear functions of place, straight ones all quadratic ones."""
    problem = polynomial(len(cells), degree)
    chamber = chamber_mesh(disc=disc, surface_radius=wavy, cells=cells, geometry=geometry)
    solution = solve_pressure(chamber=chamber, problem=problem)
    exact = problem.surface_pressure(chamber.places)
    np.testing.assert_allclose(solution.pressure, exact, atol=1e-11 * np.abs(exact).max())


def test_the_flux_through_the_surface_is_exact_for_a_linear_pressure(disc: Disc) -> None:
    sector = replace(disc, plate_thickness=0.0)
    chamber = chamber_mesh(disc=sector, surface_radius=35e-3, cells=(3, 6), geometry="straight")
    solution = solve_pressure(chamber=chamber, problem=polynomial(2, 1))
    facets = facet_points(chamber, "free_surface")
    flux = polynomial(2, 1).wall_flux(facets.points * chamber.length_scale, facets.normals)
    nodal = np.zeros(solution.pressure.size)
    nodal[chamber.grid[0]] = solution.surface_gradient
    total = np.sum(facets.weights * flux)
    found = facets.load(np.ones_like(facets.weights), unknowns=nodal.size) @ nodal
    assert found == pytest.approx(total, rel=1e-11)


@pytest.mark.parametrize("cells", [(2, 5), (8, 24), (2, 5, 2), (4, 6, 2)])
def test_assembly_agrees_with_scikit_fems_forms(disc: Disc, cells: tuple[int, ...]) -> None:
    """scikit-fem numbers the nodes in another order."""
    chamber = chamber_mesh(disc=disc, surface_radius=wavy, cells=cells)
    mesh, numbers = scikit_fem_mesh(chamber)
    unknowns = chamber.grid.size
    basis = skfem.Basis(mesh, mesh.elem(), intorder=5)
    laplace = skfem.BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(basis)
    assert abs(stiffness_matrix(chamber)[numbers][:, numbers] - laplace).max() < 1e-12 * abs(laplace).max()
    volume = volume_points(chamber)
    expected = skfem.LinearForm(lambda v, w: np.exp(w.x[0]) * v).assemble(basis)
    found = volume.load(np.exp(volume.points[0]), unknowns=unknowns)
    np.testing.assert_allclose(found[numbers], expected, atol=1e-14)
    for name in chamber.boundaries:
        facets = facet_points(chamber, name)
        other = skfem.FacetBasis(mesh, mesh.elem(), facets=name, intorder=5)
        flux = skfem.LinearForm(lambda v, w: (w.n[0] - 2 * w.n[1]) * w.x[1] * v).assemble(other)
        density = (facets.normals[0] - 2 * facets.normals[1]) * facets.points[1]
        np.testing.assert_allclose(facets.load(density, unknowns=unknowns)[numbers], flux, atol=1e-11)
        squares = skfem.BilinearForm(lambda u, v, _: u * v).assemble(other)
        np.testing.assert_allclose(
            mass(facets, chamber.nodes[0])[numbers], squares @ mesh.doflocs[0], atol=1e-11
        )


@pytest.mark.parametrize("order", [2, 3, 5])
def test_cells_of_any_order_agree_with_scikit_fems_hierarchical_ones(disc: Disc, order: int) -> None:
    """On straight sides both span the same space, so the work of the load on the pressure is the same."""
    cells = (2, 5)
    chamber = chamber_mesh(disc=disc, surface_radius=wavy, cells=cells, order=order, geometry="straight")
    discrete = WATER.problem().discretise(chamber=chamber)
    solution = solve_pressure(chamber=chamber, problem=WATER.problem())
    corners, _ = scikit_fem_mesh(
        chamber_mesh(disc=disc, surface_radius=wavy, cells=cells, geometry="straight")
    )
    mesh = skfem.MeshQuad1.from_mesh(corners)
    points = 2 * order + 1
    basis = skfem.Basis(mesh, skfem.ElementQuadP(order), intorder=points)
    laplace = skfem.BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(basis)
    unit = disc.outer_radius**2 * 1000.0 * 1047.2**2
    load = skfem.LinearForm(lambda v, _: -2 * unit * v).assemble(basis)
    for name in ("outer_wall", "plate_left", "plate_right"):
        wall = skfem.FacetBasis(mesh, basis.elem, facets=corners.boundaries[name], intorder=points)
        load += skfem.LinearForm(lambda v, w: unit * dot(w.x, w.n) * v).assemble(wall)
    other = skfem.solve(*skfem.condense(laplace, load, D=basis.get_dofs(corners.boundaries["free_surface"])))
    assert discrete.load @ solution.pressure == pytest.approx(float(load @ other), rel=1e-11)


def mass(facets: Facets, nodal: FloatArray) -> FloatArray:
    """Integrals of u v over a side."""
    return facets.load(facets.at_points(nodal), unknowns=nodal.size)


@pytest.mark.parametrize(
    ("cells", "order"), [((2, 5), 1), ((2, 5), 3), ((1, 2), 9), ((2, 4, 3), 2), ((1, 2, 1), 4)]
)
def test_the_form_without_a_matrix_is_that_of_the_matrix(
    disc: Disc, cells: tuple[int, ...], order: int
) -> None:
    """Its scale of rounding is at least that of the matrix, whose entries are sums of what it adds up."""
    chamber = chamber_mesh(disc=disc, surface_radius=wavy, cells=cells, order=order)
    form, matrix = Stiffness.of(chamber), stiffness_matrix(chamber)
    nodal = np.random.default_rng(order).standard_normal(chamber.grid.size)
    expected = matrix @ nodal
    np.testing.assert_allclose(form.apply(nodal), expected, atol=1e-12 * np.abs(expected).max())
    scale = form.magnitude(nodal)
    assert np.all(scale >= (1 - 1e-12) * (abs(matrix) @ np.abs(nodal)))
    turned = replace(form, metric=tuple(-block for block in form.metric))
    np.testing.assert_array_equal(turned.magnitude(nodal), scale)


def test_many_blocks_of_cells_give_what_one_gives(disc: Disc, monkeypatch: pytest.MonkeyPatch) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=wavy, cells=(3, 7, 2), order=3)
    nodal = np.sin(40 * chamber.nodes[0] + chamber.nodes[2])
    whole, points = Stiffness.of(chamber), volume_points(chamber)
    expected = whole.apply(nodal)
    monkeypatch.setattr(pressure_assembly, "_BLOCK", 5 * 4**3)
    parts = Stiffness.of(chamber)
    assert len(parts.metric) > len(whole.metric) == 1
    np.testing.assert_allclose(parts.apply(nodal), expected, atol=1e-13)
    np.testing.assert_array_equal(volume_points(chamber).points, points.points)


def test_normals_point_out_of_the_liquid(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=35e-3, cells=(2, 6, 2))
    total = np.zeros(3)
    volume = 0.0
    for name in chamber.boundaries:
        facets = facet_points(chamber, name)
        total += np.sum(facets.weights * facets.normals, axis=(1, 2))
        volume += float(np.sum(facets.weights * np.sum(facets.points * facets.normals, axis=0))) / 3
    np.testing.assert_allclose(total, 0, atol=1e-13)
    assert volume == pytest.approx(float(volume_points(chamber).weights.sum()), rel=1e-12)


@pytest.mark.parametrize("depth", [1e-6, 1e-3, 24e-3])
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


def test_gas_pressure_adds_to_every_point(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=35e-3, cells=(2, 6))
    plain = solve_pressure(chamber=chamber, problem=WATER.problem())
    driven = solve_pressure(chamber=chamber, problem=replace(WATER, gas_pressure=7e5).problem())
    np.testing.assert_allclose(driven.pressure - plain.pressure, 7e5, rtol=1e-9)


def test_two_and_three_dimensions_agree_in_every_section(disc: Disc) -> None:
    flat = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(3, 9))
    deep = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(3, 9, 2))
    section = solve_pressure(chamber=flat, problem=WATER.problem()).pressure[flat.grid]
    whole = solve_pressure(chamber=deep, problem=WATER.problem()).pressure[deep.grid]
    for k in range(whole.shape[-1]):
        np.testing.assert_allclose(whole[..., k], section, atol=1e-10 * section.max())


@pytest.mark.parametrize("cells", [(2, 6), (8, 24), (32, 96), (2, 6, 2), (8, 24, 8)])
@pytest.mark.parametrize("order", [2, 7])
@pytest.mark.parametrize("depth", [1e-8, 1e-3, 20e-3])
def test_steps_do_not_grow_with_mesh_order_or_thinness(
    disc: Disc, cells: tuple[int, ...], order: int, depth: float
) -> None:
    """The metric of a ring spans a factor R2/a at most, here 1.8: (sqrt(1.8) - 1)/(sqrt(1.8) + 1) a step.

    That is 14 digits in 17 steps; plates turn the metric by up to a tenth and may cost as many again.
    """
    if order == 7 and np.prod(cells) > 200:
        cells = tuple(n // 4 for n in cells)
    chamber = chamber_mesh(disc=disc, surface_radius=disc.outer_radius - depth, cells=cells, order=order)
    solution = solve_pressure(chamber=chamber, problem=WATER.problem())
    assert solution.status.ok
    assert 0 < solution.statistics.iterations <= 34


def test_the_solve_agrees_with_a_factorised_matrix_and_repeats_bit_for_bit(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=wavy, cells=(3, 8, 2), order=3)
    first, again = (solve_pressure(chamber=chamber, problem=WATER.problem()) for _ in range(2))
    np.testing.assert_array_equal(first.pressure, again.pressure)
    assert first.statistics.relative_residual < 1e-12
    discrete, free = WATER.problem().discretise(chamber=chamber), chamber.grid[1:].ravel()
    direct = solve_linear(stiffness_matrix(chamber)[free][:, free], discrete.load[free])
    np.testing.assert_allclose(first.pressure[free], direct.values, atol=1e-11 * first.pressure.max())


def test_multigrid_agrees_with_factorisation_bit_for_bit_from_run_to_run(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(4, 12, 2))
    free = chamber.grid[1:].ravel()
    matrix, right = stiffness_matrix(chamber)[free][:, free], np.ones(free.size)
    direct = solve_linear(matrix, right)
    runs = [solve_linear(matrix, right, direct_limit=0) for _ in range(2)]
    assert runs[0].status.ok
    assert runs[0].statistics.iterations > 0
    np.testing.assert_allclose(runs[0].values, direct.values, atol=1e-9 * direct.values.max())
    np.testing.assert_array_equal(runs[0].values, runs[1].values)


def test_a_solve_that_does_not_converge_says_so(disc: Disc, monkeypatch: pytest.MonkeyPatch) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(4, 12, 2))
    free = chamber.grid[1:].ravel()
    matrix = stiffness_matrix(chamber)[free][:, free]
    monkeypatch.setattr(pressure_linear, "_MAX_ITERATIONS", 2)
    solution = solve_pressure(chamber=chamber, problem=WATER.problem())
    assert solution.status.code is StatusCode.NOT_CONVERGED
    assert "residual" in solution.status.text
    assert np.all(np.isfinite(solution.pressure))
    assert not solve_linear(matrix, np.ones(free.size), direct_limit=0).status.ok


def test_linear_solver_reports_the_true_residual() -> None:
    rng = np.random.default_rng(3)
    sparse = random_array((300, 300), density=0.02, rng=rng)
    matrix = (sparse + sparse.T + diags_array(np.full(300, 10.0))).tocsr()
    right = rng.standard_normal(300)
    found = solve_linear(matrix, right)
    residual = np.linalg.norm(matrix @ found.values - right) / np.linalg.norm(right)
    assert found.statistics.relative_residual == pytest.approx(residual, rel=1e-12)
    assert found.statistics.unknowns == 300
    assert solve_linear(matrix, np.zeros(300)).status.ok


def test_a_singular_matrix_is_a_status_and_not_an_exception() -> None:
    found = solve_linear(csr_matrix(diags_array([1.0, 1.0, 0.0])), np.ones(3))
    assert found.status.code is StatusCode.NOT_CONVERGED
    assert np.all(np.isfinite(found.values))


@pytest.mark.parametrize("factor", ["source", "wall"])
def test_a_deliberate_fault_changes_the_pressure(disc: Disc, factor: str) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(2, 6))
    sound = solve_pressure(chamber=chamber, problem=WATER.problem())
    with mutated_pressure(**{factor: 1.01}):
        faulty = solve_pressure(chamber=chamber, problem=WATER.problem())
    volume = volume_points(chamber)
    difference = volume.at_points(faulty.pressure - sound.pressure)
    assert np.abs(difference).max() > 1e-3 * sound.pressure.max()
