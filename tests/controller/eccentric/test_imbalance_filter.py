"""The imbalance filter against matrix exponentials, batch least squares and its own claims of accuracy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad_vec, solve_ivp
from scipy.linalg import expm

from ringbalance.controller.eccentric_mass.imbalance_filter import (
    IMBALANCE_FILTER,
    PLATEAU_FRACTION,
    FilterConstants,
    FilterSettings,
    MassInput,
    WhirlModel,
    begin_filter,
    correct,
    imbalance_deviation,
    imbalance_filter,
    imbalance_history,
    locked_masses,
    mass_vector,
    plateau_at,
    predict,
    whirl_transition,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint
from ringbalance.controller.eccentric_mass.settings import StrategySettings, filter_settings
from ringbalance.scene.arrays import FloatArray, Record

MODEL = WhirlModel(5.36, 10.0, 1000.0)
SPEED = 100 * math.pi / 30
STEP = 1e-3
SETTINGS = FilterSettings(
    model=MODEL,
    acceleration_noise=1e-6,
    imbalance_noise=1e-10,
    start=(0.02, 0.2, 0.08),
    step=STEP,
    laboratory=False,
    euler=False,
)
QUIET = SETTINGS._replace(acceleration_noise=0.0, imbalance_noise=0.0)
VARIANCE = np.array([1e-8, 1e-8, 1e-6, 1e-6])
TRUE = np.array([0.03, -0.02])
MODELS = [MODEL, WhirlModel(26.2, 180.0, 12e3), WhirlModel(2.0, 400.0, 50.0), WhirlModel(1.0, 20.0, 100.0)]


def whirl_generator(*, model: WhirlModel, angular_velocity: float) -> FloatArray:
    """A of X' = A X, Eq. 13 of the paper on eccentric masses, with Eq. 12's damping matrix off its
    diagonal.
    """
    mass, damping, stiffness = model
    w = angular_velocity
    spring, cross = w * w - stiffness / mass, damping * w / mass
    generator = np.zeros((6, 6))
    generator[0, 2] = generator[1, 3] = 1.0
    generator[2] = [spring, cross, -damping / mass, 2 * w, w * w / mass, 0.0]
    generator[3] = [-cross, spring, -2 * w, -damping / mass, 0.0, w * w / mass]
    return generator


def dynamic_stiffness(*, model: WhirlModel, angular_velocity: float) -> complex:
    w = angular_velocity
    return complex(model.stiffness - model.mass * w**2, model.damping * w)


def constants_of(settings: FilterSettings = SETTINGS, speed: float = SPEED) -> FilterConstants:
    return imbalance_filter(settings, speeds=speed)


def begun(constants: FilterConstants) -> Record:
    """Estimate before its first sample."""
    estimate = np.zeros(1, dtype=IMBALANCE_FILTER)[0]
    begin_filter(estimate, constants)
    return estimate


def record(
    *, steps: int, seed: int, settings: FilterSettings, prior: bool = False
) -> tuple[FloatArray, FloatArray]:
    """States and samples drawn from the filter's own model; from its prior when asked."""
    random, constants = np.random.default_rng(seed), constants_of(settings)
    state = np.concatenate([np.zeros(4), TRUE])
    if prior:
        state = random.multivariate_normal(np.zeros(6), begun(constants)["covariance"])
    states, samples = np.zeros((steps, 6)), np.zeros((steps, 4))
    for i in range(steps):
        noisy = settings.acceleration_noise > 0
        push = random.multivariate_normal(np.zeros(6), constants.process[0]) if noisy else 0.0
        state = constants.transition[0] @ state + push
        states[i] = state
        samples[i] = constants.observation[0] @ state + np.sqrt(VARIANCE) * random.standard_normal(4)
    return states, samples


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("speed", [0.0, 3.0, SPEED, 24.1, -7.0])
@pytest.mark.parametrize("step", [1e-4, 1e-3, 0.03])
def test_transition_is_the_matrix_exponential(model: WhirlModel, speed: float, step: float) -> None:
    generator = whirl_generator(model=model, angular_velocity=speed)
    expected = expm(generator * step)
    np.testing.assert_allclose(whirl_transition(model, speed, step), expected, rtol=0, atol=1e-12)
    euler = constants_of(SETTINGS._replace(model=model, step=step, euler=True), speed)
    np.testing.assert_allclose(euler.transition[0], np.eye(6) + generator * step, atol=1e-15)


