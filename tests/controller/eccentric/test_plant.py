"""The plant against an independent model in the fixed frame, closed forms, and its own order."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
import pytest
from eccentric_runs import bundled
from plant_runs import driven_of, rest_state, row_of, run_steps, stuck_flags
from scipy.integrate import solve_ivp

from ringbalance.controller.eccentric_mass import plant as machine
from ringbalance.controller.eccentric_mass.plant import (
    LOCKED,
    SLIDING,
    PlantParameters,
    speed_at,
    turned,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray

RPM = math.pi / 30
ANGLES = (0.3, 2.6)


def without_friction(parameters: PlantParameters) -> PlantParameters:
    return parameters._replace(friction_arm=(0.0, 0.0))


def fixed_frame_rates(
    scene: EccentricScene, start: float, rate: float, arms: tuple[float, float]
) -> Callable[[float, FloatArray, FloatArray], FloatArray]:
    """Point masses pushed about in the fixed frame: nothing here knows of a turning frame.

    Each mass m at R + r e(theta + phi) gives m J^T (J a + the part of its acceleration without unknowns),
    J being its Jacobian with respect to (X, Y, phi_1, phi_2).  Friction acts as on masses that move forwards.
    """
    body, mass = scene.rotor, scene.masses
    masses = np.diag([body.mass - scene.imbalance.mass] * 2 + [0.0, 0.0])
    motor = scene.motor
    ratio, drag = 40.0, motor.torque_constant * motor.back_emf_constant / motor.resistance
    reflected = (motor.motor_inertia + motor.gear_inertia / 16) * ratio**2

    def point(
        matrix: FloatArray, force: FloatArray, m: float, r: float, angle: float, column: int, w: float
    ) -> None:
        turning = start_speed(w)
        out = np.array([math.cos(angle), math.sin(angle)])
        tangent = np.array([-out[1], out[0]])
        jacobian = np.zeros((2, 4))
        jacobian[0, 0] = jacobian[1, 1] = 1.0
        if column:
            jacobian[:, column] = r * tangent
        matrix += m * jacobian.T @ jacobian
        force -= m * jacobian.T @ (r * tangent * rate - r * out * turning**2)

    speed = [start]

    def start_speed(w: float) -> float:
        return speed[0] + w

    def rates(time: float, q: FloatArray, voltage: FloatArray) -> FloatArray:
        speed[0] = start + rate * time
        theta = start * time + rate * time**2 / 2
        matrix, force = masses.copy(), np.zeros(4)
        imbalance = scene.imbalance
        point(matrix, force, imbalance.mass, imbalance.radius, theta + imbalance.phase, 0, 0.0)
        for i in range(2):
            w = q[6 + i]
            point(matrix, force, mass.mass, mass.guide_radius, theta + q[2 + i], 2 + i, w)
            matrix[2 + i, 2 + i] += reflected
            friction = arms[i] * mass.mass * mass.guide_radius * (speed[0] + w) ** 2
            torque = motor.torque_constant / motor.resistance * ratio * voltage[i]
            force[2 + i] += torque - drag * ratio**2 * w - friction
        force[:2] -= body.damping * q[4:6] + body.stiffness * q[:2]
        return np.concatenate([q[4:], np.linalg.solve(matrix, force)])

    return rates


@pytest.mark.parametrize(
    ("start", "rate", "arms"),
    [(8.0, 1.5, (0.0, 0.0)), (8.0, 1.5, (0.01, 0.004)), (-3.0, 1.2, (0.0, 0.0)), (20.0, 0.0, (0.002, 0.006))],
    ids=["through critical", "with friction", "through zero", "above critical"],
)
def test_against_the_fixed_frame(
    start: float, rate: float, arms: tuple[float, float], paper: EccentricScene, parameters: PlantParameters
) -> None:
    """Moving masses under a speed ramp, from rest: 1e-9 m after 5 s, where gyroscopic faults would show."""
    step, pieces = 1e-3, 5
    voltages = np.array([[4.0, 3.0], [5.0, 2.5], [2.5, 4.5], [4.0, 4.0], [3.0, 5.0]])
    plant = parameters._replace(friction_arm=(arms[0], arms[1]))
    times, speeds = np.array([0.0, 10.0]), np.array([start, start + 10 * rate])
    commands = np.repeat(voltages, 1000, axis=0)
    states, _ = run_steps(plant, times, speeds, rest_state(ANGLES), stuck_flags(SLIDING), commands, step)
    rates = fixed_frame_rates(paper, start, rate, arms)
    q = np.array([0.0, 0.0, *ANGLES, 0.0, 0.0, 0.0, 0.0])
    largest = 0.0
    for piece in range(pieces):
        solution = solve_ivp(
            rates, (piece, piece + 1), q, method="DOP853", rtol=3e-13, atol=1e-14, args=(voltages[piece],)
        )
        assert np.all(solution.y[6:] >= 0), "the reference's friction is that of masses that move forwards"
        q = solution.y[:, -1]
        theta = start * (piece + 1) + rate * (piece + 1) ** 2 / 2
        state = states[1000 * (piece + 1)]
        seen = complex(state[0], state[1]) * cmath.exp(1j * theta)
        assert abs(seen - complex(q[0], q[1])) < 1e-9
        assert np.abs(state[4:6] - q[2:4]).max() < 1e-9
        largest = max(largest, abs(seen))
    assert largest > 1e-3


@pytest.mark.parametrize("rpm", [20, 60, 100, 125, 180, 400])
def test_steady_whirl(rpm: float, parameters: PlantParameters) -> None:
    """Masses locked at constant speed: after the transient the complex closed form, to 1e-9 of itself."""
    speed = rpm * RPM
    states, _ = run_steps(
        parameters,
        np.array([0.0]),
        np.array([speed]),
        rest_state(ANGLES),
        stuck_flags(LOCKED),
        np.zeros((3000, 2)),
        1e-2,
    )
    expected = parameters.steady_whirl(speed, ANGLES)
    whirl = complex(states[-1, 0], states[-1, 1])
    assert abs(whirl - expected) < 1e-9 * abs(expected)


def test_influence_is_the_textbook_response(parameters: PlantParameters) -> None:
    """U W^2 / sqrt((K - M W^2)^2 + (C W)^2), in phase below the critical speed and opposite far above it."""
    for speed in (1.0, 10.0, 13.66, 30.0, 1e4):
        size = speed**2 / math.hypot(1000 - 5.36 * speed**2, 10 * speed)
        assert abs(parameters.influence(speed)) == pytest.approx(size, rel=1e-12)
    assert cmath.phase(parameters.influence(0.1)) == pytest.approx(-0.001, abs=1e-5)
    assert parameters.influence(1e4) == pytest.approx(-1 / 5.36, rel=1e-3)
    with pytest.raises(ValueError, match="no steady whirl"):
        parameters._replace(damping=0.0, mass=10.0, stiffness=1000.0).influence(10.0)


def test_the_order_is_five(parameters: PlantParameters) -> None:
    """Errors of whole runs without events, in all of the state; coarse, so that no rounding shows."""
    smooth = without_friction(parameters)

    def end(step: float) -> FloatArray:
        count = round(1.0 / step)
        state = rest_state(ANGLES)
        state[6:] = [1.0, -0.5]
        row = row_of(state, stuck_flags(SLIDING), np.array([1.0, -2.0]))
        driven = driven_of(smooth, row, 3.0)
        for i in range(count):
            machine._advance(driven, row, 12.0 + 3.0 * i * step, step)
        return row[:8]

    steps = np.array([1 / 80, 1 / 160, 1 / 320])
    exact = end(1 / 6400)
    errors = np.array([np.abs(end(step) - exact).max() for step in steps])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all(np.abs(orders - 5) < 0.2), orders
    assert errors[-1] < 2e-9


def test_half_the_substep_moves_nothing_that_counts() -> None:
    """On the stiffest bundled rotor, from rest, through breakaway and the rotor's transient."""
    plant, count = PlantParameters.of(bundled("driven_masses_small")), 25
    speed, start = np.array([1047.2]), (rest_state((0.0, math.pi)), stuck_flags(SLIDING))
    parts = machine.substeps(plant, 1047.2, 0.0, 1e-3)

    def end(divided: int) -> FloatArray:
        commands = np.tile([12.0, -9.0], (divided * count, 1))
        states, _ = run_steps(plant, np.zeros(1), speed, *start, commands, 1e-3 / divided)
        return np.asarray(states[-1])

    fine, coarse = end(2 * parts), end(1)
    assert parts > 20
    assert abs(fine[4]) > 0.01
    np.testing.assert_allclose(coarse[4:6], fine[4:6], atol=1e-8)
    assert np.abs(coarse[:2] - fine[:2]).max() < 1e-5 * np.abs(fine[:2]).max()


