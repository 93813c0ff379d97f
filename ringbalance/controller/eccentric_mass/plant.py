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
by a brake that no torque overcomes.  A step is plain loops on the real numbers of one row, state first.

Dry friction is a set-valued law.  A sliding mass is braked by mu_f b (W + phi')^2.  A mass at rest on its
track is held by any torque up to mu_f b W^2; under a larger load it breaks away in the direction of the load.
Since phi'' enters both masses' equations, two masses at rest are treated together: the mass matrix is
positive definite, so exactly one of the nine combinations of held, forwards and backwards is consistent.

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
    left = cmath.rect(plant.unbalance, plant.phase) + plant.mass_vector(scene.masses.initial_angle)
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


SLIDING, STUCK, LOCKED = 0.0, 1.0, 2.0
"""Flags of a mass."""
X, Y, X_RATE, Y_RATE, ANGLE, TURN = 0, 1, 2, 3, 4, 6
"""Indices of the state in a row: displacement, m, velocity, m/s, angles, rad, and rates, rad/s."""
SIZE: Final = 8
FLAG, VOLTAGE = 8, 10
_SPEED_RATE, _UNBALANCE, _TORQUE, _MOTION, _ACCELERATION, _BEFORE = 12, 13, 15, 17, 19, 21
_FORCE, _DRIVING, _FRICTION, _COSINE, _SINE, _CROSS = 23, 25, 27, 29, 31, 33
_TRIAL, _SLOPES, ROW_SIZE = 34, 42, 90
"""Indices behind the state: flags and voltages, V, of both masses, then what a step works with."""

MAX_RATE_PRODUCT: Final = 0.25
"""Largest product of a substep and the plant's fastest rate: half of it moves no angle by 1e-8 rad."""
_BISECTIONS, _MAX_EVENTS = 40, 64
_ROUNDING, _LEAST_ROOT = 1e-12, 1e-6
_COUPLING: Final = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
"""Weights of the earlier stages in each of the six stages, and in the result of order 5.

Source: Dormand and Prince, "A family of embedded Runge-Kutta formulae", J. Comp. Appl. Math. 6 (1980).
"""
_TIMES: Final = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0])
"""Times of the stages, as fractions of the step."""


def plant_row(angles: Pair, flag: float = STUCK) -> FloatArray:
    """Row of a rotor at its centre, in its own frame, with masses at rest on the track and motors off."""
    row = np.zeros(ROW_SIZE)
    row[ANGLE:TURN], row[FLAG:VOLTAGE] = angles, flag
    return row


@in_place
def _set_loads(plant: PlantParameters, row: FloatArray, at: int, speed: float) -> None:
    """Write the forces on rotor and masses in the state at an index of the row.

    Without the rotor's accelerations A phi'' = g - friction, with A_ij = (J + J_add) delta_ij
    - b^2 / M cos(phi_i - phi_j) and g_i = u_i - J W' - b / M (-F_x sin phi_i + F_y cos phi_i), where F is all
    in the rotor's equations but M a and b phi''.
    """
    b, rate = plant.moment, row[_SPEED_RATE]
    x, y = row[at + X], row[at + Y]
    force_x = speed * speed * row[_UNBALANCE] + rate * row[_UNBALANCE + 1]
    force_y = speed * speed * row[_UNBALANCE + 1] - rate * row[_UNBALANCE]
    force_x -= plant.damping * (row[at + X_RATE] - speed * y) + plant.stiffness * x
    force_y -= plant.damping * (row[at + Y_RATE] + speed * x) + plant.stiffness * y
    for i in range(2):
        cosine, sine = math.cos(row[at + ANGLE + i]), math.sin(row[at + ANGLE + i])
        square = (speed + row[at + TURN + i]) * (speed + row[at + TURN + i])
        force_x += b * (square * cosine + rate * sine)
        force_y += b * (square * sine - rate * cosine)
        row[_COSINE + i], row[_SINE + i] = cosine, sine
        row[_FRICTION + i] = plant.friction_arm[i] * b * square
    for i in range(2):
        motor = row[_TORQUE + i] - plant.drive_damping * row[at + TURN + i]
        load = b / plant.mass * (force_y * row[_COSINE + i] - force_x * row[_SINE + i])
        row[_DRIVING + i] = motor - plant.inertia * rate - load
    row[_FORCE], row[_FORCE + 1] = force_x, force_y
    cosine = row[_COSINE] * row[_COSINE + 1] + row[_SINE] * row[_SINE + 1]
    row[_CROSS] = -b * b / plant.mass * cosine


