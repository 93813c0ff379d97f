"""Plant: rotor on its bearing, imbalance, two masses, motors and friction, in the rotor-fixed frame.

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
wrapped; in addition each mass has a flag: SLIDING, STUCK or LOCKED.  A locked mass is clamped to its track
by a brake that no torque overcomes.

Dry friction is a set-valued law.  A sliding mass is braked by mu_f b (W + phi')^2.  A mass at rest on its
track is held by any torque up to mu_f b W^2; under a larger load it breaks away in the direction of the load.
Since phi'' enters both masses' equations, two masses at rest are treated together: the mass matrix is
positive definite, so exactly one of the nine combinations of held, forwards and backwards is consistent.

Source: Eqs. (1) to (11) of the paper on eccentric masses, rederived; docs/eccentric-masses.md has the
differences.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.physics.balancing import amplification_factor, critical_speed
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.platform.compiled import in_place

Pair = tuple[float, float]
"""Values of first and second mass."""
Motions = tuple[int, int]


class PlantParameters(NamedTuple):
    """Constants of rotor, masses and motors, SI."""

    mass: float
    """M = m_r + 2 m_b, kg."""
    damping: float
    """C_B, N s/m."""
    stiffness: float
    """K_B, N/m."""
    unbalance: float
    """U = m_im r_im, kg m."""
    phase: float
    """phi_m of the unbalance in the rotor's frame, rad."""
    moment: float
    """b = m_b r_b of one eccentric mass, kg m."""
    inertia: float
    """J = m_b r_b^2 of one eccentric mass, kg m^2."""
    drive_inertia: float
    """J_add, inertia of motor and gear B reflected to phi, kg m^2."""
    drive_damping: float
    """C_add, damping by back-emf reflected to phi, N m s."""
    drive_gain: float
    """B_add, torque on a mass per motor voltage, N m/V."""
    friction_arm: Pair
    """mu_f of each mass, m."""
    gear_ratio: float
    """Turns of the motor per turn of the mass, N_3 / N_1."""
    back_emf_constant: float
    """K_m, V s/rad."""
    resistance: float
    """R_m, ohm."""
    maximum_voltage: float
    """Voltage limit of the supply, V; infinite for none."""

    def influence(self, speed: float) -> complex:
        """Influence coefficient: steady vibration per unbalance, complex, m/(kg m).

        alpha = W^2 / (K_B - M W^2 + j C_B W).
        The lag is minus its phase.
        Raises: ValueError: no damping, at the critical speed.
        """
        stiffness = complex(self.stiffness - self.mass * speed**2, self.damping * speed)
        if stiffness == 0:
            raise ValueError("a rotor without damping has no steady whirl at its critical speed")
        return speed**2 / stiffness

    def steady_whirl(self, speed: float, angles: Sequence[float]) -> complex:
        """Displacement x + j y in the rotor's frame at constant speed, masses at rest on the track, m.

        z = alpha (U exp(j phi_m) + b sum exp(j phi_i)); its magnitude is the zero-to-peak vibration.
        Raises: ValueError: no damping, at the critical speed.
        """
        masses = sum(cmath.exp(1j * angle) for angle in angles)
        moment = self.unbalance * cmath.exp(1j * self.phase) + self.moment * masses
        return self.influence(speed) * moment

    @classmethod
    def of(cls, scene: EccentricScene) -> PlantParameters:
        """Derive the plant's constants from a scene.

        J_add = (J_1 + J_2 (N_1/N_2)^2) (N_3/N_1)^2, C_add = K_i K_m / R_m (N_3/N_1)^2,
        B_add = K_i / R_m N_3/N_1.
        Source: Appendix A of the paper on eccentric masses, rederived; its Eq. (A9) with all signs.
        """
        masses, rotor, imbalance, motor = scene.masses, scene.rotor, scene.imbalance, scene.motor
        first, second, third = motor.teeth
        ratio, moment = third / first, masses.mass * masses.guide_radius
        shafts = motor.motor_inertia + motor.gear_inertia * (first / second) ** 2
        return cls(
            mass=rotor.mass + 2 * masses.mass,
            damping=rotor.damping,
            stiffness=rotor.stiffness,
            unbalance=imbalance.mass * imbalance.radius,
            phase=imbalance.phase,
            moment=moment,
            inertia=moment * masses.guide_radius,
            drive_inertia=shafts * ratio**2,
            drive_damping=motor.torque_constant * motor.back_emf_constant / motor.resistance * ratio**2,
            drive_gain=motor.torque_constant / motor.resistance * ratio,
            friction_arm=masses.friction_arm,
            gear_ratio=ratio,
            back_emf_constant=motor.back_emf_constant,
            resistance=motor.resistance,
            maximum_voltage=math.inf if motor.maximum_voltage is None else motor.maximum_voltage,
        )


