"""Dead time of a slow gas line: what stands still, the offset against it, and what `tune` makes of it."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.algorithms.algorithm import Measurement
from ringbalance.controller.algorithms.by_name import law_based_of, target_vector_of
from ringbalance.controller.ensemble import simulate_members
from ringbalance.controller.liquid_ring.loop_factor import vibration_rates
from ringbalance.controller.loop import simulate
from ringbalance.controller.tuning import search
from ringbalance.controller.tuning import tune as tune_module
from ringbalance.controller.tuning.dead_time import (
    compensated,
    dead_times,
    dead_zone,
    offset_text,
    standing_finding,
)
from ringbalance.controller.tuning.result import Tuning
from ringbalance.controller.tuning.tune import tune
from ringbalance.reduced_model.gas_line import line_answers, line_warning, standing_amplitude
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.tube.path import crest_middle
from ringbalance.scene.models import Scene


def with_settings(scene: Scene, **settings: Any) -> Scene:
    return replace(scene, controller=replace(scene.controller, **settings))


@pytest.fixture(scope="module")
def slow(scene: Scene) -> Scene:
    """A line that takes 45 ms before liquid moves, and a gain that asks for half of that at the limit."""
    gas = replace(scene.gas, conductance=0.6e-8, critical_ratio=0.3, valve_lag=4e-3)
    short = replace(scene, gas=gas, run=replace(scene.run, time_limit=30.0))
    return with_settings(short, limit=0.35e-6, proportional=0.02e6, integral_time=None)


@pytest.fixture(scope="module")
def offset(slow: Scene, calibrated: BalancerModel) -> Scene:
    return compensated(slow, calibrated, dead_times(slow, calibrated))


# --- what stands still ---


def test_the_largest_vector_that_stands_still(scene: Scene) -> None:
    def largest(times: list[float]) -> float:
        settings = with_settings(scene, kind="law_based").controller
        return standing_amplitude(settings, times, rates=[1.0] * len(times))

    # Two axes at right angles: both components at their bound; six chambers: 60 degrees apart.
    assert largest([3.0, 4.0, 3.0, 4.0]) == pytest.approx(5.0)
    assert largest([1.0] * 6) == pytest.approx(np.sqrt(3.0))
    assert largest([1.0, 2.0]) == 2.0


def test_an_amplitude_stands_as_far_as_the_dead_time_says(slow: Scene, calibrated: BalancerModel) -> None:
    """A run that starts within the zone does not move; one whose valve primes the tube does.

    Between the two it depends on every millisecond how far an injection gets on the crest.
    """
    start = slow.rotor.initial_phase + slow.rotor.lag_angle
    zone = (
        min(dead_times(replace(slow, rotor=_start(slow, 0.5e-6)), calibrated)) / slow.controller.proportional
    )
    along = replace(slow.rotor, initial_phase=start - slow.rotor.lag_angle - start)
    primes = line_answers(slow, calibrated)[0].shortest_opening
    assert primes is not None
    for part, moves in ((0.9, False), (primes / slow.controller.proportional / zone, True)):
        begun = replace(slow, rotor=replace(along, initial_amplitude=part * zone))
        exact = replace(begun, sensor=replace(slow.sensor, amplitude_noise=0.0, phase_noise=0.0))
        run = simulate(replace(exact, run=replace(slow.run, time_limit=2.0)), calibrated)
        moved = abs(float(run.amplitude[-1] - run.amplitude[0]))
        assert (moved > 0.02e-6) is moves


def _start(scene: Scene, amplitude: float) -> Any:
    return replace(scene.rotor, initial_amplitude=amplitude)


def test_only_what_runs_model_has_a_dead_time(
    scene: Scene, calibrated: BalancerModel, model: BalancerModel
) -> None:
    """The paper's law has no crest; without a line the lift over the steady velocity is an upper bound."""
    assert dead_times(scene, model) == ()
    lift = crest_middle(scene.tube) * scene.tube.length
    slowest = calibrated.flow.evaluate(
        fill_ratio=0.06, opposite_fill_ratio=0.44, gas_pressure=scene.gas.pressure, primed=True
    )
    dead = dead_times(scene, calibrated)
    assert 0 < min(dead) < max(dead) < lift / float(slowest.velocity)
    assert compensated(scene, calibrated, ()) is scene
    assert standing_finding(scene, calibrated) is None