@in_place
def _set_accelerations(plant: PlantParameters, row: FloatArray) -> None:
    """Write phi'' of both masses in their motions, rad/s^2, from the forces in the row."""
    inertia = plant.inertia + plant.drive_inertia - plant.moment * plant.moment / plant.mass
    first, second, cross = 0.0, 0.0, 0.0
    if row[_MOTION] != 0.0:
        first = row[_DRIVING] - row[_MOTION] * row[_FRICTION]
    if row[_MOTION + 1] != 0.0:
        second = row[_DRIVING + 1] - row[_MOTION + 1] * row[_FRICTION + 1]
    if row[_MOTION] * row[_MOTION + 1] != 0.0:
        cross = row[_CROSS]
    determinant = inertia * inertia - cross * cross
    row[_ACCELERATION] = (inertia * first - cross * second) / determinant
    row[_ACCELERATION + 1] = (inertia * second - cross * first) / determinant


@in_place
def _slips(row: FloatArray, mass: int) -> bool:
    """Return True if a held mass breaks loose: |g - A_12 phi''_other| > mu_f b W^2."""
    load = abs(row[_DRIVING + mass] - row[_CROSS] * row[_ACCELERATION + 1 - mass])
    return bool(load > row[_FRICTION + mass] * (1.0 + _ROUNDING))


