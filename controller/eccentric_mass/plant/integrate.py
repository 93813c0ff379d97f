"""One step of the plant: fixed steps of fifth order, cut where a mass stops, sticks or breaks away; in closed
form while friction holds both masses at constant speed.

Between such events the motion is smooth and a Runge-Kutta step of Dormand and Prince's fifth-order formula
carries it; within the step that holds an event the event's time is found by bisection to the last digits,
the mass is set to rest there, and the friction law gives what follows.  The step given is divided until it
is short against every rate of the plant.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.dormand_prince import COUPLING, TIMES, WEIGHTS
from ringbalance.controller.eccentric_mass.plant.friction import (
    HELD,
    LOCKED,
    SLIDING,
    STUCK,
    angular_accelerations,
    motions,
    slips,
)
from ringbalance.controller.eccentric_mass.plant.held import held_step
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.controller.eccentric_mass.plant.plant import SIZE, Drive, drive_of, loads, write_derivative
from ringbalance.scene.arrays import FloatArray, IntArray

LONGEST: Final = 0.1
"""Greatest product of a substep and the plant's fastest rate."""
_STAGES: Final = 6
_BISECTIONS: Final = 40
_MOST_EVENTS: Final = 64


@compiled
def _smooth(
    parameters: PlantParameters,
    state: FloatArray,
    speed: float,
    drive: Drive,
    motion: tuple[int, int],
    step: float,
    work: FloatArray,
    out: FloatArray,
) -> None:
    """Write the state one step later, the motions of the masses staying as they are.

    `work` has one row for each stage and one for the argument of the next.
    """
    argument = work[_STAGES]
    for stage in range(_STAGES):
        for place in range(SIZE):
            total = 0.0
            for earlier in range(stage):
                total += COUPLING[stage, earlier] * work[earlier, place]
            argument[place] = state[place] + step * total
        then = speed + drive.rate * step * TIMES[stage]
        write_derivative(parameters, argument, then, drive, motion, work[stage])
    for place in range(SIZE):
        total = 0.0
        for stage in range(_STAGES):
            total += WEIGHTS[stage] * work[stage, place]
        out[place] = state[place] + step * total


@compiled
def _broken(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    speed: float,
    drive: Drive,
    motion: tuple[int, int],
) -> bool:
    """Whether a mass no longer moves, or is no longer held, as `motion` says."""
    if motion[0] * state[6] < 0.0 or motion[1] * state[7] < 0.0:
        return True
    held_1 = motion[0] == HELD and stuck[0] != LOCKED
    held_2 = motion[1] == HELD and stuck[1] != LOCKED
    if not held_1 and not held_2:
        return False
    torques = loads(parameters, state, speed, drive).torques
    one, two = angular_accelerations(torques, motion[0], motion[1])
    return (held_1 and slips(torques, 0, two)) or (held_2 and slips(torques, 1, one))


@compiled
def _first_event(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    speed: float,
    drive: Drive,
    motion: tuple[int, int],
    step: float,
    work: FloatArray,
    out: FloatArray,
) -> float:
    """Time just after the first event within a step; the state there is written."""
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
    """Carry state and flags through one substep, event by event, in place."""
    done = 0.0
    for event in range(_MOST_EVENTS):
        now = speed + drive.rate * done
        motion = motions(loads(parameters, state, now, drive).torques, state, stuck)
        for mass in range(2):
            if stuck[mass] != LOCKED:
                stuck[mass] = STUCK if motion[mass] == HELD else SLIDING
        left = step - done
        _smooth(parameters, state, now, drive, motion, left, work, trial)
        cut = event < _MOST_EVENTS - 1 and _broken(
            parameters, trial, stuck, now + drive.rate * left, drive, motion
        )
        if cut:
            done += _first_event(parameters, state, stuck, now, drive, motion, left, work, trial)
        # An element at a time: numba compiles array assignment ten times as long.
        for place in range(SIZE):
            state[place] = trial[place]
        if not cut or done >= step:
            return


@compiled
def fastest_rate(parameters: PlantParameters, speed: float) -> float:
    """Bound on any rate, rad/s: |W| + sqrt(K_B/M) + C_B/M + C_add/(J + J_add - 2 b^2/M)."""
    least = parameters.inertia + parameters.drive_inertia - 2 * parameters.moment**2 / parameters.mass
    rotor = math.sqrt(parameters.stiffness / parameters.mass) + parameters.damping / parameters.mass
    return abs(speed) + rotor + parameters.drive_damping / least


@compiled
def substeps(parameters: PlantParameters, speed: float, rate: float, step: float) -> int:
    """Number of substeps that keeps each short against every rate of the plant. Returns: At least 1."""
    fastest = fastest_rate(parameters, max(abs(speed), abs(speed + rate * step)))
    return max(1, math.ceil(fastest * step / LONGEST))


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
    """Carry the plant through one step, voltages held and the rotor's speed linear in time.

    Returns: State and flags at the end, as new arrays.
    Range: the masses are points on the track; that they could touch is for the caller to prevent.
    Source: Dormand and Prince (1980), the fifth-order formula.
    """
    after, flags = state.copy(), stuck.copy()
    for mass in range(2):
        if flags[mass] == LOCKED:
            after[6 + mass] = 0.0
    drive = drive_of(parameters, command, speed_rate)
    if held_step(parameters, after, flags, speed, drive, step):
        return after, flags
    parts = substeps(parameters, speed, speed_rate, step)
    short = step / parts
    work, trial = np.empty((_STAGES + 1, SIZE)), np.empty(SIZE)
    for part in range(parts):
        now = speed + speed_rate * short * part
        _advance(parameters, after, flags, now, drive, short, work, trial)
    return after, flags