def test_the_trial_algorithm_keeps_its_steps(slow: Scene, calibrated: BalancerModel) -> None:
    trial = with_settings(slow, kind="trial")
    assert compensated(trial, calibrated, (0.1,) * 4) is trial
    assert line_answers(trial, calibrated)[0].standing_amplitude is None


# --- the offset ---


def test_the_offset_brings_every_run_to_the_limit(
    slow: Scene, offset: Scene, calibrated: BalancerModel
) -> None:
    dead = dead_times(slow, calibrated)
    assert offset.controller.gas_time_offset == dead
    assert dead_zone(slow, calibrated, dead) > slow.controller.limit > dead_zone(offset, calibrated, dead)
    stuck = simulate(slow, calibrated)
    assert not stuck.settled
    assert offset_text(dead) in stuck.status
    assert "transfers no liquid" in line_warning(stuck.gas_line)
    assert line_warning(line_answers(offset, calibrated)) == ""
    for seed in range(3):
        assert simulate(replace(offset, run=replace(offset.run, seed=seed)), calibrated).settled


def test_many_runs_have_the_offsets_of_one(offset: Scene, calibrated: BalancerModel) -> None:
    exact = replace(offset, sensor=replace(offset.sensor, amplitude_noise=0.0, phase_noise=0.0))
    one, many = simulate(exact, calibrated), simulate_members(exact, calibrated)
    assert many.settled[0]
    assert many.settling_time[0] == pytest.approx(one.settling_time, rel=1e-4)
    # One injection is within 3e-6 in fill at the ensemble's error; some tens of them are 1e-9 m at most.
    assert many.final_amplitude[0] == pytest.approx(one.amplitude[-1], abs=1e-9)


def test_every_chamber_has_its_own_offset(scene: Scene) -> None:
    offsets = (0.01, 0.02, 0.03, 0.04)
    algorithm = target_vector_of(with_settings(scene, gas_time_offset=offsets))
    bare = target_vector_of(scene)
    for phase in np.linspace(0.1, 6.2, 9):
        sample = Measurement(time=0.0, amplitude=5e-6, phase=float(phase))
        with_it, without = (each.step(each.start(), sample)[1].valves for each in (algorithm, bare))
        assert {v.chamber: v.duration - offsets[v.chamber] for v in with_it} == pytest.approx(
            {v.chamber: v.duration for v in without}
        )
    assert with_settings(scene, gas_time_offset=(0.05,)).controller.offsets(4) == (0.05,) * 4
    assert scene.controller.offsets(4) == (0.0,) * 4


def test_the_law_based_algorithm_does_not_count_on_the_offset(scene: Scene, model: BalancerModel) -> None:
    """The liquid that it expects to have moved is that of the rest of the valve-open time."""
    first, second = (
        Measurement(time=0.0, amplitude=5e-6, phase=1.0),
        Measurement(time=2.0, amplitude=1e-6, phase=1.0),
    )
    expected = []
    for offset in (None, (0.2,)):
        algorithm = law_based_of(with_settings(scene, kind="law_based", gas_time_offset=offset), model)
        state, _ = algorithm.step(algorithm.start(), first)
        expected.append(algorithm.step(state, second)[0].liquid["state"][:, 0])
    assert expected[0] == pytest.approx(expected[1])


# --- tune ---


def tuned(scene: Scene, model: BalancerModel) -> Tuning:
    return tune(scene, model, members=24, runs=4)


def test_tune_recommends_what_its_runs_confirm(slow: Scene, calibrated: BalancerModel) -> None:
    found = tuned(slow, calibrated)
    document = found.to_dict()
    assert "gas_time_offset" in found.status
    assert document["change"] == offset_text(found.dead_times)
    assert document["gas_time_offset_s"] == list(found.dead_times) == document["dead_time_s"]
    assert found.settling is not None
    assert found.settling.quantiles["p95"] is not None
    assert document["tried"] == []
    assert simulate(found.scene, calibrated).settled


