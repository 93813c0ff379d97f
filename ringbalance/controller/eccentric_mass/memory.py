"""Memory of the strategy and history of a run: stages, causes, and their records."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.friction_filter import FRICTION_FILTER
from ringbalance.controller.eccentric_mass.imbalance_filter import IMBALANCE_FILTER

Pair = tuple[float, float]

NOT_YET: Final = -1.0
MOVING, RELEASED, HELD = range(3)
"""State of the drives: moving the masses to their goal; off, since friction holds the masses; or holding the
masses, where friction is not certain to."""
WAITING, IMBALANCE, FRICTION, POSITIONING, CHECK, CORRECTION, FINE_TUNING, REST, FAILED = range(9)
"""Stages of the strategy, with the paper's periods:

    nothing yet;
    (A) the masses are held, the imbalance is estimated;
    (B) both masses go round together, their friction is estimated;
    (C) the masses go to their targets;
    (D) the drives rest, the vibration is averaged;
    the masses go to targets that the averaged vibration has corrected, and a check follows;
    (E) by trial;
    (F) nothing more to do;
    nothing more that can be done: the masses are held where they are.
"""
STAGE_NAMES: Final = (
    *("waiting", "imbalance estimation", "friction estimation", "positioning"),
    *("check", "correction", "fine tuning", "rest", "failed"),
)
NONE, BALANCED, SATURATED, RESIDUAL, TUNING_TIME, SPEED_CHANGED, TOO_SLOW = range(7)
SPEED_NOT_CONSTANT, IMBALANCE_UNCERTAIN, FRICTION_UNCERTAIN, STALLED, NOT_ARRIVED = range(7, 12)
LOCKED_MASSES, MASSES_MOVE = 12, 13
"""Cause of entering the last stage."""
CAUSE_NAMES: Final = (
    *("none", "balanced", "saturated", "residual", "tuning_time", "speed_changed", "too_slow"),
    *("speed_not_constant", "imbalance_uncertain", "friction_uncertain", "stalled", "not_arrived"),
    *("locked", "masses_move"),
)


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


_REAL: Final = (
    "entered",  # time at which the present stage began, s
    "moving",  # time at which the masses set out to the present goal, s
    "arrived",  # time at which they arrived there, s, or NOT_YET
    "nearest",  # largest distance of a mass from its goal, rad, at the time `nearer`
    "nearer",  # last time at which the masses had come nearer by a noticeable angle, s
    "averaging",  # time at which averaging of the vibration begins, s; NOT_YET while the masses move
    "left",  # residual imbalance at the targets, kg m
    "objective",  # mean amplitude at the present goal, m; infinite before the first
    "short",  # largest distance from its goal at which friction held a mass after the last move, rad
    "share",  # correction: fraction of the full step
    "least",  # fine tuning: objective at its best goal, m
    "move_size",  # fine tuning: travel of a mass in one move, rad
    "deviation",  # largest standard deviation of the estimated imbalance in any direction, kg m
    "surprise",  # sum of normalised innovations squared of the imbalance filter
)
_WHOLE: Final = (
    "sample",  # number of the next sample
    "stage",
    "cause",
    "hold",
    "averaged",  # samples in the mean
    "saturated",  # 1 if the imbalance exceeds what the masses cancel
    "driven",  # samples of the friction stage, without its beginning
    "stalled",  # number of `driven` with a mass nearly at standstill
    "steps",  # number of correction steps so far
    "move",  # fine tuning: index of the present move among the four
    "failed",  # number of successive moves that brought no gain
    "done",  # 1 if the moves are shorter than the resolution of the search
    "running",  # 1 if the imbalance filter used the last sample that it was due
    "judged",  # samples in `surprise`
)
_COMPLEX: Final = (
    "total",  # sum of the rotor-fixed vibration in the mean, m
    "residual",  # correction: mean vibration at its best goal, m; infinite before the first mean
    "corrected",  # imbalance that belongs to the best goal, kg m
    "aim",  # imbalance that belongs to the present targets, kg m
    "position",  # smoothed displacement, m; velocity, angle and rate are smoothed as well
    "velocity",
    "imbalance",  # estimated imbalance, kg m; after balancing from the mean residual vibration
    "mass_vector",  # p = b sum exp(j phi_i) at the imbalance filter's last sample, kg m
    "mass_pace",  # time derivative of `mass_vector`, kg m/s
)
_PAIRS: Final = (
    "goal",  # desired angles of the masses, rad, unwrapped
    "best_goal",  # correction: goal of the least mean vibration, rad
    "aimed",  # goal of the present step; friction may hold the masses short of it
    "base",  # fine tuning: best goal, rad
    "angle",
    "rate",
    "torque",  # sum of known torques over the samples since the friction filter's last step, N m
    "motor",  # time integral of the stall torque B_add V over the friction stage, N m s
    "back_emf",  # time integral of the torque loss by back-EMF, N m s
    "arm_doubt",  # standard deviation of the friction arms by uncertain constants of motor and masses, m
    "last_rate",  # rate measured at the friction filter's last step, rad/s
    "voltage",
)
MEMORY: Final = np.dtype(
    [(name, np.float64) for name in _REAL]
    + [(name, np.int64) for name in _WHOLE]
    + [(name, np.complex128) for name in _COMPLEX]
    + [(name, np.float64, (2,)) for name in _PAIRS]
    + [("filter", IMBALANCE_FILTER), ("friction", FRICTION_FILTER, (2,))]
)
"""State of the strategy between two samples."""
HISTORY: Final = np.dtype(
    [
        ("state", np.float64, (8,)),  # of the plant
        ("voltage", np.float64, (2,)),  # V, from this sample on
        ("energy", np.float64),  # electrical energy since the start, J
        ("stage", np.int64),
        ("cause", np.int64),
        ("hold", np.int64),
        ("goal", np.float64, (2,)),  # rad
        ("imbalance", np.float64, (2,)),  # estimate along the rotor's axes, kg m
        ("imbalance_covariance", np.float64, (2, 2)),  # of the noise alone, kg^2 m^2
        ("friction_arm", np.float64, (2,)),  # estimates, m
        ("friction_variance", np.float64, (2,)),  # m^2
    ]
)
"""One sample of a run; a filter's estimates are constant outside its stage."""
