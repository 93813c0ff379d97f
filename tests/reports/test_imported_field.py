"""The pressure that a report shows of an imported chamber, against the exact one between its walls."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista
from block_discs import imported

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.reports.pictures.fields import _ChamberField, chamber_field
from ringbalance.scene.models import Scene

_FILL = 0.4


@pytest.fixture(scope="module")
def scene(paper_scene: Scene) -> Scene:
    return replace(paper_scene, disc=imported(paper_scene.disc))


@pytest.fixture(scope="module")
def field(scene: Scene) -> _ChamberField:
    return chamber_field(scene, fill_ratio=_FILL)


def test_its_profile_is_the_exact_one_from_the_surface_to_the_wall(
    scene: Scene, field: _ChamberField
) -> None:
    shown = field.pressure_profile(scene=scene)
    radius, scale = np.array(shown["radius_m"]), scene.liquid.density * scene.rotor.speed**2 / 2
    assert radius[[0, -1]] == pytest.approx([field.surface_radius, scene.disc.outer_radius], rel=1e-5)
    # Nodes lie in each of four layers of cells, 6 mm thick, and in their middles.
    assert np.diff(radius).min() >= -1e-9
    assert 0 < np.diff(np.unique(radius.round(9))).max() < 6e-3
    exact = scale * (radius**2 - field.surface_radius**2)
    # A pixel of a figure that is a thousand of them high.
    assert shown["pressure_Pa"] == pytest.approx(exact, abs=1e-3 * exact[-1])


def test_its_file_holds_the_liquid(scene: Scene, field: _ChamberField, tmp_path: Path) -> None:
    volume = _FILL * chamber_volume(disc=scene.disc)
    grid = pyvista.read(field.write(path=tmp_path / "field.vtu"))
    # VTK and drawings take straight edges for curved ones: 16 cells along 84 degrees, 1 % of the depth.
    assert grid.volume == pytest.approx(volume, rel=1e-2)
    assert np.max(grid.point_data["depth_m"]) == pytest.approx(
        scene.disc.outer_radius - field.surface_radius, rel=1e-5
    )