def test_the_law_based_algorithm_gets_the_same(slow: Scene, calibrated: BalancerModel) -> None:
    found = tuned(with_settings(slow, kind="law_based"), calibrated)
    assert found.gain is None
    assert "gas_time_offset" in found.status
    assert found.settling is not None
    assert found.settling.quantiles["p95"] is not None


def test_the_law_based_algorithm_keeps_its_times_where_offsets_would_slow_it(
    slow: Scene, calibrated: BalancerModel
) -> None:
    """It learns the dead time of a fast line from the first response."""
    gas = replace(slow.gas, conductance=3e-8, valve_lag=2e-3)
    fast = with_settings(replace(slow, gas=gas), kind="law_based", limit=0.22e-6)
    dead = dead_times(fast, calibrated)
    assert dead_zone(fast, calibrated, dead) > fast.controller.limit
    found = tuned(fast, calibrated)
    assert found.change == ""
    assert found.succeeded
    assert found.reachable is True


def test_dead_times_and_the_gain_are_found_once(
    slow: Scene, calibrated: BalancerModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []

    def counted(name: str, function: Any) -> Any:
        def called(*args: Any, **kwargs: Any) -> Any:
            calls.append(name)
            return function(*args, **kwargs)

        return called

    for module in (search, tune_module):
        for name in ("recommended_gain", "dead_times"):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, counted(name, getattr(module, name)))
    tuned(slow, calibrated)
    assert sorted(calls) == ["dead_times", "recommended_gain"]


def test_what_its_runs_refute_is_not_recommended(
    slow: Scene, calibrated: BalancerModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Valves that open for 60 ms or not at all: other settings are tried, and what is reached is reported.

    Of each way out the last of the steps, and one limit that is not enough.
    """
    for name, steps in (("LIMITS", (20.0, 50.0)), ("VALVES", (10.0,)), ("_OPENINGS", (0.1,))):
        assert getattr(search, name)[-len(steps) :] == steps
        monkeypatch.setattr(search, name, steps)
    coarse = with_settings(slow, minimum_gas_time=0.06, limit=0.05e-6)
    found = tuned(coarse, calibrated)
    assert not found.succeeded
    assert found.search is not None
    assert len(found.search.tried) > 3
    limit = found.search.limit
    assert limit == 50.0 * coarse.controller.limit
    assert f"raise controller.limit to {limit * 1e6:.3g} um" in found.status
    json.dumps(found.to_dict(), allow_nan=False)
    assert tuned(with_settings(coarse, limit=limit), calibrated).settling is not None
    # The smallest injection moves more than the scene's limit to either side.
    assert float(np.max(vibration_rates(slow, calibrated))) * 0.06 > 2 * coarse.controller.limit


def test_too_little_time_is_told_from_settings_that_fail(slow: Scene, calibrated: BalancerModel) -> None:
    hurried = replace(slow, run=replace(slow.run, time_limit=2.0))
    found = tuned(hurried, calibrated)
    assert found.search is not None
    assert found.search.settles
    assert "raise run.time_limit" in found.status


def test_an_unbalance_beyond_the_capacity_is_said_first(slow: Scene, calibrated: BalancerModel) -> None:
    heavy = replace(slow, rotor=replace(slow.rotor, initial_amplitude=100 * slow.rotor.initial_amplitude))
    found = tuned(heavy, calibrated)
    assert found.status.startswith("capacity exceeded")
    assert found.search is None
    assert found.reachable is False
    assert 0 < found.beyond_capacity < heavy.rotor.initial_amplitude


def test_the_law_based_algorithm_is_told_of_no_gain(slow: Scene, calibrated: BalancerModel) -> None:
    """Its overshoots come from the dead time, which a lower gain would not shorten."""
    line = replace(slow, gas=replace(slow.gas, conductance=0.3e-8))
    turned = replace(line, rotor=replace(line.rotor, initial_phase=1.6))
    run = simulate(with_settings(turned, kind="law_based"), calibrated)
    assert run.overshoots > 2
    assert "gas_time_offset" in run.status
    assert "controller.proportional" not in run.status
