"""The friction filter against an accurate integration of the mass's motion, and what the print would do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from eccentric_runs import bundled
from scipy.integrate import solve_ivp

from ringbalance.controller.eccentric_mass.devices import device
from ringbalance.controller.eccentric_mass.friction_filter import (
    FRICTION_FILTER,
    FrictionNoise,
    TrackModel,
    friction_flow,
    friction_restart,
    friction_step,
)
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.supervisor import arm_deviation
from ringbalance.scene.draws import run_noise
from ringbalance.scene.origins import InputUncertainty
from ringbalance.verification.papers import at_constant_speed, changed

TRACK = TrackModel(0.0112, 0.16, 0.0414)
SPEED = 10.47
STEP = 1e-3
NOISE = FrictionNoise(1e-4, 1e-4, 1e-12)
CASES = [(0.5, 0.01, 0.2), (0.3, 0.005, -0.1), (-0.4, 0.01, -0.2), (3.0, 0.0, 0.0)]


def accurate(rate: float, arm: float, torque: float, duration: float) -> float:
    direction = math.copysign(1.0, rate)

    def slope(_: float, w: list[float]) -> list[float]:
        friction = direction * arm * TRACK.moment * (SPEED + w[0]) ** 2
        return [(torque - TRACK.damping * w[0] - friction) / TRACK.inertia]

    return float(solve_ivp(slope, (0, duration), [rate], rtol=1e-11, atol=1e-13).y[0, -1])


@pytest.mark.parametrize(("rate", "arm", "torque"), CASES)
def test_flow_is_the_motion(rate: float, arm: float, torque: float) -> None:
    flow = friction_flow(TRACK, rate, arm, SPEED, torque, STEP, False)
    change = accurate(rate, arm, torque, STEP) - rate
    assert flow[0] - rate == pytest.approx(change, rel=1e-3, abs=1e-9)
    # Of second order: a tenth of the step, a thousandth of the error, down to round-off.
    short = friction_flow(TRACK, rate, arm, SPEED, torque, STEP / 10, False)
    error = abs(short[0] - accurate(rate, arm, torque, STEP / 10))
    assert error <= 2e-3 * abs(flow[0] - accurate(rate, arm, torque, STEP)) + 1e-12


@pytest.mark.parametrize(("rate", "arm", "torque"), CASES)
def test_derivatives_are_the_flows(rate: float, arm: float, torque: float) -> None:
    flow = friction_flow(TRACK, rate, arm, SPEED, torque, STEP, False)
    small = 1e-5
    by_rate = (accurate(rate + small, arm, torque, STEP) - accurate(rate - small, arm, torque, STEP)) / (
        2 * small
    )
    by_arm = (accurate(rate, arm + small, torque, STEP) - accurate(rate, arm - small, torque, STEP)) / (
        2 * small
    )
    assert flow[1] == pytest.approx(by_rate, rel=1e-4)
    assert flow[2] == pytest.approx(by_arm, rel=5e-3)


def drive(*, arm: float, seed: int, steps: int = 2000, stray: bool = False) -> np.void:
    """The estimate of a mass kept near 0.4 rad/s; `stray` puts the arm into d/d mu once more."""
    random = np.random.default_rng(seed)
    rate = 0.4
    estimate: np.void = np.array([(0.4, 0.0, 1e-4, 0.0, 0.02**2)], dtype=FRICTION_FILTER)[0]
    for _ in range(steps):
        torque = 0.8 * (0.5 - rate)
        friction = arm * TRACK.moment * (SPEED + rate) ** 2
        rate += STEP / TRACK.inertia * (torque - TRACK.damping * rate - friction)
        seen = rate + 0.01 * random.standard_normal()
        if stray:
            _printed_step(estimate, seen, torque)
        else:
            friction_step(estimate, TRACK, NOISE, seen, SPEED, torque, STEP, False)
    return estimate


def _printed_step(estimate: np.void, seen: float, torque: float) -> None:
    """One step with the printed f_13 = -dt chi (W + w)^2 sgn(w)/r_b, with chi in excess."""
    rate, arm, p11, p12, p22 = estimate.tolist()
    later, by_rate, _ = friction_flow(TRACK, rate, arm, SPEED, torque, STEP, False)
    by_arm = -STEP * arm * (SPEED + rate) ** 2 / 0.23
    jacobian = np.array([[by_rate, by_arm], [0.0, 1.0]])
    covariance = jacobian @ np.array([[p11, p12], [p12, p22]]) @ jacobian.T
    covariance += np.diag([NOISE.acceleration * STEP, 0.0])
    gain = covariance[:, 0] / (covariance[0, 0] + NOISE.rate_variance)
    state = np.array([later, arm]) + gain * (seen - later)
    covariance = covariance - np.outer(gain, covariance[0])
    estimate["rate"], estimate["arm"] = state
    estimate["rate_variance"], estimate["covariance"], estimate["arm_variance"] = covariance[
        np.triu_indices(2)
    ]


@pytest.mark.parametrize("arm", [0.0, 0.002, 0.01])
def test_the_arm_is_found_within_what_the_filter_claims(arm: float) -> None:
    estimate = drive(arm=arm, seed=1)
    assert abs(estimate["arm"] - arm) < 4 * math.sqrt(estimate["arm_variance"])
    assert math.sqrt(estimate["arm_variance"]) < 2e-4


def test_errors_are_as_large_as_the_covariance_says() -> None:
    nees = [
        (estimate["arm"] - 0.01) ** 2 / estimate["arm_variance"]
        for estimate in (drive(arm=0.01, seed=seed, steps=400) for seed in range(40))
    ]
    # The plant has none of the process noise that the filter allows for, so the mean is at most about one.
    assert 0.1 < np.mean(nees) < 1.9


def test_the_printed_jacobian_never_starts_from_zero() -> None:
    """Chi in d/d mu: an estimate of zero has no sensitivity, no gain, and stays zero."""
    printed = drive(arm=0.01, seed=1, stray=True)
    right = drive(arm=0.01, seed=1)
    assert printed["arm"] == 0.0
    assert right["arm"] == pytest.approx(0.01, rel=0.05)


def test_the_printed_transition_is_not_the_flow() -> None:
    """Eq. 33 multiplies the state with the Jacobian: the drive's torque drops out of the prediction."""
    rate, arm, torque = 0.4, 0.01, 0.1
    flow = friction_flow(TRACK, rate, arm, SPEED, torque, STEP, False)
    linear = flow[1] * rate + flow[2] * arm
    true = accurate(rate, arm, torque, STEP)
    assert abs(flow[0] - true) < 1e-7
    assert abs(linear - true) > 1e-3


