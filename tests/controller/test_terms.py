"""What a run leaves out is named, with an estimate by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from ringbalance.controller.loop import simulate
from ringbalance.controller.quadrature import quadrature
from ringbalance.controller.terms import choices, filling_time, inertia_time
from ringbalance.reduced_model.calibration import calibrate
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
    # 5 ms of the 0.8 s that Kc gives to 10 um are below the tolerance of 1 %.
    assert found["valve lag"].model == "left out"
    assert found["valve lag"].estimated_contribution == pytest.approx(5e-3 / 0.8)
    assert "below the tolerance of 1 %" in found["valve lag"].why
    assert found["gas filling"].estimated_contribution is None
    assert found["tube flow"].model == "paper"
    assert run.integrator == "closed_form"


def test_a_term_above_the_tolerance_is_modelled_and_says_why(scene: Scene, model: BalancerModel) -> None:
    run = simulate(replace(scene, gas=replace(scene.gas, valve_lag=50e-3)), model)
    found = {term.term: term for term in run.terms}
    assert found["valve lag"].model == "pure delay"
    assert (
        "50 ms of a first gas time of 800 ms; 6.2 % is above the tolerance of 1 %" in found["valve lag"].why
    )
    assert run.integrator == "runge_kutta"


def test_inertia_is_above_the_tolerance_for_short_trials_only(scene: Scene) -> None:
    calibrated = calibrate(scene).model
    trial = replace(scene, controller=replace(scene.controller, kind="trial"))
    for asked, is_modelled in ((scene, False), (trial, True), (replace(trial, tolerance=0.1), False)):
        found = {choice.term: choice for choice in choices(scene=asked, model=calibrated)}
        assert found["tube inertia"].modelled is is_modelled


def test_the_papers_law_has_no_mass_in_the_tube(scene: Scene, model: BalancerModel) -> None:
    trial = replace(scene, tolerance=1e-3, controller=replace(scene.controller, kind="trial"))
    found = {choice.term: choice for choice in choices(scene=trial, model=model)}
    assert not found["tube inertia"].modelled
    assert "no mass in the tube" in found["tube inertia"].why
    assert choices(scene=trial, model=model, asked=["tube inertia"])[0].modelled


def test_a_law_without_forces_carries_no_terms(
    scene: Scene, model: BalancerModel, laws: Mapping[str, Any]
) -> None:
    late = replace(scene, gas=replace(scene.gas, valve_lag=50e-3))
    run = simulate(late, replace(model, name="constant", flow=laws["constant"]))
    found = {term.term: term for term in run.terms}
    assert found["valve lag"].model == "not modelled in this version"
    assert "no forces" in found["valve lag"].why


@pytest.mark.parametrize("asked", [["gas filling"], ["valve lag"], ["surface tension"]])
def test_terms_without_numbers_are_refused(scene: Scene, model: BalancerModel, asked: list[str]) -> None:
    with pytest.raises(ValueError, match=asked[0]):
        simulate(scene, model, modelled=asked)


def test_an_integrator_excludes_terms(scene: Scene, model: BalancerModel) -> None:
    late = replace(scene, gas=replace(scene.gas, valve_lag=50e-3))
    assert simulate(late, model, integrator=quadrature).integrator == "quadrature"
    with pytest.raises(ValueError, match="integrator"):
        simulate(late, model, integrator=quadrature, modelled=["valve lag"])
