"""Dry friction that sticks and slips: sliding, stopping, breaking away, and holding against the whirl."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_runs import driven_of, plant_step, rest_state, row_of, run_steps, stuck_flags
from scipy.integrate import solve_ivp

from ringbalance.controller.eccentric_mass import plant as machine
from ringbalance.controller.eccentric_mass.plant import LOCKED, SLIDING, STUCK, PlantParameters
from ringbalance.scene.arrays import FloatArray

RPM = math.pi / 30
OFF = np.zeros(2)


@pytest.fixture(scope="module")
def fixed_rotor(parameters: PlantParameters) -> PlantParameters:
    """A rotor too heavy and stiff to move, without imbalance, motors without back-emf."""
    return parameters._replace(mass=1e9, stiffness=1e12, unbalance=0.0, drive_damping=0.0)


def at_rest_on(parameters: PlantParameters, speed: float, angles: tuple[float, float]) -> FloatArray:
    """The state of a steady whirl."""
    whirl = parameters.steady_whirl(speed, angles)
    state = rest_state(angles)
    state[:2] = whirl.real, whirl.imag
    return state


def steps(
    parameters: PlantParameters, state: FloatArray, speed: float, commands: FloatArray, step: float = 1e-3
) -> tuple[FloatArray, FloatArray]:
    return run_steps(
        parameters, np.array([0.0]), np.array([speed]), state, stuck_flags(SLIDING), commands, step
    )


def test_a_sliding_mass_decays_as_the_exact_solution(fixed_rotor: PlantParameters) -> None:
    """(J + J_add) v' = -mu b v^2 with v = W + phi': v = v_0 / (1 + mu b v_0 t / (J + J_add)), until v = W."""
    speed, start = 5.0, 3.0
    state = rest_state((0.0, math.pi))
    state[6:] = start
    arm, inertia = 0.01, fixed_rotor.inertia + fixed_rotor.drive_inertia
    gain = arm * fixed_rotor.moment / inertia
    stop = (speed + start - speed) / (gain * (speed + start) * speed)
    states, stuck = steps(fixed_rotor, state, speed, np.zeros((4000, 2)))
    time = np.arange(4001) * 1e-3
    first = speed + start
    moving = time < stop
    assert 0.5 < stop < 3.9
    expected = first / (1 + gain * first * time[moving]) - speed
    np.testing.assert_allclose(states[moving, 6], expected, rtol=1e-9, atol=1e-10)
    angle = np.log1p(gain * first * stop) / gain - speed * stop
    np.testing.assert_allclose(states[-1, 4], angle, rtol=1e-10)
    assert np.all(states[~moving, 6:] == 0.0)
    assert np.all(stuck[np.flatnonzero(~moving)[1:]] == STUCK)
    assert np.all(stuck[1 : moving.sum() - 1] == SLIDING)


def test_break_away_at_the_torque_and_not_before(fixed_rotor: PlantParameters) -> None:
    """Held up to mu b W^2 = B_add V; a tenth of a percent more and it slides, with the excess alone."""
    speed = 10.0
    most = 0.01 * fixed_rotor.moment * speed**2 / fixed_rotor.drive_gain
    for share, sign in product((0.5, 0.999, 1.001, 1.5), (1.0, -1.0)):
        command = np.array([sign * share * most, 0.0])
        state, stuck = plant_step(
            fixed_rotor, rest_state((0.0, 2.0)), stuck_flags(STUCK), command, speed, 0.0, 1e-3
        )
        assert stuck[1] == STUCK
        assert (stuck[0] == SLIDING) == (share > 1)
        if share < 1:
            assert state[6] == 0.0
        else:
            excess = sign * (share - 1) * most * fixed_rotor.drive_gain
            inertia = fixed_rotor.inertia + fixed_rotor.drive_inertia
            assert state[6] == pytest.approx(excess / inertia * 1e-3, rel=1e-3)


def test_the_run_up_itself_breaks_a_mass_loose(fixed_rotor: PlantParameters) -> None:
    """J W' > mu b W^2 leaves the mass behind; as the speed grows friction catches it up and holds it."""
    rate, arm = 2.0, 0.01
    state, stuck = rest_state((0.0, 2.0)), stuck_flags(STUCK)
    threshold = math.sqrt(fixed_rotor.inertia * rate / (arm * fixed_rotor.moment))
    below, held = plant_step(fixed_rotor, state, stuck, OFF, 0.9 * threshold, rate, 1e-3)
    above, stays = plant_step(fixed_rotor, state, stuck, OFF, 1.001 * threshold, rate, 1e-3)
    assert below[6] < 0
    assert held[0] == SLIDING
    assert above[6] == 0
    assert stays[0] == STUCK
    # Break-away within a step, when the rotor slows down: the time is that of |W'| J = mu b W^2.
    slowing, _ = plant_step(fixed_rotor, state, stuck, OFF, threshold * 1.01, -rate, 0.02 * threshold / rate)
    left = 0.01 * threshold / rate
    inertia = fixed_rotor.inertia + fixed_rotor.drive_inertia
    gathered = 2 * arm * fixed_rotor.moment * threshold * rate * left**2 / 2 / inertia
    assert slowing[6] == pytest.approx(gathered, rel=0.05)


