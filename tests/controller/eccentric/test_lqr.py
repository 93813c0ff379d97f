"""Regulator gains in closed form against scipy's Riccati solver, and their poles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_are

from ringbalance.controller.eccentric_mass.drive_law import lqr_gain
from ringbalance.controller.eccentric_mass.friction_filter import TrackModel
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.sampled_loops import GAIN_MARGIN, RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_scene
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.verification.papers import changed

TRACKS = [TrackModel(0.0112, 0.16, 0.0414), TrackModel(0.5, 0.0, 0.1), TrackModel(0.01, 2.0, 0.03)]
PAPER = TRACKS[0]


def riccati_gain(track: TrackModel, weight: float, inputs: float) -> FloatArray:
    """Eqs. 42 to 49: one mass, Q = q diag(0.1, 0.01), R = 0.1 r."""
    a = np.array([[0.0, 1.0], [0.0, -track.damping / track.inertia]])
    b = np.array([[0.0], [1 / track.inertia]])
    cost, price = weight * np.diag([0.1, 0.01]), np.array([[0.1 * inputs]])
    gain: FloatArray = np.linalg.solve(price, b.T @ solve_continuous_are(a, b, cost, price))[0]
    return gain


@pytest.mark.parametrize("track", TRACKS)
@pytest.mark.parametrize("weight", [0.5, 3.5, 40.0])
def test_gain_is_that_of_the_riccati_equation(track: TrackModel, weight: float) -> None:
    gain = lqr_gain(track, state_weight=weight, input_weight=2.0)
    np.testing.assert_allclose(gain, riccati_gain(track, weight, 2.0), rtol=1e-9)


def test_the_back_emf_printed_without_its_sign_is_another_plant() -> None:
    """Eq. 10 lost its minus signs: a mass that its own motor drives on has another gain."""
    right = lqr_gain(PAPER, state_weight=3.5, input_weight=1.0)
    other = lqr_gain(PAPER._replace(damping=-PAPER.damping), state_weight=3.5, input_weight=1.0)
    assert other[1] > right[1] + 0.3


@pytest.fixture(scope="module", params=["eccentric_mass_paper", "driven_masses_small", "washing_machine"])
def scene(request: pytest.FixtureRequest) -> EccentricScene:
    return eccentric_scene(load_scene(bundled_scene(request.param)))


def test_a_bundled_scene_needs_no_mending(scene: EccentricScene) -> None:
    assert all(loop.stable and loop.gain_margin >= GAIN_MARGIN for loop in RecommendedGains.of(scene).loops)


def held(scene: EccentricScene, position: float, rate: float, *, helped: bool) -> ComplexArray:
    """Sampled poles of two opposite masses with their rotor's inertia, all torques held over a step.

    The drive law adds the load of the rotor under the accelerations it wants when `helped`.
    """
    plant = PlantParameters.of(scene)
    total, lever = plant.inertia + plant.drive_inertia, plant.moment**2 / plant.mass
    mass = np.array([[total - lever, lever], [lever, total - lever]])
    system = np.zeros((6, 6))
    system[:2, 2:4] = np.eye(2)
    system[2:4, 2:4] = -plant.drive_damping * np.linalg.inv(mass)
    system[2:4, 4:] = np.linalg.inv(mass)
    power = expm(system * scene.lqr.step)
    apart = np.array([[0.5, -0.5], [-0.5, 0.5]]) if helped else np.eye(2)
    law = np.hstack([position * apart, rate * np.eye(2)])
    if helped:
        wanted = (law + np.hstack([np.zeros((2, 2)), plant.drive_damping * np.eye(2)])) / total
        law = law + (mass - total * np.eye(2)) @ wanted
    return np.asarray(np.linalg.eigvals(power[:4, :4] - power[:4, 4:] @ law), dtype=np.complex128)


def test_sampled_poles_are_those_of_both_masses_on_their_rotor(scene: EccentricScene) -> None:
    gains, plant = RecommendedGains.of(scene), PlantParameters.of(scene)
    track = TrackModel(plant.inertia + plant.drive_inertia, plant.drive_damping, plant.moment)
    position, rate = lqr_gain(track, state_weight=scene.lqr.state_weight, input_weight=scene.lqr.input_weight)
    both = held(scene, position, rate, helped=False)
    for pole in gains.regulator.poles:
        assert np.min(np.abs(both - pole)) < 1e-9
    keys = scene.friction_filter
    pair, speed = 2 * plant.drive_gain * keys.pair_gain, plant.drive_gain * keys.speed_gain
    both = held(scene, pair, speed, helped=True)
    for pole in gains.pair.poles:
        assert np.min(np.abs(both - pole)) < 1e-9


def test_recommended_gains_leave_their_margin(scene: EccentricScene) -> None:
    gains = RecommendedGains.of(scene)
    speed = changed(scene, {"friction_filter.speed_gain": GAIN_MARGIN * gains.speed.recommended})
    assert RecommendedGains.of(speed).speed.radius == pytest.approx(1.0, abs=1e-9)
    advised = changed(scene, {"lqr.state_weight": gains.regulator.recommended})
    advised = changed(
        advised,
        {
            "friction_filter.speed_gain": gains.speed.recommended,
            "friction_filter.pair_gain": gains.pair.recommended,
        },
    )
    assert all(loop.stable for loop in RecommendedGains.of(advised).loops)
    shorter = changed(scene, {"lqr.step": gains.step})
    assert all(loop.stable for loop in RecommendedGains.of(shorter).loops)


@pytest.mark.parametrize("hold", [1.0, 30.0])
def test_at_its_margin_a_loop_has_a_pole_on_the_unit_circle(scene: EccentricScene, hold: float) -> None:
    """Jury's conditions against eigenvalues; the margin is zero beside another loop that is unstable."""
    longer = changed(scene, {"lqr.step": hold * scene.lqr.step})
    for name, key in (("speed", "speed_gain"), ("pair", "pair_gain")):
        gains = RecommendedGains.of(longer)
        loop = getattr(gains, name)
        if loop.gain_margin == 0:
            assert name == "pair"
            assert not gains.speed.stable
            continue
        for factor, stable in ((1 - 1e-7, True), (1 + 1e-7, False)):
            gain = {f"friction_filter.{key}": factor * loop.gain_margin * loop.value}
            assert getattr(RecommendedGains.of(changed(longer, gain)), name).stable == stable


def test_the_drive_speed_overcomes_friction_and_a_free_mass_needs_none(scene: EccentricScene) -> None:
    gains, plant = RecommendedGains.of(scene), PlantParameters.of(scene)
    gain = min(scene.friction_filter.speed_gain, gains.speed.recommended)
    speed = scene.rotor.speed_profile[0].speed
    friction = max(scene.masses.friction_arm) * plant.moment * speed**2
    assert plant.drive_gain * gain * gains.drive_speed > 1.49 * friction
    free = changed(scene, {"masses.friction_arm": (0.0, 0.0)})
    assert RecommendedGains.of(free).drive_speed == scene.friction_filter.drive_speed
    assert math.isfinite(gains.drive_speed)
