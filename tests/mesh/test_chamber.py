"""Meshes of the liquid: where nodes lie, what boundaries are called, how good cells are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.mesh.chamber import ChamberMesh, Geometry, chamber_mesh, default_cells
from ringbalance.mesh.export import scikit_fem_mesh
from ringbalance.mesh.geometry import half_angle
from ringbalance.scene.models import Disc

FLAT = {"free_surface", "outer_wall", "plate_left", "plate_right"}


def nodes_on(chamber: ChamberMesh, boundary: str) -> np.ndarray:
    """Places of the nodes on a boundary as scikit-fem counts them from its facets, m."""
    mesh, _ = scikit_fem_mesh(chamber)
    dofs = mesh.dofs.get_facet_dofs(mesh.boundaries[boundary]).all()
    return np.asarray(chamber.length_scale * mesh.doflocs[:, dofs])


@pytest.mark.parametrize("cells", [(3, 8), (3, 8, 2)])
def test_boundaries_lie_where_their_names_say(disc: Disc, cells: tuple[int, ...]) -> None:
    a = 35e-3
    chamber = chamber_mesh(disc=disc, surface_radius=a, cells=cells)
    ends = {"end_front": 31e-3, "end_back": -31e-3} if len(cells) == 3 else {}
    assert set(chamber.boundaries) == set(scikit_fem_mesh(chamber)[0].boundaries) == FLAT | set(ends)
    for name, radius in (("free_surface", a), ("outer_wall", disc.outer_radius)):
        np.testing.assert_allclose(np.hypot(*nodes_on(chamber, name)[:2]), radius, rtol=1e-14)
    for name, side in (("plate_left", 1), ("plate_right", -1)):
        x, y = nodes_on(chamber, name)[:2]
        half = disc.central_angle / 2
        np.testing.assert_allclose(np.sin(half) * x - side * np.cos(half) * y, 2.777e-3, rtol=1e-12)
        assert np.all(side * y > 0)
    for name, axial in ends.items():
        np.testing.assert_allclose(nodes_on(chamber, name)[2], axial, rtol=1e-14)


def test_every_boundary_facet_has_one_name(disc: Disc) -> None:
    for cells in ((2, 5), (2, 5, 3)):
        mesh, _ = scikit_fem_mesh(chamber_mesh(disc=disc, surface_radius=30e-3, cells=cells))
        named = np.concatenate(list(mesh.boundaries.values()))
        assert np.array_equal(np.sort(named), np.sort(mesh.boundary_facets()))


def test_nodes_on_a_plate_are_evenly_spaced(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=25e-3, cells=(4, 8))
    face = chamber.nodes[:, chamber.grid[:, -1]]
    steps = np.hypot(*np.diff(face, axis=1))
    np.testing.assert_allclose(steps, steps[0], rtol=1e-12)


def test_straight_cells_have_mid_nodes_half_way(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=25e-3, cells=(2, 4, 2), geometry="straight")
    places = chamber.nodes[:, chamber.grid]
    np.testing.assert_allclose(places[:, 1], (places[:, 0] + places[:, 2]) / 2, rtol=1e-13)
    np.testing.assert_allclose(places[:, :, 3], (places[:, :, 2] + places[:, :, 4]) / 2, rtol=1e-13)


def test_a_surface_given_as_a_function_is_met_at_every_node(disc: Disc) -> None:
    def surface(angle: np.ndarray, axial: np.ndarray) -> np.ndarray:
        return 33e-3 + 2e-3 * np.cos(angle - 0.4) + 0.05 * axial

    for cells in ((4, 10), (4, 10, 3)):
        chamber = chamber_mesh(disc=disc, surface_radius=surface, cells=cells)
        x, y, *z = nodes_on(chamber, "free_surface")
        expected = surface(np.arctan2(y, x), z[0] if z else np.zeros_like(x))
        np.testing.assert_allclose(np.hypot(x, y), expected, rtol=1e-13)
        corner = chamber.nodes[:, chamber.grid[0, -1]].reshape(len(cells), -1)[:2]
        edge = half_angle(disc=disc, radius=np.hypot(*corner) * chamber.length_scale)
        np.testing.assert_allclose(np.arctan2(corner[1], corner[0]), edge, rtol=1e-12)


def test_surface_radii_are_kept_as_given(disc: Disc) -> None:
    radii = np.linspace(30e-3, 36e-3, 17)
    chamber = chamber_mesh(disc=disc, surface_radius=radii, cells=(2, 8))
    np.testing.assert_array_equal(chamber.surface_radius, radii)
    on_mesh = np.hypot(*chamber.nodes[:, chamber.grid[0]]) * chamber.length_scale
    np.testing.assert_allclose(on_mesh, radii, rtol=1e-14)


@pytest.mark.parametrize("depth", [24e-3, 1e-3, 1e-6])
@pytest.mark.parametrize("cells", [(8, 24), (8, 24, 4)])
@pytest.mark.parametrize("geometry", ["curved", "straight"])
def test_cells_stay_square_down_to_a_micrometre(
    disc: Disc, depth: float, cells: tuple[int, ...], geometry: Geometry
) -> None:
    chamber = chamber_mesh(
        disc=disc, surface_radius=disc.outer_radius - depth, cells=cells, geometry=geometry
    )
    quality = chamber.quality()
    assert quality.minimum_scaled_jacobian > 0.95
    assert quality.cells == np.prod(cells)
    assert quality.nodes == np.prod([2 * n + 1 for n in cells])


def test_aspect_is_that_of_the_cells(disc: Disc) -> None:
    sector = replace(disc, plate_thickness=0.0)
    chamber = chamber_mesh(disc=sector, surface_radius=44e-3, cells=(1, 10))
    longest = disc.outer_radius * disc.central_angle / 10
    assert chamber.quality().maximum_aspect == pytest.approx(longest / 0.5e-3, rel=0.02)


def test_a_folded_cell_is_seen(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(2, 4))
    folded = replace(chamber, nodes=chamber.nodes.copy())
    folded.nodes[:, chamber.grid[0, 4]] = folded.nodes[:, chamber.grid[4, 4]] * 1.1
    assert folded.quality().minimum_scaled_jacobian < 0


@pytest.mark.parametrize(
    ("surface", "cells"),
    [
        (44.5e-3, (2, 4)),
        (50e-3, (2, 4)),
        (2e-3, (2, 4)),
        (np.nan, (2, 4)),
        (30e-3, (2,)),
        (30e-3, (2, 0)),
        (30e-3, (1, 1, 1, 1)),
        (lambda angle, axial: 60e-3 + 0 * (angle + axial), (2, 4)),
        (lambda angle, axial: -1e-3 + 0 * (angle + axial), (2, 4)),
    ],
)
def test_impossible_meshes_are_refused(disc: Disc, surface: Any, cells: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"cells|surface_radius"):
        chamber_mesh(disc=disc, surface_radius=surface, cells=cells)


@pytest.mark.parametrize("order", [0, 17])
def test_impossible_orders_are_refused(disc: Disc, order: int) -> None:
    with pytest.raises(ValueError, match="order"):
        chamber_mesh(disc=disc, surface_radius=30e-3, cells=(2, 4), order=order)


@pytest.mark.parametrize("order", [1, 3, 8, 16])
def test_nodes_of_any_order_lie_on_the_arcs_and_share_their_cells_corners(disc: Disc, order: int) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(2, 4, 3), order=order)
    quadratic = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(2, 4, 3))
    for end, radius in ((0, 30e-3), (-1, disc.outer_radius)):
        nodes = chamber.places[:2, chamber.grid[end]]
        np.testing.assert_allclose(np.hypot(*nodes), radius, rtol=1e-14)
    corners = chamber.nodes[:, chamber.grid[::order, ::order, ::order]]
    np.testing.assert_allclose(corners, quadratic.nodes[:, quadratic.grid[::2, ::2, ::2]], atol=1e-15)
    assert chamber.quality().minimum_scaled_jacobian > 0.95


def test_default_cells_follow_the_angle(disc: Disc) -> None:
    assert default_cells(disc=disc, dimension=3) == (8, 24, 4)
    assert default_cells(disc=replace(disc, central_angle=np.pi)) == (8, 48)
    assert default_cells(disc=replace(disc, central_angle=0.1)) == (8, 8)


def test_meshes_of_one_topology_do_not_share_places(disc: Disc) -> None:
    first = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(2, 4))
    before = first.nodes.copy()
    chamber_mesh(disc=disc, surface_radius=40e-3, cells=(2, 4))
    np.testing.assert_array_equal(first.nodes, before)
