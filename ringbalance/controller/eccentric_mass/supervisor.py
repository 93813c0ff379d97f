"""Stages of the strategy, from the estimation of the imbalance to rest, and when each ends.

Functions change an element of type `MEMORY`, or the record of a stage in it; `Motion` is the present sample.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Final

from ringbalance.controller.eccentric_mass.drive_law import DriveLaw, Motion, rotor_load
from ringbalance.controller.eccentric_mass.imbalance_filter import mass_vector
from ringbalance.controller.eccentric_mass.memory import NOT_YET, Cause, Hold, Pair, Stage
from ringbalance.controller.eccentric_mass.scene_records import STEADY_RAD_S2
from ringbalance.controller.eccentric_mass.settings import Gates
from ringbalance.controller.eccentric_mass.targets import (
    aim_back,
    assign,
    begin_correction,
    begin_tuning,
    judge_correction,
    next_trial,
    separation,
    set_pair,
    target_angles,
    tuning_place,
)
from ringbalance.scene.arrays import Record
from ringbalance.scene.platform.compiled import in_place

_DRIVES_ON_LOAD: Final = 0.7
"""Load beyond which the drives hold the masses, as a fraction of the certain friction."""
_DRIVES_OFF_LOAD: Final = 0.5
"""Load below which holding drives are switched off, as a fraction of the certain friction."""
STALLED_SHARE: Final = 0.5
"""Fraction of the friction stage with a stalled mass beyond which the drive is the cause of failure."""
_DWELL_TIME_S: Final = 0.2
"""Time for which masses must stay at their goal to count as arrived."""
LEAST_DRIVE_TIME_S: Final = 1.0
"""Shortest friction stage: long against the drive's own time constants."""
_LONGEST_MOVE_S: Final = 10.0
_STILL_TIME_S: Final = 1.0
"""Time without approach to the goal after which masses count as held by friction."""


@in_place
def supervise(gates: Gates, law: DriveLaw, memory: Record, motion: Motion, visible: bool) -> None:
    """Decide stage, goal and state of the drives after a sample.

    Args: `visible`: True if the imbalance filter's model holds now.
    Source: Fig. 3 of the paper on eccentric masses, with gates on relative uncertainty and ways out.
    """
    if memory.stage == Stage.WAITING:
        if memory.time >= gates.start:
            enter(memory, Stage.IMBALANCE_ESTIMATION, memory.travel.goal, Cause.NONE)
    elif memory.stage == Stage.IMBALANCE_ESTIMATION:
        _judge_imbalance(gates, law, memory, motion, visible)
    elif memory.stage == Stage.FRICTION_ESTIMATION:
        _judge_friction(gates, law, memory, motion)
    elif memory.stage == Stage.POSITIONING:
        # Until the masses are at their targets or held by friction; the check shows the residual vibration.
        if _stopped(gates, memory, gates.arrival_angle):
            enter(memory, Stage.CHECK, memory.travel.goal, Cause.NONE)
        elif memory.time - memory.entered >= gates.positioning_time:
            enter(memory, Stage.FAILED, memory.angle, Cause.NOT_ARRIVED)
    elif memory.stage in (Stage.CHECK, Stage.CORRECTION) and not is_constant(motion):
        cause = Cause.SPEED_CHANGED
        if _is_balanced(gates, abs(memory.correction.residual)):
            cause = Cause.BALANCED
        enter(memory, Stage.REST, memory.correction.best_goal, cause)
    elif memory.stage == Stage.CHECK:
        _check(gates, law, memory, motion)
    elif memory.stage == Stage.CORRECTION:
        # Until the masses are at the corrected targets or held by friction.
        if _move_ended(gates, memory, gates.tuning_near):
            enter(memory, Stage.CHECK, memory.travel.goal, Cause.NONE)
    elif memory.stage == Stage.FINE_TUNING:
        _fine_tune(gates, law, memory, motion)
    else:
        _rest(gates, law, memory, motion)


@in_place
def enter(memory: Record, stage: int, goal: Sequence[float], cause: int) -> None:
    """Begin a stage in which the masses move to a goal, rad, or keep their positions where that is one."""
    memory.stage, memory.entered, memory.cause = stage, memory.time, cause
    _set_out(memory, goal)


@in_place
def _set_out(memory: Record, goal: Sequence[float]) -> None:
    travel, mean = memory.travel, memory.mean
    set_pair(travel.goal, goal[0], goal[1])
    memory.hold, travel.moving, travel.arrived = Hold.MOVING, memory.time, NOT_YET
    travel.nearest, travel.nearer = math.inf, memory.time
    mean.since, mean.total, mean.samples = NOT_YET, 0.0j, 0