def test_electrical_energy_is_the_integral_of_power(parameters: PlantParameters) -> None:
    """Sum over steps of V i h, with i from the speed of the motor; and for a held mass V^2 / R."""
    step, count = 1e-4, 5000
    command = np.array([3.0, -2.0])
    free = without_friction(parameters)
    row, total = row_of(rest_state(ANGLES), stuck_flags(SLIDING), command), 0.0
    rates = [row[6:8].copy()]
    for _ in range(count):
        total += machine.plant_step(free, row, 10.0, 0.0, step)
        rates.append(row[6:8].copy())
    power = (command * (command - 0.01 * 40.0 * np.array(rates)) / 1.0).sum(axis=1)
    assert total == pytest.approx(np.sum((power[1:] + power[:-1]) / 2) * step, rel=1e-6)

    def held(plant: PlantParameters) -> float:
        row = row_of(rest_state(ANGLES), stuck_flags(LOCKED), command)
        return machine.plant_step(plant, row, 10.0, 0.0, 2.0)

    assert held(free) == pytest.approx((9 + 4) * 2.0)
    assert held(free._replace(maximum_voltage=1.0)) == pytest.approx(2 * 2.0)


def test_motor_equations_by_shaft_and_gear(parameters: PlantParameters) -> None:
    """A motor alone on a mass of its own: terminal speed V / (n K_m), time constant (J + J_add) / C_add."""
    heavy = without_friction(parameters)._replace(mass=1e9, stiffness=1e12, unbalance=0.0)
    states, _ = run_steps(
        heavy,
        np.array([0.0]),
        np.array([0.0]),
        rest_state((0.0, math.pi)),
        stuck_flags(SLIDING),
        np.tile([2.0, -2.0], (1000, 1)),
        1e-3,
    )
    terminal = 2.0 / (40 * 0.01)
    constant = (0.18 * 0.23**2 + (1e-6 + 1e-6 / 16) * 1600) / (0.01 * 0.01 * 1600)
    time = np.arange(1001) * 1e-3
    np.testing.assert_allclose(states[:, 6], terminal * -np.expm1(-time / constant), rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(states[:, 7], -states[:, 6], rtol=1e-8, atol=1e-9)


def test_speed_profile(paper: EccentricScene) -> None:
    times, speeds = paper.rotor.profile
    low, high = 100 * RPM, 230 * RPM
    assert speed_at(times, speeds, 60.0) == pytest.approx((low, 0.0))
    assert speed_at(times, speeds, 120.0) == pytest.approx((low, RPM))
    assert speed_at(times, speeds, 250.0) == pytest.approx((high, 0.0))
    assert turned(times, speeds, 60.0) == pytest.approx(60 * low)
    assert turned(times, speeds, 250.0) == pytest.approx(120 * low + 130 * (low + high) / 2)
    assert turned(times, speeds, 260.0) == pytest.approx(turned(times, speeds, 250.0) + 10 * high)
    late = np.array([2.0, 4.0]), np.array([3.0, 5.0])
    assert turned(*late, 1.0) == pytest.approx(3.0)
    assert turned(*late, 3.0) == pytest.approx(6.0 + 3.5)
