"""Dry friction as a set-valued law: which masses are held, which slide, and which way.

A mass that slides is braked by mu_f b (W + phi')^2.  A mass at rest on its track is held by whatever torque
it takes, up to mu_f b W^2; beyond that it breaks away in the direction of the torque.  Since phi'' enters
both masses' equations, two masses at rest are looked at together: the mass matrix is positive definite, so
exactly one of the nine combinations of held, forwards and backwards is consistent.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.scene.arrays import FloatArray, IntArray

SLIDING: Final = 0
STUCK: Final = 1
LOCKED: Final = 2

HELD: Final = 0
FORWARDS: Final = 1
BACKWARDS: Final = -1

_ROUNDING: Final = 1e-12


class Torques(NamedTuple):
    """The equations of both masses once the rotor's accelerations are eliminated.

    A phi'' = g - friction, with A = [[own, cross], [cross, own]].
    """

    own: float
    """J + J_add - b^2 / M, kg m^2."""
    cross: float
    """-b^2 / M cos(phi_1 - phi_2), kg m^2."""
    driving_1: float
    """g of the first mass, all torques but friction, N m."""
    driving_2: float
    """g of the second mass, N m."""
    friction_1: float
    """mu_f b (W + phi')^2 of the first mass, N m."""
    friction_2: float
    """mu_f b (W + phi')^2 of the second mass, N m."""


@compiled
def angular_accelerations(torques: Torques, first: int, second: int) -> tuple[float, float]:
    """Solve for phi'' of both masses in given motions. Returns: phi_1'' and phi_2'', rad/s^2."""
    net_1 = torques.driving_1 - first * torques.friction_1
    net_2 = torques.driving_2 - second * torques.friction_2
    if first == HELD:
        return 0.0, 0.0 if second == HELD else net_2 / torques.own
    if second == HELD:
        return net_1 / torques.own, 0.0
    determinant = torques.own * torques.own - torques.cross * torques.cross
    one = (torques.own * net_1 - torques.cross * net_2) / determinant
    two = (torques.own * net_2 - torques.cross * net_1) / determinant
    return one, two


@compiled
def slips(torques: Torques, mass: int, other_acceleration: float) -> bool:
    """Whether a held mass breaks loose: |g - cross phi''_other| > mu_f b W^2."""
    driving = torques.driving_1 if mass == 0 else torques.driving_2
    most = torques.friction_1 if mass == 0 else torques.friction_2
    return abs(driving - torques.cross * other_acceleration) > most * (1.0 + _ROUNDING)


@compiled
def _consistent(torques: Torques, first: int, second: int, loose_1: bool, loose_2: bool) -> bool:
    """Whether motions of masses at rest hold together; a mass that already moves is not asked."""
    one, two = angular_accelerations(torques, first, second)
    if loose_1 and first == HELD and slips(torques, 0, two):
        return False
    if loose_2 and second == HELD and slips(torques, 1, one):
        return False
    if loose_1 and first != HELD and first * one < 0.0:
        return False
    return not (loose_2 and second != HELD and second * two < 0.0)


@compiled
def _sliding(rate: float) -> int:
    return FORWARDS if rate > 0.0 else BACKWARDS


@compiled
def motions(torques: Torques, state: FloatArray, stuck: IntArray) -> tuple[int, int]:
    """Which way each mass moves, or that it is held: HELD, FORWARDS or BACKWARDS."""
    loose_1 = stuck[0] != LOCKED and state[6] == 0.0
    loose_2 = stuck[1] != LOCKED and state[7] == 0.0
    known_1 = HELD if stuck[0] == LOCKED else _sliding(state[6])
    known_2 = HELD if stuck[1] == LOCKED else _sliding(state[7])
    for turn_1 in range(3):
        first = (HELD, FORWARDS, BACKWARDS)[turn_1] if loose_1 else known_1
        for turn_2 in range(3):
            second = (HELD, FORWARDS, BACKWARDS)[turn_2] if loose_2 else known_2
            if _consistent(torques, first, second, loose_1, loose_2):
                return first, second
            if not loose_2:
                break
        if not loose_1:
            break
    # Only rounding can bring us here: the torques are at their bounds.
    return (HELD if loose_1 else known_1), (HELD if loose_2 else known_2)