def test_a_mass_reverses_without_resting_when_the_drive_is_strong(fixed_rotor: PlantParameters) -> None:
    """Past zero speed the friction changes sign at once; accelerations are constant while W is large."""
    speed = 100.0
    light = fixed_rotor._replace(friction_arm=(1e-6, 1e-6))
    friction = 1e-6 * light.moment * speed**2
    inertia = light.inertia + light.drive_inertia
    voltage = -5 * friction / light.drive_gain
    state = rest_state((0.0, 2.0))
    state[6] = 6 * friction / inertia * 5e-3
    states, stuck = steps(light, state, speed, np.tile([voltage, 0.0], (10, 1)))
    # Stops after 5 ms at -6 friction / inertia, then goes back at -4 friction / inertia for 5 ms.
    assert states[-1, 6] == pytest.approx(-4 * friction / inertia * 5e-3, rel=1e-4)
    assert np.all(stuck[1:, 0] == SLIDING)


@pytest.mark.parametrize("share", [0.98, 1.02])
@pytest.mark.parametrize("rpm", [60, 100, 200])
def test_self_holding_against_the_whirl(share: float, rpm: float, parameters: PlantParameters) -> None:
    """Drive off: friction holds exactly while its arm exceeds the displacement across the mass's radius."""
    speed, angles = rpm * RPM, (1.2, 4.0)
    whirl = parameters.steady_whirl(speed, angles)
    across = [abs((whirl * cmath.exp(-1j * angle)).imag) for angle in angles]
    arms = parameters._replace(friction_arm=(across[0] / share, 10 * across[1]))
    states, stuck = steps(arms, at_rest_on(arms, speed, angles), speed, np.zeros((200, 2)))
    assert np.all(stuck[1:, 1] == STUCK)
    assert np.all(stuck[1:, 0] == (STUCK if share < 1 else SLIDING))
    assert (states[-1, 4] == angles[0]) == (share < 1)


def test_a_locked_mass_is_held_by_more_than_friction(parameters: PlantParameters) -> None:
    state = rest_state((0.0, 2.0))
    state[6] = 1.0
    flags = np.array([LOCKED, SLIDING])
    after, flags_after = plant_step(parameters, state, flags, np.array([1e3, 0.0]), 10.0, 5.0, 1e-3)
    assert after[6] == 0.0
    assert after[4] == 0.0
    assert flags_after[0] == LOCKED
    assert np.array_equal(flags, [LOCKED, SLIDING])


def test_without_friction_and_speed_nothing_holds(parameters: PlantParameters) -> None:
    """At zero speed the centrifugal force is gone, and with it the friction: any torque moves a mass."""
    after, stuck = plant_step(
        parameters, rest_state((0.0, 2.0)), stuck_flags(STUCK), np.array([1e-6, 0.0]), 0.0, 0.0, 1e-3
    )
    assert after[6] > 0
    assert stuck[0] == SLIDING
    free = parameters._replace(friction_arm=(0.0, 0.0))
    states, stuck_now = steps(free, rest_state((0.0, 2.0)), 10.0, np.zeros((50, 2)))
    assert np.all(stuck_now[1:] == SLIDING)
    assert np.all(np.isfinite(states))


