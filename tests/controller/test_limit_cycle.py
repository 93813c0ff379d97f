"""Runs that correct for ever are told from runs that need more time; loops near instability are named."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.controller.liquid_ring.loop_factor import loop_information
from ringbalance.controller.loop import simulate
from ringbalance.controller.loop_records import NOTICEABLE_CHANGE
from ringbalance.controller.simulation import Outcome, Simulation
from ringbalance.controller.terms import least_period
from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.law.flow_law import BalancerModel, CompleteLaw
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from scenes import with_tables


@cache
def machine(name: str) -> tuple[Scene, BalancerModel]:
    scene = liquid_ring_scene(rb.load_scene(name))
    return scene, calibrated_model(scene, checked=False)


@cache
def law() -> CompleteLaw:
    return rb.calibrate(rb.load_scene("grinding_spindle")).flow_law


def drawn(name: str, seed: int, *, offset: float) -> Simulation:
    """A run without the gas's models under drawn settings; with a long offset it overshoots for ever."""
    scene, model = machine(name)
    random = np.random.default_rng(seed)
    settings = {
        "proportional": scene.controller.proportional * random.uniform(0.6, 1.1),
        "gas_time_offset": (offset * random.uniform(0.7, 1.0),),
        "assumed_lag_angle": scene.rotor.lag_angle + math.radians(random.uniform(-10, 10)),
    }
    run = {"seed": seed, "time_limit": 60.0}
    return simulate(with_tables(scene, controller=settings, run=run), model, modelled=[])


@pytest.mark.parametrize("offset", [0.06, 0.12, 0.2])
@pytest.mark.parametrize("name", ["spindle_design", "imported_chamber"])
def test_a_period_in_which_an_injection_does_not_die_out_is_named(name: str, offset: float) -> None:
    """With at least the wait that is named no liquid runs back; the crest holds it at any period."""
    scene, model = machine(name)
    line = {"conductance": 0.3e-8, "critical_ratio": 0.3, "valve_lag": 3e-3}
    held = {"gas_time_offset": (offset,), "hold_time": 5.0}
    least = least_period(with_tables(scene, gas=line), model)
    for part, runs_back in ((0.1, True), (1.0, False)):
        settings = {**held, "period": part * least}
        run = simulate(with_tables(scene, gas=line, controller=settings), model)
        assert (run.state["drift"] > NOTICEABLE_CHANGE) == runs_back
        short = [each.values for each in run.findings if each.code == "period_too_short"]
        assert short == ([{"period": settings["period"], "least": least}] if runs_back else [])
        assert "tube_runs_back" not in {each.code for each in run.findings}


def test_corrections_for_ever_are_a_limit_cycle_and_not_a_lack_of_time() -> None:
    scene, model = machine("grinding_spindle")
    run = simulate(scene, model, modelled=[])
    assert run.outcome is Outcome.LIMIT_CYCLE
    assert "a longer run.time_limit does not help" in run.status
    assert "raise run.time_limit" not in run.status
    assert "lower controller.gas_time_offset or controller.proportional" in run.status
    # Each of the changes that the finding names ends it; a longer period does not.
    ends = (
        {"gas_time_offset": (0.03,)},
        {"proportional": scene.controller.proportional / 2},
        {"kind": "law_based"},
    )
    for change in ends:
        assert simulate(with_tables(scene, controller=change), model, modelled=[]).settled
    longer = with_tables(scene, controller={"period": 1.5})
    assert simulate(longer, model, modelled=[]).outcome is Outcome.LIMIT_CYCLE


DRAWN = [(name, seed) for name in ("grinding_spindle", "liquid_ring_paper") for seed in range(6)]


def test_drawn_limit_cycles_are_known() -> None:
    runs = [drawn(name, seed, offset=0.2) for name, seed in DRAWN]
    # One comes within its limit and is lost again, one diverges.
    cycles = [run for run in runs if run.outcome not in {Outcome.HOVERING, Outcome.DIVERGING}]
    assert [run.outcome for run in cycles] == [Outcome.LIMIT_CYCLE] * 10
    for run in cycles:
        longer = with_tables(run.scene, run={"time_limit": 240.0})
        assert run.again(longer, modelled=[]).outcome is Outcome.LIMIT_CYCLE


