"""k by the library `fluids` alone: which methods count, and where nothing is judged."""

from __future__ import annotations

import dataclasses

import pytest
from fluids.fittings import bend_rounded, entrance_distance, entrance_sharp
from fluids.friction import friction_factor

from ringbalance.scene.models import Scene
from ringbalance.verification.cases.handbooks import by_fluids
from ringbalance.verification.runner import run_case


def test_parts_are_the_librarys_own_numbers(paper_scene: Scene) -> None:
    tube = paper_scene.tube
    parts = by_fluids(tube, 2e4)
    straight = tube.length - sum(bend.angle * bend.radius for bend in tube.bends)
    haaland = friction_factor(2e4, 1e-3, Method="Haaland") * straight / tube.bore
    assert parts["friction"]["Haaland"] == pytest.approx(haaland, rel=1e-12)
    ito = 2 * bend_rounded(1.5e-3, 90.0, rc=3e-3, Re=2e4, roughness=1.5e-6, method="Ito")
    assert parts["bends"]["Ito"] == pytest.approx(ito, rel=1e-12)
    assert parts["entrance"]["Miller"] == entrance_sharp("Miller")
    assert parts["exit"] == {"normal": 0.0}


def test_methods_beyond_their_range_do_not_count(paper_scene: Scene) -> None:
    parts = by_fluids(paper_scene.tube, 1.5e4)
    assert set(parts["bends"]) == {"Rennels", "Miller", "Swamee"}
    assert set(by_fluids(paper_scene.tube, 1000.0)["friction"]) == {"laminar"}
    remarks = dict(zip(*(_methods(paper_scene)[head] for head in ("method", "remark")), strict=True))
    assert remarks["Rao_Kumar_2007"] == "left out: 39 % from Colebrook’s equation"
    assert remarks["Crane standard"].startswith("left out: friction of steel pipes")


def _methods(scene: Scene) -> dict[str, list[float | str]]:
    evidence = run_case("k_by_fluids", scene=scene).evidence
    assert evidence is not None
    return {name: list(values) for name, values in evidence.tables[1].columns.items()}


def test_a_projecting_tube_is_asked_for_both_edges(paper_scene: Scene) -> None:
    tube = dataclasses.replace(paper_scene.tube, entrance="projecting")
    entrance = by_fluids(tube, 2e4)["entrance"]
    assert entrance["Crane, any edge"] == 0.78
    assert entrance["Harris, edge 0.05 d"] == entrance_distance(1.0, 0.05, method="Harris")
    assert len(entrance) == 9


def test_a_laminar_tube_is_not_judged(paper_scene: Scene) -> None:
    oil = dataclasses.replace(paper_scene.liquid, kinematic_viscosity=1e-5)
    result = run_case("k_by_fluids", scene=dataclasses.replace(paper_scene, liquid=oil))
    assert "stays below Re = 10,000" in result.status
    assert result.evidence is None
