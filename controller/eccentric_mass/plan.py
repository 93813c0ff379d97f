"""What the strategy remembers and goes by: stages, causes and records."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Final, NamedTuple

from ringbalance.controller.eccentric_mass.friction_filter import FrictionEstimate
from ringbalance.controller.eccentric_mass.imbalance_filter import FilterMatrices, ImbalanceEstimate
from ringbalance.controller.eccentric_mass.targets import Correction, Tuning
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import compiled

Pair = tuple[float, float]

NOT_YET: Final = -1.0

MOVING: Final = 0
"""The drives bring the masses to their goal."""
RELEASED: Final = 1
"""The drives are off: friction holds the masses."""
HELD: Final = 2
"""The drives hold the masses, because friction does not, or is not known to."""


class Stage(IntEnum):
    """What the strategy is doing; letters are the paper's periods."""

    WAITING = 0
    IMBALANCE = 1
    """(A): the masses are held, the imbalance is estimated."""
    FRICTION = 2
    """(B): both masses go round together, their friction is estimated."""
    POSITIONING = 3
    """(C): the masses go to their targets."""
    CHECK = 4
    """(D): the drives rest, the vibration is averaged."""
    CORRECTION = 5
    """The masses go to targets that the averaged vibration has corrected; a check follows."""
    FINE_TUNING = 6
    """(E): by trial."""
    REST = 7
    """(F): nothing more to do."""
    FAILED = 8
    """Nothing more that can be done; the masses are held where they are."""


STAGE_NAMES: Final = (
    *("waiting", "imbalance estimation", "friction estimation", "positioning"),
    *("check", "correction", "fine tuning", "rest", "failed"),
)
"""In the order of `Stage`."""


class Cause(IntEnum):
    """Why the last stage was entered."""

    NONE = 0
    BALANCED = 1
    SATURATED = 2
    RESIDUAL = 3
    TUNING_TIME = 4
    SPEED_CHANGED = 5
    TOO_SLOW = 6
    SPEED_NOT_CONSTANT = 7
    IMBALANCE_UNCERTAIN = 8
    FRICTION_UNCERTAIN = 9
    STALLED = 10
    NOT_ARRIVED = 11
    LOCKED = 12
    MASSES_MOVE = 13


class Gates(NamedTuple):
    """Limits between the stages."""

    start: float
    limit: float
    """Amplitude that is good enough, m."""
    lowest_speed: float
    arrival_angle: float
    arrival_rate: float
    noticeable: float
    """Least angle by which masses that are not held come nearer within a second, rad."""
    dwell: float
    """For which a mass must have arrived, s."""
    imbalance_time: float
    friction_time: float
    positioning_time: float
    fine_tuning_time: float
    imbalance_gate: float
    """Relative standard deviation."""
    friction_gate: float
    """Relative standard deviation."""
    friction_torque: float
    """Standard deviation of the friction torque that makes no difference to arrival, N m."""
    least_estimate: float
    """Shortest time of imbalance estimation, s."""
    least_drive: float
    """Shortest time of friction estimation, s."""
    stall_rate: float
    """Rate below which the drive nearly stalls, rad/s."""
    tuning_step: float
    tuning_stop: float
    tuning_near: float
    """Closest that a mass is brought to a place, rad."""
    wait: float
    average: float
    margin: float
    """By which a trial or a correction must be better, m."""
    move_time: float
    """Longest move of one trial, s."""
    moment: float
    """b, kg m."""
    gap: float
    """Angle that one mass takes up, rad."""
    target_error: Pair
    by_trials: bool
    """Whether the masses are tuned by trials alone, as in the paper."""


class Facts(NamedTuple):
    """The supervisor's inputs at each sample."""

    time: float
    speed: float
    constant: bool
    """Whether the speed is constant."""
    visible: bool
    """Whether the imbalance filter's model holds now."""
    position: complex
    """m, rotor-fixed."""
    angle: Pair
    """Smoothed, rad."""
    rate: Pair
    """Smoothed, rad/s."""
    imbalance: complex
    deviation: float
    """Standard deviation of the imbalance, kg m."""
    influence: complex
    """alpha, steady vibration per imbalance at this speed as configured, m/(kg m)."""
    arm: Pair
    arm_deviation: Pair
    load: float
    """Largest share of what friction holds for sure that holding takes; infinite when it holds nothing."""