def test_drawn_runs_that_need_more_time_are_none() -> None:
    """Runs that settle, ended by a shorter time limit: in the last correction, and before it."""
    runs = [run for name, seed in DRAWN if (run := drawn(name, seed, offset=0.0)).settled]
    assert len(runs) >= 10
    outcomes = set()
    for run in runs:
        assert run.settling_time is not None
        for part in (0.5, 0.7, 0.9, 0.99):
            short = with_tables(run.scene, run={"time_limit": part * run.settling_time})
            outcomes.add(run.again(short, modelled=[]).outcome)
    assert Outcome.TIME_LIMIT in outcomes
    assert Outcome.LIMIT_CYCLE not in outcomes


def test_a_run_that_has_just_come_within_its_limit_is_told_to_wait() -> None:
    scene, model = machine("liquid_ring_paper")
    whole = simulate(scene, model, modelled=[])
    last = [sample.time for sample in whole.samples if sample.command.valves][-1]
    duration = max(each.duration for each in whole.injections if each.time == last)
    cut = with_tables(scene, run={"time_limit": last + 0.98 * duration})
    run = simulate(cut, model, modelled=[])
    assert run.outcome is Outcome.HOLD_INCOMPLETE
    assert "raise run.time_limit" in run.status


def test_a_hold_that_the_most_samples_cut_is_not_laid_to_the_time_limit() -> None:
    scene, model = machine("liquid_ring_paper")
    quick = {"period": 5e-3, "hold_time": 5.0, "derivative_time": 0.0}
    run = simulate(with_tables(scene, controller=quick), model)
    assert run.state["since"] < run.state["time"] < scene.run.time_limit
    assert run.outcome is Outcome.TOO_MANY_SAMPLES
    assert "raise controller.period" in run.status
    assert "raise run.time_limit" not in run.status


@pytest.mark.parametrize("ratio", [0.5, 1.0])
def test_a_strong_integral_with_a_wrong_lag_is_near_instability(ratio: float) -> None:
    scene, model = machine("grinding_spindle")
    settings = {
        "assumed_lag_angle": scene.rotor.lag_angle + math.radians(40.0),
        "integral_time": scene.controller.period / ratio,
    }
    wrong = with_tables(scene, controller=settings)
    (finding,) = (each for each in simulate(wrong, model).findings if each.code == "phase_margin_small")
    assert finding.values["phase"] == pytest.approx(math.radians(5.0))
    assert finding.values["error"] == pytest.approx(math.radians(40.0))
    codes = {each.code for each in simulate(scene, model).findings}
    assert not codes & {"phase_margin_small", "gain_margin_small"}


def test_corrections_of_noise_that_move_nothing_are_none() -> None:
    """A balanced rotor without gas: every reading is zero, and noise alone asks for corrections."""
    scene, model = machine("liquid_ring_paper")
    still = with_tables(
        scene,
        rotor={"initial_amplitude": 0.0},
        sensor={"amplitude_noise": 1e-6},
        gas={"pressure": 0.0},
        run={"time_limit": 40.0},
    )
    run = simulate(still, model, modelled=[])
    assert sum(bool(sample.command.valves) for sample in run.samples) >= 9
    assert run.limit_cycle is None


@pytest.mark.parametrize("error", [47.0, 53.0, 60.0])
def test_a_lag_that_no_gain_bears_is_named(error: float) -> None:
    """Such runs end in a limit cycle, at the time limit or by growing: the cause is one."""
    scene, model = machine("grinding_spindle")
    wrong = with_tables(scene, controller={"assumed_lag_angle": scene.rotor.lag_angle + math.radians(error)})
    run, loop = simulate(wrong, model), rb.linear_loop(wrong, flow_law=law())
    for findings in (run.findings, loop.findings):
        (finding,) = (each for each in findings if each.code == "lag_beyond")
        assert finding.values["error"] == pytest.approx(math.radians(error))
    assert not run.settled
    assert not loop.stable


def test_a_loop_says_where_its_margins_do_not_cover_the_integral() -> None:
    scene, _ = machine("grinding_spindle")
    loop = rb.linear_loop(scene, flow_law=law())
    for factor in (0.98, 1.02):
        changed = with_tables(scene, controller={"integral_time": 5.0 * factor * loop.plant.dt})
        codes = {each.code for each in rb.linear_loop(changed, flow_law=law()).findings}
        assert ("integral_short" in codes) == (factor < 1.0)
    # The bundled spindle has 2.5 s, 3.6 sampling intervals.
    assert loop.integral == pytest.approx(0.274, abs=0.001)
    assert "integral_short" in {each.code for each in loop.findings}