def test_generator_is_the_whirls_equation() -> None:
    """In the fixed frame a free whirl is a plain oscillator: roots s of M s^2 + C s + K, seen at s - j W."""
    roots = np.roots([MODEL.mass, MODEL.damping, MODEL.stiffness]) - 1j * SPEED
    eigenvalues = np.linalg.eigvals(whirl_generator(model=MODEL, angular_velocity=SPEED)[:4, :4])
    for value in (*roots, *roots.conj()):
        assert np.min(np.abs(eigenvalues - value)) < 1e-10
    steady = SPEED**2 * complex(*TRUE) / dynamic_stiffness(model=MODEL, angular_velocity=SPEED)
    state = np.array([steady.real, steady.imag, 0, 0, *TRUE])
    np.testing.assert_allclose(whirl_transition(MODEL, SPEED, 0.7) @ state, state, atol=1e-14)


STIFF = WhirlModel(1.0, 4000.0, 9e4)
"""Its fastest rate decays by a factor exp(-40) within 0.01 s."""


@pytest.mark.parametrize("model", [*MODELS, STIFF])
@pytest.mark.parametrize("speed", [0.0, SPEED, -7.0])
@pytest.mark.parametrize("step", [1e-3, 0.01, 0.1])
def test_process_covariance_is_the_integral(model: WhirlModel, speed: float, step: float) -> None:
    """Integral of E(s) S E(s)^T by quadrature; each element to 1e-12 of its pair's deviations."""
    generator = whirl_generator(model=model, angular_velocity=speed)
    power = np.diag([0, 0, 1e-3, 1e-3, 1e-8, 1e-8])

    def grown(time: float) -> FloatArray:
        transition = expm(generator * time)
        return np.asarray(transition @ power @ transition.T)

    expected, _ = quad_vec(grown, 0.0, step, epsabs=0.0, epsrel=1e-14, limit=2000, norm="max")
    settings = SETTINGS._replace(model=model, acceleration_noise=1e-3, imbalance_noise=1e-8, step=step)
    process, deviation = constants_of(settings, speed).process[0], np.sqrt(np.diag(expected))
    scale = np.outer(deviation, deviation)
    np.testing.assert_allclose(process / scale, expected / scale, rtol=0, atol=1e-12)
    assert np.array_equal(process, process.T)
    assert np.min(np.linalg.eigvalsh(process / scale)) > -1e-15


@pytest.mark.parametrize("model", [*MODELS, STIFF])
@pytest.mark.parametrize("step", [1e-4, 0.01, 0.3])
def test_two_steps_are_one_step_of_twice_the_length(model: WhirlModel, step: float) -> None:
    """F(2 h) = F(h)^2 and Q(2 h) = F(h) Q(h) F(h)^T + Q(h)."""
    short, long = (constants_of(SETTINGS._replace(model=model, step=each)) for each in (step, 2 * step))
    transition, process = short.transition[0], short.process[0]
    scale = np.sqrt(np.diag(long.process[0]))
    np.testing.assert_allclose(long.transition[0], transition @ transition, rtol=0, atol=1e-12)
    doubled = (transition @ process @ transition.T + process - long.process[0]) / np.outer(scale, scale)
    np.testing.assert_allclose(doubled, 0.0, rtol=0, atol=1e-12)