@in_place
def _influence_of(law: DriveLaw, speed: float) -> complex:
    """alpha, steady vibration per imbalance as configured, m/(kg m)."""
    stiffness = law.whirl.stiffness - law.whirl.mass * speed * speed
    return speed * speed / complex(stiffness, law.whirl.damping * speed)


@in_place
def is_constant(motion: Motion) -> bool:
    """Return True if the rotor's speed is constant."""
    return abs(motion.speed_rate) < STEADY_RAD_S2


@in_place
def _is_balanced(gates: Gates, mean: float) -> bool:
    """Return True if a mean vibration shows the true one within the limit, whatever its noise."""
    return mean + gates.margin <= gates.limit


@in_place
def _judge_imbalance(gates: Gates, law: DriveLaw, memory: Record, motion: Motion, visible: bool) -> None:
    """Go on once the imbalance's error is small, relative to itself or, as vibration, to the limit."""
    estimation, elapsed = memory.estimation, memory.time - memory.entered
    precise = estimation.deviation <= gates.imbalance_gate * abs(memory.imbalance)
    little = 2 * estimation.deviation * abs(_influence_of(law, motion.speed)) <= 0.1 * gates.limit
    if visible and (precise or little) and elapsed >= gates.least_estimate:
        enter(memory, Stage.FRICTION_ESTIMATION, memory.angle, Cause.NONE)
    elif elapsed >= gates.imbalance_time:
        cause = Cause.IMBALANCE_UNCERTAIN
        if abs(motion.speed) < gates.lowest_speed:
            cause = Cause.TOO_SLOW
        elif estimation.filter.plateau < 0:
            cause = Cause.SPEED_NOT_CONSTANT
        elif not visible:
            cause = Cause.MASSES_MOVE
        enter(memory, Stage.FAILED, memory.angle, cause)


@in_place
def _judge_friction(gates: Gates, law: DriveLaw, memory: Record, motion: Motion) -> None:
    """Go on once the errors of both friction arms are small, relative to the arms or for the arrival."""
    friction, elapsed, precise = memory.friction, memory.time - memory.entered, True
    # Without the time in which the drives start.
    if elapsed >= 0.5 * LEAST_DRIVE_TIME_S:
        friction.driven += 1
        friction.stalled += 1 if min(abs(memory.rate[0]), abs(memory.rate[1])) < gates.stall_rate else 0
    for i in range(2):
        arm, deviation, turning = (
            friction.filter[i].arm,
            arm_noise(friction, i),
            motion.speed + memory.rate[i],
        )
        # Standard deviation by the constants of an arm (T - C w)/(b (W + w)^2) less the rotor's load.
        friction.arm_doubt[i] = 0.0
        if elapsed > 0 and turning != 0:
            motor, back = friction.motor[i] / elapsed, friction.back_emf[i] / elapsed
            of_motor, of_both, of_back = gates.constants
            variance = motor * motor * of_motor - 2 * motor * back * of_both + back * back * of_back
            friction.arm_doubt[i] = math.sqrt(max(variance, 0.0)) / (law.track.moment * turning * turning)
        relative = deviation <= gates.friction_gate * arm
        # Friction cannot drive a mass: an arm well below zero contradicts the filter's model.
        possible = arm >= -2 * arm_deviation(friction, i)
        little = deviation * law.track.moment * motion.speed**2 <= gates.friction_torque
        precise = precise and possible and (relative or little)
    if precise and elapsed >= LEAST_DRIVE_TIME_S:
        goal, saturated, left = _goal(gates, law, memory.angle, memory.imbalance)
        begin_correction(memory.correction, memory.imbalance, goal)
        memory.correction.saturated, memory.correction.left = saturated, left
        enter(memory, Stage.POSITIONING, goal, Cause.NONE)
    elif elapsed >= gates.friction_time:
        stalled = friction.stalled > STALLED_SHARE * friction.driven
        cause = Cause.STALLED if stalled else Cause.FRICTION_UNCERTAIN
        enter(memory, Stage.FAILED, memory.angle, cause)


@in_place
def arm_noise(friction: Record, mass: int) -> float:
    """Standard deviation of an estimated friction arm by noise, m."""
    return math.sqrt(max(friction.filter[mass].arm_variance, 0.0))


@in_place
def arm_deviation(friction: Record, mass: int) -> float:
    """Standard deviation of a friction arm by noise and by the constants of motor and masses, m."""
    return math.hypot(arm_noise(friction, mass), friction.arm_doubt[mass])


