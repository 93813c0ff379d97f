"""Runs at both ends of the default range of gas lines."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ringbalance.controller.document import line_runs, line_runs_document, line_runs_table
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene


def test_a_line_that_is_not_given_is_run_at_both_ends(scene: Scene, calibrated: BalancerModel) -> None:
    gain = 0.3 * scene.controller.proportional
    asked = replace(
        scene,
        controller=replace(scene.controller, proportional=gain),
        run=replace(scene.run, time_limit=15.0),
    )
    slow, fast = line_runs(simulate(asked, calibrated))
    assert (slow.end, fast.end) == ("slow", "fast")
    assert (slow.conductance, fast.conductance) == pytest.approx((0.2e-8, 1e-8))
    assert (slow.valve_lag, fast.valve_lag) == pytest.approx((10e-3, 5e-3))
    assert set(slow.run.terms_modelled) == {
        "tube inertia",
        "gas filling",
        "valve lag",
        "liquid held in the tube",
    }
    # Late gas moves less in the same valve-open time, and the slow line is later.
    moved = [
        run.injections[0].fill_before - run.injections[0].fill_after
        for run in (slow.run, fast.run, simulate(asked, calibrated))
    ]
    assert 0 < moved[0] < moved[1] < 1.1 * moved[2]
    given = replace(asked, gas=replace(asked.gas, conductance=1e-8, critical_ratio=0.3, valve_lag=5e-3))
    assert line_runs(simulate(given, calibrated)) == ()
    # The fast end is the run of a scene that gives that line.
    assert simulate(given, calibrated).amplitude[-1] == fast.run.amplitude[-1]
    rows = line_runs_document((slow, fast))
    assert [row["final_amplitude_m"] for row in rows] == [slow.run.amplitude[-1], fast.run.amplitude[-1]]
    assert [row[0] for row in line_runs_table((slow, fast)).rows] == ["slow", "fast"]
