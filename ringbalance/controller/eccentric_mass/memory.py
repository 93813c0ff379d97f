"""Memory of the strategy and history of a run: stages, causes, and a record for each stage."""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.friction_filter import FRICTION_FILTER
from ringbalance.controller.eccentric_mass.imbalance_filter import IMBALANCE_FILTER

Pair = tuple[float, float]

NOT_YET: Final = -1.0


class Hold(IntEnum):
    """State of the drives."""

    MOVING = 0  # the masses to their goal
    RELEASED = 1  # off, since friction holds the masses
    HELD = 2  # holding the masses, where friction is not certain to


class Stage(IntEnum):
    """Stages of the strategy, with the paper's periods."""

    WAITING = 0
    IMBALANCE_ESTIMATION = 1  # (A) the masses are held, the imbalance is estimated
    FRICTION_ESTIMATION = 2  # (B) both masses go round together, their friction is estimated
    POSITIONING = 3  # (C) the masses go to their targets
    CHECK = 4  # (D) the drives rest, the vibration is averaged
    CORRECTION = 5  # the masses go to targets that the averaged vibration has corrected; a check follows
    FINE_TUNING = 6  # (E) by trial
    REST = 7  # (F) nothing more to do
    FAILED = 8  # nothing more that can be done: the masses are held where they are


STAGE_NAMES: Final = tuple(each.name.lower().replace("_", " ") for each in Stage)


class Cause(IntEnum):
    """Cause of entering the last stage."""

    NONE, BALANCED, SATURATED, RESIDUAL, TUNING_TIME, SPEED_CHANGED, TOO_SLOW = range(7)
    SPEED_NOT_CONSTANT, IMBALANCE_UNCERTAIN, FRICTION_UNCERTAIN, STALLED, NOT_ARRIVED = range(7, 12)
    LOCKED, MASSES_MOVE = range(12, 14)


CAUSE_NAMES: Final = tuple(each.name.lower() for each in Cause)


class EccentricMeasurement(NamedTuple):
    """Sample of all measured quantities."""

    time: float
    speed: float
    """W, rad/s."""
    speed_rate: float
    """W', rad/s^2."""
    rotor_angle: float
    """Angle of the rotor's first axis, rad."""
    position: complex
    """Displacement in the sensor's frame, m."""
    velocity: complex
    """Velocity in the sensor's frame, m/s."""
    angle: Pair
    """Angles of the masses, rad, not wrapped."""
    rate: Pair
    """Rates of the masses, rad/s."""