@in_place
def _goal(gates: Gates, law: DriveLaw, angle: Sequence[float], imbalance: complex) -> tuple[Pair, int, float]:
    """Goal for an imbalance, rad: for each mass from its angle to the target that `assign` selects.

    Returns: Goal, 1 if saturated, and residual imbalance at the goal, kg m.
    """
    targets = target_angles(abs(imbalance), cmath.phase(imbalance), law.track.moment, gates.gap)
    first, second = assign(angle[0], angle[1], targets.first, targets.second)
    goal = (angle[0] + first + gates.target_error[0], angle[1] + second + gates.target_error[1])
    return goal, 1 if targets.saturated else 0, targets.residual


@in_place
def _check(gates: Gates, law: DriveLaw, memory: Record, motion: Motion) -> None:
    """Average the vibration once the masses have arrived or are held, and correct the targets by the mean."""
    _rest(gates, law, memory, motion)
    if memory.hold == Hold.MOVING:
        return
    if memory.mean.since == NOT_YET:
        memory.mean.since = memory.time + gates.wait
    if _averaged(gates, memory, motion):
        _correct(
            gates, law, memory, memory.mean.total / memory.mean.samples, _influence_of(law, motion.speed)
        )


@in_place
def _averaged(gates: Gates, memory: Record, motion: Motion) -> bool:
    """Add a sample to the mean vibration; return True if it has the full averaging time.

    The mean is of the rotor-fixed vector, in which noise averages out; in amplitudes it does not.
    """
    mean = memory.mean
    if memory.time >= mean.since:
        mean.total += motion.position
        mean.samples += 1
    return bool(mean.samples > 0 and memory.time - mean.since >= gates.average)


@in_place
def _correct(gates: Gates, law: DriveLaw, memory: Record, mean: complex, influence: complex) -> None:
    """Move to better targets while that helps, then back to the best ones, or begin the next stage."""
    correction, balanced = memory.correction, _is_balanced(gates, abs(mean))
    far = memory.travel.short > gates.arrival_angle
    done = judge_correction(correction, mean, gates.margin, memory.travel.short > gates.tuning_near)
    done = done or (far and balanced) or gates.by_trials or influence == 0
    if not done and _aim_better(gates, law, correction, influence, far):
        enter(memory, Stage.CORRECTION, correction.goal, Cause.NONE)
    elif correction.residual != mean and not (far and balanced):
        # Back to the best targets, for the last mean.
        aim_back(correction)
        correction.share = 0.0
        enter(memory, Stage.CORRECTION, correction.goal, Cause.NONE)
    # These targets are final: rest, failure, or fine tuning.
    elif balanced or correction.saturated:
        hold = memory.hold
        _settle(law, memory, mean, influence, Cause.BALANCED if balanced else Cause.SATURATED)
        memory.hold = hold
    elif far:
        enter(memory, Stage.FAILED, memory.angle, Cause.NOT_ARRIVED)
    else:
        begin_tuning(memory.tuning, memory.travel.goal, abs(mean), gates.tuning_step)
        enter(memory, Stage.FINE_TUNING, memory.travel.goal, Cause.NONE)
        _try(gates, memory)


@in_place
def _aim_better(gates: Gates, law: DriveLaw, correction: Record, influence: complex, far: bool) -> bool:
    """Set targets that also cancel the residual at the best ones. Returns: True if they differ."""
    best, error = correction.best_goal, gates.target_error
    aim = correction.best_aim + correction.share * correction.residual / influence
    (first, second), saturated, left = _goal(gates, law, (best[0] - error[0], best[1] - error[1]), aim)
    if max(abs(first - best[0]), abs(second - best[1])) <= gates.tuning_near:
        return False
    # If friction keeps the masses far off, the aim exceeds the imbalance so that they break away.
    if not far:
        correction.saturated, correction.left = saturated, left
    correction.aim, correction.steps = aim, correction.steps + 1
    set_pair(correction.goal, first, second)
    return True


@in_place
def _settle(law: DriveLaw, memory: Record, mean: complex, influence: complex, cause: int) -> None:
    """Begin the stage of rest where the masses are; the drive law believes U = z/alpha - p from now on.

    Not before: an error of the filter's estimate keeps the masses off all goals alike, so goals compare.
    """
    if influence != 0:
        vector, _ = mass_vector(law.track.moment, (memory.angle[0], memory.angle[1]), (0.0, 0.0))
        memory.imbalance = mean / influence - vector
    enter(memory, Stage.REST, memory.angle, cause)


