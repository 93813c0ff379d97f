"""Plant: rotor on its bearing, imbalance, two masses, motors and friction, in the rotor-fixed frame.

With z = x + j y, M = m_r + 2 m_b, b = m_b r_b, J = m_b r_b^2, U = m_im r_im exp(j phi_m), e_i = exp(j phi_i),
W the rotor's speed and W' its rate:

    M a + C_B (z' + j W z) + K_B z = (W^2 - j W') U + b sum [(W + phi_i')^2 - j (W' + phi_i'')] e_i,
    a = z'' + 2 j W z' + (j W' - W^2) z,
    J (phi_i'' + W') + b Im(a e_i*) = u_i - friction_i.

The motor shaft turns n = N_3 / N_1 times as fast as the mass along the track.  Without inductance and with
i = (V - K_m n phi') / R_m the torque on the mass is

    u = n K_i V / R_m - n^2 K_i K_m / R_m phi' - J_add phi'',

positive voltage driving the mass with the rotation.  The signs follow from K_i i = J_1 theta_1'' + T_1 on the
motor shaft, T_2 = J_2 theta_2'' + T_3 on gear B, equal power at each mesh, and theta_1 = n phi; the inertia
and the back-emf both oppose the motion.  The imbalance mass is a part of m_r.

With F, all in the rotor's equation but M a and b phi'', that is M a = F - j b sum phi_k'' e_k, the rotor
leaves the masses' equations:

    sum_k A_ik phi_k'' = g_i - friction_i,    g_i = B_add V - C_add phi_i' - J W' - b / M Im(F e_i*),
    A_ik = (J + J_add) delta_ik - b^2 / M cos(phi_i - phi_k).

Dry friction is a set-valued law.  A sliding mass is braked by mu_f b (W + phi')^2.  A mass at rest on its
track is held by any torque up to mu_f b W^2; under a larger load it breaks away in the direction of the load.
Since phi'' enters both masses' equations, two masses at rest are treated together: the mass matrix A is
positive definite, so exactly one of the nine combinations of held, forwards and backwards is consistent.

The state is [x, y, x', y', phi_1, phi_2, phi_1', phi_2'], angles not wrapped; in addition each mass has a
flag: SLIDING, STUCK or LOCKED.  A locked mass is clamped to its track by a brake that no torque overcomes.

Between events, where a mass stops, sticks or breaks away, the motion is smooth and integrated by the
fifth-order Runge-Kutta formula of Dormand and Prince, in substeps that are short compared with the time
constants of the plant.  An event is located by bisection to machine precision; the mass is set to rest there,
and the friction law decides its further motion.  While friction holds both masses at constant speed the step
has a closed form.

Source: Eqs. (1) to (11) of the paper on eccentric masses, rederived; docs/eccentric-masses.md has the
differences.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.integrate import RK45

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.physics.balancing import amplification_factor, critical_speed
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import in_place

Pair = tuple[float, float]
"""Values of first and second mass."""


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

        z = alpha (U exp(j phi_m) + p), see `mass_vector`; its magnitude is the zero-to-peak vibration.
        Raises: ValueError: no damping, at the critical speed.
        """
        return self.influence(speed) * (cmath.rect(self.unbalance, self.phase) + self.mass_vector(angles))

    def mass_vector(self, angles: Sequence[float]) -> complex:
        """Static moment of the masses in the rotor's frame, p = b sum exp(j phi_i), kg m."""
        return sum((cmath.rect(self.moment, angle) for angle in angles), 0j)

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
    plant = PlantParameters.of(scene)
    mass, stiffness, left = plant.mass, plant.stiffness, cmath.rect(plant.unbalance, plant.phase)
    return {
        "critical_speed_rad_s": critical_speed(mass=mass, stiffness=stiffness),
        "amplification_factor": amplification_factor(mass=mass, stiffness=stiffness, damping=plant.damping),
        "locked_phase_rad": cmath.phase(left + plant.mass_vector(scene.masses.initial_angle)),
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
        length = min(time, times[i + 1]) - times[i]
        if length > 0.0:
            slope = (speeds[i + 1] - speeds[i]) / (times[i + 1] - times[i])
            angle += speeds[i] * length + 0.5 * slope * length * length
    angle += speeds[-1] * max(0.0, time - times[-1])
    return angle


SLIDING, STUCK, LOCKED = 0.0, 1.0, 2.0
"""Flags of a mass."""
X, Y, X_RATE, Y_RATE, ANGLE, TURN = 0, 1, 2, 3, 4, 6
"""Indices of the state in a row: displacement, m, velocity, m/s, angles, rad, and rates, rad/s."""
SIZE: Final = 8
FLAG, VOLTAGE, _TRIAL, _SLOPES, ROW_SIZE = 8, 10, 12, 20, 68
"""Indices behind the state: flags and voltages, V, of both masses, state and slopes of a trial step."""

MAX_RATE_PRODUCT: Final = 0.25
"""Largest product of a substep and the plant's fastest rate: half of it moves no angle by 1e-8 rad."""
_BISECTIONS, _MAX_EVENTS = 40, 64
_ROUNDING, _LEAST_ROOT = 1e-12, 1e-6
_COUPLING: Final = np.vstack([np.pad(RK45.A, ((0, 0), (0, 1))), RK45.B])
"""Weights of the earlier stages in each of the six stages, and in the result of order 5."""
_TIMES: Final = RK45.C
"""Times of the stages, as fractions of the step."""


def plant_row(angles: Pair, flag: float = STUCK) -> FloatArray:
    """Row of a rotor at its centre, in its own frame, with masses at rest on the track and motors off."""
    row = np.zeros(ROW_SIZE)
    row[ANGLE:TURN], row[FLAG:VOLTAGE] = angles, flag
    return row


class _Driven(NamedTuple):
    """Plant with what is constant within a step."""

    plant: PlantParameters
    speed_rate: float
    """W', rad/s^2."""
    unbalance: complex
    """U, kg m."""
    torque: Pair
    """B_add V, N m."""


class _Forces(NamedTuple):
    """Forces in one state, as far as they do not depend on accelerations."""

    rotor: complex
    """F, N."""
    direction: tuple[complex, complex]
    """e_i."""
    driving: Pair
    """g_i, N m."""
    friction: Pair
    """Largest torque of friction, mu_f b (W + phi_i')^2, N m."""
    coupling: float
    """A_12, kg m^2."""


@in_place
def _whirl(row: FloatArray, at: int) -> tuple[complex, complex]:
    """z, m, and z', m/s, of the state at an index of the row."""
    return complex(row[at + X], row[at + Y]), complex(row[at + X_RATE], row[at + Y_RATE])


@in_place
def _direction(angle: float) -> complex:
    return complex(math.cos(angle), math.sin(angle))


@in_place
def _across(vector: complex, direction: complex) -> float:
    """Im(v e*), component of a vector across a direction."""
    return vector.imag * direction.real - vector.real * direction.imag


@in_place
def _forces(driven: _Driven, row: FloatArray, at: int, speed: float) -> _Forces:
    """Forces in the state at an index of the row."""
    plant, rate = driven.plant, driven.speed_rate
    b, spin, lever = plant.moment, plant.inertia * rate, plant.moment / plant.mass
    z, velocity = _whirl(row, at)
    first, second = _direction(row[at + ANGLE]), _direction(row[at + ANGLE + 1])
    squares = ((speed + row[at + TURN]) ** 2, (speed + row[at + TURN + 1]) ** 2)
    force = complex(speed**2, -rate) * driven.unbalance
    force -= plant.damping * (velocity + complex(0.0, speed) * z) + plant.stiffness * z
    force += b * (complex(squares[0], -rate) * first)
    force += b * (complex(squares[1], -rate) * second)
    driving = (
        driven.torque[0] - plant.drive_damping * row[at + TURN] - spin - lever * _across(force, first),
        driven.torque[1] - plant.drive_damping * row[at + TURN + 1] - spin - lever * _across(force, second),
    )
    friction = (plant.friction_arm[0] * b * squares[0], plant.friction_arm[1] * b * squares[1])
    cosine = first.real * second.real + first.imag * second.imag
    return _Forces(force, (first, second), driving, friction, -b * lever * cosine)


@in_place
def _accelerations(plant: PlantParameters, forces: _Forces, motion: Pair) -> Pair:
    """phi_i'', rad/s^2, of masses in their motions: 0 for held, or the sign of the rate."""
    inertia = plant.inertia + plant.drive_inertia - plant.moment * plant.moment / plant.mass
    first = forces.driving[0] - motion[0] * forces.friction[0] if motion[0] != 0.0 else 0.0
    second = forces.driving[1] - motion[1] * forces.friction[1] if motion[1] != 0.0 else 0.0
    cross = forces.coupling if motion[0] * motion[1] != 0.0 else 0.0
    determinant = inertia * inertia - cross * cross
    return (inertia * first - cross * second) / determinant, (inertia * second - cross * first) / determinant


@in_place
def _breaks_away(row: FloatArray, forces: _Forces, motion: Pair, acceleration: Pair) -> bool:
    """Return True if friction cannot hold a mass at rest: |g_i - A_12 phi_k''| > mu_f b W^2."""
    loose = False
    for i in range(2):
        load = abs(forces.driving[i] - forces.coupling * acceleration[1 - i])
        held = motion[i] == 0.0 and row[FLAG + i] != LOCKED
        loose = loose or (held and load > forces.friction[i] * (1.0 + _ROUNDING))
    return loose


@in_place
def _tried(flag: float, rate: float, way: int) -> float:
    """Motion of a mass; of one at rest the way that is tried, 0 for held, 1 for forwards, 2 for backwards."""
    if flag == LOCKED:
        return 0.0
    if rate != 0.0:
        return 1.0 if rate > 0.0 else -1.0
    return 1.0 if way == 1 else -0.5 * way


@in_place
def _motion(plant: PlantParameters, forces: _Forces, row: FloatArray) -> Pair:
    """Write the flags and return the motions, the one of nine combinations that is consistent."""
    motion = (0.0, 0.0)
    # The tenth trial, held again, is reached by round-off only: the torques are at their bounds.
    for trial in range(10):
        motion = (
            _tried(row[FLAG], row[TURN], trial // 3 % 3),
            _tried(row[FLAG + 1], row[TURN + 1], trial % 3),
        )
        acceleration = _accelerations(plant, forces, motion)
        consistent = not _breaks_away(row, forces, motion, acceleration)
        for i in range(2):
            if row[TURN + i] == 0.0 and motion[i] * acceleration[i] < 0.0:
                consistent = False
        if consistent:
            break
    for i in range(2):
        if row[FLAG + i] != LOCKED:
            row[FLAG + i] = STUCK if motion[i] == 0.0 else SLIDING
    return motion


@in_place
def _set_slope(driven: _Driven, motion: Pair, row: FloatArray, speed: float, out: int) -> None:
    """Write the time derivative of the trial to an index of the row, for masses in their motions.

    z'' = (F - j b sum phi_i'' e_i) / M - 2 j W z' + (W^2 - j W') z.
    """
    plant, forces = driven.plant, _forces(driven, row, _TRIAL, speed)
    first, second = _accelerations(plant, forces, motion)
    z, velocity = _whirl(row, _TRIAL)
    pull = complex(0.0, plant.moment) * (first * forces.direction[0] + second * forces.direction[1])
    turning = complex(0.0, 2 * speed) * velocity - complex(speed**2, -driven.speed_rate) * z
    acceleration = (forces.rotor - pull) / plant.mass - turning
    row[out + X], row[out + Y] = velocity.real, velocity.imag
    row[out + X_RATE], row[out + Y_RATE] = acceleration.real, acceleration.imag
    row[out + ANGLE], row[out + ANGLE + 1] = row[_TRIAL + TURN], row[_TRIAL + TURN + 1]
    row[out + TURN], row[out + TURN + 1] = first, second


@in_place
def _try(driven: _Driven, motion: Pair, row: FloatArray, speed: float, step: float) -> bool:
    """Write the state one step later as trial; return True if a mass has stopped or broken away in it."""
    for stage in range(7):
        for i in range(SIZE):
            total = 0.0
            for earlier in range(stage):
                total += _COUPLING[stage, earlier] * row[_SLOPES + SIZE * earlier + i]
            row[_TRIAL + i] = row[i] + step * total
        if stage < 6:
            now = speed + driven.speed_rate * step * _TIMES[stage]
            _set_slope(driven, motion, row, now, _SLOPES + SIZE * stage)
    for i in range(2):
        if motion[i] * row[_TRIAL + TURN + i] < 0.0:
            return True
    forces = _forces(driven, row, _TRIAL, speed + driven.speed_rate * step)
    return _breaks_away(row, forces, motion, _accelerations(driven.plant, forces, motion))


@in_place
def _advance(driven: _Driven, row: FloatArray, speed: float, step: float) -> None:
    """Integrate state and flags over one substep; each event ends a part of it, at the time just after."""
    done = 0.0
    for event in range(_MAX_EVENTS):
        now, left = speed + driven.speed_rate * done, step - done
        motion = _motion(driven.plant, _forces(driven, row, 0, now), row)
        cut = _try(driven, motion, row, now, left) and event < _MAX_EVENTS - 1
        if cut:
            before, after = 0.0, left
            for _ in range(_BISECTIONS):
                middle = 0.5 * (before + after)
                if not before < middle < after:
                    break
                if _try(driven, motion, row, now, middle):
                    after = middle
                else:
                    before = middle
            _try(driven, motion, row, now, after)
            done += after
        for i in range(SIZE):
            row[i] = row[_TRIAL + i]
        for i in range(2):
            if cut and motion[i] * row[TURN + i] < 0.0:
                row[TURN + i] = 0.0
        if not cut or done >= step:
            return


@in_place
def fastest_rate(plant: PlantParameters, speed: float) -> float:
    """Bound on any rate, rad/s: |W| + |s| + C_add/(J + J_add - 2 b^2/M), s the rotor's faster root.

    s^2 + C_B/M s + K_B/M = 0.
    """
    least = plant.inertia + plant.drive_inertia - 2 * plant.moment * plant.moment / plant.mass
    half, square = 0.5 * plant.damping / plant.mass, plant.stiffness / plant.mass
    rotor = math.sqrt(square) if half * half < square else half + math.sqrt(half * half - square)
    return abs(speed) + rotor + plant.drive_damping / least


@in_place
def substeps(plant: PlantParameters, speed: float, rate: float, step: float) -> int:
    """Number of substeps, at least 1, that keeps rate times substep within `MAX_RATE_PRODUCT`."""
    fastest = fastest_rate(plant, max(abs(speed), abs(speed + rate * step)))
    return max(1, math.ceil(fastest * step / MAX_RATE_PRODUCT))


@in_place
def _held_step(driven: _Driven, row: FloatArray, speed: float, step: float) -> bool:
    """Integrate the rotor over one step if both masses are certainly held; return True if so.

    The deviation from the steady whirl, seen in the fixed frame, obeys D'' + 2 h D' + k D = 0: with
    A = D' + h D and w^2 = k - h^2, D(t) = exp(-h t) (D cos w t + A / w sin w t), and cosh, sinh for k < h^2.
    In both cases D is a sum of parts d_1, d_2 that do not grow, so that |s_1|^2 |d_1| + |s_2|^2 |d_2|, with
    the roots s = -h +- j w, bounds the track's acceleration, and with it the load on friction, from now on.
    """
    if driven.speed_rate != 0.0 or speed == 0.0 or row[TURN] != 0.0 or row[TURN + 1] != 0.0:
        return False
    plant = driven.plant
    half, square = 0.5 * plant.damping / plant.mass, plant.stiffness / plant.mass
    root = math.sqrt(abs(square - half * half))
    spring, drag = plant.stiffness - plant.mass * speed * speed, plant.damping * speed
    size = spring * spring + drag * drag
    # The closed form divides by w; without damping there is no steady whirl at the critical speed.
    if size == 0.0 or root <= _LEAST_ROOT * half:
        return False
    direction = (_direction(row[ANGLE]), _direction(row[ANGLE + 1]))
    moment = driven.unbalance + plant.moment * direction[0] + plant.moment * direction[1]
    steady = speed * speed * (moment * complex(spring, -drag)) / size
    (z, velocity), turning = _whirl(row, 0), complex(0.0, speed)
    d = z - steady
    a = velocity + turning * d + half * d
    if square > half * half:
        jw, decay = complex(0.0, root), math.exp(-half * step)
        pull = 0.5 * square * (abs(a + jw * d) + abs(a - jw * d)) / root
        cosine, sine = decay * math.cos(root * step), decay * math.sin(root * step) / root
    else:
        slow, fast = root - half, -root - half
        pull = 0.5 * (slow * slow * abs(a + root * d) + fast * fast * abs(a - root * d)) / root
        slow, fast = math.exp(slow * step), math.exp(fast * step)
        cosine, sine = 0.5 * (slow + fast), 0.5 * (slow - fast) / root
    pressure = plant.moment * speed * speed
    for i in range(2):
        load = abs(driven.torque[i] + pressure * _across(steady, direction[i])) + plant.moment * pull
        if row[FLAG + i] != LOCKED and not load <= plant.friction_arm[i] * pressure:
            return False
    later = cosine * d + sine * a
    rate = cosine * a + (half * half - square) * sine * d - half * later - turning * later
    back = complex(math.cos(speed * step), -math.sin(speed * step))
    z, velocity = steady + back * later, back * rate
    row[X], row[Y], row[X_RATE], row[Y_RATE] = z.real, z.imag, velocity.real, velocity.imag
    for i in range(2):
        if row[FLAG + i] != LOCKED:
            row[FLAG + i] = STUCK
    return True


@in_place
def plant_step(
    plant: PlantParameters, row: FloatArray, speed: float, speed_rate: float, step: float
) -> float:
    """Integrate state and flags of a row over one step, with its voltages, the speed linear in time.

    Returns: Energy that both motors take from the supply, J: sum V (V h - K_m n (phi(t + h) - phi(t))) / R_m,
    the exact integral of V i; negative when a motor feeds back.
    Range: the masses are points on the track; contact between them is not modelled.
    Source: Dormand and Prince (1980), the fifth-order formula; Kirchhoff's law for the motor without
    inductance, Eqs. (A1) to (A3) of the paper on eccentric masses.
    """
    for i in range(2):
        row[VOLTAGE + i] = min(max(row[VOLTAGE + i], -plant.maximum_voltage), plant.maximum_voltage)
        if row[FLAG + i] == LOCKED:
            row[TURN + i] = 0.0
    torque = (plant.drive_gain * row[VOLTAGE], plant.drive_gain * row[VOLTAGE + 1])
    before = (row[ANGLE], row[ANGLE + 1])
    driven = _Driven(plant, speed_rate, plant.unbalance * _direction(plant.phase), torque)
    if not _held_step(driven, row, speed, step):
        parts = substeps(plant, speed, speed_rate, step)
        for part in range(parts):
            _advance(driven, row, speed + speed_rate * (step / parts) * part, step / parts)
    energy = 0.0
    for i in range(2):
        back = plant.back_emf_constant * plant.gear_ratio * (row[ANGLE + i] - before[i])
        energy += row[VOLTAGE + i] * (row[VOLTAGE + i] * step - back) / plant.resistance
    return energy
