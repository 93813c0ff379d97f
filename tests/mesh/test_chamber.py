"""Meshes of the liquid: where nodes lie, what boundaries are called, how good cells are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.mesh.chamber import ChamberMesh, chamber_mesh, default_cells
from ringbalance.scene.models import Disc

FLAT = {"free_surface", "outer_wall", "plate_left", "plate_right"}


def nodes_on(chamber: ChamberMesh, boundary: str) -> np.ndarray:
    """Places of the nodes on a boundary as scikit-fem counts them from its facets, m."""
    mesh = chamber.mesh
    dofs = mesh.dofs.get_facet_dofs(mesh.boundaries[boundary]).all()
    return np.asarray(chamber.length_scale * mesh.doflocs[:, dofs])


@pytest.mark.parametrize("cells", [(3, 8), (3, 8, 2)])
def test_boundaries_lie_where_their_names_say(disc: Disc, cells: tuple[int, ...]) -> None:
    a = 35e-3
    chamber = chamber_mesh(disc=disc, surface_radius=a, cells=cells)
    ends = {"end_front": 31e-3, "end_back": -31e-3} if len(cells) == 3 else {}
    assert set(chamber.mesh.boundaries) == FLAT | set(ends)
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
        mesh = chamber_mesh(disc=disc, surface_radius=30e-3, cells=cells).mesh
        named = np.concatenate(list(mesh.boundaries.values()))
        assert np.array_equal(np.sort(named), np.sort(mesh.boundary_facets()))


def test_surface_radii_are_kept_as_given(disc: Disc) -> None:
    radii = np.linspace(30e-3, 36e-3, 17)
    chamber = chamber_mesh(disc=disc, surface_radius=radii, cells=(2, 8))
    np.testing.assert_array_equal(chamber.surface_radius, radii)
    on_mesh = np.hypot(*chamber.places[:, chamber.grid[0]])
    np.testing.assert_allclose(on_mesh, radii, rtol=1e-14)


@pytest.mark.parametrize("depth", [24e-3, 1e-3, 1e-6])
@pytest.mark.parametrize("cells", [(8, 24), (8, 24, 4)])
def test_cells_stay_square_down_to_a_micrometre(disc: Disc, depth: float, cells: tuple[int, ...]) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=disc.outer_radius - depth, cells=cells)
    assert chamber.quality()[0] > 0.95
    assert chamber.mesh.nelements == np.prod(cells)
    assert chamber.mesh.doflocs.shape[1] == np.prod([2 * n + 1 for n in cells])


def test_a_folded_cell_is_seen(disc: Disc) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(2, 4))
    chamber.mesh.doflocs[:, chamber.grid[0, 4]] = chamber.mesh.doflocs[:, chamber.grid[4, 4]] * 1.1
    assert chamber.quality()[0] < 0


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
        (np.linspace(40e-3, 60e-3, 9), (2, 4)),
    ],
)
def test_impossible_meshes_are_refused(disc: Disc, surface: Any, cells: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"cells|surface_radius"):
        chamber_mesh(disc=disc, surface_radius=surface, cells=cells)


def test_default_cells_follow_the_angle(disc: Disc) -> None:
    assert default_cells(disc=disc, dimension=3) == (8, 24, 4)
    assert default_cells(disc=replace(disc, central_angle=np.pi)) == (8, 48)
    assert default_cells(disc=replace(disc, central_angle=0.1)) == (8, 8)


def test_meshes_of_one_topology_do_not_share_places(disc: Disc) -> None:
    first = chamber_mesh(disc=disc, surface_radius=30e-3, cells=(2, 4))
    before = first.mesh.doflocs.copy()
    chamber_mesh(disc=disc, surface_radius=40e-3, cells=(2, 4))
    np.testing.assert_array_equal(first.mesh.doflocs, before)