@in_place
def _fine_tune(gates: Gates, law: DriveLaw, memory: Record, motion: Motion) -> None:
    """Judge each trial at the angles at which friction leaves the masses, even if not quite at the goal."""
    tuning = memory.tuning
    if not is_constant(motion):
        enter(memory, Stage.REST, tuning.base, Cause.SPEED_CHANGED)
    elif memory.time - memory.entered >= gates.fine_tuning_time:
        enter(memory, Stage.REST, tuning.base, Cause.TUNING_TIME)
    elif memory.mean.since == NOT_YET:
        if _move_ended(gates, memory, max(0.1 * tuning.move_size, gates.tuning_near)):
            memory.mean.since = memory.time + gates.wait
    elif _averaged(gates, memory, motion):
        mean = memory.mean.total / memory.mean.samples
        next_trial(tuning, abs(mean), gates.margin, gates.tuning_stop)
        if _is_balanced(gates, tuning.least):
            _settle(law, memory, mean, _influence_of(law, motion.speed), Cause.BALANCED)
        else:
            _try(gates, memory)


@in_place
def _try(gates: Gates, memory: Record) -> None:
    """Go to the next trial at which the masses do not overlap."""
    tuning = memory.tuning
    first, second = tuning_place(tuning)
    while not tuning.done and separation(first, second) < gates.gap:
        next_trial(tuning, math.inf, gates.margin, gates.tuning_stop)
        first, second = tuning_place(tuning)
    if tuning.done:
        enter(memory, Stage.REST, tuning.base, Cause.RESIDUAL)
    else:
        _set_out(memory, (first, second))


@in_place
def _rest(gates: Gates, law: DriveLaw, memory: Record, motion: Motion) -> None:
    """Move the masses to the goal; then switch the drives off while friction certainly holds, else hold."""
    travel, friction = memory.travel, memory.friction
    stopped = _stopped(gates, memory, gates.tuning_near)
    if memory.hold == Hold.MOVING:
        if not (stopped or memory.time - travel.moving >= _LONGEST_MOVE_S):
            return
        memory.hold, travel.short = Hold.RELEASED, _distance(memory)
        # Masses held far from their goal: the present angles become the goal.
        if travel.short > gates.arrival_angle:
            set_pair(travel.goal, memory.angle[0], memory.angle[1])
    # Largest load on a mass at rest, as a fraction of its certain friction.
    load = 0.0
    angle = (memory.angle[0], memory.angle[1])
    quiet = Motion(motion.speed, motion.speed_rate, memory.position, memory.velocity, angle, (0.0, 0.0))
    torque = rotor_load(law, quiet, memory.imbalance, (0.0, 0.0))
    for i in range(2):
        least_arm = max(friction.filter[i].arm - 2 * arm_deviation(friction, i), 0.0)
        most = least_arm * law.track.moment * motion.speed * motion.speed
        load = max(load, abs(torque[i]) / most if most > 0 else math.inf)
    if _distance(memory) > 2 * gates.arrival_angle or load > _DRIVES_ON_LOAD:
        memory.hold = Hold.HELD
    elif load < _DRIVES_OFF_LOAD and stopped:
        memory.hold = Hold.RELEASED


@in_place
def _stopped(gates: Gates, memory: Record, closeness: float) -> bool:
    """Follow the masses to their goal; return True if they have arrived there or friction holds them short.

    Held masses are slow and have not come nearer for `_STILL_TIME_S`.
    """
    travel, distance = memory.travel, _distance(memory)
    slow = max(abs(memory.rate[0]), abs(memory.rate[1])) <= gates.arrival_rate
    if not (distance <= closeness and slow):
        travel.arrived = NOT_YET
    elif travel.arrived == NOT_YET:
        travel.arrived = memory.time
    if distance < travel.nearest - gates.noticeable:
        travel.nearest, travel.nearer = distance, memory.time
    arrived = travel.arrived != NOT_YET and memory.time - travel.arrived >= _DWELL_TIME_S
    return bool(arrived or (slow and memory.time - travel.nearer >= _STILL_TIME_S))


@in_place
def _move_ended(gates: Gates, memory: Record, closeness: float) -> bool:
    """Return True if a move has ended, at its goal or short of it."""
    return _stopped(gates, memory, closeness) or memory.time - memory.travel.moving >= _LONGEST_MOVE_S


@in_place
def _distance(memory: Record) -> float:
    """Largest distance of a mass from its goal, rad."""
    goal = memory.travel.goal
    return float(max(abs(memory.angle[0] - goal[0]), abs(memory.angle[1] - goal[1])))