def test_through_zero_speed_with_friction(parameters: PlantParameters) -> None:
    """A rotor that stops and turns back: every state is finite, and the masses rest again at the end."""
    states, stuck = run_steps(
        parameters._replace(unbalance=1e-3),
        np.array([0.0, 20.0]),
        np.array([5.0, -5.0]),
        rest_state((0.0, math.pi)),
        stuck_flags(STUCK),
        np.zeros((30000, 2)),
        1e-3,
    )
    assert np.all(np.isfinite(states))
    assert np.any(stuck[9000:11000] == SLIDING)
    assert np.all(stuck[-1] == STUCK)


def energy_of(parameters: PlantParameters, state: FloatArray, speed: float) -> float:
    """Kinetic and elastic energy in the fixed frame, without the rotor's own rotation."""
    z, v = complex(state[0], state[1]), complex(state[2], state[3])
    hub = v + 1j * speed * z
    kinetic = (parameters.mass - 2 * parameters.moment**2 / parameters.inertia) * abs(hub) ** 2 / 2
    for mass in range(2):
        radius = parameters.inertia / parameters.moment
        tangential = 1j * radius * (speed + state[6 + mass]) * cmath.exp(1j * state[4 + mass])
        kinetic += parameters.moment**2 / parameters.inertia * abs(hub + tangential) ** 2 / 2
        kinetic += parameters.drive_inertia * state[6 + mass] ** 2 / 2
    return kinetic + parameters.stiffness * abs(z) ** 2 / 2


def test_friction_never_gives_energy(parameters: PlantParameters) -> None:
    """At W = 0 with the drive off, shaken masses and rotor only lose energy, whatever sticks or slips."""
    calm = parameters._replace(unbalance=0.0, friction_arm=(0.05, 0.02))
    state = rest_state((0.2, 2.0))
    state[:4] = [0.02, -0.01, 0.3, 0.1]
    state[6:] = [3.0, -2.0]
    states, _ = steps(calm, state, 0.0, np.zeros((3000, 2)))
    energy = np.array([energy_of(calm, each, 0.0) for each in states[::10]])
    assert np.all(np.diff(energy) < 1e-12)
    assert energy[-1] < 0.1 * energy[0]


def consistent_motions(parameters: PlantParameters, forces: machine._Forces) -> Iterator[tuple[float, float]]:
    """Accelerations in all combinations that the law of friction allows, by its definition."""
    inertia = parameters.inertia + parameters.drive_inertia - parameters.moment**2 / parameters.mass
    for motion in product((0.0, 1.0, -1.0), (0.0, 1.0, -1.0)):
        a = machine._accelerations(parameters, forces, motion)
        needed = [forces.driving[i] - inertia * a[i] - forces.coupling * a[1 - i] for i in range(2)]
        held = all(abs(needed[i]) <= forces.friction[i] for i in range(2) if motion[i] == 0)
        if held and all(motion[i] * a[i] > 0 for i in range(2) if motion[i] != 0):
            yield a


@given(
    driving=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
    friction=st.tuples(st.floats(0.01, 2), st.floats(0.01, 2)),
    cross=st.floats(-0.9, 0.9),
)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_the_motion_from_rest_is_the_one_that_the_law_allows(
    driving: tuple[float, float],
    friction: tuple[float, float],
    cross: float,
    parameters: PlantParameters,
) -> None:
    unit = parameters._replace(inertia=1.0, drive_inertia=0.0, mass=1e12)
    row = row_of(rest_state((0.0, 1.0)), stuck_flags(STUCK), OFF)
    forces = machine._Forces(0j, (1 + 0j, 1 + 0j), driving, friction, cross)
    motion = machine._motion(unit, forces, row)
    chosen = machine._accelerations(unit, forces, motion)
    moves = np.array(motion) != 0
    np.testing.assert_array_equal(row[machine.FLAG : machine.FLAG + 2], np.where(moves, SLIDING, STUCK))
    # At the bound of the torque two motions are the same: what counts is the acceleration.
    for allowed in consistent_motions(unit, forces):
        assert allowed == pytest.approx(chosen, abs=1e-9)


