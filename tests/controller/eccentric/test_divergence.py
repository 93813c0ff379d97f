"""Runs whose sampled loops are unstable end with a status, and runs that would take for ever are refused."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene import SceneError, bundled_scene, load_scene
from ringbalance.verification.eccentric_scenes import changed


@pytest.fixture(scope="module")
def unlimited() -> EccentricScene:
    """The small scene with the weight and gain of a larger machine, and without its voltage limit."""
    scene = load_scene(bundled_scene("driven_masses_small"))
    assert isinstance(scene, EccentricScene)
    return replace(
        scene,
        lqr=replace(scene.lqr, state_weight=3.5),
        friction_filter=replace(scene.friction_filter, speed_gain=2.0),
        motor=replace(scene.motor, maximum_voltage=None),
        run=replace(scene.run, time_limit=4.0),
    )


def test_a_diverging_run_is_a_status_with_finite_numbers(unlimited: EccentricScene) -> None:
    run = simulate_eccentric(unlimited)
    assert run.outcome == "diverged"
    assert not run.settled
    assert run.time[-1] < 4.0
    assert "lower lqr.state_weight from 3.5 to " in run.status
    json.dumps(run.to_dict(), allow_nan=False)
    assert np.all(np.isfinite(run.amplitude))


def test_the_remedy_of_a_diverging_run_is_true(unlimited: EccentricScene) -> None:
    mended = replace(unlimited, run=replace(unlimited.run, time_limit=8.0))
    for key, value in simulate_eccentric(unlimited).remedies[0].change.items():
        table, name = key.split(".")
        mended = changed(mended, table, **{name: value})
    assert all(loop.stable for loop in RecommendedGains.of(mended).loops)
    assert simulate_eccentric(mended).settled


def test_sampled_poles_of_the_small_scene(unlimited: EccentricScene) -> None:
    assert RecommendedGains.of(unlimited).speed.radius == pytest.approx(1.34, abs=0.01)
    gain = RecommendedGains.of(unlimited).speed.recommended
    half = replace(unlimited, friction_filter=replace(unlimited.friction_filter, speed_gain=2 * gain))
    assert RecommendedGains.of(half).speed.radius == pytest.approx(1.0)


def test_a_plant_too_stiff_is_refused_with_key_and_limit(unlimited: EccentricScene) -> None:
    stiff = replace(unlimited, rotor=replace(unlimited.rotor, stiffness=1.26e12))
    long = replace(stiff, run=replace(stiff.run, time_limit=30.0))
    with pytest.raises(SceneError, match=r"\[rotor\] stiffness = .* allowed: at most .* N/m"):
        simulate_eccentric(long)


def test_a_run_of_too_many_samples_is_refused(unlimited: EccentricScene) -> None:
    long = replace(unlimited, run=replace(unlimited.run, time_limit=1e6))
    with pytest.raises(SceneError, match="time_limit"):
        simulate_eccentric(long)