def rotor_record(scene: EccentricScene) -> dict[str, float | None]:
    """Critical speed, rad/s, amplification factor, and phase of the resultant of unbalance and masses at
    their initial angles, rad in the rotor's frame; plain numbers.
    """
    plant, angles = PlantParameters.of(scene), scene.masses.initial_angle
    left = cmath.rect(plant.unbalance, plant.phase) + sum(cmath.rect(plant.moment, each) for each in angles)
    constants = {"mass": plant.mass, "stiffness": plant.stiffness}
    return {
        "critical_speed_rad_s": critical_speed(**constants),
        "amplification_factor": amplification_factor(**constants, damping=plant.damping),
        "locked_phase_rad": cmath.phase(left),
    }


@in_place
def speed_at(times: FloatArray, speeds: FloatArray, time: float) -> tuple[float, float]:
    """W, rad/s, and W', rad/s^2, just after a time; constant before the first corner and after the last."""
    if time < times[0]:
        return speeds[0], 0.0
    for i in range(len(times) - 1):
        if time < times[i + 1]:
            rate = (speeds[i + 1] - speeds[i]) / (times[i + 1] - times[i])
            return speeds[i] + rate * (time - times[i]), rate
    return speeds[-1], 0.0


@in_place
def turned(times: FloatArray, speeds: FloatArray, time: float) -> float:
    """Angle of the rotor, the integral of its speed from time zero. Returns: rad, not wrapped."""
    angle: float = speeds[0] * min(time, times[0])
    for i in range(len(times) - 1):
        end = min(time, times[i + 1])
        if end > times[i]:
            now, _ = speed_at(times, speeds, times[i])
            slope = (speeds[i + 1] - speeds[i]) / (times[i + 1] - times[i])
            length = end - times[i]
            angle += now * length + 0.5 * slope * length * length
    angle += speeds[-1] * max(0.0, time - times[-1])
    return angle


SLIDING: Final = 0
STUCK: Final = 1
LOCKED: Final = 2

HELD: Final = 0
FORWARDS: Final = 1
BACKWARDS: Final = -1

_ROUNDING: Final = 1e-12


class _Torques(NamedTuple):
    """Equations of both masses once the rotor's accelerations are eliminated.

    A phi'' = g - friction, with A = [[inertia, cross], [cross, inertia]].
    """

    inertia: float
    """J + J_add - b^2 / M, kg m^2."""
    cross: float
    """-b^2 / M cos(phi_1 - phi_2), kg m^2."""
    driving: Pair
    """g of each mass, all torques but friction, N m."""
    friction: Pair
    """mu_f b (W + phi')^2 of each mass, N m."""


@in_place
def angular_accelerations(torques: _Torques, motion: Motions) -> Pair:
    """phi'' of both masses in given motions, rad/s^2."""
    inertia, cross = torques.inertia, torques.cross
    net_1 = torques.driving[0] - motion[0] * torques.friction[0]
    net_2 = torques.driving[1] - motion[1] * torques.friction[1]
    if motion[0] == HELD:
        return 0.0, 0.0 if motion[1] == HELD else net_2 / inertia
    if motion[1] == HELD:
        return net_1 / inertia, 0.0
    determinant = inertia * inertia - cross * cross
    first = (inertia * net_1 - cross * net_2) / determinant
    second = (inertia * net_2 - cross * net_1) / determinant
    return first, second


@in_place
def slips(torques: _Torques, mass: int, other_acceleration: float) -> bool:
    """Return True if a held mass breaks loose: |g - cross phi''_other| > mu_f b W^2."""
    load = abs(torques.driving[mass] - torques.cross * other_acceleration)
    return load > torques.friction[mass] * (1.0 + _ROUNDING)


@in_place
def _consistent(torques: _Torques, motion: Motions, loose: tuple[bool, bool]) -> bool:
    """Return True if motions of masses at rest are consistent; a mass that already moves is skipped."""
    acceleration = angular_accelerations(torques, motion)
    for i in range(2):
        if loose[i]:
            slipping = motion[i] == HELD and slips(torques, i, acceleration[1 - i])
            if slipping or motion[i] * acceleration[i] < 0.0:
                return False
    return True


@in_place
def _moving(flag: int, rate: float) -> int:
    """Motion of a mass that is locked or has a rate."""
    if flag == LOCKED or rate == 0.0:
        return HELD
    return FORWARDS if rate > 0.0 else BACKWARDS