def test_every_plateau_has_its_own_matrices(scene: EccentricScene) -> None:
    """A scene that keeps 60, 90 and 800 rpm; 300 rpm is a corner of two ramps, and gets none."""
    rpm = math.pi / 30
    corners = [(5.0, 60.0), (10.0, 90.0), (20.0, 90.0), (30.0, 300.0), (40.0, 800.0)]
    profile = tuple(SpeedPoint(time=time, speed=speed * rpm) for time, speed in corners)
    kept = replace(scene, rotor=replace(scene.rotor, speed_profile=profile))
    constants = StrategySettings.of(kept).filter
    np.testing.assert_allclose(constants.speed, [60 * rpm, 90 * rpm, 800 * rpm])
    settings = filter_settings(kept)
    for i, speed in enumerate(constants.speed):
        alone = constants_of(settings, float(speed))
        for name in ("transition", "process", "observation"):
            np.testing.assert_array_equal(getattr(constants, name)[i], getattr(alone, name)[0])
        np.testing.assert_allclose(
            constants.transition[i],
            expm(whirl_generator(model=settings.model, angular_velocity=speed) * settings.step),
            rtol=0,
            atol=1e-12,
        )
    near = 1 + 0.99 * PLATEAU_FRACTION
    assert [plateau_at(constants, near * speed) for speed in constants.speed] == [0, 1, 2]
    assert [plateau_at(constants, speed / near) for speed in constants.speed] == [0, 1, 2]
    far = 1 + 1.01 * PLATEAU_FRACTION
    assert [plateau_at(constants, far * speed) for speed in constants.speed] == [-1, -1, -1]
    assert plateau_at(constants, -float(constants.speed[0])) == -1
    assert plateau_at(constants_of(settings, 0.0), 0.0) == 0


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("speed", [0.0, 5.0, SPEED, 40.0])
def test_eulers_step_limit_is_where_its_eigenvalues_leave_the_unit_circle(
    model: WhirlModel, speed: float
) -> None:
    limit = float(model.euler_step_limit(angular_velocity=speed))
    for share, grows in ((0.999, False), (1.001, True)):
        euler = constants_of(SETTINGS._replace(model=model, step=share * limit, euler=True), speed)
        radius = max(abs(np.linalg.eigvals(euler.transition[0, :4, :4])))
        assert (radius > 1) == grows


def test_covariance_history_is_the_information_filters() -> None:
    """Sums of inverses in place of gains: another arithmetic for the same numbers."""
    constants = constants_of()
    _, samples = record(steps=60, seed=1, settings=SETTINGS)
    states, covariances = imbalance_history(constants, samples=samples, variance=VARIANCE)
    transition, observation = constants.transition[0], constants.observation[0]
    state, covariance = begun(constants)["state"], begun(constants)["covariance"]
    for i in range(60):
        state = transition @ state
        covariance = transition @ covariance @ transition.T + constants.process[0]
        information = np.linalg.inv(covariance)
        seen = information + observation.T @ (observation / VARIANCE[:, None])
        covariance = np.linalg.inv(seen)
        state = covariance @ (information @ state + observation.T @ (samples[i] / VARIANCE))
        np.testing.assert_allclose(covariances[i], covariance, rtol=1e-6, atol=1e-14)
        np.testing.assert_allclose(states[i], state, rtol=1e-6, atol=1e-9)


def test_last_estimate_is_the_batch_least_squares_solution() -> None:
    """Without process noise all samples hang on the first state: one weighted least-squares problem."""
    constants = constants_of(QUIET)
    _, samples = record(steps=300, seed=2, settings=QUIET)
    states, covariances = imbalance_history(constants, samples=samples, variance=VARIANCE)
    transition, observation = constants.transition[0], constants.observation[0]
    rows, power = [np.diag(1 / np.sqrt(np.diag(begun(constants)["covariance"])))], np.eye(6)
    sides = [np.zeros(6)]
    for sample in samples:
        power = transition @ power
        rows.append(observation @ power / np.sqrt(VARIANCE)[:, None])
        sides.append(sample / np.sqrt(VARIANCE))
    weighted = np.vstack(rows)
    first = np.linalg.lstsq(weighted, np.concatenate(sides), rcond=None)[0]
    np.testing.assert_allclose(states[-1], power @ first, rtol=1e-8, atol=1e-11)
    spread = power @ np.linalg.inv(weighted.T @ weighted) @ power.T
    np.testing.assert_allclose(covariances[-1], spread, rtol=1e-7, atol=1e-16)