def carried(parameters: PlantParameters, row: FloatArray, speed: float, time: float) -> FloatArray:
    """The state of held masses by an adaptive solution of the plant's own equations."""
    work, out = row.copy(), machine._SLOPES
    driven = driven_of(parameters, work)

    def rates(_: float, now: FloatArray) -> FloatArray:
        work[machine._TRIAL : machine._TRIAL + 8] = now
        machine._set_slope(driven, (0.0, 0.0), work, speed, out)
        return work[out : out + 8].copy()

    solution = solve_ivp(rates, (0.0, time), row[:8], method="DOP853", rtol=1e-12, atol=1e-16)
    return np.asarray(solution.y[:, -1])


@pytest.mark.parametrize("damping", [0.0, 20.0, 3000.0])
def test_a_step_with_held_masses_is_exact(damping: float, parameters: PlantParameters) -> None:
    """Undamped, underdamped, and overdamped; the step is as long as the transient."""
    rotor = parameters._replace(damping=damping, friction_arm=(1e3, 1e3))
    speed, state = 150 * RPM, rest_state((0.4, 2.9))
    state[:4] = 1e-3, -2e-3, 0.01, 0.02
    row = row_of(state, stuck_flags(SLIDING), np.array([0.01, -0.02]))
    expected = carried(rotor, row, speed, 0.3)
    assert machine._held_step(driven_of(rotor, row), row, speed, 0.3)
    np.testing.assert_allclose(row[:8], expected, rtol=1e-9, atol=1e-13)
    assert np.all(row[machine.FLAG : machine.FLAG + 2] == STUCK)


@pytest.mark.parametrize("damping", [0.0, 20.0, 3000.0])
def test_the_bound_on_the_load_of_held_masses_holds(damping: float, parameters: PlantParameters) -> None:
    """Masses taken as held stay so on the plant's own equations, however often the friction is halved."""
    speed, state = 150 * RPM, rest_state((0.4, 2.9))
    state[:4] = 1e-3, -2e-3, 0.01, 0.02
    arm, held = 4.0, 0
    while arm > 1e-5:
        arm *= 0.9
        rotor = parameters._replace(damping=damping, friction_arm=(arm, arm))
        row = row_of(state, stuck_flags(STUCK), OFF)
        driven = driven_of(rotor, row)
        if not machine._held_step(driven, row.copy(), speed, 1e-3):
            break
        held += 1
        for _ in range(2000):
            machine._advance(driven, row, speed, 1e-3)
            assert np.all(row[machine.FLAG : machine.FLAG + 2] == STUCK), arm
    assert held > 3
    assert arm > 1e-5


def test_masses_that_the_transient_could_break_loose_are_not_taken_as_held(
    parameters: PlantParameters,
) -> None:
    """Friction that holds the steady whirl, and not the transient on top."""
    speed, angles = 150 * RPM, (1.2, 4.0)
    whirl = parameters.steady_whirl(speed, angles)
    arm = 1.5 * max(abs((whirl * cmath.exp(-1j * angle)).imag) for angle in angles)
    rotor = parameters._replace(friction_arm=(arm, arm))
    settled, shaken = at_rest_on(rotor, speed, angles), rest_state(angles)
    stuck, step = stuck_flags(STUCK), 1e-3
    driven = driven_of(rotor, row_of(shaken, stuck, OFF))
    assert machine._held_step(driven, row_of(settled, stuck, OFF), speed, step)
    before = row_of(shaken, stuck, OFF)
    row = before.copy()
    assert not machine._held_step(driven, row, speed, step)
    assert not machine._held_step(driven._replace(speed_rate=1.0), row_of(shaken, stuck, OFF), speed, step)
    np.testing.assert_array_equal(row[:10], before[:10])
    assert machine._held_step(driven, row_of(shaken, stuck_flags(LOCKED), OFF), speed, step)