@in_place
def motions(torques: _Torques, state: FloatArray, stuck: IntArray) -> Motions:
    """Motion of each mass: HELD, FORWARDS or BACKWARDS."""
    loose = (stuck[0] != LOCKED and state[6] == 0.0, stuck[1] != LOCKED and state[7] == 0.0)
    present = (_moving(stuck[0], state[6]), _moving(stuck[1], state[7]))
    for first in (HELD, FORWARDS, BACKWARDS):
        for second in (HELD, FORWARDS, BACKWARDS):
            motion = (first if loose[0] else present[0], second if loose[1] else present[1])
            if _consistent(torques, motion, loose):
                return motion
    # Reached by round-off only: the torques are at their bounds.
    return present


SIZE: Final = 8


class Drive(NamedTuple):
    """Inputs of the plant during one step."""

    unbalance_x: float
    """U cos phi_m, kg m."""
    unbalance_y: float
    """U sin phi_m, kg m."""
    torque: Pair
    """Torque of each motor at standstill, B_add V, N m."""
    rate: float
    """W', rad/s^2, constant."""


class _Loads(NamedTuple):
    """Forces on rotor and masses in one state of the plant."""

    force_x: float
    """All but M a_x and b phi_i'' sin phi_i in the first equation, N."""
    force_y: float
    """All but M a_y and b phi_i'' cos phi_i in the second equation, N."""
    torques: _Torques


@in_place
def _limited(voltage: float, maximum: float) -> float:
    """Voltage limited to the supply's maximum, which may be infinite, V."""
    return min(max(voltage, -maximum), maximum)


@in_place
def drive_of(parameters: PlantParameters, command: FloatArray, rate: float) -> Drive:
    """Gather the inputs of the plant."""
    most, gain = parameters.maximum_voltage, parameters.drive_gain
    return Drive(
        parameters.unbalance * math.cos(parameters.phase),
        parameters.unbalance * math.sin(parameters.phase),
        (gain * _limited(command[0], most), gain * _limited(command[1], most)),
        rate,
    )


@in_place
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
    lever, common, drag = b / parameters.mass, parameters.inertia * rate, parameters.drive_damping
    drive_1 = drive.torque[0] - drag * state[6] - common
    drive_2 = drive.torque[1] - drag * state[7] - common
    torques = _Torques(
        parameters.inertia + parameters.drive_inertia - b * lever,
        -b * lever * (cos_1 * cos_2 + sin_1 * sin_2),
        (
            drive_1 - lever * (force_y * cos_1 - force_x * sin_1),
            drive_2 - lever * (force_y * cos_2 - force_x * sin_2),
        ),
        (parameters.friction_arm[0] * b * square_1, parameters.friction_arm[1] * b * square_2),
    )
    return _Loads(force_x, force_y, torques)


@in_place
def write_derivative(
    parameters: PlantParameters,
    state: FloatArray,
    speed: float,
    drive: Drive,
    motion: Motions,
    out: FloatArray,
) -> None:
    """Write the time derivative of the state for given motions of the masses."""
    load = loads(parameters, state, speed, drive)
    first, second = angular_accelerations(load.torques, motion)
    b, rate = parameters.moment, drive.rate
    pull_x = b * (math.sin(state[4]) * first + math.sin(state[5]) * second)
    pull_y = b * (math.cos(state[4]) * first + math.cos(state[5]) * second)
    accelerated_x = (load.force_x + pull_x) / parameters.mass
    accelerated_y = (load.force_y - pull_y) / parameters.mass
    out[0] = state[2]
    out[1] = state[3]
    out[2] = accelerated_x + 2 * speed * state[3] + rate * state[1] + speed * speed * state[0]
    out[3] = accelerated_y - 2 * speed * state[2] - rate * state[0] + speed * speed * state[1]
    out[4] = state[6]
    out[5] = state[7]
    out[6] = first
    out[7] = second


def rest_state(angles: tuple[float, float]) -> FloatArray:
    """State of a rotor at its centre, in its own frame, with masses at rest on the track, shape (8,)."""
    return np.array([0.0, 0.0, 0.0, 0.0, angles[0], angles[1], 0.0, 0.0])


def stuck_flags(flag: int) -> IntArray:
    """One flag for both masses, shape (2,)."""
    return np.full(2, flag, dtype=np.int64)


@in_place
def electrical_energy(
    parameters: PlantParameters, before: FloatArray, after: FloatArray, command: FloatArray, step: float
) -> float:
    """Energy that both motors take from the supply in one step of constant voltages, J.

    E = sum V (V h - K_m n (phi(t + h) - phi(t))) / R_m, the exact integral of V i; negative when a motor
    feeds back.
    Source: Kirchhoff's law for the motor without inductance, Eqs. (A1) to (A3) of the paper on eccentric
    masses.
    """
    total = 0.0
    for mass in range(2):
        voltage = _limited(command[mass], parameters.maximum_voltage)
        turned = parameters.gear_ratio * (after[4 + mass] - before[4 + mass])
        total += voltage * (voltage * step - parameters.back_emf_constant * turned) / parameters.resistance
    return total
