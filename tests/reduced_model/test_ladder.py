"""Terms are chosen by their estimate against the tolerance, and what is missing says so."""

from __future__ import annotations

import dataclasses

import pytest

from ringbalance.reduced_model.calibration import Calibration
from ringbalance.reduced_model.ladder import IN_THE_LOOP, LEFT_OUT, Term, models_used
from ringbalance.reduced_model.operating_point import operating_point
from ringbalance.reduced_model.transients import filling_time, inertia_time, pulse_time, tube_liquid_share
from ringbalance.scene.models import Scene


def chosen(calibration: Calibration, scene: Scene) -> dict[str, Term]:
    terms = models_used(
        scene=scene,
        chamber=calibration.chamber,
        law=calibration.flow_law,
        point=operating_point(scene=scene, law=calibration.flow_law),
    )
    return {term.term: term for term in terms}


def test_every_term_says_model_and_reason(table_1_calibration: Calibration) -> None:
    assert (
        len({t.term for t in table_1_calibration.models_used}) == len(table_1_calibration.models_used) >= 10
    )
    assert all(t.model and t.why for t in table_1_calibration.models_used)


@pytest.mark.parametrize(("tolerance", "model"), [(0.01, LEFT_OUT), (1e-4, IN_THE_LOOP)])
def test_tolerance_decides_on_the_tubes_inertia(
    table_1_calibration: Calibration, table_1_scene: Scene, tolerance: float, model: str
) -> None:
    scene = dataclasses.replace(table_1_scene, tolerance=tolerance)
    assert chosen(table_1_calibration, scene)["inertia of the liquid in the tube"].model == model


def test_valve_and_filling_are_unknown_until_the_scene_asks(
    table_1_calibration: Calibration, table_1_scene: Scene
) -> None:
    silent = chosen(table_1_calibration, table_1_scene)
    assert silent["valve lag"].estimated_contribution is None
    assert silent["gas filling of the chamber"].estimated_contribution is None
    gas = dataclasses.replace(
        table_1_scene.gas, valve_lag=0.1, conductance=1e-8, critical_ratio=0.3, dead_volume=1e-5
    )
    asked = chosen(table_1_calibration, dataclasses.replace(table_1_scene, gas=gas))
    assert asked["valve lag"].estimated_contribution == pytest.approx(0.1 / 0.8)
    assert asked["valve lag"].model == IN_THE_LOOP
    assert asked["gas filling of the chamber"].estimated_contribution is not None


def test_filling_time_by_hand(table_1_calibration: Calibration, table_1_scene: Scene) -> None:
    gas = dataclasses.replace(table_1_scene.gas, conductance=1e-8, dead_volume=0.0)
    scene = dataclasses.replace(table_1_scene, gas=gas)
    # 50.8 ml of gas space at 0.7 MPa gauge hold 0.355 l of free air; C p_1 is 8.01 l/s.
    time = filling_time(scene=scene, law=table_1_calibration.flow_law)
    assert time == pytest.approx(0.75 * 67.69e-6 * 7 / (1e-8 * 801325), rel=1e-3)


def test_inertia_time_by_hand(table_1_calibration: Calibration, table_1_scene: Scene) -> None:
    point = table_1_calibration.operating_point
    assert point.k is not None
    time = inertia_time(scene=table_1_scene, point=point)
    assert time == pytest.approx(2 * 0.12 / ((point.k + 1) * point.velocity))


def test_pulse_time_follows_the_controller(table_1_scene: Scene) -> None:
    assert pulse_time(table_1_scene) == pytest.approx(0.8)
    short = dataclasses.replace(table_1_scene.controller, maximum_gas_time=0.3)
    assert pulse_time(dataclasses.replace(table_1_scene, controller=short)) == 0.3
    trial = dataclasses.replace(table_1_scene.controller, kind="trial")
    assert pulse_time(dataclasses.replace(table_1_scene, controller=trial)) == 0.1


def test_liquid_in_the_tube_by_hand(table_1_calibration: Calibration, table_1_scene: Scene) -> None:
    share = tube_liquid_share(scene=table_1_scene, law=table_1_calibration.flow_law)
    assert share == pytest.approx(0.21206e-6 / 16.92e-6, rel=1e-3)


def test_decree_and_blocked_tubes_have_no_rotation_share(
    table_1_calibration: Calibration, table_1_scene: Scene
) -> None:
    tube = dataclasses.replace(table_1_scene.tube, drag_coefficient=50.0)
    fixed = chosen(table_1_calibration, dataclasses.replace(table_1_scene, tube=tube))
    assert fixed["friction by rotation"].model == LEFT_OUT
    weak = dataclasses.replace(table_1_scene, gas=dataclasses.replace(table_1_scene.gas, pressure=1e3))
    blocked = chosen(table_1_calibration, weak)
    assert blocked["friction by rotation"].estimated_contribution is None
