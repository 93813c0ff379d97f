"""Time integration of the plant, with events where a mass stops, sticks or breaks away.

Between events the motion is smooth and integrated by the fifth-order Runge-Kutta formula of Dormand and
Prince.  An event is located within its step by bisection to machine precision; the mass is set to rest there,
and the friction law decides its further motion.  A step is divided until it is short compared with the time
constants of the plant.  While friction holds both masses at constant speed the step has a closed form.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.plant import (
    HELD,
    LOCKED,
    SIZE,
    SLIDING,
    STUCK,
    Drive,
    Motions,
    PlantParameters,
    angular_accelerations,
    drive_of,
    loads,
    motions,
    slips,
    write_derivative,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.platform.compiled import compiled
from ringbalance.scene.units import format_quantity

MAX_RATE_PRODUCT: Final = 0.1
"""Largest product of a substep and the plant's fastest rate."""
_STAGES: Final = 6
_BISECTIONS: Final = 40
_MAX_EVENTS: Final = 64
_COUPLING: Final = np.array(
    [
        [0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    ]
)
"""Weights of the earlier stages, one row for each of the six stages.

Source: Dormand and Prince, "A family of embedded Runge-Kutta formulae", J. Comp. Appl. Math. 6 (1980).
"""
_TIMES: Final = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0])
"""Times of the stages, as fractions of the step."""
_WEIGHTS: Final = np.array([35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84])
"""Weights of the stages in the result of order 5."""
_LEAST_ROOT_DISTANCE: Final = 1e-6
"""Smallest relative distance of the two roots: the closed form divides by their difference."""


@compiled
def _smooth(
    parameters: PlantParameters,
    state: FloatArray,
    speed: float,
    drive: Drive,
    motion: Motions,
    step: float,
    work: FloatArray,
    out: FloatArray,
) -> None:
    """Write the state one step later, for unchanged motions of the masses.

    Args: `work`: workspace, one row for each stage and one for the argument of the next.
    """
    argument = work[_STAGES]
    for stage in range(_STAGES):
        for i in range(SIZE):
            total = 0.0
            for earlier in range(stage):
                total += _COUPLING[stage, earlier] * work[earlier, i]
            argument[i] = state[i] + step * total
        then = speed + drive.rate * step * _TIMES[stage]
        write_derivative(parameters, argument, then, drive, motion, work[stage])
    for i in range(SIZE):
        total = 0.0
        for stage in range(_STAGES):
            total += _WEIGHTS[stage] * work[stage, i]
        out[i] = state[i] + step * total


@compiled
def _broken(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    speed: float,
    drive: Drive,
    motion: Motions,
) -> bool:
    """Return True if the motion of a mass differs from `motion`: it has stopped or broken away."""
    if motion[0] * state[6] < 0.0 or motion[1] * state[7] < 0.0:
        return True
    held = (motion[0] == HELD and stuck[0] != LOCKED, motion[1] == HELD and stuck[1] != LOCKED)
    if not (held[0] or held[1]):
        return False
    torques = loads(parameters, state, speed, drive).torques
    first, second = angular_accelerations(torques, motion)
    return (held[0] and slips(torques, 0, second)) or (held[1] and slips(torques, 1, first))


@compiled
def _first_event(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    speed: float,
    drive: Drive,
    motion: Motions,
    step: float,
    work: FloatArray,
    out: FloatArray,
) -> float:
    """Time just after the first event within a step, s; `out` gets the state at that time."""
    before, after = 0.0, step
    for trial in range(_BISECTIONS + 1):
        middle = 0.5 * (before + after)
        last = trial == _BISECTIONS or not before < middle < after
        time = after if last else middle
        _smooth(parameters, state, speed, drive, motion, time, work, out)
        if last:
            break
        if _broken(parameters, out, stuck, speed + drive.rate * middle, drive, motion):
            after = middle
        else:
            before = middle
    for mass in range(2):
        if motion[mass] * out[6 + mass] < 0.0:
            out[6 + mass] = 0.0
    return after


@compiled
def _advance(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    speed: float,
    drive: Drive,
    step: float,
    work: FloatArray,
    trial: FloatArray,
) -> None:
    """Integrate state and flags over one substep, event by event, in place."""
    done = 0.0
    for event in range(_MAX_EVENTS):
        now = speed + drive.rate * done
        motion = motions(loads(parameters, state, now, drive).torques, state, stuck)
        for mass in range(2):
            if stuck[mass] != LOCKED:
                stuck[mass] = STUCK if motion[mass] == HELD else SLIDING
        left = step - done
        _smooth(parameters, state, now, drive, motion, left, work, trial)
        cut = event < _MAX_EVENTS - 1 and _broken(
            parameters, trial, stuck, now + drive.rate * left, drive, motion
        )
        if cut:
            done += _first_event(parameters, state, stuck, now, drive, motion, left, work, trial)
        # Element by element: numba takes ten times as long to compile an array assignment.
        for i in range(SIZE):
            state[i] = trial[i]
        if not cut or done >= step:
            return