class Progress(NamedTuple):
    """Of the present move, and of the mean that is taken after it."""

    moving: float
    """Since when the masses have been under way to the present goal, s."""
    arrived: float
    """Since when they have been there, s; NOT_YET."""
    nearest: float
    """Distance from the goal of the mass farther from it, rad, that was reached at `nearer`."""
    nearer: float
    """When the masses last came nearer by a noticeable angle, s."""
    averaging: float
    """From when on the vibration is averaged, s; NOT_YET while the masses move."""
    total: complex
    """Sum of the rotor-fixed vibration, m."""
    samples: int
    """Samples in the sum."""


class Findings(NamedTuple):
    """What a stage leaves behind for those after it and for the status."""

    saturated: bool
    """Whether the imbalance is more than the masses can undo."""
    residual: float
    """Imbalance that the targets leave, kg m."""
    objective: float
    """Mean amplitude at the place that the masses have or go to, m; infinite before the first mean."""
    short: float
    """Largest distance from its goal at which friction was left to hold a mass after the last move, rad."""
    driven: int
    """Samples of the friction stage, without its beginning."""
    stalled: int
    """Those of them in which a mass was nearly at a standstill."""


class Plan(NamedTuple):
    """What the supervisor remembers."""

    stage: int
    entered: float
    cause: int
    goal: Pair
    """Where the masses should be, rad, unwrapped."""
    hold: int
    """MOVING, RELEASED or HELD."""
    progress: Progress
    correction: Correction
    tuning: Tuning
    findings: Findings


class EccentricMeasurement(NamedTuple):
    """One sample of everything that the strategy may look at."""

    time: float
    speed: float
    """W, rad/s."""
    speed_rate: float
    """W', rad/s^2."""
    rotor_angle: float
    """Of the rotor's first axis, rad."""
    vibration: FloatArray
    """Displacement (m) and velocity (m/s) in the sensor's frame: x, y, x', y', shape (4,)."""
    angle: Pair
    """Of the masses, rad, not wrapped."""
    rate: Pair
    """Of the masses, rad/s."""


class Motion(NamedTuple):
    """What the law sees of rotor and masses, in the rotor's frame."""

    speed: float
    """W, rad/s."""
    speed_rate: float
    """W', rad/s^2."""
    position: complex
    """z, m."""
    velocity: complex
    """z', m/s."""
    angle: Pair
    rate: Pair


class Smoothed(NamedTuple):
    """Slow copies of what is measured, in the rotor's frame."""

    position: complex
    velocity: complex
    angle: Pair
    rate: Pair


class Whirl(NamedTuple):
    """The imbalance filter's part of the memory."""

    estimate: ImbalanceEstimate
    matrices: FilterMatrices
    running: bool
    """Whether the filter took in the last sample that was its turn."""
    place: complex
    """p = b sum exp(j phi_i) of the masses at that sample."""
    pace: complex
    """Its time derivative."""
    surprise: float
    """Sum of the normalised innovations squared."""
    judged: int
    """Samples in that sum."""


class Beliefs(NamedTuple):
    """The filters' estimates, as far as the voltages depend on them."""

    imbalance: complex
    deviation: float
    """Largest standard deviation of the imbalance, kg m."""
    friction: tuple[FrictionEstimate, FrictionEstimate]


class StrategyState(NamedTuple):
    """All that changes."""

    sample: int
    """Number of the next sample."""
    plan: Plan
    smoothed: Smoothed
    whirl: Whirl
    beliefs: Beliefs
    torque: Pair
    """Known torques summed over the samples since the friction filter's last step, N m."""
    last_rate: Pair
    """Of the masses, as measured at that step."""
    voltage: Pair


@compiled
def setting_out(time: float) -> Progress:
    """Progress at the beginning of a move, with nothing arrived or averaged yet."""
    return Progress(time, NOT_YET, math.inf, time, NOT_YET, 0.0j, 0)