def test_a_resting_mass_teaches_nothing() -> None:
    estimate = np.array([(0.3, 0.01, 1e-4, 1e-6, 1e-6)], dtype=FRICTION_FILTER)[0]
    friction_restart(estimate, NOISE, 0.0)
    assert (estimate["arm"], estimate["arm_variance"], estimate["covariance"]) == (0.01, 1e-6, 0.0)


def test_euler_is_close_for_short_steps_and_unstable_for_long_ones() -> None:
    near = friction_flow(TRACK, 0.4, 0.01, SPEED, 0.1, 1e-4, True)
    exact = friction_flow(TRACK, 0.4, 0.01, SPEED, 0.1, 1e-4, False)
    assert near[0] == pytest.approx(exact[0], rel=1e-3)
    assert abs(friction_flow(TRACK, 0.4, 0.01, SPEED, 0.1, 0.2, True)[1]) > 1
    assert abs(friction_flow(TRACK, 0.4, 0.01, SPEED, 0.1, 0.2, False)[1]) < 1


def test_the_printed_jacobian_is_that_of_a_mass_without_a_motor() -> None:
    """f_11 = 1 - dt (gamma + ...)/(m_b r_b^2): with J_add and the back-EMF left out it falls too fast."""
    gamma, inertia, rate, arm = 0.8, 0.009522, 0.4, 0.01
    printed = 1 - STEP * (gamma + 2 * TRACK.moment * arm * (SPEED + rate)) / inertia
    driven = TRACK._replace(damping=TRACK.damping + gamma)
    right = friction_flow(driven, rate, arm, SPEED, gamma * 0.5, STEP, False)[1]
    assert abs(printed - right) > 2e-3
    bare = TrackModel(inertia, gamma, TRACK.moment)
    assert printed == pytest.approx(friction_flow(bare, rate, arm, SPEED, 0.0, STEP, True)[1])


@pytest.mark.parametrize(
    ("name", "time_limit"),
    [pytest.param("eccentric_mass_paper", 8.0, marks=pytest.mark.heavy), ("washing_machine", 5.0)],
)
def test_intervals_of_friction_arms_hold_the_arms_of_built_machines(name: str, time_limit: float) -> None:
    """Constants of motor and masses are in them; noise alone covers a quarter."""
    scene = at_constant_speed(bundled(name), time_limit=time_limit)
    settings, within, alone = StrategySettings.of(scene), [], []
    for number in range(40):
        plant = device(scene, number).scene
        run = simulate_eccentric(plant, seed=run_noise(scene.run.seed, number), settings=settings)
        error = np.abs(run.history["friction_arm"][-1] - plant.masses.friction_arm)
        within += list(error <= run.friction_half_width)
        alone += list(error <= 1.96 * np.sqrt(run.history["friction_variance"][-1]))
    assert 0.90 <= np.mean(within) <= 0.98
    assert np.mean(alone) < 0.5


def test_a_motor_that_is_off_moves_the_arms_by_what_the_drives_take_off_them() -> None:
    """One standard deviation of a torque constant known to 5 %, in the margin of what friction holds."""
    scene = at_constant_speed(bundled("eccentric_mass_paper"), time_limit=8.0)
    stated = InputUncertainty(quantity="motor.torque_constant", half_width=0.05, relative=True)
    doubtful = replace(scene, uncertainty=(stated,))
    plant = changed(scene, {"motor.torque_constant": scene.motor.torque_constant * (1 + 0.05 / 1.96)})
    settings = StrategySettings.of(doubtful)
    same, off = (simulate_eccentric(each, settings=settings) for each in (doubtful, plant))
    moved = np.abs(off.history["friction_arm"][-1] - same.history["friction_arm"][-1])
    doubt = same.memory["friction"]["arm_doubt"]
    np.testing.assert_allclose(moved, doubt, rtol=0.15, atol=2e-5)
    assert doubt.max() > 2e-4
    for mass in range(2):
        noise = same.history["friction_variance"][-1][mass]
        assert arm_deviation(same.memory["friction"], mass) == pytest.approx(
            math.sqrt(noise + doubt[mass] ** 2)
        )