@compiled
def _fastest_rate(parameters: PlantParameters, speed: float) -> float:
    """Bound on any rate, rad/s: |W| + sqrt(K_B/M) + C_B/M + C_add/(J + J_add - 2 b^2/M)."""
    least = parameters.inertia + parameters.drive_inertia - 2 * parameters.moment**2 / parameters.mass
    rotor = math.sqrt(parameters.stiffness / parameters.mass) + parameters.damping / parameters.mass
    return abs(speed) + rotor + parameters.drive_damping / least


@compiled
def substeps(parameters: PlantParameters, speed: float, rate: float, step: float) -> int:
    """Number of substeps, at least 1, that keeps rate times substep within `MAX_RATE_PRODUCT`."""
    fastest = _fastest_rate(parameters, max(abs(speed), abs(speed + rate * step)))
    return max(1, math.ceil(fastest * step / MAX_RATE_PRODUCT))


@compiled
def plant_step(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    command: FloatArray,
    speed: float,
    speed_rate: float,
    step: float,
) -> tuple[FloatArray, IntArray]:
    """Integrate the plant over one step, with constant voltages and the rotor's speed linear in time.

    Returns: State and flags at the end, as new arrays.
    Range: the masses are points on the track; contact between them is not modelled.
    Source: Dormand and Prince (1980), the fifth-order formula.
    """
    after, flags = state.copy(), stuck.copy()
    for mass in range(2):
        if flags[mass] == LOCKED:
            after[6 + mass] = 0.0
    drive = drive_of(parameters, command, speed_rate)
    if _held_step(parameters, after, flags, speed, drive, step):
        return after, flags
    parts = substeps(parameters, speed, speed_rate, step)
    short = step / parts
    work, trial = np.empty((_STAGES + 1, SIZE)), np.empty(SIZE)
    for part in range(parts):
        now = speed + speed_rate * short * part
        _advance(parameters, after, flags, now, drive, short, work, trial)
    return after, flags


@compiled
def _held_step(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    speed: float,
    drive: Drive,
    step: float,
) -> bool:
    """Integrate the rotor over one step, in place, if both masses are certainly held; return True if so.

    The deviation d = z - z_s from the steady whirl obeys M D'' + C_B D' + K_B D = 0 for D = d exp(j W t), so
    d = d_1 exp((s_1 - j W) t) + d_2 exp((s_2 - j W) t), with s the roots of M s^2 + C_B s + K_B.  The track's
    acceleration is -W^2 z_s + s_1^2 d_1 ... + s_2^2 d_2 ...; since no root grows, the sum of the magnitudes
    bounds the load on friction from now on.
    """
    if drive.rate != 0.0 or speed == 0.0 or state[6] != 0.0 or state[7] != 0.0:
        return False
    mass, half = parameters.mass, 0.5 * parameters.damping / parameters.mass
    root = cmath.sqrt(complex(half * half - parameters.stiffness / mass, 0.0))
    first, second = root - half, -root - half
    if abs(root) < _LEAST_ROOT_DISTANCE * abs(first) or second.real > 0.0 or first.real > 0.0:
        return False
    moment = complex(drive.unbalance_x, drive.unbalance_y)
    for i in range(2):
        moment += parameters.moment * complex(math.cos(state[4 + i]), math.sin(state[4 + i]))
    dynamic = complex(parameters.stiffness - mass * speed * speed, parameters.damping * speed)
    # Without damping there is no steady whirl at the critical speed, hence no bound on the load.
    steady = speed * speed * moment / dynamic if dynamic != 0 else complex(math.inf, 0.0)
    away, turning = complex(state[0], state[1]) - steady, complex(0.0, speed)
    velocity = complex(state[2], state[3])
    first_part = (velocity - (second - turning) * away) / (first - second)
    second_part = away - first_part
    pull = abs(first) ** 2 * abs(first_part) + abs(second) ** 2 * abs(second_part)
    for i in range(2):
        across = steady.imag * math.cos(state[4 + i]) - steady.real * math.sin(state[4 + i])
        most = parameters.friction_arm[i] * parameters.moment * speed * speed
        load = abs(drive.torque[i] + parameters.moment * speed * speed * across) + parameters.moment * pull
        if stuck[i] != LOCKED and not load <= most:
            return False
    if not math.isfinite(pull):
        return False
    first_part *= cmath.exp((first - turning) * step)
    second_part *= cmath.exp((second - turning) * step)
    displacement = steady + first_part + second_part
    velocity = (first - turning) * first_part + (second - turning) * second_part
    state[0], state[1], state[2], state[3] = (
        displacement.real,
        displacement.imag,
        velocity.real,
        velocity.imag,
    )
    for i in range(2):
        if stuck[i] != LOCKED:
            stuck[i] = STUCK
    return True