@in_place
def _set_motion(plant: PlantParameters, row: FloatArray) -> None:
    """Write flags and motions, 0 for held or the sign of the rate; one of nine combinations is consistent."""
    # The tenth trial, held again, is reached by round-off only: the torques are at their bounds.
    for trial in range(10):
        consistent = True
        for i in range(2):
            way = (trial // 3) % 3 if i == 0 else trial % 3
            row[_MOTION + i] = 1.0 if way == 1 else -0.5 * way
            if row[FLAG + i] == LOCKED:
                row[_MOTION + i] = 0.0
            elif row[TURN + i] != 0.0:
                row[_MOTION + i] = 1.0 if row[TURN + i] > 0.0 else -1.0
        _set_accelerations(plant, row)
        for i in range(2):
            if row[FLAG + i] != LOCKED and row[TURN + i] == 0.0:
                slipping = row[_MOTION + i] == 0.0 and _slips(row, i)
                if slipping or row[_MOTION + i] * row[_ACCELERATION + i] < 0.0:
                    consistent = False
        if consistent:
            break
    for i in range(2):
        if row[FLAG + i] != LOCKED:
            row[FLAG + i] = STUCK if row[_MOTION + i] == 0.0 else SLIDING


@in_place
def _set_slope(plant: PlantParameters, row: FloatArray, at: int, speed: float, out: int) -> None:
    """Write the time derivative of the state at one index to another, for the motions in the row."""
    _set_loads(plant, row, at, speed)
    _set_accelerations(plant, row)
    first, second = row[_ACCELERATION], row[_ACCELERATION + 1]
    pull_x = plant.moment * (row[_SINE] * first + row[_SINE + 1] * second)
    pull_y = plant.moment * (row[_COSINE] * first + row[_COSINE + 1] * second)
    x, y, rate = row[at + X], row[at + Y], row[_SPEED_RATE]
    turning_x = 2 * speed * row[at + Y_RATE] + rate * y + speed * speed * x
    turning_y = 2 * speed * row[at + X_RATE] + rate * x - speed * speed * y
    row[out + X], row[out + Y] = row[at + X_RATE], row[at + Y_RATE]
    row[out + X_RATE] = (row[_FORCE] + pull_x) / plant.mass + turning_x
    row[out + Y_RATE] = (row[_FORCE + 1] - pull_y) / plant.mass - turning_y
    for i in range(2):
        row[out + ANGLE + i], row[out + TURN + i] = row[at + TURN + i], row[_ACCELERATION + i]


@in_place
def _smooth(plant: PlantParameters, row: FloatArray, speed: float, step: float) -> None:
    """Write the state one step later as trial, for unchanged motions of the masses."""
    for stage in range(7):
        for i in range(SIZE):
            total = 0.0
            for earlier in range(stage):
                total += _COUPLING[stage, earlier] * row[_SLOPES + SIZE * earlier + i]
            row[_TRIAL + i] = row[i] + step * total
        if stage < 6:
            now = speed + row[_SPEED_RATE] * step * _TIMES[stage]
            _set_slope(plant, row, _TRIAL, now, _SLOPES + SIZE * stage)


@in_place
def _has_event(plant: PlantParameters, row: FloatArray, speed: float) -> bool:
    """Return True if a mass has stopped or broken away in the trial."""
    holds = False
    for i in range(2):
        if row[_MOTION + i] * row[_TRIAL + TURN + i] < 0.0:
            return True
        holds = holds or (row[_MOTION + i] == 0.0 and row[FLAG + i] != LOCKED)
    if not holds:
        return False
    _set_loads(plant, row, _TRIAL, speed)
    _set_accelerations(plant, row)
    loose = False
    for i in range(2):
        loose = loose or (row[_MOTION + i] == 0.0 and row[FLAG + i] != LOCKED and _slips(row, i))
    return loose


@in_place
def _advance(plant: PlantParameters, row: FloatArray, speed: float, step: float) -> None:
    """Integrate state and flags over one substep; each event ends a part of it, at the time just after."""
    done, rate = 0.0, row[_SPEED_RATE]
    for event in range(_MAX_EVENTS):
        now, left = speed + rate * done, step - done
        _set_loads(plant, row, 0, now)
        _set_motion(plant, row)
        _smooth(plant, row, now, left)
        cut = event < _MAX_EVENTS - 1 and _has_event(plant, row, now + rate * left)
        if cut:
            before, after = 0.0, left
            for _ in range(_BISECTIONS):
                middle = 0.5 * (before + after)
                if not before < middle < after:
                    break
                _smooth(plant, row, now, middle)
                if _has_event(plant, row, now + rate * middle):
                    after = middle
                else:
                    before = middle
            _smooth(plant, row, now, after)
            done += after
        for i in range(SIZE):
            row[i] = row[_TRIAL + i]
        for i in range(2):
            if cut and row[_MOTION + i] * row[TURN + i] < 0.0:
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
def _length(x: float, y: float) -> float:
    return math.sqrt(x * x + y * y)


@in_place
def _held_step(plant: PlantParameters, row: FloatArray, speed: float, step: float) -> bool:
    """Integrate the rotor over one step if both masses are certainly held; return True if so.

    The deviation from the steady whirl, seen in the fixed frame, obeys D'' + 2 h D' + k D = 0: with
    A = D' + h D and w^2 = k - h^2, D(t) = exp(-h t) (D cos w t + A / w sin w t), and cosh, sinh for k < h^2.
    In both cases D is a sum of parts d_1, d_2 that do not grow, so that |s_1|^2 |d_1| + |s_2|^2 |d_2|, with
    the roots s = -h +- j w, bounds the track's acceleration, and with it the load on friction, from now on.
    """
    if row[_SPEED_RATE] != 0.0 or speed == 0.0 or row[TURN] != 0.0 or row[TURN + 1] != 0.0:
        return False
    half, square = 0.5 * plant.damping / plant.mass, plant.stiffness / plant.mass
    root = math.sqrt(abs(square - half * half))
    spring, drag = plant.stiffness - plant.mass * speed * speed, plant.damping * speed
    size = spring * spring + drag * drag
    # The closed form divides by w; without damping there is no steady whirl at the critical speed.
    if size == 0.0 or root <= _LEAST_ROOT * half:
        return False
    moment_x, moment_y, pressure = row[_UNBALANCE], row[_UNBALANCE + 1], plant.moment * speed * speed
    for i in range(2):
        row[_COSINE + i], row[_SINE + i] = math.cos(row[ANGLE + i]), math.sin(row[ANGLE + i])
        moment_x, moment_y = (
            moment_x + plant.moment * row[_COSINE + i],
            moment_y + plant.moment * row[_SINE + i],
        )
    steady_x = speed * speed * (moment_x * spring + moment_y * drag) / size
    steady_y = speed * speed * (moment_y * spring - moment_x * drag) / size
    x, y = row[X] - steady_x, row[Y] - steady_y
    a_x, a_y = row[X_RATE] - speed * y + half * x, row[Y_RATE] + speed * x + half * y
    if square > half * half:
        both = _length(a_x - root * y, a_y + root * x) + _length(a_x + root * y, a_y - root * x)
        pull, decay = 0.5 * square * both / root, math.exp(-half * step)
        cosine, sine = decay * math.cos(root * step), decay * math.sin(root * step) / root
    else:
        slow, fast = root - half, -root - half
        pull = slow * slow * _length(a_x + root * x, a_y + root * y)
        pull = 0.5 * (pull + fast * fast * _length(a_x - root * x, a_y - root * y)) / root
        slow, fast = math.exp(slow * step), math.exp(fast * step)
        cosine, sine = 0.5 * (slow + fast), 0.5 * (slow - fast) / root
    for i in range(2):
        across = steady_y * row[_COSINE + i] - steady_x * row[_SINE + i]
        load = abs(row[_TORQUE + i] + pressure * across) + plant.moment * pull
        if row[FLAG + i] != LOCKED and not load <= plant.friction_arm[i] * pressure:
            return False
    later_x, later_y = cosine * x + sine * a_x, cosine * y + sine * a_y
    shift = (half * half - square) * sine
    rate_x = cosine * a_x + shift * x - half * later_x + speed * later_y
    rate_y = cosine * a_y + shift * y - half * later_y - speed * later_x
    cosine, sine = math.cos(speed * step), math.sin(speed * step)
    row[X], row[Y] = (
        steady_x + cosine * later_x + sine * later_y,
        steady_y + cosine * later_y - sine * later_x,
    )
    row[X_RATE], row[Y_RATE] = cosine * rate_x + sine * rate_y, cosine * rate_y - sine * rate_x
    for i in range(2):
        if row[FLAG + i] != LOCKED:
            row[FLAG + i] = STUCK
    return True


@in_place
def _set_inputs(plant: PlantParameters, row: FloatArray, speed_rate: float) -> None:
    """Write what is constant within a step: speed rate, imbalance, torques of the motors at standstill."""
    row[_SPEED_RATE] = speed_rate
    row[_UNBALANCE] = plant.unbalance * math.cos(plant.phase)
    row[_UNBALANCE + 1] = plant.unbalance * math.sin(plant.phase)
    for i in range(2):
        voltage = min(max(row[VOLTAGE + i], -plant.maximum_voltage), plant.maximum_voltage)
        row[VOLTAGE + i], row[_TORQUE + i] = voltage, plant.drive_gain * voltage
        row[_BEFORE + i] = row[ANGLE + i]
        if row[FLAG + i] == LOCKED:
            row[TURN + i] = 0.0


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
    _set_inputs(plant, row, speed_rate)
    if not _held_step(plant, row, speed, step):
        parts = substeps(plant, speed, speed_rate, step)
        for part in range(parts):
            _advance(plant, row, speed + speed_rate * (step / parts) * part, step / parts)
    energy = 0.0
    for i in range(2):
        back = plant.back_emf_constant * plant.gear_ratio * (row[ANGLE + i] - row[_BEFORE + i])
        energy += row[VOLTAGE + i] * (row[VOLTAGE + i] * step - back) / plant.resistance
    return energy
