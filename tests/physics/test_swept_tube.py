"""The swept tube: its path, its volume, its boundaries and its slabs."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import Basis, ElementHex2, FacetBasis

from ringbalance.verification.navier_stokes.tube import SectionMesh
from ringbalance.verification.reference.bent_tube import Segment, _SweptTube, swept_tube

BEND = Segment(length=np.pi, turn=-np.pi / 2, cells=4)
PATH = (Segment(length=1.5, cells=2, ratio=0.5), BEND, Segment(length=2.0, cells=2))


def _tube() -> _SweptTube:
    return swept_tube(section=SectionMesh(around=2, across=2, wall_ratio=3.0).mesh(), segments=PATH)


def test_a_path_of_lines_and_a_quarter_circle_ends_where_it_must() -> None:
    tube = _tube()
    # Twice the cells of what lies before: start, both ends and the middle of the bend, and the path's end.
    place, direction = (each[:, [0, 4, 8, 12, 16]] for each in (tube.path, tube.direction))
    # To the right about (1.5, -2), radius 2.
    assert np.allclose(place[:, 1], [1.5, 0.0])
    assert np.allclose(place[:, 2], [1.5 + np.sqrt(2), -2 + np.sqrt(2)])
    assert np.allclose(place[:, 3], [3.5, -2.0])
    assert np.allclose(direction[:, 0], [1.0, 0.0])
    assert np.allclose(direction[:, 3], [0.0, -1.0])
    assert np.allclose(place[:, 4], [3.5, -4.0])


def test_stations_are_graded_and_have_their_mid_nodes() -> None:
    at = _tube().arc_length
    assert at.size == 2 * 8 + 1
    assert at[-1] == pytest.approx(3.5 + np.pi)
    assert np.allclose(at[1::2], (at[:-1:2] + at[2::2]) / 2)
    assert (at[4] - at[2]) / (at[2] - at[0]) == pytest.approx(0.5)


def test_volume_and_areas_are_those_of_a_swept_half_disc() -> None:
    tube = _tube()
    # Pappus: the half section's centroid stands straight above the path, so its distance plays no part.
    volume = Basis(tube.mesh, ElementHex2(), intorder=6).dx.sum()
    assert volume == pytest.approx(np.pi / 8 * (3.5 + np.pi), rel=2e-4)
    areas = {
        name: FacetBasis(tube.mesh, ElementHex2(), facets=tube.mesh.boundaries[name], intorder=6).dx.sum()
        for name in ("inlet", "outlet", "wall", "symmetry")
    }
    assert areas["inlet"] == pytest.approx(np.pi / 8, rel=2e-4)
    assert areas["outlet"] == pytest.approx(np.pi / 8, rel=2e-4)
    assert areas["wall"] == pytest.approx(np.pi / 2 * (3.5 + np.pi), rel=2e-4)
    assert areas["symmetry"] == pytest.approx(3.5 + np.pi, rel=2e-4)
    named = np.concatenate([tube.mesh.boundaries[name] for name in areas])
    assert np.array_equal(np.sort(named), np.sort(tube.mesh.boundary_facets()))


def test_nodes_stand_at_their_stations_on_their_section_nodes() -> None:
    tube = _tube()
    section = SectionMesh(around=2, across=2, wall_ratio=3.0).mesh()
    offset = tube.mesh.doflocs[:2] - tube.path[:, tube.half_station]
    tangent = tube.direction[:, tube.half_station]
    assert np.abs((offset * tangent).sum(axis=0)).max() < 1e-12
    left = offset[1] * tangent[0] - offset[0] * tangent[1]
    assert np.allclose(left, section.doflocs[0, tube.section_node])
    assert np.allclose(tube.mesh.doflocs[2], section.doflocs[1, tube.section_node])