# Numba builds a tuple by position alone: each of these replaces one part.
@compiled
def enter(plan: Plan, stage: int, time: float, cause: int, goal: Pair) -> Plan:
    """Begin a stage with the plan's tuning and findings."""
    begin = setting_out(time)
    return Plan(stage, time, cause, goal, MOVING, begin, plan.correction, plan.tuning, plan.findings)


@compiled
def with_progress(plan: Plan, progress: Progress) -> Plan:
    """Of the present move."""
    stage, entered, cause, goal, hold, _, correction, tuning, findings = plan
    return Plan(stage, entered, cause, goal, hold, progress, correction, tuning, findings)


@compiled
def with_findings(plan: Plan, findings: Findings) -> Plan:
    """What stages leave behind."""
    stage, entered, cause, goal, hold, progress, correction, tuning, _ = plan
    return Plan(stage, entered, cause, goal, hold, progress, correction, tuning, findings)


@compiled
def with_hold(plan: Plan, hold: int) -> Plan:
    """Whether the drives move, hold or rest."""
    stage, entered, cause, goal, _, progress, correction, tuning, findings = plan
    return Plan(stage, entered, cause, goal, hold, progress, correction, tuning, findings)


@compiled
def with_trial(plan: Plan, time: float, tuning: Tuning, goal: Pair) -> Plan:
    """Set out to a trial of fine tuning."""
    stage, entered, cause, _, _, _, correction, _, findings = plan
    return Plan(stage, entered, cause, goal, MOVING, setting_out(time), correction, tuning, findings)


@compiled
def with_goal(plan: Plan, goal: Pair) -> Plan:
    """Another goal for the same move."""
    stage, entered, cause, _, hold, progress, correction, tuning, findings = plan
    return Plan(stage, entered, cause, goal, hold, progress, correction, tuning, findings)


@compiled
def with_correction(plan: Plan, correction: Correction) -> Plan:
    """By the measured vibration."""
    stage, entered, cause, goal, hold, progress, _, tuning, findings = plan
    return Plan(stage, entered, cause, goal, hold, progress, correction, tuning, findings)


@compiled
def averaging_from(progress: Progress, begins: float) -> Progress:
    """Begin the mean at a time, s."""
    return Progress(progress.moving, progress.arrived, progress.nearest, progress.nearer, begins, 0.0j, 0)


@compiled
def with_arrival(progress: Progress, arrived: float) -> Progress:
    """Args: `arrived`: time, s; NOT_YET."""
    moving, _, nearest, nearer, averaging, total, samples = progress
    return Progress(moving, arrived, nearest, nearer, averaging, total, samples)


@compiled
def with_nearest(progress: Progress, nearest: float, since: float) -> Progress:
    """Masses have come as near to their goal as this, rad, at a time, s."""
    moving, arrived, _, _, averaging, total, samples = progress
    return Progress(moving, arrived, nearest, since, averaging, total, samples)


@compiled
def with_sample(progress: Progress, position: complex) -> Progress:
    """One sample more in the mean."""
    moving, arrived, nearest, nearer, averaging, total, samples = progress
    return Progress(moving, arrived, nearest, nearer, averaging, total + position, samples + 1)


@compiled
def with_stall(findings: Findings, stalled: bool) -> Findings:
    """One sample more of the friction stage."""
    saturated, residual, objective, short, driven, before = findings
    return Findings(saturated, residual, objective, short, driven + 1, before + (1 if stalled else 0))


@compiled
def with_targets(findings: Findings, saturated: bool, residual: float) -> Findings:
    """What the targets leave, kg m."""
    _, _, objective, short, driven, stalled = findings
    return Findings(saturated, residual, objective, short, driven, stalled)


@compiled
def with_objective(findings: Findings, objective: float) -> Findings:
    """The mean amplitude at the present place, m."""
    saturated, residual, _, short, driven, stalled = findings
    return Findings(saturated, residual, objective, short, driven, stalled)


@compiled
def with_short(findings: Findings, short: float) -> Findings:
    """The distance at which friction was left to hold a mass short of its goal, rad."""
    saturated, residual, objective, _, driven, stalled = findings
    return Findings(saturated, residual, objective, short, driven, stalled)
