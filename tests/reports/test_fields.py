"""Fields of the report against closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from skfem import Mesh

from ringbalance.reports.pictures.fields import (
    _ChamberField,
    chamber_field,
)
from ringbalance.scene import Scene


@pytest.fixture(scope="module")
def field(paper_scene: Scene) -> _ChamberField:
    """The paper's disc, its chamber half full."""
    return chamber_field(paper_scene, fill_ratio=0.5)


def test_the_profile_is_that_of_liquid_at_rest(paper_scene: Scene, field: _ChamberField) -> None:
    profile = field.pressure_profile(scene=paper_scene)
    radius, pressure = np.array(profile["radius_m"]), np.array(profile["pressure_Pa"])
    factor = paper_scene.liquid.density * paper_scene.rotor.speed**2 / 2
    assert radius[0] == pytest.approx(field.surface_radius, rel=1e-12)
    assert radius[-1] == pytest.approx(paper_scene.disc.outer_radius, rel=1e-12)
    assert pressure == pytest.approx(factor * (radius**2 - radius[0] ** 2), rel=1e-6, abs=1e-3)


def test_the_papers_profile_ends_at_equation_12(paper_scene: Scene, field: _ChamberField) -> None:
    profile, disc = field.pressure_profile(scene=paper_scene), paper_scene.disc
    # V' = 33.84 ml, half of the chamber's 67.69 ml; Eq. 12 by hand.
    volume = 0.5 * 67.68766e-6
    wall = paper_scene.liquid.density * paper_scene.rotor.speed**2 * volume / (disc.axial_width * math.pi / 2)
    assert profile["paper_pressure_Pa"][-1] == pytest.approx(wall, rel=1e-6)
    assert profile["paper_pressure_Pa"][0] == 0
    assert profile["paper_radius_m"][0] > profile["radius_m"][0]


def test_the_file_holds_the_field(tmp_path: Path, paper_scene: Scene, field: _ChamberField) -> None:
    data: list[Any] = ["point_data"]
    stored = Mesh.load(field.write(path=tmp_path / "field.vtu"), out=data)
    factor = paper_scene.liquid.density * paper_scene.rotor.speed**2 / 2
    radius = np.hypot(*stored.doflocs[:2])
    assert data[0]["pressure_Pa"] == pytest.approx(
        factor * (radius**2 - field.surface_radius**2), rel=1e-6, abs=1.0
    )
    assert data[0]["depth_m"].max() == pytest.approx(
        paper_scene.disc.outer_radius - field.surface_radius, rel=1e-9
    )
    assert {"free_surface", "outer_wall", "end_front"} <= set(stored.boundaries)


def test_the_mesh_is_reported(field: _ChamberField) -> None:
    record = field.record
    assert record["unknowns"] == math.prod(2 * count + 1 for count in record["cells"])
    assert 0.5 < record["minimum_scaled_jacobian"] <= 1
    assert record["status"] == "solved"