def test_an_injection_that_the_time_limit_cuts_is_not_too_short() -> None:
    scene, model = machine("grinding_spindle")
    run = simulate(with_tables(scene, run={"time_limit": 0.1}), model)
    assert run.longest is not None
    assert not run.longest.moved
    assert run.outcome is Outcome.TIME_LIMIT


def test_a_gain_near_its_limit_is_near_instability() -> None:
    scene, model = machine("grinding_spindle")
    loop = simulate(scene, model).loop
    assert loop.value is not None
    highest = scene.controller.proportional * loop.limit / loop.value
    for part, named in ((0.95, True), (0.85, False)):
        near = rb.load_scene("grinding_spindle").with_values({"controller.proportional": part * highest})
        findings = simulate(liquid_ring_scene(near), model).findings
        assert ("gain_margin_small" in {each.code for each in findings}) == named


def test_a_loop_and_a_run_name_the_same_gain() -> None:
    scene, model = machine("liquid_ring_paper")
    high = with_tables(scene, controller={"proportional": 0.12e6})
    flow_law = rb.calibrate(rb.load_scene("liquid_ring_paper")).flow_law
    (of_loop,) = (each for each in rb.linear_loop(high, flow_law=flow_law).findings)
    (of_run,) = (each for each in simulate(high, model).findings if each.code == "gain_too_high")
    assert of_loop == of_run
    half = of_loop.values["half"]
    assert isinstance(half, float)
    slower = with_tables(scene, controller={"proportional": half})
    assert rb.linear_loop(slower, flow_law=flow_law).margins.gain_factor == pytest.approx(2.0)


@pytest.mark.parametrize("error", [43.0, -43.0])
def test_a_lag_that_takes_the_gain_margin_is_named_before_the_gain(error: float) -> None:
    scene, model = machine("liquid_ring_paper")
    wrong = with_tables(scene, controller={"assumed_lag_angle": scene.rotor.lag_angle + math.radians(error)})
    codes = [each.code for each in simulate(wrong, model).findings]
    assert codes[1:3] == ["lag_beyond", "gain_too_high"]


def test_a_derivative_that_amplifies_noise_is_named() -> None:
    """From h Td/dt = 1 on; far beyond, a run under noise grows, and one without noise does not."""
    scene, model = machine("liquid_ring_paper")
    loop = simulate(scene, model).loop
    assert loop.value is not None
    settings = {"period": 5e-3, "derivative_time": 60e-3}
    fast = with_tables(scene, controller=settings)
    run = simulate(fast, model)
    assert run.outcome is Outcome.DIVERGING
    assert "check_direction" not in {each.code for each in run.findings}
    (finding,) = (each for each in run.findings if each.code == "derivative_noise")
    interval = 5e-3 + scene.controller.proportional * scene.controller.limit
    assert finding.values["answer"] == pytest.approx(loop.value * 60e-3 / interval)
    still = with_tables(fast, sensor={"amplitude_noise": 0.0, "phase_noise": 0.0})
    assert simulate(still, model).settled
    flow_law = rb.calibrate(rb.load_scene("liquid_ring_paper")).flow_law
    for factor, named in ((0.98, False), (1.02, True)):
        time = factor * interval / loop.value
        changed = with_tables(scene, controller={**settings, "derivative_time": time})
        codes = {each.code for each in rb.linear_loop(changed, flow_law=flow_law).findings}
        assert ("derivative_noise" in codes) == named


def test_margins_of_tune_say_what_they_do_not_cover() -> None:
    scene, model = machine("grinding_spindle")
    information, loop = loop_information(scene, model), rb.linear_loop(scene, flow_law=law())
    (of_loop,) = (each for each in loop.findings if each.code == "integral_short")
    assert of_loop in information.findings


def test_a_margin_near_one_has_three_digits_beyond_it() -> None:
    scene, model = machine("liquid_ring_paper")
    highest = simulate(scene, model).loop
    assert highest.value is not None
    gain = scene.controller.proportional * highest.limit / highest.value / 1.004
    near = with_tables(scene, controller={"proportional": gain})
    information = loop_information(near, model)
    (margin,) = (each for each in information.quantities if each.key == "gain_margin")
    assert margin.digits == 4
    (finding,) = (each for each in information.findings if each.code == "gain_margin_small")
    assert "with 1.004 times" in finding.text
