"""Settings of the strategy by runs, and what a scene answers without a run."""

from __future__ import annotations

import math

import numpy as np
import pytest
from eccentric_runs import bundled

from ringbalance.controller.balancer import Draws, balancer_of
from ringbalance.controller.eccentric_mass.run import locked_run, simulate_eccentric
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_scene
from ringbalance.controller.eccentric_mass.static_answers import (
    holding_margin,
    largest_whirl_per_imbalance,
    stall_ratio,
    static_quantities,
)
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE
from ringbalance.controller.judging.tune import tuned
from ringbalance.verification.papers import RPM, at_constant_speed, changed


def _own(scene: EccentricScene) -> set[float]:
    return {scene.fine_tuning.wait, scene.lqr.state_weight, scene.friction_filter.drive_speed}


def test_levels_are_multiples_of_the_scenes_settings(paper: EccentricScene) -> None:
    (trials,) = balancer_of(paper).trials()
    own = {
        "fine_tuning.wait": 8.576,
        "lqr.state_weight": 3.5,
        "friction_filter.drive_speed": 5 * RPM,
    }
    assert {axis.name for axis in trials.axes} == set(own)
    for axis in trials.axes:
        assert any(level == pytest.approx(own[axis.name], rel=1e-12) for level in axis.levels)
    at = {axis.name: value for axis in trials.axes for value in axis.levels if value in _own(paper)}
    assert trials.settings(at) == {}
    assert trials.settings({**at, "fine_tuning.wait": 2.14}) == {"fine_tuning.wait": 2.14}


def test_no_weight_without_its_margin_is_tried(small_scene: EccentricScene) -> None:
    (trials,) = balancer_of(small_scene).trials()
    at = {axis.name: axis.levels[axis.first[-1]] for axis in trials.axes}
    assert trials.settings({**at, "lqr.state_weight": 0.01}) == {"lqr.state_weight": 0.01}
    assert trials.settings({**at, "lqr.state_weight": 0.04}) is None


@pytest.fixture(scope="module")
def small_scene() -> EccentricScene:
    return bundled("driven_masses_small")


def test_a_gate_is_tried_where_its_stage_lasts(paper: EccentricScene) -> None:
    """A filter that assumes ten times the noise takes 9 s in place of 2.1 s."""
    loud = {"imbalance_filter.position_noise": 1e-3, "imbalance_filter.velocity_noise": 1e-2}
    slow = {"supervisor.limit": 1e-6, "imbalance_filter.gate": 1e-3, "run.time_limit": 60.0}
    names = {axis.name for axis in balancer_of(changed(paper, {**loud, **slow})).trials()[0].axes}
    assert "imbalance_filter.gate" in names
    assert "friction_filter.gate" not in names


def test_locked_masses_have_no_settings(paper: EccentricScene) -> None:
    assert balancer_of(changed(paper, {"supervisor.strategy": "locked"})).trials() == ()


def test_a_search_foresees_which_devices_the_run_up_brings_above_the_limit(paper: EccentricScene) -> None:
    """With a quarter of the wait two of these devices pass their critical speed above the limit."""
    balancer = balancer_of(paper)
    numbers = (FIRST_VERDICT_DEVICE + 29, FIRST_VERDICT_DEVICE + 30, FIRST_VERDICT_DEVICE + 59)
    whole, search = (
        balancer.run({"fine_tuning.wait": 2.14}, Draws(numbers=numbers, complete=each))
        for each in (True, False)
    )
    assert whole.ended == search.ended == ("rises_again", "settled", "rises_again")
    assert search.settling_time[1] == whole.settling_time[1]


@pytest.mark.heavy
def test_tune_finds_the_wait_by_runs_and_no_device_is_lost(paper: EccentricScene) -> None:
    tuning = tuned(balancer_of(at_constant_speed(paper, time_limit=40.0)))
    assert tuning.own is not None
    assert tuning.recommended.fraction.count >= tuning.own.fraction.count
    assert tuning.changes["fine_tuning.wait"] < 5.0
    assert tuning.recommended.time(0.5) < 0.75 * tuning.own.time(0.5)
    recommended = eccentric_scene(paper.with_values(dict(tuning.changes)))
    assert recommended.fine_tuning.wait == tuning.changes["fine_tuning.wait"]


def test_the_largest_vibration_is_that_of_locked_masses_slowly_run_up(paper: EccentricScene) -> None:
    """The steady peak bounds a run-up of 1 rpm/s, which comes within 2 % of it."""
    answers = {each.key: each.value for each in static_quantities(paper)}
    bound, run = answers["locked_amplitude"], locked_run(paper)
    assert bound is not None
    assert 0.98 * bound < float(np.max(run.amplitude)) < 1.02 * bound
    assert largest_whirl_per_imbalance(paper, after=250.0) < largest_whirl_per_imbalance(paper, after=120.0)


@pytest.mark.parametrize(("share", "ended"), [(0.7, "stalled"), (1.6, "settled")])
def test_the_stall_ratio_is_where_drives_stall(paper: EccentricScene, share: float, ended: str) -> None:
    steady = at_constant_speed(paper, time_limit=40.0)
    limited = changed(steady, {"motor.maximum_voltage": 1.0})
    ratio = stall_ratio(limited)
    assert ratio is not None
    weak = changed(steady, {"motor.maximum_voltage": share / ratio, "supervisor.friction_time": 10.0})
    assert stall_ratio(weak) == pytest.approx(share)
    assert simulate_eccentric(weak, seed=1).outcome.value == ended
    assert stall_ratio(steady) is None


def test_the_holding_margin_is_the_load_at_the_foot_of_a_ramp(paper: EccentricScene) -> None:
    """Without vibration left, mu_f b W^2/(J W'): 10 mm, 100 rpm and 1 rpm/s against r_b = 0.23 m."""
    exact = changed(paper, {"supervisor.limit": 1e-9, "sensor.position_noise": 0.0})
    assert holding_margin(exact) == pytest.approx(0.01 * (100 * RPM) ** 2 / (0.23 * RPM), rel=1e-3)
    # At constant speed the arm over the limit: 10 mm over 0.3 mm.
    assert holding_margin(at_constant_speed(paper, time_limit=40.0)) == pytest.approx(10 / 0.3)
    assert math.isclose(holding_margin(bundled("washing_machine")) or 0.0, 0.557, rel_tol=0.01)
