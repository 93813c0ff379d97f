"""Ensembles with inertia and a gas line, member by member against `simulate`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ringbalance.controller.ensemble import simulate_members
from ringbalance.controller.loop import simulate
from ringbalance.controller.members import Members, MemberUncertainty
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty

AGREEMENT = 1e-6
"""In fill: what `RELATIVE_ERROR` in each step leaves of an injection; the loop corrects what came before."""


def reach(scene: Scene, model: BalancerModel) -> float:
    """Vibration, m, of two pairs that are both off by that."""
    moment = model.moment.pair_moment(fill_ratio=0.25 + AGREEMENT, opposite_fill_ratio=0.25 - AGREEMENT)
    return 2 * scene.rotor.influence_coefficient * abs(float(moment))


@pytest.mark.parametrize("gain", [0.02e6, 0.05e6])
@pytest.mark.parametrize("line", [True, False])
def test_a_member_with_moving_liquid_is_the_interpreted_run(
    scene: Scene, calibrated: BalancerModel, gain: float, line: bool
) -> None:
    """Inertia, and with a gas line filling, venting and lag, with the gain of a calm and of a rough loop."""
    piped = replace(scene.gas, conductance=1e-8, critical_ratio=0.3, valve_lag=0.005)
    asked = replace(
        scene,
        gas=piped if line else scene.gas,
        controller=replace(scene.controller, proportional=gain),
        run=replace(scene.run, time_limit=8.0),
    )
    run = simulate(asked, calibrated)
    expected = {"tube inertia", "liquid held in the tube"} | ({"gas filling", "valve lag"} if line else set())
    assert set(run.terms_modelled) == expected
    found = simulate_members(asked, calibrated)
    assert found.final_amplitude[0] == pytest.approx(run.amplitude[-1], abs=reach(scene, calibrated))
    assert found.samples[0] == len(run.samples)
    assert (found.overshoots[0], found.shortened[0]) == (run.overshoots, run.shortened)
    assert bool(found.settled[0]) == run.settled
    if run.settling_time is not None:
        assert found.settling_time[0] == pytest.approx(run.settling_time, abs=1e-5)


def piped(scene: Scene, offset: float) -> Scene:
    """A gas line whose dead time the controller makes up for, with an exact sensor."""
    return replace(
        scene,
        gas=replace(scene.gas, conductance=1e-8, critical_ratio=0.3, dead_volume=1e-6, valve_lag=0.005),
        controller=replace(scene.controller, proportional=0.02e6, gas_time_offset=(offset,)),
        run=replace(scene.run, time_limit=6.0),
    )


def test_a_members_own_gas_line_moves_the_plant_and_not_what_the_controller_knows(
    scene: Scene, calibrated: BalancerModel
) -> None:
    """A slower and a faster line, each as a scene of its own with the nominal offset."""
    asked = piped(scene, 0.02)
    factors = np.array([[1.0, 0.7, 1.3], [1.0, 1.2, 0.9], [1.0, 2.0, 0.5], [1.0, 1.6, 0.8]])
    members = replace(Members.alike(asked, size=3), gas_line=factors)
    found = simulate_members(asked, calibrated, members=members)
    amplitude = found.final_amplitude
    assert abs(amplitude[1] - amplitude[0]) > 0.05e-6
    for number in range(3):
        run = simulate(replace(asked, gas=members.gas_of(asked.gas, number)), calibrated)
        assert amplitude[number] == pytest.approx(run.amplitude[-1], abs=reach(scene, calibrated))
        assert found.samples[number] == len(run.samples)
    # Had the controller known of the slow line it would have added more, and the run would end elsewhere.
    told = simulate(replace(piped(scene, 0.03), gas=members.gas_of(asked.gas, 1)), calibrated)
    assert abs(told.amplitude[-1] - amplitude[1]) > 0.05e-6


def test_a_stated_uncertainty_of_the_gas_line_is_drawn(scene: Scene, model: BalancerModel) -> None:
    def own(quantity: str, half_width: float, relative: bool) -> InputUncertainty:
        return InputUncertainty(quantity=quantity, half_width=half_width, relative=relative)

    asked = replace(
        piped(scene, 0.02), uncertainty=(own("conductance", 0.2, True), own("valve_lag", 0.001, False))
    )
    width = MemberUncertainty.of(asked, model)
    assert width.gas_line == pytest.approx({"conductance": 0.2, "valve_lag": 0.2})
    line = Members.drawn(asked, uncertainty_95=width, seed=0, block=0).gas_line
    assert line is not None
    for row, factor in zip(line, (1.2, 1.0, 1.0, 1.2), strict=True):
        assert np.mean((row >= 1 / factor) & (row <= factor)) == pytest.approx(
            0.95 if factor > 1 else 1.0, abs=0.01
        )
    # What was drawn before is drawn as before.
    alone = replace(asked, uncertainty=())
    plain = Members.drawn(alone, uncertainty_95=replace(width, gas_line={}), seed=0, block=0)
    again = Members.drawn(asked, uncertainty_95=width, seed=0, block=0)
    assert plain.gas_line is None
    assert np.array_equal(plain.velocity_factor, again.velocity_factor)


def test_a_lag_delays_a_member(scene: Scene, model: BalancerModel) -> None:
    prompt = replace(scene, run=replace(scene.run, time_limit=20.0))
    late = replace(prompt, gas=replace(scene.gas, valve_lag=0.05))
    times = [simulate_members(asked, model).settling_time[0] for asked in (prompt, late)]
    assert times[1] - times[0] == pytest.approx(0.05, abs=2e-3)
