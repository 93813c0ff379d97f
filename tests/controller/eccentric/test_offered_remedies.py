"""Remedies as changes of the scene that are tried."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from eccentric_runs import bundled

from ringbalance.controller.balancer import Draws, balancer_of
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint
from ringbalance.results.rows import sentences
from ringbalance.scene.origins import value_at, with_values_at
from ringbalance.verification.papers import RPM, at_constant_speed, changed


def test_a_run_that_ends_too_early_advises_more_time() -> None:
    short = bundled("driven_masses_small").with_values({"run.time_limit": "3 s"})
    remedies = balancer_of(short).remedies()
    assert "run.time_limit" in remedies[0].changes
    short.with_values(remedies[0].changes)


def test_masses_too_light_are_made_heavy_enough() -> None:
    """7 g cancel 700 of 926 g mm; the remedy, applied and run on devices that did not size it, settles."""
    light = bundled("driven_masses_small").with_values({"masses.mass": "7 g", "run.time_limit": "12 s"})
    remedies = balancer_of(light).remedies()
    assert {"mass", "guide_radius"} <= {each.code for each in remedies}
    mended = balancer_of(light.with_values(remedies[0].changes))
    assert mended.run({}, Draws.block(1 << 22, 3)).settled.all()


def test_a_residual_below_the_limit_lowers_it() -> None:
    scene = bundled("driven_masses_small").with_values({"run.time_limit": "4 s"})
    required = scene.with_values({"requirement.residual": "0.02 um"})
    limits = [each.changes for each in balancer_of(required).remedies() if each.code == "limit"]
    assert limits == [{"supervisor.limit": 2e-8}]


@pytest.fixture(scope="module")
def paper() -> EccentricScene:
    return at_constant_speed(bundled("eccentric_mass_paper"), time_limit=40.0)


def settling(scene: EccentricScene, count: int, *, within: float = 1e9) -> int:
    """Devices, of `count` that sized nothing, that settle."""
    return int(np.sum(balancer_of(scene).run({}, Draws.block(1 << 22, count)).settling_time <= within))


def test_encoders_that_are_too_noisy_are_offered_with_a_twentieth(paper: EccentricScene) -> None:
    """Half and a quarter of the noise serve none; a limit above the 10.7 mm before balancing is no remedy."""
    noisy = changed(paper, {"sensor.encoder_noise": math.radians(3), "sensor.encoder_rate_noise": 0.5})
    remedies = balancer_of(noisy).remedies()
    factors = [
        each.changes["sensor.encoder_noise"] / math.radians(3) for each in remedies if "encoder" in each.code
    ]
    assert factors == pytest.approx([0.5, 0.25, 0.05])
    served = [settling(changed(noisy, each.changes), 4) for each in remedies if each.code.endswith("encoder")]
    assert served == [0, 0, 4]
    assert "limit" not in {each.code for each in remedies}


def test_the_wait_is_shortened_where_devices_settle_too_late(paper: EccentricScene) -> None:
    late = changed(paper, {"requirement.settling_time": 10.0})
    remedies = [each.changes for each in balancer_of(late).remedies()]
    assert [each["fine_tuning.wait"] for each in remedies] == pytest.approx(
        [factor * paper.fine_tuning.wait for factor in (0.5, 0.25, 0.125)]
    )
    before = settling(late, 16, within=10.0)
    after = settling(with_values_at(late, remedies[2]), 16, within=10.0)
    assert before <= 6
    assert after >= 12
    assert balancer_of(paper).remedies() == ()


def weak(scene: EccentricScene) -> EccentricScene:
    """Heavy masses whose rotor drives them round against their motors."""
    return changed(
        scene,
        {
            "rotor.mass": 49.2,
            "rotor.stiffness": 7027.0,
            "rotor.damping": 101.2,
            "imbalance.mass": 3.19,
            "imbalance.radius": 0.319,
            "masses.mass": 5.66,
            "masses.guide_radius": 0.319,
            "masses.arc_length": 0.064,
            "masses.friction_arm": (0.0105, 0.004),
            "motor.maximum_voltage": 18.5,
            "rotor.speed_profile": (SpeedPoint(time=0.0, speed=12.35),),
            "run.time_limit": 20.0,
        },
    )


def test_more_time_is_not_advised_to_an_unstable_loop(paper: EccentricScene) -> None:
    """Runs with the stated change settle."""
    gain = 3 * RecommendedGains.of(paper).speed.recommended
    shaking = changed(paper, {"friction_filter.speed_gain": gain, "motor.maximum_voltage": 24.0})
    run = simulate_eccentric(shaking)
    assert (run.outcome, run.ended.code) == ("time_limit", "masses_unstable")
    assert run.ended.change == {"friction_filter.speed_gain": pytest.approx(gain / 3)}
    assert simulate_eccentric(with_values_at(shaking, run.ended.change)).settled
    short = changed(shaking, {"run.time_limit": 6.0})
    offered = {path for each in balancer_of(short).remedies() for path in each.changes}
    assert "run.time_limit" not in offered


def test_masses_that_turn_are_named(paper: EccentricScene) -> None:
    run = simulate_eccentric(weak(paper))
    assert (run.outcome, run.ended.code) == ("time_limit", "masses_run_away")
    assert run.run_away > 5


@pytest.mark.heavy
def test_what_is_advised_to_masses_that_turn_settles(paper: EccentricScene) -> None:
    slower = {"rotor.speed_profile": (SpeedPoint(time=0.0, speed=6.0),), "run.time_limit": 60.0}
    stronger = {"motor.maximum_voltage": 74.0, "friction_filter.speed_gain": 20.0, "run.time_limit": 40.0}
    for advised in (slower, stronger):
        assert simulate_eccentric(changed(weak(paper), advised)).settled


def test_a_residue_that_the_speed_magnifies_is_named_as_that() -> None:
    """The filter knows the rotor exactly; the advised change settles."""
    paper = bundled("eccentric_mass_paper")
    slow, *_ = paper.rotor.speed_profile
    slow = replace(slow, speed=34.6 * RPM)
    up = SpeedPoint(time=250.0, speed=230 * RPM)
    low = changed(paper, {"rotor.speed_profile": (slow, replace(slow, time=120.0), up)})
    run = simulate_eccentric(low)
    assert (run.outcome, run.ended.code) == ("rises_again", "masses_rises_by_speed")
    nearer = (replace(slow, speed=100 * RPM), SpeedPoint(time=120.0, speed=100 * RPM), up)
    quieter = {
        f"{table}.{key}": 0.5 * value_at(low, f"{table}.{key}")
        for table in ("sensor", "imbalance_filter")
        for key in ("position_noise", "velocity_noise")
    }
    for advised in ({"rotor.speed_profile": nearer}, quieter):
        assert simulate_eccentric(changed(low, advised)).settled
    loose = {"imbalance_filter.assumed_stiffness": 1.02 * paper.rotor.stiffness, "supervisor.limit": 1e-3}
    trials = changed(paper, {**loose, "supervisor.correction": "trials"})
    run = simulate_eccentric(trials)
    assert (run.outcome, run.ended.code) == ("rises_again", "masses_rises_by_trials")
    advice = sentences()[run.ended.code].change
    assert advice == {"supervisor.correction": "measured"}
    assert simulate_eccentric(with_values_at(trials, advice)).settled
