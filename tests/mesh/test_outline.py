"""Outlines in planes through the built-in chamber as a record, whose areas are known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ringbalance.mesh.geometry import liquid_area
from ringbalance.mesh.section import outlines
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.models import Disc
from ringbalance.verification.reference.chambers import disc_chamber


def area(loop: FloatArray) -> float:
    x, y = loop.T
    return abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))) / 2


def test_sections_have_the_area_of_the_chamber(disc: Disc) -> None:
    record = disc_chamber(disc, (2, 16, 2))
    (across,), (along,) = outlines(record, axis=2), outlines(record, axis=1)
    exact = float(liquid_area(disc=disc, surface_radius=disc.inner_radius))
    # Chords between 33 nodes of a right angle take (90 deg/32)^2/6 off the outer circle's sector.
    chords = (np.pi / 2 / 32) ** 2 / 6 * disc.central_angle / 2 * disc.outer_radius**2
    assert abs(area(across) - exact) < chords
    assert area(along) == pytest.approx((disc.outer_radius - disc.inner_radius) * disc.axial_width)


@pytest.mark.parametrize(("kind", "nodes"), [("hexahedron", 8), ("hexahedron20", 20)])
def test_cells_with_fewer_nodes_give_the_chords_that_they_have(
    disc: Disc, kind: CellKind, nodes: int
) -> None:
    """Away from the nodes: straight cells have the columns of their corners, others some of those between."""
    record = disc_chamber(disc, (2, 16, 1))
    fewer = replace(record, kind=kind, cells=record.cells[:, :nodes], boundaries={})
    (across,) = outlines(fewer, axis=2, offset=0.25 * disc.axial_width)
    coarser = disc_chamber(disc, (2, 8, 1))
    (chords,) = outlines(coarser, axis=2, offset=0.25 * disc.axial_width)
    if kind == "hexahedron":
        assert area(across) == pytest.approx(area(chords), rel=1e-6)
    else:
        assert area(chords) < area(across) < float(liquid_area(disc=disc, surface_radius=disc.inner_radius))


def test_a_plane_may_cut_a_chamber_twice(disc: Disc) -> None:
    """Across x below the outer wall's ends: both flanks of a half circle, and nothing beyond its rim."""
    half = replace(disc, central_angle=np.pi, chambers=2)
    record = disc_chamber(half, (2, 16, 2))
    assert len(outlines(record, axis=0, offset=0.5 * disc.inner_radius)) == 2
    assert outlines(record, axis=0, offset=1.01 * disc.outer_radius) == ()
