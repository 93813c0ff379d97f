"""Memory of the strategy and history of a run: stages, causes, and their records."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.friction_filter import FRICTION_FILTER
from ringbalance.controller.eccentric_mass.imbalance_filter import IMBALANCE_FILTER

Pair = tuple[float, float]

NOT_YET: Final = -1.0
MOVING, RELEASED, HELD = range(3)
"""State of the drives: bringing the masses to their goal; off, as friction holds the masses; or holding them,
because friction does not, or is not known to."""
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
    """Sample of everything that the strategy may look at."""

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
    """m/s."""
    angle: Pair
    """Angles of the masses, rad, not wrapped."""
    rate: Pair
    """Rates of the masses, rad/s."""


_REAL: Final = (
    "entered",  # when the stage was, s
    "moving",  # since when the masses have been under way to the present goal, s
    "arrived",  # since when they have been there, s; NOT_YET
    "nearest",  # distance from the goal of the mass farther from it, rad, that was reached at `nearer`
    "nearer",  # when the masses last came nearer by a noticeable angle, s
    "averaging",  # from when on the vibration is averaged, s; NOT_YET while the masses move
    "left",  # imbalance that the targets leave, kg m
    "objective",  # mean amplitude at the present goal, m; infinite before the first
    "short",  # largest distance from its goal at which friction held a mass after the last move, rad
    "share",  # correction: of a whole step that is taken
    "least",  # fine tuning: objective at its best goal, m
    "move_size",  # rad
    "deviation",  # of the estimated imbalance, the largest in any direction, kg m
    "surprise",  # sum of the imbalance filter's normalised innovations squared
)
_WHOLE: Final = (
    "sample",  # number of the next one
    "stage",
    "cause",
    "hold",
    "averaged",  # samples in the mean
    "saturated",  # 1 if the imbalance is more than the masses can undo
    "driven",  # samples of the friction stage, without its beginning
    "stalled",  # those of them in which a mass was nearly at a standstill
    "steps",  # of correction, taken so far
    "move",  # of the four of fine tuning, the one that is tried now
    "failed",  # moves in a row that were no better than staying
    "done",  # 1 if the moves have become shorter than the search is to resolve
    "running",  # 1 if the imbalance filter took in the last sample that was its turn
    "judged",  # samples in `surprise`
)
_COMPLEX: Final = (
    "total",  # sum of the rotor-fixed vibration in the mean, m
    "residual",  # correction: mean vibration at its best goal, m; infinite before the first mean
    "corrected",  # imbalance for which the targets of that goal were, kg m
    "aim",  # for which the present targets are, kg m
    "position",  # smoothed, m, as velocity, angle and rate
    "velocity",
    "imbalance",  # as estimated, at last as the balanced rotor shows it, kg m
    "mass_vector",  # p = b sum exp(j phi_i) at the imbalance filter's last sample, kg m
    "mass_pace",  # its time derivative
)
_PAIRS: Final = (
    "goal",  # where the masses should be, rad, unwrapped
    "best_goal",  # correction: goal of the least mean vibration, rad
    "aimed",  # goal of the present step; friction may hold the masses short of it
    "base",  # fine tuning: its best goal, rad
    "angle",
    "rate",
    "torque",  # known torques summed over the samples since the friction filter's last step, N m
    "motor",  # torques of the motors at standstill over the time of the friction stage, N m s
    "back_emf",  # what their back-EMF took of these, likewise, N m s
    "arm_doubt",  # standard deviation of the friction arms by the constants of motor and masses, m
    "last_rate",  # as measured at that step
    "voltage",
)
MEMORY: Final = np.dtype(
    [(name, np.float64) for name in _REAL]
    + [(name, np.int64) for name in _WHOLE]
    + [(name, np.complex128) for name in _COMPLEX]
    + [(name, np.float64, (2,)) for name in _PAIRS]
    + [("filter", IMBALANCE_FILTER), ("friction", FRICTION_FILTER, (2,))]
)
"""State of the strategy, which changes from sample to sample."""
HISTORY: Final = np.dtype(
    [
        ("state", np.float64, (8,)),  # of the plant
        ("voltage", np.float64, (2,)),  # V, from this sample on
        ("energy", np.float64),  # electrical, taken since the start, J
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
"""Sample of a run; estimates of a filter are constant outside its stage."""