_REAL, _WHOLE, _COMPLEX, _PAIR = np.float64, np.int64, np.complex128, (np.float64, (2,))
_ESTIMATION: Final = np.dtype(
    [
        ("filter", IMBALANCE_FILTER),
        ("deviation", _REAL),  # largest standard deviation of the imbalance in any direction, kg m
        ("running", _WHOLE),  # 1 if the filter used the last sample that it was due
        ("judged", _WHOLE),  # samples in `surprise`
        ("surprise", _REAL),  # sum of normalised innovations squared
        ("mass_vector", _COMPLEX),  # p = b sum exp(j phi_i) at the filter's last sample, kg m
        ("mass_pace", _COMPLEX),  # time derivative of `mass_vector`, kg m/s
    ]
)
_FRICTION: Final = np.dtype(
    [
        ("filter", FRICTION_FILTER, (2,)),
        ("driven", _WHOLE),  # samples of the stage, without its beginning
        ("stalled", _WHOLE),  # number of `driven` with a mass nearly at standstill
        ("torque", _PAIR),  # sum of known torques over the samples since the filter's last step, N m
        ("last_rate", _PAIR),  # rate measured at the filter's last step, rad/s
        ("motor", _PAIR),  # time integral of the stall torque B_add V over the stage, N m s
        ("back_emf", _PAIR),  # time integral of the torque loss by back-EMF, N m s
        ("arm_doubt", _PAIR),  # standard deviation of the arms by uncertain motor and masses, m
    ]
)
_TRAVEL: Final = np.dtype(
    [
        ("goal", _PAIR),  # desired angles of the masses, rad, unwrapped
        ("moving", _REAL),  # time at which the masses set out to the goal, s
        ("arrived", _REAL),  # time at which they arrived there, s, or NOT_YET
        ("nearest", _REAL),  # largest distance of a mass from its goal, rad, at the time `nearer`
        ("nearer", _REAL),  # last time at which the masses had come nearer by a noticeable angle, s
        ("short", _REAL),  # largest distance at which friction held a mass after the last move, rad
    ]
)
_MEAN: Final = np.dtype(
    [
        ("since", _REAL),  # time at which averaging begins, s; NOT_YET while the masses move
        ("total", _COMPLEX),  # sum of the rotor-fixed vibration, m
        ("samples", _WHOLE),
    ]
)
CORRECTION: Final = np.dtype(
    [
        ("goal", _PAIR),  # of the present step, rad; friction may hold the masses short of it
        ("aim", _COMPLEX),  # imbalance that `goal` cancels, kg m; beyond the true one to break masses away
        ("saturated", _WHOLE),  # 1 if the imbalance exceeds what the masses cancel
        ("left", _REAL),  # residual imbalance at the targets, kg m
        ("best_goal", _PAIR),  # goal of the least mean vibration, rad
        ("best_aim", _COMPLEX),  # imbalance that `best_goal` cancels, kg m
        ("residual", _COMPLEX),  # mean vibration at `best_goal`, m; infinite before the first mean
        ("share", _REAL),  # fraction of the full step
        ("steps", _WHOLE),  # number of steps so far
    ]
)
TUNING: Final = np.dtype(
    [
        ("base", _PAIR),  # best goal, rad
        ("least", _REAL),  # mean amplitude there, m
        ("move_size", _REAL),  # travel of a mass in one move, rad
        ("move", _WHOLE),  # index of the present move among the four
        ("failed", _WHOLE),  # number of successive moves that brought no gain
        ("done", _WHOLE),  # 1 if the moves are shorter than the resolution of the search
    ]
)
MEMORY: Final = np.dtype(
    [
        ("sample", _WHOLE),  # number of the next sample
        ("time", _REAL),  # of the last sample, s
        ("stage", _WHOLE),
        ("entered", _REAL),  # time at which the stage began, s
        ("cause", _WHOLE),
        ("hold", _WHOLE),
        ("position", _COMPLEX),  # smoothed displacement, m; velocity, angle and rate are smoothed as well
        ("velocity", _COMPLEX),
        ("angle", _PAIR),
        ("rate", _PAIR),
        ("voltage", _PAIR),
        # Imbalance that the drive law believes, kg m: the filter's estimate, from rest on that of the mean.
        ("imbalance", _COMPLEX),
        ("estimation", _ESTIMATION),
        ("friction", _FRICTION),
        ("travel", _TRAVEL),
        ("mean", _MEAN),
        ("correction", CORRECTION),
        ("tuning", TUNING),
    ]
)
"""State of the strategy between two samples: what all stages share, and a record of each."""
HISTORY: Final = np.dtype(
    [
        ("state", np.float64, (8,)),  # of the plant
        ("voltage", _PAIR),  # V, from this sample on
        ("energy", _REAL),  # electrical energy since the start, J
        ("stage", _WHOLE),
        ("cause", _WHOLE),
        ("hold", _WHOLE),
        ("goal", _PAIR),  # rad
        ("imbalance", _PAIR),  # estimate along the rotor's axes, kg m
        ("imbalance_covariance", np.float64, (2, 2)),  # of the noise alone, kg^2 m^2
        ("friction_arm", _PAIR),  # estimates, m
        ("friction_variance", _PAIR),  # m^2
    ]
)
"""One sample of a run; a filter's estimates are constant outside its stage."""
