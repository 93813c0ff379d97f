"""What a run leaves out is named, with an estimate by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from ringbalance.controller.loop import simulate
from ringbalance.controller.terms import filling_time, inertia_time
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.scene.models import Scene


def test_inertia_by_hand(scene: Scene, model: BalancerModel) -> None:
    u = math.sqrt(2 * 0.7e6 / (1000 * 51))
    assert inertia_time(scene=scene, model=model) == pytest.approx(math.log(2) * 2 * 0.12 / (51 * u))
    assert inertia_time(scene=replace(scene, gas=replace(scene.gas, pressure=0.0)), model=model) is None


def test_filling_by_hand(scene: Scene, model: BalancerModel) -> None:
    assert filling_time(scene=scene, model=model) is None
    # C = 1e-8 m^3/(s Pa): choked mass flow 1e-8 * 801325 * 1.188 kg/s into 0.75 V + 10 ml, air at 20 degC.
    piped = replace(scene, gas=replace(scene.gas, conductance=1e-8, dead_volume=10e-6))
    mass = 0.7e6 * (0.75 * model.chamber_volume + 10e-6) / (287.06 * 293.15)
    assert filling_time(scene=piped, model=model) == pytest.approx(mass / (1e-8 * 801325 * 1.188), rel=1e-3)


def test_terms_left_out_are_in_the_record(scene: Scene, model: BalancerModel) -> None:
    run = simulate(replace(scene, gas=replace(scene.gas, valve_lag=5e-3)), model)
    found = {term.term: term for term in run.terms}
    mean = sum(i.operation.duration for i in run.injections) / len(run.injections)
    assert found["valve lag"].model == "left out"
    assert found["valve lag"].estimated_contribution == pytest.approx(5e-3 / mean)
    assert found["gas filling"].estimated_contribution is None
    assert found["tube flow"].model == "paper"
