"""The plant: a rotor on its bearing with an imbalance and two eccentric masses, in the frame that turns with
it.

With M = m_r + 2 m_b, b = m_b r_b, J = m_b r_b^2, U = m_im r_im, W the rotor's speed and W' its rate:

    a_x = x'' - 2 W y' - W' y - W^2 x,    a_y = y'' + 2 W x' + W' x - W^2 y
    M a_x + C_B (x' - W y) + K_B x = U (W^2 cos phi_m + W' sin phi_m)
                                     + b sum[(W + phi_i')^2 cos phi_i + (W' + phi_i'') sin phi_i]
    M a_y + C_B (y' + W x) + K_B y = U (W^2 sin phi_m - W' cos phi_m)
                                     + b sum[(W + phi_i')^2 sin phi_i - (W' + phi_i'') cos phi_i]
    J (phi_i'' + W') + b (-a_x sin phi_i + a_y cos phi_i) = u_i - friction_i

The motor shaft turns n = N_3 / N_1 times as fast as the mass along the track.  Without inductance and with
i = (V - K_m n phi') / R_m the torque on the mass is

    u = n K_i V / R_m - n^2 K_i K_m / R_m phi' - J_add phi'',

positive voltage driving the mass with the rotation.  The signs follow from K_i i = J_1 theta_1'' + T_1 on the
motor shaft, T_2 = J_2 theta_2'' + T_3 on gear B, equal power at each mesh, and theta_1 = n phi; the inertia
and the back-emf both oppose the motion.

The imbalance mass is a part of m_r.  The state is [x, y, x', y', phi_1, phi_2, phi_1', phi_2'], angles not
wrapped; beside it each mass is SLIDING, STUCK or LOCKED (`friction`).  A locked mass is clamped to its track
by a brake that no torque overcomes.

Source: Eqs. (1) to (11) of the paper on eccentric masses, rederived; docs/eccentric-masses.md has the
differences.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.eccentric_mass.plant.friction import Torques, angular_accelerations
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.scene.arrays import FloatArray, IntArray

SIZE: Final = 8


class Drive(NamedTuple):
    """What acts on the plant from outside while a step lasts."""

    unbalance_x: float
    """U cos phi_m, kg m."""
    unbalance_y: float
    """U sin phi_m, kg m."""
    torque_1: float
    """Of the first motor at standstill, B_add V, N m."""
    torque_2: float
    """Of the second motor at standstill, N m."""
    rate: float
    """W', rad/s^2, constant."""


class _Loads(NamedTuple):
    """Forces on rotor and masses in one state."""

    force_x: float
    """All but M a_x and b phi_i'' sin phi_i in the first equation, N."""
    force_y: float
    """Likewise in the second, N."""
    torques: Torques
    """Of the masses."""


@compiled
def _limited(voltage: float, maximum: float) -> float:
    """A voltage cut to what the supply can give, which may be infinite."""
    return min(max(voltage, -maximum), maximum)


@compiled
def drive_of(parameters: PlantParameters, command: FloatArray, rate: float) -> Drive:
    """Gather what acts on the plant from outside."""
    most = parameters.maximum_voltage
    return Drive(
        parameters.unbalance * math.cos(parameters.phase),
        parameters.unbalance * math.sin(parameters.phase),
        parameters.drive_gain * _limited(command[0], most),
        parameters.drive_gain * _limited(command[1], most),
        rate,
    )


