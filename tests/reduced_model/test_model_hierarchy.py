"""Every term that has a model is modelled, and what is missing says so."""

from __future__ import annotations

from typing import Any

import pytest

from ringbalance.reduced_model.terms import LEFT_OUT, NOT_MODELLED, ModelUsed, models_used, terms_of
from ringbalance.scene.models import Scene
from scenes import with_tables


def chosen(scene: Scene, **tables: Any) -> dict[str, ModelUsed]:
    return {used.term: used for used in models_used(with_tables(scene, **tables))}


@pytest.mark.parametrize("tolerance", [0.9, 0.01, 1e-6])
def test_the_tolerance_decides_on_no_model(table_1_scene: Scene, tolerance: float) -> None:
    used = chosen(table_1_scene, tolerance=tolerance)
    models = {term.name: term.model for term in terms_of(table_1_scene) if term.model}
    without = {"gas filling": LEFT_OUT, "valve lag": LEFT_OUT}
    assert {name: used[name].model for name in models} == models | without
    # What no model holds is compared with it.
    assert used["surface tension"].model == (NOT_MODELLED if tolerance < 1e-3 else LEFT_OUT)
    assert "tolerance" in used["surface tension"].why


@pytest.mark.parametrize(
    ("term", "tube"),
    [("bends of the tube", {"bends": ()}), ("roughness of the tube's wall", {"roughness": 0.0})],
)
def test_a_part_of_the_loss_that_a_tube_lacks_changes_nothing(
    table_1_scene: Scene, term: str, tube: dict[str, Any]
) -> None:
    used = chosen(table_1_scene, tube=tube)[term]
    assert used.estimated_contribution == 0.0
    assert used.model == LEFT_OUT


def test_valve_and_filling_are_unknown_until_the_scene_asks(table_1_scene: Scene) -> None:
    silent = chosen(table_1_scene)
    assert silent["valve lag"].estimated_contribution is None
    assert silent["gas filling"].estimated_contribution is None
    gas = {"valve_lag": 0.1, "conductance": 1e-8, "critical_ratio": 0.3, "dead_volume": 1e-5}
    used = chosen(table_1_scene, gas=gas)
    assert used["valve lag"].estimated_contribution == 1.0
    assert used["valve lag"].model == "pure delay, in injections"
    assert used["gas filling"].estimated_contribution is not None


def test_prescribed_k_and_blocked_tubes_have_no_rotation_fraction(table_1_scene: Scene) -> None:
    fixed = chosen(table_1_scene, tube={"drag_coefficient": 50.0})
    assert fixed["friction by rotation"].model == LEFT_OUT
    blocked = chosen(table_1_scene, gas={"pressure": 1e3})
    assert blocked["friction by rotation"].estimated_contribution is None
    assert blocked["loss of the tube"].model.startswith("k(u)")