MAX_SUBSTEPS: Final = 30_000_000
"""Substeps of a run of about one minute, at 2 us each."""
MAX_SAMPLES: Final = 2_000_000
"""Samples whose histories take about 500 MB."""
_INTERVAL_SUBSTEPS: Final = 50_000
"""Substeps between two reports of progress, some 0.1 s."""


def check_substeps(scene: EccentricScene) -> None:
    """Refuse a scene whose run would take many minutes or much memory.

    A substep lasts at most 0.1 / (|W| + sqrt(K_B / M) + C_B / M + C_add / J_least).
    Raises: SceneError: more than `MAX_SAMPLES`, or more than `MAX_SUBSTEPS`; it names the key of the
    fastest rate and what is allowed.
    """
    samples, duration = scene.run.time_limit / scene.sensor.step + 1, scene.run.time_limit
    if samples > MAX_SAMPLES:
        longest = scene.sensor.step * (MAX_SAMPLES - 1)
        raise SceneError(
            [
                Fault(
                    file=scene.file,
                    table="run",
                    key="time_limit",
                    value=format_quantity(duration, "time", "s"),
                    problem=f"the run would take {samples:.3g} samples, and {MAX_SAMPLES:.3g} are the most",
                    allowed=f"at most {longest:.4g} s, or a longer sensor.step",
                )
            ]
        )
    count = _substeps(scene)
    if count <= MAX_SUBSTEPS:
        return
    plant, resistance = PlantParameters.of(scene), scene.motor.resistance
    least = plant.inertia + plant.drive_inertia - 2 * plant.moment**2 / plant.mass
    speed = max(abs(point.speed) for point in scene.rotor.speed_profile)
    whirl, damped = math.sqrt(plant.stiffness / plant.mass), plant.damping / plant.mass
    drive = plant.drive_damping / least
    # Half of the allowed substeps: the other rates need the rest.
    rate = 0.5 * MAX_SUBSTEPS * MAX_RATE_PRODUCT / duration
    most, lowest = "at most", "at least"
    rates = [
        (whirl, ("rotor", "stiffness"), plant.stiffness, most, plant.mass * rate**2, "stiffness", "N/m"),
        (damped, ("rotor", "damping"), plant.damping, most, plant.mass * rate, "damping", "N*s/m"),
        (speed, ("rotor", "speed_profile"), speed, most, rate, "speed", "rpm"),
        (drive, ("motor", "resistance"), resistance, lowest, resistance * drive / rate, "resistance", "ohm"),
    ]
    _, (table, key), value, bound, limit, dimension, unit = max(rates)
    limit_text = format_quantity(limit, dimension, unit, digits=3)
    problem = f"the run would take {count:.3g} steps of the integration, and {MAX_SUBSTEPS:.3g} are the most"
    raise SceneError(
        [
            Fault(
                file=scene.file,
                table=table,
                key=key,
                value=format_quantity(value, dimension, unit),
                problem=problem,
                allowed=f"{bound} {limit_text}, or a shorter run.time_limit",
            )
        ]
    )


def _substeps(scene: EccentricScene) -> float:
    """Number of substeps of a whole run, estimated from the speed at no more than 10,000 instants."""
    times, speeds = scene.rotor.profile
    samples = scene.samples
    instants = np.linspace(0.0, scene.run.time_limit, min(samples, 10_000))
    rates = np.abs(np.interp(instants, times, speeds)) + _fastest_rate(PlantParameters.of(scene), 0.0)
    substeps_each = np.maximum(np.ceil(rates * scene.sensor.step / MAX_RATE_PRODUCT), 1.0)
    return samples * float(np.mean(substeps_each))


def intervals(scene: EccentricScene) -> Iterator[tuple[int, int]]:
    """Yield first sample, and last sample plus one, of each interval between two reports of progress."""
    size = max(1, round(_INTERVAL_SUBSTEPS * scene.samples / _substeps(scene)))
    for begin in range(0, scene.samples, size):
        yield begin, min(begin + size, scene.samples)