@compiled
def loads(parameters: PlantParameters, state: FloatArray, speed: float, drive: Drive) -> _Loads:
    """Forces on the rotor, and the masses' equations with the rotor's accelerations eliminated.

    A phi'' = g - friction, with A_ij = (J + J_add) delta_ij - b^2 / M cos(phi_i - phi_j) and
    g_i = u_i - J W' - b / M (-F_x sin phi_i + F_y cos phi_i).
    """
    b, rate = parameters.moment, drive.rate
    cos_1, sin_1 = math.cos(state[4]), math.sin(state[4])
    cos_2, sin_2 = math.cos(state[5]), math.sin(state[5])
    square_1, square_2 = (speed + state[6]) ** 2, (speed + state[7]) ** 2
    force_x = b * (square_1 * cos_1 + rate * sin_1 + square_2 * cos_2 + rate * sin_2)
    force_y = b * (square_1 * sin_1 - rate * cos_1 + square_2 * sin_2 - rate * cos_2)
    force_x += speed * speed * drive.unbalance_x + rate * drive.unbalance_y
    force_y += speed * speed * drive.unbalance_y - rate * drive.unbalance_x
    force_x -= parameters.damping * (state[2] - speed * state[1]) + parameters.stiffness * state[0]
    force_y -= parameters.damping * (state[3] + speed * state[0]) + parameters.stiffness * state[1]
    lever = b / parameters.mass
    common = parameters.inertia * rate
    torques = Torques(
        parameters.inertia + parameters.drive_inertia - b * lever,
        -b * lever * (cos_1 * cos_2 + sin_1 * sin_2),
        drive.torque_1
        - parameters.drive_damping * state[6]
        - common
        - lever * (force_y * cos_1 - force_x * sin_1),
        drive.torque_2
        - parameters.drive_damping * state[7]
        - common
        - lever * (force_y * cos_2 - force_x * sin_2),
        parameters.friction_arm_1 * b * square_1,
        parameters.friction_arm_2 * b * square_2,
    )
    return _Loads(force_x, force_y, torques)


@compiled
def write_derivative(
    parameters: PlantParameters,
    state: FloatArray,
    speed: float,
    drive: Drive,
    motion: tuple[int, int],
    out: FloatArray,
) -> None:
    """Write the time derivative of the state for given motions of the masses."""
    found = loads(parameters, state, speed, drive)
    one, two = angular_accelerations(found.torques, motion[0], motion[1])
    b, rate = parameters.moment, drive.rate
    pull_x = b * (math.sin(state[4]) * one + math.sin(state[5]) * two)
    pull_y = b * (math.cos(state[4]) * one + math.cos(state[5]) * two)
    accelerated_x = (found.force_x + pull_x) / parameters.mass
    accelerated_y = (found.force_y - pull_y) / parameters.mass
    out[0] = state[2]
    out[1] = state[3]
    out[2] = accelerated_x + 2 * speed * state[3] + rate * state[1] + speed * speed * state[0]
    out[3] = accelerated_y - 2 * speed * state[2] - rate * state[0] + speed * speed * state[1]
    out[4] = state[6]
    out[5] = state[7]
    out[6] = one
    out[7] = two


def rest_state(angles: tuple[float, float]) -> FloatArray:
    """The state of a rotor at its centre, in its own frame, with masses at rest on the track, shape (8,)."""
    return np.array([0.0, 0.0, 0.0, 0.0, angles[0], angles[1], 0.0, 0.0])


def stuck_flags(flag: int) -> IntArray:
    """The same flag for both masses. Returns: Shape (2,)."""
    return np.full(2, flag, dtype=np.int64)


@compiled
def electrical_energy(
    parameters: PlantParameters, before: FloatArray, after: FloatArray, command: FloatArray, step: float
) -> float:
    """Energy that both motors take from the supply while their voltages are held.

    E = sum V (V h - K_m n (phi(t + h) - phi(t))) / R_m, the exact integral of V i; negative when a motor
    feeds back.
    Returns: J.
    Source: Kirchhoff's law for the motor without inductance, Eqs. (A1) to (A3) of the paper on eccentric
    masses.
    """
    total = 0.0
    for mass in range(2):
        voltage = _limited(command[mass], parameters.maximum_voltage)
        turned = parameters.gear_ratio * (after[4 + mass] - before[4 + mass])
        total += voltage * (voltage * step - parameters.back_emf_constant * turned) / parameters.resistance
    return total
