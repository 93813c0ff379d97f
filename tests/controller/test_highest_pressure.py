"""From where on gas that flows faster makes every correction too large for the limit."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from ringbalance.controller.tuning.highest_pressure import highest_pressure
from ringbalance.reduced_model.gas_line import largest_correction, line_answers
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene import Scene
from ringbalance.scene.uncertain import with_value
from ringbalance.verification.loops import calibration_of


def smallest(scene: Scene, model: BalancerModel) -> float:
    return max(answer.smallest_correction or 0.0 for answer in line_answers(scene, model))


@pytest.fixture(scope="module")
def fast(paper_scene: Scene) -> Scene:
    """The paper's disc with a fast valve, and a limit a tenth above what is sure to be reached."""
    scene = replace(paper_scene, gas=replace(paper_scene.gas, conductance=1e-8, valve_lag=5e-3))
    limit = 1.1 * smallest(scene, calibration_of(scene).model) / largest_correction(1.0, chambers=4)
    return replace(scene, controller=replace(scene.controller, limit=limit))


def test_there_the_smallest_correction_is_the_largest_that_is_sure(fast: Scene) -> None:
    model = calibration_of(fast).model
    highest = highest_pressure(fast, model)
    assert highest is not None
    assert fast.gas.pressure < highest < 2 * fast.gas.pressure
    there = with_value(scene=fast, quantity="pressure", value=highest)
    # It rises by less than its own share of the pressure, which is known within 1 %.
    largest = largest_correction(fast.controller.limit, chambers=fast.disc.chambers)
    assert smallest(there, model) == pytest.approx(largest, rel=0.01)


def test_of_a_range_of_gas_lines_the_worse_end_counts(paper_scene: Scene) -> None:
    """The better end would reach a limit between both."""
    model = calibration_of(paper_scene).model
    ends = [answer.smallest_correction or 0.0 for answer in line_answers(paper_scene, model)]
    assert max(ends) > 1.1 * min(ends) > 0
    scene = replace(
        paper_scene, controller=replace(paper_scene.controller, limit=1.1 * min(ends) / math.sqrt(2))
    )
    assert highest_pressure(scene, model) is None


@pytest.mark.parametrize("factor", [0.5, 10.0])
def test_none_below_the_smallest_correction_or_far_above_it(fast: Scene, factor: float) -> None:
    controller = replace(fast.controller, limit=factor * fast.controller.limit)
    scene = replace(fast, controller=controller)
    assert highest_pressure(scene, calibration_of(scene).model) is None
