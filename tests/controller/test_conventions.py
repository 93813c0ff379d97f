"""A run in the terms of balancing shops."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ringbalance.controller.document import _lasting_speed, conventions
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.scene import Scene


def test_unbalances_and_vibrations_follow_from_the_amplitudes(paper_scene: Scene) -> None:
    run = simulate(paper_scene, paper_model(paper_scene))
    values = {each.key: each.value or 0.0 for each in conventions(run)}
    before, after = float(run.amplitude[0]), float(run.amplitude[-1])
    assert values["unbalance_reduction_ratio"] == pytest.approx(1 - after / before)
    assert values["residual_unbalance"] * paper_scene.rotor.influence_coefficient == pytest.approx(after)
    # 10 um at 10 000 rpm.
    assert values["initial_velocity"] == pytest.approx(7.405e-3, rel=1e-3)
    assert values["gas_per_correction"] < run.gas.normal_volume


def test_a_correction_lasts_down_to_the_speed_at_which_the_column_parts(paper_scene: Scene) -> None:
    speed = _lasting_speed(paper_scene, 0.4)
    assert speed is not None
    for factor, holds in ((1.001, True), (0.999, False)):
        slower = replace(paper_scene, rotor=replace(paper_scene.rotor, speed=factor * speed))
        assert Holding.of(slower, fill_ratio=0.4).holds is holds
    fixed = replace(paper_scene, tube=replace(paper_scene.tube, hump_radius=None))
    assert _lasting_speed(fixed, 0.4) is None
