"""The view that a browser turns: its data are the disc's, and it needs nothing else."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ringbalance.physics.pressure.hydrostatics import hydrostatic_pressure
from ringbalance.reports import cli
from ringbalance.reports.pictures.fields import shown_fill
from ringbalance.reports.pictures.view import view_page
from ringbalance.scene import Scene, SceneError, bundled_scene


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, flags=re.DOTALL)
    assert found is not None
    told: dict[str, Any] = json.loads(found[1])
    return told


@pytest.fixture(scope="module")
def page(paper_scene: Scene) -> str:
    return view_page(paper_scene)


def test_the_mesh_is_the_liquid_of_one_chamber(page: str, paper_scene: Scene) -> None:
    data, disc = data_of(page), paper_scene.disc
    points = np.array(data["points"])
    radius = np.hypot(*points[:, :2].T)
    assert data["chambers"] == disc.chambers
    assert radius.max() == pytest.approx(1e3 * disc.outer_radius, abs=0.02)
    assert np.ptp(points[:, 2]) == pytest.approx(1e3 * disc.axial_width, abs=0.02)
    used = {corner for quad in data["quads"] for corner in quad}
    assert used == set(range(len(points)))


def test_the_faces_close_the_surface(page: str) -> None:
    """Every edge of a closed surface belongs to two faces."""
    edges: dict[frozenset[int], int] = {}
    for quad in data_of(page)["quads"]:
        for pair in zip(quad, [*quad[1:], quad[0]], strict=True):
            edges[frozenset(pair)] = edges.get(frozenset(pair), 0) + 1
    assert set(edges.values()) == {2}


def test_shades_follow_the_hydrostatic_pressure(page: str, paper_scene: Scene) -> None:
    data = data_of(page)
    points = 1e-3 * np.array(data["points"])
    radius = np.hypot(*points[:, :2].T)
    surface = float(radius.min())

    def pressure(outer: Any) -> Any:
        return hydrostatic_pressure(
            density=paper_scene.liquid.density,
            angular_velocity=paper_scene.rotor.speed,
            inner=surface,
            outer=outer,
        )

    expected = np.mean(pressure(radius)[np.array(data["quads"])], axis=1) / pressure(radius.max())
    assert np.array(data["shade"]) == pytest.approx(expected, abs=0.01)


def test_nothing_is_fetched_and_no_name_leaves_its_place(paper_scene: Scene) -> None:
    page = view_page(replace(paper_scene, name="</script><img src=x>"))
    assert not re.search(r"https?:|src=|@import|url\(", page.replace("&lt;img src=x&gt;", ""))
    assert page.count("</script>") == 2


def test_a_scene_without_a_first_fill_is_shown_half_full(paper_scene: Scene) -> None:
    empty = replace(paper_scene, disc=replace(paper_scene.disc, initial_fill=0.0))
    assert shown_fill(empty) == paper_scene.disc.max_fill_ratio / 2


def test_eccentric_masses_have_no_liquid_to_turn(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="--interactive"):
        cli.report(bundled_scene("driven_masses_small"), out=tmp_path / "out", interactive=True)
    assert not (tmp_path / "out").exists()