@pytest.mark.parametrize("laboratory", [False, True])
def test_errors_are_as_large_as_the_covariance_says(laboratory: bool) -> None:
    """The mean of e^T P^-1 e over runs drawn from the prior is the number of states, 6."""
    runs, nees, settings = 60, [], SETTINGS._replace(laboratory=laboratory)
    for seed in range(runs):
        states, samples = record(steps=150, seed=seed, settings=settings, prior=True)
        estimates, covariances = imbalance_history(constants_of(settings), samples=samples, variance=VARIANCE)
        error = states[-1] - estimates[-1]
        nees.append(error @ np.linalg.solve(covariances[-1], error))
    # Chi-squared of 6 degrees of freedom: standard deviation sqrt(12/60) of the mean; 4 of them.
    assert np.mean(nees) == pytest.approx(6.0, abs=4 * math.sqrt(12 / runs))


def test_josephs_form_stays_symmetric_and_positive() -> None:
    constants = constants_of(QUIET)
    estimate = begun(constants)
    for _ in range(200):
        predict(constants, estimate, locked_masses(0.0j))
        correct(constants, estimate, np.zeros(4), np.full(4, 1e-14))
        covariance = estimate["covariance"]
        assert np.array_equal(covariance, covariance.T)
        assert np.min(np.linalg.eigvalsh(covariance)) >= 0


def test_both_frames_know_the_imbalance() -> None:
    states, _ = record(steps=4000, seed=3, settings=QUIET)
    random = np.random.default_rng(4)
    noise = np.sqrt(VARIANCE) * random.standard_normal((4000, 4))
    z, v = states[:, 0] + 1j * states[:, 1], states[:, 2] + 1j * states[:, 3]
    seen = v + 1j * SPEED * z
    outside = np.column_stack([z.real, z.imag, seen.real, seen.imag])
    for laboratory, samples in ((False, states[:, :4] + noise), (True, outside + noise)):
        constants = constants_of(SETTINGS._replace(laboratory=laboratory))
        estimates, covariances = imbalance_history(constants, samples=samples, variance=VARIANCE)
        error = np.hypot(*(estimates[-1, 4:] - TRUE))
        assert error < 4 * imbalance_deviation(covariances[-1])
        assert error < 2e-3 * np.hypot(*TRUE)


def test_masses_that_are_not_opposite_are_taken_out() -> None:
    vector, _ = mass_vector(0.0414, (0.2, 2.9), (0.0, 0.0))
    masses, constants = np.array([vector.real, vector.imag]), constants_of(QUIET)
    state, samples = np.concatenate([np.zeros(4), TRUE + masses]), []
    for _ in range(3000):
        state = constants.transition[0] @ state
        samples.append(state[:4].copy())
    for assumed, expected in ((vector, TRUE), (0.0j, TRUE + masses)):
        estimates, _ = imbalance_history(
            constants, samples=np.array(samples), variance=VARIANCE, masses=locked_masses(assumed)
        )
        np.testing.assert_allclose(estimates[-1, 4:], expected, rtol=1e-3)


