"""The closed loop: against a few lines by hand, its limit cases, and what each ending says."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pairs import Passage

from ringbalance.controller.algorithms.algorithm import Command, Measurement, ValveCommand
from ringbalance.controller.algorithms.law_based import controller_of
from ringbalance.controller.balancer import WATCH_TIME_S
from ringbalance.controller.document import simulation_document
from ringbalance.controller.liquid_ring.loop_factor import loop_factor
from ringbalance.controller.loop import simulate
from ringbalance.controller.outcome import run_findings
from ringbalance.controller.simulation import Outcome, RunVerdict, Simulation
from ringbalance.controller.stepped import Stepped
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from scenes import with_tables


def with_controller(scene: Scene, **changes: Any) -> Scene:
    return with_tables(scene, controller=changes)


def with_rotor(scene: Scene, **changes: Any) -> Scene:
    return with_tables(scene, rotor=changes)


def with_noise(scene: Scene, *, seed: int = 0) -> Scene:
    noisy = replace(scene.sensor, amplitude_noise=0.01e-6, phase_noise=math.radians(0.5))
    return with_tables(scene, sensor=noisy, run={"seed": seed})


def document(simulation: Simulation) -> str:
    return json.dumps(simulation_document(simulation), allow_nan=False)


def test_proportional_control_along_one_axis_by_hand(scene: Scene, model: BalancerModel) -> None:
    # Unbalance exactly at chamber A: every operation drives A, the amplitude is 10 um less what has moved.
    towards_a = with_tables(
        scene,
        controller={"integral_time": None, "derivative_time": 0.0},
        rotor={"initial_phase": -math.radians(17)},
    )
    run = simulate(towards_a, model)
    area = math.pi / 4 * 1.5e-3**2
    volume = (math.pi / 4 * (44.5e-3**2 - 20.5e-3**2) - 2 * 2.777e-3 * 24e-3) * 62e-3
    omega2 = (10000 * 2 * math.pi / 60) ** 2
    x, time, amplitude, expected = 0.25, 0.0, 10e-6, []
    while amplitude > 0.05e-6:
        gas = 0.08e6 * amplitude
        head = 0.7e6 + 1000 * omega2 * volume / (62e-3 * math.pi / 2) * (2 * x - 0.5)
        u = math.sqrt(2 / (1000 * 51) * head)
        after = x - area / volume * (u * gas - omega2 * area / (51 * 62e-3 * math.pi / 2) * gas**2)
        expected.append((time, gas, x, after))
        x, time = after, time + gas + 0.5
        amplitude = 10e-6 - 0.0108 * 72e-3 * 1000 * volume * (0.25 - x)
    gone = [(i.time, i) for i in run.injections]
    result = [(time, one.duration, one.fill_before, one.fill_after) for time, one in gone]
    assert {i.chamber for i in run.injections} == {"A"}
    assert np.array(result) == pytest.approx(np.array(expected), rel=1e-9)
    assert run.settled
    assert run.amplitude[-1] == pytest.approx(amplitude, rel=1e-6)


def test_the_record_is_consistent(scene: Scene, model: BalancerModel) -> None:
    run = simulate(scene, model)
    assert np.all(np.diff(run.time) > 0)
    assert run.amplitude[0] == pytest.approx(10e-6)
    assert run.phase[0] == pytest.approx(math.pi / 2)
    assert run.settling_time is not None
    after = run.time >= run.settling_time
    assert np.all(run.amplitude[after] <= run.limit)
    assert run.amplitude[np.flatnonzero(after)[0] - 1] > run.limit
    for injection in run.injections:
        start = int(np.flatnonzero(run.time == injection.time)[0])
        stop = int(np.argmin(np.abs(run.time - injection.time - injection.duration)))
        fills = run.fill_ratio[injection.chamber]
        assert fills[start] == injection.fill_before
        assert fills[stop] == pytest.approx(injection.fill_after, abs=1e-15)


def test_both_valves_open_together_and_the_wait_follows_the_longer_one(
    scene: Scene, model: BalancerModel
) -> None:
    run = simulate(scene, model)
    first = [i for i in run.injections if i.time == 0.0]
    assert [i.chamber for i in first] == ["B", "C"]
    # The unbalance lies at 90 + 17 degrees; Kc e = 0.8 s.
    assert first[0].duration == pytest.approx(0.8 * math.cos(math.radians(17)))
    assert first[1].duration == pytest.approx(0.8 * math.sin(math.radians(17)))
    assert run.samples[1].time == pytest.approx(first[0].duration + 0.5)


@pytest.mark.parametrize("chambers", [2, 6, 8])
def test_other_numbers_of_chambers_settle(scene: Scene, model: BalancerModel, chambers: int) -> None:
    disc = replace(scene.disc, chambers=chambers)
    phase = -math.radians(17) if chambers == 2 else 1.0
    run = simulate(with_rotor(replace(scene, disc=disc), initial_phase=phase), model)
    assert run.settled, run.status
    assert list(run.fill_ratio) == list("ABCDEFGH"[:chambers])


def test_nothing_is_done_without_vibration(scene: Scene, model: BalancerModel) -> None:
    run = simulate(with_rotor(scene, initial_amplitude=0.0), model)
    assert (run.outcome, run.settling_time, run.injections) == (Outcome.SETTLED, 0.0, ())
    assert np.all(run.amplitude == 0)


def test_an_unbalance_beyond_the_capacity_is_said_so(scene: Scene, model: BalancerModel) -> None:
    run = simulate(with_rotor(scene, initial_amplitude=30e-6, initial_phase=math.radians(73)), model)
    assert run.outcome is Outcome.CAPACITY_EXCEEDED
    # 30 um at chamber B against 72 mm * 1000 kg/m^3 * V * 0.25 of one pair, less the residual fill.
    usable = 1218.6 * (1 - run.gas.residual_fill_ratio / 0.25)
    assert "2778 g mm" in run.status
    assert f"{usable:.4g} g mm" in run.status
    assert run.amplitude[-1] == pytest.approx(30e-6 - 0.0108 * usable * 1e-6, rel=1e-3)
    assert run.shortened > 0
    assert "keeps its residual fill" in run.status
    assert min(float(fill.min()) for fill in run.fill_ratio.values()) >= run.gas.residual_fill_ratio
    assert run.time[-1] == pytest.approx(scene.run.time_limit)


@pytest.mark.parametrize("kind", ["target_vector", "law_based"])
def test_neighbours_give_what_a_chamber_at_its_residual_fill_cannot(scene: Scene, kind: str) -> None:
    """The end is asserted by what cancels the unbalance, not by the fill of each chamber.

    No sensor tells of an empty chamber; a correction that overshoots while the controller finds it out is
    taken back by opposite chambers, which gives an empty one some liquid again.
    """
    disc = replace(scene.disc, chambers=8, central_angle=math.pi / 4)
    eight = with_rotor(replace(scene, disc=disc), initial_amplitude=10.5e-6, initial_phase=0.3)
    run = simulate(with_controller(eight, kind=kind), paper_model(eight))
    assert run.settled, run.status
    # The unbalance lies between A and B, and is more than both can cancel: C gives what they lack.
    area = math.pi / 8 * (44.5e-3**2 - 20.5e-3**2) - 2 * 2.777e-3 * 24e-3
    of_change = 0.0108 * 72e-3 * 1000 * area * 62e-3
    moved = np.array([0.25 - run.fill_ratio[letter][-1] for letter in "ABCD"])
    cancelled = of_change * (moved @ np.exp(0.25j * math.pi * np.arange(4)))
    unbalance = 10.5e-6 * np.exp(1j * (0.3 + math.radians(17)))
    assert abs(unbalance - cancelled) == pytest.approx(run.amplitude[-1], abs=1e-12)
    assert run.amplitude[-1] <= 0.05e-6
    residual = run.gas.residual_fill_ratio
    assert of_change * (0.25 - residual) * 2 * math.cos(math.pi / 8) < 10.5e-6
    assert moved[2] > 0.05
    assert run.fill_ratio["B"].min() == pytest.approx(residual, abs=1e-9)
    assert min(float(fill.min()) for fill in run.fill_ratio.values()) >= residual


def test_a_wrong_lag_angle_is_found_out_and_stopped(scene: Scene, model: BalancerModel) -> None:
    run = simulate(with_controller(scene, assumed_lag_angle=math.radians(197)), model)
    assert run.outcome is Outcome.DIVERGING
    assert "controller.assumed_lag_angle is 180" in run.status
    assert len(run.samples) <= 4
    assert run.misadjustments >= 2


def test_a_wrong_sense_of_rotation_is_found_out(scene: Scene, model: BalancerModel) -> None:
    mirrored = Stepped(controller_of(scene, model))

    class Mirrored:
        rises_tolerated = mirrored.rises_tolerated
        start = staticmethod(mirrored.start)

        @staticmethod
        def step(state: Any, measurement: Measurement | None) -> Any:
            assert measurement is not None
            return mirrored.step(state, replace(measurement, phase=-measurement.phase))

    run = simulate(with_rotor(scene, initial_phase=math.radians(70)), model, controller=Mirrored())
    assert run.outcome is Outcome.DIVERGING
    assert "sense of rotation" in run.status


@pytest.mark.parametrize(
    ("factor", "degrees_off", "advice"),
    [
        (2.2, 0, ["gain_too_high"]),
        (5.0, 0, ["gain_too_high"]),
        (2.5, 20, ["gain_too_high"]),
        (2.5, 30, ["lag_beyond", "gain_too_high"]),
        (1.9, 40, ["lag_beyond", "gain_too_high"]),
        (1.9, 55, ["lag_beyond"]),
        (0.3, 95, ["lag_beyond"]),
        (1.7, 100, ["lag_beyond"]),
    ],
)
def test_a_growing_residual_is_laid_to_the_gain_or_to_the_lag_angle(
    scene: Scene, model: BalancerModel, factor: float, degrees_off: float, advice: list[str]
) -> None:
    rate = loop_factor(scene, model, controller_of(scene, model)).rate
    lag = scene.rotor.lag_angle + math.radians(degrees_off)
    turned = with_controller(scene, assumed_lag_angle=lag, proportional=factor / rate)
    run = simulate(turned, model)
    assert run.outcome in {Outcome.DIVERGING, Outcome.UNSTABLE}
    findings = {each.code: each for each in run_findings(run)}
    assert [code for code in findings if code in {"check_direction", "lag_beyond", "gain_too_high"}] == advice
    if "gain_too_high" in advice:
        highest = findings["gain_too_high"].values["proportional"]
        assert isinstance(highest, float)
        assert simulate(with_controller(turned, proportional=0.9 * highest), model).settled
        assert findings["gain_too_high"].values["half"] == pytest.approx(highest / 2.0)


def test_far_too_high_a_gain_is_reported_by_its_overshoots(scene: Scene, model: BalancerModel) -> None:
    run = simulate(with_controller(scene, proportional=0.5e6), model)
    assert not run.settled
    assert run.overshoots > 2
    assert f"overshoots: {run.overshoots}" in run.status


def test_commands_below_the_valves_minimum_are_reported(scene: Scene, model: BalancerModel) -> None:
    run = simulate(with_controller(scene, minimum_gas_time=0.05, integral_time=None), model)
    assert run.outcome is Outcome.GAS_TIME_TOO_SHORT
    assert "50 ms" in run.status
    assert all(i.duration >= 0.05 for i in run.injections)


def test_the_time_limit_ends_a_run_in_mid_operation(scene: Scene, model: BalancerModel) -> None:
    short = with_tables(scene, run={"time_limit": 0.3})
    run = simulate(short, model)
    assert run.outcome is Outcome.TIME_LIMIT
    assert run.time[-1] == pytest.approx(0.3)
    assert max(i.duration for i in run.injections) == pytest.approx(0.3)


def test_a_tiny_period_does_not_run_for_ever(
    scene: Scene, model: BalancerModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ringbalance.controller.loop._MAX_TRACED_SAMPLES", 50)
    tiny = with_controller(scene, period=1e-9, minimum_gas_time=10.0, maximum_gas_time=20.0)
    run = simulate(tiny, model)
    assert run.outcome is Outcome.TOO_MANY_SAMPLES
    assert "controller.period" in run.status
    assert len(run.samples) == 50


def test_noise_is_reproducible_by_seed(scene: Scene, model: BalancerModel) -> None:
    runs = [document(simulate(with_noise(scene, seed=seed), model)) for seed in (7, 7, 8)]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_noise_has_the_deviations_asked_for(scene: Scene, model: BalancerModel) -> None:
    still = with_tables(
        scene,
        sensor={"amplitude_noise": 0.2e-6, "phase_noise": 0.05},
        controller={"minimum_gas_time": 1e3, "maximum_gas_time": 2e3},
    )
    seen = [s.measurement for s in simulate(still, model).samples]
    amplitudes = np.array([m.amplitude for m in seen if m is not None])
    phases = np.array([m.phase for m in seen if m is not None])
    assert len(seen) > 200
    assert amplitudes.mean() == pytest.approx(10e-6, abs=0.06e-6)
    assert amplitudes.std() == pytest.approx(0.2e-6, rel=0.2)
    assert phases.std() == pytest.approx(0.05, rel=0.2)


def test_a_faulty_sensor_delays_but_does_not_mislead(scene: Scene, model: BalancerModel) -> None:
    count = 0

    def faulty(time: float, vibration: complex) -> Measurement | None:
        nonlocal count
        count += 1
        if count % 3 == 1:
            return None
        amplitude = math.nan if count % 3 == 2 and count < 6 else abs(vibration)
        return Measurement(time=time, amplitude=amplitude, phase=float(np.angle(vibration)) + 4 * math.pi)

    short = with_tables(scene, run={"time_limit": 20.0})
    run = simulate(short, model, sensor=faulty)
    assert run.amplitude[-1] <= run.limit
    assert run.misadjustments == 0
    samples = simulation_document(run)["samples"]
    assert samples["amplitude_m"][:2] == [None, None]
    document(run)


def test_a_run_within_its_limit_in_time_is_watched_until_it_has_settled(
    scene: Scene, model: BalancerModel
) -> None:
    settled = simulate(with_noise(scene), model)
    assert settled.settled
    assert settled.settling_time is not None
    after, before = (
        simulate(with_tables(with_noise(scene), run={"time_limit": end}), model)
        for end in (settled.settling_time + 1.2, settled.settling_time - 0.1)
    )
    assert after.settling_time == settled.settling_time
    assert after.time[-1] >= settled.settling_time + scene.controller.hold_time + WATCH_TIME_S
    assert before.outcome is Outcome.TIME_LIMIT
    assert before.verdict is RunVerdict.NOT_SETTLED


def test_progress_runs_to_the_end(scene: Scene, model: BalancerModel) -> None:
    seen: list[tuple[float, float]] = []
    run = simulate(scene, model, progress=lambda time, limit: seen.append((time, limit)))
    assert [time for time, _ in seen] == [sample.time for sample in run.samples]
    assert {limit for _, limit in seen} == {120.0}


def test_a_rotor_too_slow_for_a_ring_is_a_fault_of_the_scene(scene: Scene, model: BalancerModel) -> None:
    # sqrt(g/a) at a = 34.9 mm: 16.76 rad/s, 160 rpm.
    for speed, slow in ((16.7, True), (16.9, False)):
        turning = with_tables(scene, rotor={"speed": speed})
        if slow:
            with pytest.raises(SceneError, match=r"\[rotor\] speed.*160"):
                simulate(turning, model)
        else:
            assert simulate(turning, model).status
    upright = with_tables(scene, environment={"shaft": "vertical"})
    assert simulate(with_tables(upright, rotor={"speed": 5.0}), model).status


# --- liquid that runs back through a full tube ---


@pytest.fixture
def siphoning(model: BalancerModel, laws: Mapping[str, Any]) -> BalancerModel:
    """A balancer whose column holds with the gas off: levels run back by u = 20 (x_A - x_C) m/s."""
    return replace(model, name="levelling", flow=laws["levelling"])


def test_self_siphoning_loses_the_correction_and_is_reported(scene: Scene, siphoning: BalancerModel) -> None:
    run = simulate(scene, siphoning)
    assert run.outcome is Outcome.DRIFTING
    assert "run back" in run.status


def test_levels_run_back_by_the_law_once_the_valve_is_shut(
    siphoning: BalancerModel, plant: Callable[..., Dynamics], pulse: Callable[..., Passage]
) -> None:
    driven, waited = (pulse(plant(siphoning, pressure=1e5), 0.4, np.array([end])) for end in (0.4, 1.1))
    assert driven.primed
    rate = 2 * 20 * siphoning.tube_area / siphoning.chamber_volume
    lost = (driven.fill - 0.25) * math.exp(-rate * 0.7)
    assert waited.fill == pytest.approx(0.25 + lost, abs=1e-9)
    assert waited.ran_back == pytest.approx(0.25 + lost - driven.fill, abs=1e-9)


def gas_into(*chambers: int) -> Command:
    return Command(valves=tuple(ValveCommand(chamber=chamber, duration=0.01) for chamber in chambers))


class Answers:
    """Opens what it is told to, in a command alone or with a state."""

    rises_tolerated = 3

    def __init__(self, answer: Any) -> None:
        self.answer = answer

    def start(self) -> None:
        return None

    def step(self, _state: None, _measurement: Measurement | None) -> Any:
        return self.answer


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (Command(resting=True), r"Answers.step returns the next state and a Command"),
        (None, r"it returned None"),
        ((None, "A"), r"it returned \(None, 'A'\)"),
        ((None, gas_into(9)), "this disc has chambers 0 to 3"),
        ((None, gas_into(1, 3)), "one pair"),
    ],
)
def test_an_answer_that_is_none_is_refused(
    scene: Scene, model: BalancerModel, answer: Any, message: str
) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        simulate(scene, model, controller=Answers(answer))


@pytest.mark.parametrize(
    ("chamber", "duration", "message"),
    [
        (-1, 0.01, "chambers are counted from 0"),
        *((0, duration, "a valve cannot open for") for duration in (-0.01, 0.0, math.nan, math.inf)),
    ],
)
def test_no_valve_opens_before_the_first_chamber_or_for_no_time(
    chamber: int, duration: float, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        ValveCommand(chamber=chamber, duration=duration)
