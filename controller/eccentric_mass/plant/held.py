"""One step with both masses held at constant speed: the rotor alone, in closed form.

The deviation d = z - z_s from the steady whirl obeys M D'' + C_B D' + K_B D = 0 for D = d exp(j W t), so
d = d_1 exp((s_1 - j W) t) + d_2 exp((s_2 - j W) t), with s the roots of M s^2 + C_B s + K_B.  The track's
acceleration is -W^2 z_s + s_1^2 d_1 ... + s_2^2 d_2 ...; since no root grows, the sum of the magnitudes
bounds what friction has to hold from now on.
"""

from __future__ import annotations

import cmath
import math
from typing import Final

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.eccentric_mass.plant.friction import LOCKED, STUCK
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.controller.eccentric_mass.plant.plant import Drive
from ringbalance.scene.arrays import FloatArray, IntArray

_APART: Final = 1e-6
"""Least distance of both roots, relative, which divides by it."""


@compiled
def held_step(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    speed: float,
    drive: Drive,
    step: float,
) -> bool:
    """Carry the rotor through one step, in place, if both masses are held for sure; say whether they are."""
    if drive.rate != 0.0 or speed == 0.0 or state[6] != 0.0 or state[7] != 0.0:
        return False
    mass, half = parameters.mass, 0.5 * parameters.damping / parameters.mass
    root = cmath.sqrt(complex(half * half - parameters.stiffness / mass, 0.0))
    first, second = root - half, -root - half
    if abs(root) < _APART * abs(first) or second.real > 0.0 or first.real > 0.0:
        return False
    steady = _steady(parameters, state, speed, drive)
    away, turning = complex(state[0], state[1]) - steady, complex(0.0, speed)
    velocity = complex(state[2], state[3])
    one = (velocity - (second - turning) * away) / (first - second)
    two = away - one
    pull = abs(first) ** 2 * abs(one) + abs(second) ** 2 * abs(two)
    if not _holds(parameters, state, stuck, speed, drive, steady, pull):
        return False
    one *= cmath.exp((first - turning) * step)
    two *= cmath.exp((second - turning) * step)
    place, pace = steady + one + two, (first - turning) * one + (second - turning) * two
    state[0], state[1], state[2], state[3] = place.real, place.imag, pace.real, pace.imag
    for i in range(2):
        if stuck[i] != LOCKED:
            stuck[i] = STUCK
    return True


@compiled
def _steady(parameters: PlantParameters, state: FloatArray, speed: float, drive: Drive) -> complex:
    moment = complex(drive.unbalance_x, drive.unbalance_y)
    for i in range(2):
        moment += parameters.moment * complex(math.cos(state[4 + i]), math.sin(state[4 + i]))
    dynamic = complex(parameters.stiffness - parameters.mass * speed * speed, parameters.damping * speed)
    # Without damping at the critical speed there is none: friction then holds nothing for sure.
    return speed * speed * moment / dynamic if dynamic != 0 else complex(math.inf, 0.0)


@compiled
def _holds(
    parameters: PlantParameters,
    state: FloatArray,
    stuck: IntArray,
    speed: float,
    drive: Drive,
    steady: complex,
    pull: float,
) -> bool:
    """Whether friction holds both masses against drive, steady whirl and any deviation of that size."""
    for i in range(2):
        if stuck[i] == LOCKED:
            continue
        torque, arm = drive.torque_1, parameters.friction_arm_1
        if i == 1:
            torque, arm = drive.torque_2, parameters.friction_arm_2
        across = steady.imag * math.cos(state[4 + i]) - steady.real * math.sin(state[4 + i])
        load = abs(torque + parameters.moment * speed * speed * across) + parameters.moment * pull
        if not load <= arm * parameters.moment * speed * speed:
            return False
    return math.isfinite(pull)