def test_moving_masses_are_taken_out() -> None:
    """Against the rotor in the fixed frame, driven by the acceleration of all that turns out of balance."""
    moment, theta = 0.0414, complex(*TRUE)

    def angles(time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        angle = (0.3 + 0.2 * math.sin(3 * time), 3.0 - 0.4 * time)
        return angle, (0.6 * math.cos(3 * time), -0.4)

    def slope(time: float, q: np.ndarray) -> list[complex]:
        angle, rate = angles(time)
        force = SPEED**2 * theta * np.exp(1j * SPEED * time)
        for i, angular in enumerate((-1.8 * math.sin(3 * time), 0.0)):
            force += moment * ((SPEED + rate[i]) ** 2 - 1j * angular) * np.exp(1j * (SPEED * time + angle[i]))
        return [q[1], (force - MODEL.damping * q[1] - MODEL.stiffness * q[0]) / MODEL.mass]

    time = STEP * np.arange(3001)
    run = solve_ivp(slope, (0, 3), [0j, 0j], t_eval=time, rtol=1e-10, atol=1e-13, method="DOP853")
    back = np.exp(-1j * SPEED * time)
    z, v = run.y[0] * back, (run.y[1] - 1j * SPEED * run.y[0]) * back
    constants = constants_of(QUIET)
    estimate = begun(constants)
    before = mass_vector(moment, *angles(0.0))
    for i in range(1, time.size):
        now = mass_vector(moment, *angles(float(time[i])))
        p, pace = 0.5 * (before[0] + now[0]), 0.5 * (before[1] + now[1])
        damped = MODEL.damping / (MODEL.mass * SPEED**2)
        masses = MassInput(p + damped * pace, pace * STEP / MODEL.mass, (0.0, 0.0, 0.0), 0.0)
        seen = v[i] + now[1] / MODEL.mass
        sample = np.array([z[i].real, z[i].imag, seen.real, seen.imag])
        predict(constants, estimate, masses)
        correct(constants, estimate, sample, 1e-4 * VARIANCE)
        before = now
    # Of second order in the step: (3 rad/s * 1 ms)^2 of 0.04 kg m at most.
    np.testing.assert_allclose(estimate["state"][4:], TRUE, atol=4e-7)


def test_a_resting_rotor_is_refused() -> None:
    with pytest.raises(ValueError, match="at rest"):
        imbalance_history(constants_of(speed=0.0), samples=np.zeros((5, 4)), variance=VARIANCE)


def test_a_sample_that_is_not_a_number_is_passed_over() -> None:
    constants = constants_of()
    estimate = begun(constants)
    predict(constants, estimate, locked_masses(0.0j))
    before = estimate.copy()
    assert correct(constants, estimate, np.full(4, np.nan), VARIANCE) == 0.0
    np.testing.assert_array_equal(estimate["state"], before["state"])
    np.testing.assert_array_equal(estimate["covariance"], before["covariance"])


def test_the_printed_observation_lets_the_imbalance_into_the_velocity() -> None:
    """Its last row is 0 0 0 1 1 1: the filter then blames the imbalance for what y' shows."""
    _, samples = record(steps=4000, seed=5, settings=QUIET)
    right, printed = constants_of(), constants_of()
    printed.observation[0, 3, 4:] = 1.0
    for constants, good in ((right, True), (printed, False)):
        estimates, _ = imbalance_history(constants, samples=samples, variance=VARIANCE)
        error = np.hypot(*(estimates[-1, 4:] - TRUE)) / np.hypot(*TRUE)
        assert (error < 0.01) == good


def test_the_printed_process_noise_is_no_covariance() -> None:
    """diag(O randn) with normal numbers is negative half of the time, and takes the covariance along."""
    random, constants, lowest = np.random.default_rng(0), constants_of(), 0.0
    estimate = begun(constants)
    for _ in range(200):
        constants.process[0] = np.diag(1e-6 * random.standard_normal(6))
        predict(constants, estimate, locked_masses(0.0j))
        correct(constants, estimate, np.zeros(4), VARIANCE)
        covariance = estimate["covariance"]
        lowest = min(lowest, float(np.min(np.linalg.eigvalsh(covariance))))
        if not np.all(np.isfinite(covariance)):
            break
    assert lowest < -1e-8
