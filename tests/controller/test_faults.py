"""Broken settings, sensors and gas supplies: each a clear error, or a behaviour that is stated here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.algorithms.algorithm import Measurement
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Outcome, Simulation
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene

KINDS = ("target_vector", "trial", "law_based")


def changed(scene: Scene, table: str, **values: Any) -> Scene:
    return replace(scene, **{table: replace(getattr(scene, table), **values)})


def seen_through(
    scene: Scene, model: BalancerModel, fault: Callable[[int, Measurement], Measurement | None]
) -> Simulation:
    """A run whose sensor is exact but for a fault of the n-th sample."""
    count = 0

    def sensor(time: float, vibration: complex) -> Measurement | None:
        nonlocal count
        count += 1
        phase = float(np.angle(vibration))
        return fault(count, Measurement(time=time, amplitude=abs(vibration), phase=phase))

    return simulate(changed(scene, "run", time_limit=20.0), model, sensor=sensor)


def test_a_limit_below_the_noise_ends_with_the_noise_named(scene: Scene, model: BalancerModel) -> None:
    run = simulate(changed(scene, "sensor", amplitude_noise=1e-6), model)
    assert run.outcome is Outcome.NOISE
    assert "raise controller.limit or average the sensor" in run.status


@pytest.mark.parametrize("kind", KINDS)
def test_no_pressure_stalls_and_names_the_pressure_that_is_needed(
    scene: Scene, model: BalancerModel, calibrated: BalancerModel, kind: str
) -> None:
    idle = changed(changed(scene, "gas", pressure=0.0), "controller", kind=kind)
    for own in (model, calibrated):
        run = simulate(idle, own)
        assert run.outcome is Outcome.STALLED
        assert run.energy == 0
        assert "no pressure" not in run.status
        assert run.time[-1] == pytest.approx(scene.run.time_limit)
    # To empty a chamber of the paper's disc takes 0.381 MPa by Eq. 19.
    assert "to empty it: 0.381" in simulate(idle, model).status


@pytest.mark.parametrize("bad", ["none", "nan", "inf"])
@pytest.mark.parametrize("kind", KINDS)
def test_one_bad_sample_costs_one_period(scene: Scene, model: BalancerModel, kind: str, bad: str) -> None:
    own = changed(scene, "controller", kind=kind)

    def fault(count: int, sample: Measurement) -> Measurement | None:
        if count != 1:
            return sample
        value = math.nan if bad == "nan" else math.inf
        return None if bad == "none" else replace(sample, amplitude=value)

    run, clean = seen_through(own, model, fault), seen_through(own, model, lambda _, sample: sample)
    assert not run.samples[0].command.valves
    assert run.samples[0].command.reason == "no usable sample"
    commands = [s.command for s in run.samples[1:6]]
    assert commands == [s.command for s in clean.samples[:5]]


@pytest.mark.parametrize("kind", KINDS)
def test_a_dead_sensor_opens_no_valve_and_is_reported(scene: Scene, model: BalancerModel, kind: str) -> None:
    run = seen_through(changed(scene, "controller", kind=kind), model, lambda *_: None)
    assert run.outcome is Outcome.NO_SAMPLES
    assert run.injections == ()
    assert "check the vibration sensor" in run.status


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turns", [-1, 1, 3])
def test_a_phase_that_jumps_by_whole_turns_changes_nothing(
    scene: Scene, model: BalancerModel, kind: str, turns: int
) -> None:
    own = changed(scene, "controller", kind=kind)

    def jumps(count: int, sample: Measurement) -> Measurement:
        return replace(sample, phase=sample.phase + 2 * math.pi * turns * (count % 2))

    run, clean = seen_through(own, model, jumps), seen_through(own, model, lambda _, sample: sample)
    assert run.overshoots == clean.overshoots
    assert len(run.samples) == len(clean.samples)
    assert run.amplitude[-1] == pytest.approx(clean.amplitude[-1], rel=1e-6, abs=1e-12)


def test_gas_that_is_gone_before_it_presses_is_reported(scene: Scene, calibrated: BalancerModel) -> None:
    # 25 ms fill a chamber at this conductance; 4 ms lift no liquid over the crest.
    gas = {"conductance": 1e-8, "critical_ratio": 0.3}
    short = changed(changed(scene, "gas", **gas), "controller", kind="trial", first_trial=4e-3)
    run = simulate(short, calibrated)
    assert run.outcome is Outcome.GAS_TIME_TOO_SHORT
    assert "4 ms of gas" in run.status
    assert run.time[-1] == pytest.approx(scene.run.time_limit)
    assert all(fill[-1] == 0.25 for fill in run.fill_ratio.values())
