"""What a run leaves out is named, with an estimate by hand; runs at both ends of a range of gas lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from ringbalance.controller.document import line_runs, line_runs_table, simulation_document
from ringbalance.controller.liquid_ring import balancer
from ringbalance.controller.loop import simulate
from ringbalance.controller.terms import run_models
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene
from scenes import with_tables


@pytest.mark.parametrize(("lag", "share"), [(2e-5, "0.5 %"), (1e-3, "25 %")])
def test_a_term_with_numbers_is_modelled_however_small(
    scene: Scene, model: BalancerModel, lag: float, share: str
) -> None:
    """Of the 4 ms that Kc gives to the limit of 0.05 um."""
    run = simulate(with_tables(scene, gas={"valve_lag": lag}), model)
    result = {term.term: term for term in run.models_used}
    assert result["valve lag"].model == "pure delay, in injections"
    assert result["valve lag"].estimated_contribution == pytest.approx(lag / 4e-3)
    assert result["valve lag"].why.endswith(f"in the shortest injection that matters, 4 ms; {share}")
    assert result["gas filling"].estimated_contribution is None
    assert result["gas filling"].model == "left out"
    assert result["loss of the tube"].model == "as in the law “paper”"


def test_the_papers_law_has_no_mass_in_the_tube(scene: Scene, model: BalancerModel) -> None:
    trial = with_tables(scene, tolerance=1e-3, controller={"kind": "trial"})
    result = {used.term: used for used in run_models(scene=trial, model=model)}
    assert not result["tube inertia"].modelled
    assert "no mass in the tube" in result["tube inertia"].why
    asked = {used.term: used for used in run_models(scene=trial, model=model, terms=["tube inertia"])}
    assert asked["tube inertia"].modelled


def test_a_law_without_forces_carries_no_terms(
    scene: Scene, model: BalancerModel, laws: Mapping[str, Any]
) -> None:
    late = with_tables(scene, gas={"valve_lag": 50e-3})
    run = simulate(late, replace(model, name="constant", flow=laws["constant"]))
    result = {term.term: term for term in run.models_used}
    assert result["valve lag"].model == "not modelled in this version"
    assert "no forces" in result["valve lag"].why


@pytest.mark.parametrize("asked", [["gas filling"], ["valve lag"], ["surface tension"]])
def test_terms_without_numbers_are_refused(scene: Scene, model: BalancerModel, asked: list[str]) -> None:
    with pytest.raises(ValueError, match=asked[0]):
        simulate(scene, model, modelled=asked)


def test_a_run_states_a_bound_on_what_it_neglects_and_the_status_of_its_models(scene: Scene) -> None:
    calibrated = calibrate(scene).model
    short = with_tables(scene, run={"time_limit": 0.5 * scene.controller.period})
    nothing = simulation_document(simulate(short, calibrated))["neglected"]
    assert nothing["bound"] == 0
    assert nothing["text"].startswith(
        "no term of an injection that the scene gives numbers for is neglected; "
    )
    assert "0 %" not in nothing["text"]
    document = simulation_document(simulate(short, calibrated, modelled=["tube inertia"]))
    held = {row["term"]: row["estimated_contribution"] for row in document["models_used"]}
    neglected = document["neglected"]
    assert list(neglected["terms"]) == ["liquid held in the tube"]
    assert neglected["bound"] == held["liquid held in the tube"]
    assert list(neglected["unknown"]) == ["gas filling", "valve lag"]
    assert "at most 100 %" in neglected["text"]
    assert document["model_status"]["code"] == "ok"
    slow = with_tables(short, rotor={"speed": 63.0})
    status = simulation_document(simulate(slow, calibrated))["model_status"]
    assert status["code"] == "out_of_range"
    assert "waves" in status["text"]


def test_a_line_that_is_not_given_is_run_at_both_ends(scene: Scene, calibrated: BalancerModel) -> None:
    gain = 0.3 * scene.controller.proportional
    asked = with_tables(scene, controller={"proportional": gain}, run={"time_limit": 15.0})
    nominal = simulate(asked, calibrated)
    runs = line_runs(nominal)
    slow, fast = runs["slow"], runs["fast"]
    rows = nominal.to_dict()["gas_line_runs"]
    assert [row["end"] for row in rows] == [row[0] for row in line_runs_table(runs).rows] == [*runs]
    assert [row["conductance_m3_per_s_Pa"] for row in rows] == pytest.approx([0.2e-8, 1e-8])
    assert [row["valve_lag_s"] for row in rows] == pytest.approx([10e-3, 5e-3])
    assert [row["final_amplitude_m"] for row in rows] == [slow.amplitude[-1], fast.amplitude[-1]]
    assert set(slow.terms_modelled) == {
        "tube inertia",
        "gas filling",
        "valve lag",
        "liquid held in the tube",
    }
    # Late gas moves less in the same valve-open time, and the slow line is later.
    moved = [run.injections[0].fill_before - run.injections[0].fill_after for run in (slow, fast, nominal)]
    assert 0 < moved[0] < moved[1] < 1.1 * moved[2]
    given = with_tables(asked, gas={"conductance": 1e-8, "critical_ratio": 0.3, "valve_lag": 5e-3})
    assert line_runs(simulate(given, calibrated)) == {}
    # The fast end is the run of a scene that gives that line.
    assert simulate(given, calibrated).amplitude[-1] == fast.amplitude[-1]


def test_one_verdict_where_an_end_of_the_default_range_ends_otherwise(
    scene: Scene, calibrated: BalancerModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = simulate(scene, calibrated)
    limited = simulate(with_tables(scene, run={"time_limit": 1.0}), calibrated)
    assert run.settled
    assert not limited.settled
    for slow, codes in ((limited, ["valve_decides"]), (run, ["settled"])):
        monkeypatch.setattr(balancer, "line_runs", lambda _, slow=slow: {"slow": slow, "fast": run})
        findings = balancer.LiquidRingBalancer(scene).rows(run).findings
        assert [each.code for each in findings if "settled" in each.text] == codes
        if slow is limited:
            for each in (run, slow):
                assert each.findings[0].text in findings[0].text
