"""Compiled runs with their record against `simulate`, instant by instant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.loop import simulate
from ringbalance.controller.prepared_run import Trace, prepare_run
from ringbalance.controller.rotor import chamber_letters
from ringbalance.controller.simulation import Simulation
from ringbalance.reduced_model.flow_law import Regime
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.reduced_model.paper_law import paper_model
from ringbalance.scene.models import Scene


def compare(trace: Trace, run: Simulation, *, tolerance: float) -> None:
    assert trace.settled == run.settled
    assert trace.settling_time == pytest.approx(run.settling_time)
    assert (trace.overshoots, trace.misadjustments) == (run.overshoots, run.misadjustments)
    # `simulate` keeps a few more instants in waits.
    at = np.argmin(np.abs(run.time[None, :] - trace.time[:, None]), axis=1)
    assert run.time[at] == pytest.approx(trace.time, rel=1e-10, abs=1e-10)
    assert np.max(np.abs(np.abs(trace.vibration) - run.amplitude[at])) < tolerance * 1e-4
    fills = np.array([run.fill_ratio[letter] for letter in run.fill_ratio])
    assert np.max(np.abs(trace.fill_ratio - fills[:, at])) < tolerance
    seen = [s.measurement for s in run.samples if s.measurement is not None]
    assert trace.sample_time == pytest.approx([m.time for m in seen], rel=1e-10, abs=1e-10)
    assert trace.sample_amplitude == pytest.approx([m.amplitude for m in seen], abs=tolerance * 1e-4)
    letters = chamber_letters(len(fills))
    commanded = {(round(i.time, 7), i.chamber): i.operation for i in run.injections}
    assert len(commanded) == trace.valve_time.size
    for i, (time, chamber) in enumerate(zip(trace.valve_time, trace.valve_chamber, strict=True)):
        done = commanded[round(float(time), 7), letters[chamber]]
        assert trace.valve_duration[i] == pytest.approx(done.duration, abs=1e-10)
        assert trace.fill_before[i] == pytest.approx(done.fill_before, abs=tolerance)
        if run.law != "levelling":
            assert trace.fill_after[i] == pytest.approx(done.fill_after, abs=tolerance)


@pytest.mark.parametrize("noise", [0.0, 2e-8])
@pytest.mark.parametrize("chambers", [2, 4, 6])
def test_a_compiled_run_is_the_run(scene: Scene, chambers: int, noise: float) -> None:
    disc = replace(scene.disc, chambers=chambers, central_angle=2 * math.pi / max(chambers, 3))
    sensor = replace(scene.sensor, amplitude_noise=noise, phase_noise=noise * 1e6)
    asked = replace(scene, disc=disc, sensor=sensor, run=replace(scene.run, time_limit=15.0))
    model = paper_model(asked)
    compare(prepare_run(asked, model).run(), simulate(asked, model), tolerance=1e-12)
    other = replace(asked, run=replace(asked.run, seed=7))
    compare(prepare_run(asked, model).run(seed=7), simulate(other, model), tolerance=1e-12)


def test_one_with_liquid_that_runs_back_as_well(
    scene: Scene, model: BalancerModel, laws: Mapping[str, Any]
) -> None:
    def levelling(x: Any, y: Any, p: Any, _: Any) -> tuple[Any, Any]:
        return 2.0 * (x - y) + np.where(p > 0, 12.0, 0.0), np.full(x.shape, Regime.SIPHON)

    sensor = replace(scene.sensor, amplitude_noise=2e-8, phase_noise=0.02)
    asked = replace(scene, sensor=sensor, run=replace(scene.run, time_limit=8.0))
    other = replace(model, name="levelling", flow=replace(laws["levelling"], function=levelling))
    compare(prepare_run(asked, other).run(), simulate(asked, other), tolerance=1e-9)
