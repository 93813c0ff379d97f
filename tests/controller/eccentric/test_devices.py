"""Devices of a scene with eccentric masses, and which of them meet what is required."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from eccentric_runs import bundled

from ringbalance.controller.balancer import Draws, balancer_of
from ringbalance.controller.eccentric_mass.devices import ASSUMED_AMPLITUDE, PHASE, device
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import locked_run, simulate_eccentric
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.targets import reach_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.judging.tune import tuned
from ringbalance.results.requirements import Proportion
from ringbalance.scene.origins import InputUncertainty
from ringbalance.verification.papers import at_constant_speed, changed


@pytest.fixture(scope="module")
def small() -> EccentricScene:
    return bundled("driven_masses_small")


def stating(scene: EccentricScene, **widths: tuple[float, bool]) -> EccentricScene:
    """Scene with these uncertainties alone, by path with __ for the dot: half-width, and True if relative."""
    stated = (
        InputUncertainty(quantity=path.replace("__", "."), half_width=width, relative=relative)
        for path, (width, relative) in widths.items()
    )
    return replace(scene, uncertainty=tuple(stated))


def test_the_locked_run_is_what_balancing_is_judged_by(paper: EccentricScene) -> None:
    locked, run = locked_run(paper), simulate_eccentric(paper)
    assert locked.outcome.value == "locked"
    assert locked.unbalanced_amplitude == run.unbalanced_amplitude
    assert locked.worst_amplitude > run.worst_amplitude
    assert json.loads(json.dumps(locked.to_dict(), allow_nan=False))["settled"] is False


def test_the_capacity_is_that_of_both_masses_side_by_side(paper: EccentricScene) -> None:
    masses = paper.masses
    side_by_side = math.cos(masses.arc_length / masses.guide_radius / 2)
    assert reach_of(paper) == pytest.approx(2 * masses.mass * masses.guide_radius * side_by_side)


def test_a_loop_at_its_gain_margin_is_at_the_edge(paper: EccentricScene) -> None:
    speed = RecommendedGains.of(paper).speed
    edge = changed(paper, {"friction_filter.speed_gain": speed.value * speed.gain_margin * (1 + 1e-6)})
    beyond = RecommendedGains.of(edge).speed
    assert not beyond.stable
    assert beyond.radius == pytest.approx(1.0, abs=1e-4)


def test_drawn_inputs_have_the_stated_half_widths(paper: EccentricScene) -> None:
    """A block is a Latin hypercube, whose spreads come to those stated within a few per cent."""
    scene = stating(paper, rotor__stiffness=(0.02, True), masses__friction_arm=(0.002, False))
    plants = [device(scene, number).scene for number in range(64)]
    stiffness = np.log([each.rotor.stiffness / paper.rotor.stiffness for each in plants])
    arms = np.log(np.array([each.masses.friction_arm for each in plants]) / paper.masses.friction_arm)
    assert 1.96 * np.std(stiffness) == pytest.approx(math.log1p(0.02), rel=0.05)
    assert 1.96 * np.std(arms[:, 0]) == pytest.approx(0.002 / paper.masses.friction_arm[0], rel=0.05)
    size = np.log([PlantParameters.of(each).unbalance for each in plants])
    assert 1.96 * np.std(size) == pytest.approx(math.log1p(ASSUMED_AMPLITUDE), rel=0.05)
    assert len({each.rotor.damping for each in plants}) == 1


def test_the_direction_of_the_imbalance_is_any_unless_the_scene_restricts_it(paper: EccentricScene) -> None:
    turned = np.array([device(paper, number).scene.imbalance.phase for number in range(64)])
    places = np.sort((turned - paper.imbalance.phase) / (2 * math.pi))
    assert np.all(np.abs(places - (np.arange(64) + 0.5) / 64 + 0.5) <= 0.5 / 64)
    certain = changed(stating(paper, imbalance__mass=(0.0, True)), {"requirement.phase_range": 0.0})
    assert device(certain, 3).scene.imbalance == paper.imbalance
    assert PHASE not in device(certain, 3).inputs


def test_devices_whose_imbalance_is_beyond_reach_do_not_settle(paper: EccentricScene) -> None:
    """Half of the devices have an imbalance beyond the reach; those and no others fail."""
    short = at_constant_speed(paper, time_limit=40.0)
    size = reach_of(short) / short.imbalance.radius
    scene = changed(stating(short, imbalance__mass=(0.5, True)), {"imbalance.mass": size})
    outcomes = balancer_of(scene).run({}, Draws.first(8))
    within = outcomes.unbalance < outcomes.usable_moment
    assert 2 <= np.count_nonzero(within) <= 6
    np.testing.assert_array_equal(outcomes.settled, within)
    assert {code for code, met in zip(outcomes.ended, within, strict=True) if not met} == {"saturated"}


def test_what_is_required_is_judged_over_the_devices(paper: EccentricScene) -> None:
    """A residual that none reaches decides, whatever settles."""
    scene = at_constant_speed(paper, time_limit=40.0)
    demanding = changed(
        scene, {"requirement.residual": 1e-9, "requirement.settling_time": 39.0, "requirement.fraction": 0.8}
    )
    (judgement,) = judged_all(balancer_of(demanding), [{}], first=8, most=8)
    settled, residual = (judgement.fraction_of(each) for each in judgement.demands)
    assert settled.value > 0.5
    assert judgement.fraction == residual == Proportion(count=0, of=8)
    assert (judgement.verdict, judgement.required_fraction) == ("not met", 0.8)


def test_a_device_is_run_as_it_is_with_every_setting(paper: EccentricScene) -> None:
    scene = at_constant_speed(paper, time_limit=3.0)
    balancer, gain = balancer_of(scene), {"friction_filter.speed_gain": 4.0}
    both = balancer.run_all([{}, gain], Draws.block(5, 2))
    for settings, outcomes in zip([{}, gain], both, strict=True):
        alone = balancer.run(settings, Draws(numbers=(6,)))
        assert alone.final_amplitude[0] == outcomes.final_amplitude[1]
        assert alone.inputs[PHASE][0] == outcomes.inputs[PHASE][1]
    assert both[0].final_amplitude[0] != both[1].final_amplitude[0]


def test_tuning_gives_the_drives_their_margins_where_they_lack_them(small: EccentricScene) -> None:
    """A speed control at its edge: the devices are run with it and with half of it."""
    assert "margins of the drives" not in {axis.name for axis in balancer_of(small).trials()[0].axes}
    edge = RecommendedGains.of(small).speed
    scene = changed(small, {"friction_filter.speed_gain": 1.5 * edge.recommended})
    (trials,) = balancer_of(changed(scene, {"run.time_limit": 6.0})).trials()
    own = {axis.name: axis.levels[axis.first[-1]] for axis in trials.axes}
    settings = trials.settings({**own, trials.axes[0].name: 1.0})
    assert settings is not None
    assert settings["friction_filter.speed_gain"] == pytest.approx(edge.recommended)
    assert trials.settings({**own, trials.axes[0].name: 0.0}) == {}


def test_too_few_devices_are_told_after_sixteen(small: EccentricScene) -> None:
    """In one second none settles; the loops stand beside it as information."""
    tuning = tuned(balancer_of(small.with_values({"run.time_limit": 1.0})))
    document = tuning.to_dict()
    assert (document["verdict"], document["fraction"]["of"], document["fraction"]["count"]) == (
        "not met",
        16,
        0,
    )
    assert document["ended"] == {"time_limit": 16}
    assert not tuning.succeeded
    assert {loop["key"] for loop in document["loops"]} == set(document["gain"])
    assert document["longer"] is None
