"""VTU files: boundary names, places and fields survive, and VTK sees right-handed cells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
from skfem import Mesh

from ringbalance.mesh.chamber import chamber_mesh
from ringbalance.mesh.geometry import liquid_area
from ringbalance.reports.pictures.fields import _write_vtu
from ringbalance.scene.models import Disc


@pytest.mark.parametrize("cells", [(3, 6), (3, 6, 2)])
def test_round_trip(
    disc: Disc, tmp_path: Path, cells: tuple[int, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    chamber = chamber_mesh(disc=disc, surface_radius=35e-3, cells=cells)
    mesh = chamber.mesh
    field = np.arange(chamber.grid.size) * 0.1
    path = _write_vtu(tmp_path / "a" / "ring.vtu", mesh=mesh, fields={"pressure": field})
    data: list[Any] = ["point_data"]
    stored = Mesh.load(path, out=data)
    np.testing.assert_array_equal(stored.doflocs, mesh.doflocs)
    np.testing.assert_array_equal(stored.t, mesh.t)
    np.testing.assert_array_equal(data[0]["pressure"], field)
    assert set(stored.boundaries) == set(mesh.boundaries)
    for name, facets in mesh.boundaries.items():
        np.testing.assert_array_equal(np.sort(stored.boundaries[name]), np.sort(facets))
    assert capsys.readouterr() == ("", "")


def test_vtk_measures_the_liquid_and_not_its_mirror_image(disc: Disc, tmp_path: Path) -> None:
    area = float(liquid_area(disc=disc, surface_radius=35e-3))
    for cells, size in (((8, 24), area), ((8, 24, 2), area * disc.axial_width)):
        chamber = chamber_mesh(disc=disc, surface_radius=35e-3, cells=cells)
        path = _write_vtu(tmp_path / "ring.vtu", mesh=chamber.mesh.scaled(chamber.length_scale))
        grid = pyvista.read(path)
        measured = grid.area if len(cells) == 2 else grid.volume
        # VTK measures quadratic cells by their linear parts.
        assert measured == pytest.approx(size, rel=5e-3)
