"""The loop's gain by hand and by simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reports.pages.loop import _loop_gain
from ringbalance.scene.models import Scene
from scenes import with_tables


def gain_of(scene: Scene, model: BalancerModel) -> dict[str, Any]:
    gain = _loop_gain(scene, model)
    assert gain is not None
    return gain


def small(scene: Scene, **controller: Any) -> Scene:
    """An unbalance of 10 nm along chamber A, an exact sensor and the proportional part alone."""
    settings = replace(
        scene.controller,
        integral_time=None,
        derivative_time=0.0,
        minimum_gas_time=0.0,
        limit=1e-12,
        **controller,
    )
    rotor = replace(scene.rotor, initial_amplitude=1e-8, initial_phase=-scene.rotor.lag_angle)
    return replace(scene, rotor=rotor, controller=settings)


def test_the_gain_per_operation_by_hand(scene: Scene, model: BalancerModel) -> None:
    gain = gain_of(scene, model)
    u = math.sqrt(2 * 0.7e6 / (1000 * 51))
    area = math.pi / 4 * 1.5e-3**2
    by_hand = scene.rotor.influence_coefficient * 0.072 * 1000 * area * u
    assert gain["velocity_m_s"] == pytest.approx(u)
    assert gain["drag_coefficient"] == pytest.approx(50)
    assert gain["moment_per_transferred_mass_m"] == pytest.approx(0.072)
    assert gain["slope_m_per_s"] == pytest.approx(by_hand)
    assert gain["gain_per_operation"] == pytest.approx(scene.controller.proportional * by_hand)


@pytest.mark.parametrize("h", [0.5, 0.9, 1.4])
def test_an_operation_leaves_one_minus_h(scene: Scene, model: BalancerModel, h: float) -> None:
    slope = gain_of(scene, model)["slope_m_per_s"]
    run = simulate(small(scene, proportional=h / slope), model)
    seen = [s.measurement.amplitude for s in run.samples if s.measurement is not None]
    assert seen[1] / seen[0] == pytest.approx(abs(1 - h), abs=1e-3)
    assert (run.overshoots > 0) == (h > 1)


def test_no_flow_no_gain(scene: Scene, model: BalancerModel, laws: Mapping[str, Any]) -> None:
    weak = with_tables(scene, gas={"pressure": 0.0})
    assert _loop_gain(weak, model) is None
    assert gain_of(scene, replace(model, flow=laws["constant"]))["velocity_m_s"] == 5.0
