"""`ringbalance tune`: the gain, its margins, what the valve can do, and the settling times."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.liquid_ring.loop_factor import loop_margins, vibration_rates
from ringbalance.controller.loop import simulate
from ringbalance.controller.tuning.recommendation import factor_uncertainty
from ringbalance.controller.tuning.result import Tuning
from ringbalance.controller.tuning.tune import tune
from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from ringbalance.scene.uncertain import half_widths, shifted

MEMBERS = 300


def tuned(scene: Scene, **more: Any) -> Tuning:
    asked = replace(scene, sensor=replace(scene.sensor, amplitude_noise=1e-8, phase_noise=0.005))
    return tune(asked, paper_model(asked), members=MEMBERS, runs=3, **more)


@pytest.fixture(scope="module")
def found(scene: Scene) -> Tuning:
    return tuned(scene)


def with_settings(scene: Scene, **settings: Any) -> Scene:
    return replace(scene, controller=replace(scene.controller, **settings))


# --- margins ---


@pytest.mark.parametrize("h", [0.2, 0.8, 1.5])
def test_margins_of_a_proportional_loop_are_known(h: float) -> None:
    # S = (z - 1)/(z - 1 + h): (S - T)/2 is largest at z = -1.
    margins = loop_margins(loop_factor=h, gain_uncertainty=0.0, phase_uncertainty=0.0)
    assert margins.disk == pytest.approx(2 * (2 - h) / (2 + h), rel=1e-9)
    assert margins.disk_gain_factor == pytest.approx(2 / h) == margins.gain_factor
    assert margins.phase == pytest.approx(math.acos(h / 2))
    assert margins.disk_phase < margins.phase
    assert margins.left_gain_factor == pytest.approx(2 / h)


def test_any_gain_and_phase_within_the_disk_leave_the_loop_stable() -> None:
    h, i, q = 0.8, 0.01, 0.12
    margins = loop_margins(
        loop_factor=h, integral=i, derivative=q, gain_uncertainty=0.0, phase_uncertainty=0.0
    )
    span = 0.999 * margins.disk / 2

    def radius(factor: complex) -> float:
        c = h * factor
        loop = [1.0, -2 + c * (1 + i / 2 + q), 1 - c * (1 - i / 2 + 2 * q), c * q]
        return float(np.max(np.abs(np.roots(loop))))

    for angle in np.linspace(0, 2 * math.pi, 60):
        turned = span * np.exp(1j * angle)
        assert radius((1 + turned) / (1 - turned)) < 1
    over = (1 + 1.01 * margins.disk / 2) / (1 - 1.01 * margins.disk / 2)
    assert radius(over) > 1


def test_uncertainty_takes_from_both_margins() -> None:
    # |1 - h (1 + U) exp(j d)| = 1 at h (1 + U) = 2 cos d.
    margins = loop_margins(loop_factor=0.8, gain_uncertainty=0.25, phase_uncertainty=0.3)
    assert margins.left_gain_factor == pytest.approx(2 * math.cos(0.3) / 1.0)
    assert margins.left_phase == pytest.approx(math.acos(0.5) - 0.3)


# --- the gain ---


def test_no_residual_turns_round_at_the_edge_of_the_uncertainty(scene: Scene, found: Tuning) -> None:
    assert found.gain is not None
    assert found.margins is not None
    fastest = float(np.max(vibration_rates(scene, paper_model(scene))))
    assert found.gain * fastest * (1 + found.margins.gain_uncertainty) == pytest.approx(1.0)
    assert found.present.value == pytest.approx(found.present.rate * scene.controller.proportional)


def test_an_uncertain_input_counts_by_what_it_does_to_the_rate(scene: Scene) -> None:
    bore = InputUncertainty(quantity="bore", half_width=0.03, relative=True)
    exact = tuned(replace(scene, uncertainty=()))
    wider = tuned(replace(scene, uncertainty=(bore,)))
    parts = {part.name: part.uncertainty for part in wider.contributions}
    # Under Eq. 19 with its constant k the rate goes with the tube's area.
    assert parts["bore"] == pytest.approx(1.03**2 - 1, rel=1e-6)
    assert wider.gain is not None
    assert exact.gain is not None
    assert wider.gain < exact.gain


def test_a_device_solved_again_stands_for_its_law_made_again(paper_scene: Scene) -> None:
    """Every input that matters: its effect on the rate under a law that is calibrated with it."""
    law = calibrated_model(paper_scene)
    found = {part.name: part.uncertainty for part in factor_uncertainty(paper_scene, law).parts}
    rate = float(np.max(np.mean(vibration_rates(paper_scene, law), axis=1)))
    for quantity in ("bore", "length", "pressure", "hump_position", "outer_radius"):
        width = half_widths(paper_scene)[quantity]
        moved = [shifted(scene=paper_scene, quantity=quantity, change=side * width) for side in (-1, 1)]
        rates = [float(np.max(np.mean(vibration_rates(s, calibrated_model(s)), axis=1))) for s in moved]
        effect = max(abs(one / rate - 1) for one in rates)
        assert found[quantity] == pytest.approx(effect, rel=0.05, abs=2e-4), quantity


def test_the_velocity_is_as_uncertain_as_calibrate_says(paper_scene: Scene) -> None:
    # The flow spills over the crest of an empty tube under this pressure, and does not carry the gas off.
    asked = paper_scene.with_values({"gas.pressure": "0.345 MPa", "uncertainty": None})
    velocity = rb.calibrate(asked).budgets["velocity"]
    known = factor_uncertainty(asked, calibrated_model(asked))
    parts = {part.name: part.uncertainty for part in known.parts}
    # The same model errors at the same state; numerical and input parts are far below them.
    assert parts["velocity"] == pytest.approx(velocity.total / velocity.value, rel=0.02)


def test_simulate_names_the_gain_that_tune_recommends(paper_scene: Scene) -> None:
    law = paper_model(paper_scene)
    high = replace(
        with_settings(paper_scene, proportional=4 * paper_scene.controller.proportional),
        run=replace(paper_scene.run, time_limit=20.0),
    )
    run = simulate(high, law)
    gain = tune(high, law, members=10, runs=1).gain
    assert gain is not None
    assert f"to {gain * 1e-6:.3g} s/um" in run.status


def test_the_recommended_gain_settles_its_runs(found: Tuning) -> None:
    assert found.succeeded
    assert found.settling is not None
    assert found.settling.runs == MEMBERS
    p50, p95 = found.settling.quantiles["p50"], found.settling.quantiles["p95"]
    assert p50 is not None
    assert p95 is not None
    assert p50 <= p95 < 5.0
    run = simulate(found.scene, paper_model(found.scene))
    assert run.settling_time == pytest.approx(p50, rel=0.5)


def test_the_same_scene_gives_the_same_document(scene: Scene, found: Tuning) -> None:
    assert tuned(scene).to_dict() == found.to_dict()
    json.dumps(found.to_dict(), allow_nan=False)


def test_what_runs_reach_with_a_slow_gas_line_is_within_reach(scene: Scene, found: Tuning) -> None:
    # Nothing is known of the scene's own line: the default range leaves it open.
    assert found.reachable is None
    given = replace(scene, gas=replace(scene.gas, conductance=2e-9, critical_ratio=0.3, valve_lag=0.01))
    answer = tuned(given)
    # The smallest correction leaves the limit unsure; the runs settle all the same, and they decide.
    assert answer.gas_line[0].above_limit
    assert answer.reachable is answer.succeeded is True
    assert [line.end for line in answer.gas_line] == ["given"]


def test_a_law_based_controller_has_margins_and_no_gain(scene: Scene) -> None:
    answer = tuned(with_settings(scene, kind="law_based"))
    assert answer.gain is None
    assert answer.loop.value == pytest.approx(1.0)
    assert answer.margins is not None
    assert answer.margins.gain_factor == pytest.approx(2.0)
    assert answer.settling is not None
    assert answer.settling.runs == 3


# --- what cannot be ---


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"minimum_gas_time": 0.05}, "valve is too slow"), ({"limit": 1e-10}, "no gain keeps")],
)
def test_a_limit_that_cannot_be_reached_is_said(scene: Scene, settings: dict[str, float], words: str) -> None:
    answer = tuned(with_settings(scene, **settings))
    assert words in answer.status
    assert not answer.succeeded
    assert not answer.reachable


def test_gas_that_drives_nothing_gives_no_gain(scene: Scene, calibrated: BalancerModel) -> None:
    # 0.1 MPa lifts no liquid over the crest.
    weak = replace(scene, gas=replace(scene.gas, pressure=0.1e6))
    answer = tune(weak, calibrated)
    assert answer.gain is None
    assert "drives no liquid" in answer.status
    json.dumps(answer.to_dict(), allow_nan=False)


def test_a_short_time_limit_leaves_quantiles_open(scene: Scene) -> None:
    answer = tuned(replace(scene, run=replace(scene.run, time_limit=4.0)))
    assert answer.settling is not None
    assert answer.settling.quantiles == {"p50": None, "p95": None}
    assert answer.settling.settled.value == 0.0
    assert "not reached" in answer.status


# --- as a user calls it ---


def test_the_command_prints_one_document(capsys: pytest.CaptureFixture[str]) -> None:
    scene = str(Path(rb.__file__).parent.parent / "scenes" / "liquid_ring_paper.toml")
    assert main(["tune", scene, "--law", "paper", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["gain"] > 0
    assert set(answer["settling_time_s"]) == {"p50", "p95"}
    assert main(["tune", scene, "--law", "paper"]) == 0
    assert "recommended controller.proportional" in capsys.readouterr().out


@pytest.mark.parametrize(("reachable", "warned"), [(True, False), (None, True), (False, True)])
def test_a_line_whose_runs_settle_is_not_warned_of(
    scene: Scene, reachable: bool | None, warned: bool
) -> None:
    found = replace(tune(scene, paper_model(scene), members=8), reachable=reachable)
    assert ("gas_line" in [each.code for each in found.rows().findings]) is warned


def test_bad_input_is_exit_code_two(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = tmp_path / "broken.toml"
    broken.write_text('[disc]\nouter_radius = "4 s"\n')
    assert main(["tune", str(broken)]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_a_tuning_states_what_its_runs_leave_out(scene: Scene) -> None:
    """The liquid that each injection lifts to the crest takes most of one at the limit, so runs have it."""
    document = tune(scene, calibrated_model(scene), members=8).to_dict()
    assert document["neglected"]["terms"] == ()
    held = next(row for row in document["models_used"] if row["term"] == "liquid held in the tube")
    assert held["estimated_contribution"] > 0.5
    assert "unless the tube is primed" in held["model"]
    assert document["neglected"]["unknown"] == ("gas filling", "valve lag")
