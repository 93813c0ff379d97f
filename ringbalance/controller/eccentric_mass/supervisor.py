"""Stages of the strategy, from the estimation of the imbalance to rest, and when each ends.

Functions change an element of type `MEMORY`; `Motion` is the present sample.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Final

from ringbalance.controller.eccentric_mass.drive_law import DriveLaw, Motion, rotor_load
from ringbalance.controller.eccentric_mass.imbalance_filter import mass_vector
from ringbalance.controller.eccentric_mass.memory import (
    BALANCED,
    CHECK,
    CORRECTION,
    FAILED,
    FINE_TUNING,
    FRICTION,
    FRICTION_UNCERTAIN,
    HELD,
    IMBALANCE,
    IMBALANCE_UNCERTAIN,
    MASSES_MOVE,
    MOVING,
    NONE,
    NOT_ARRIVED,
    NOT_YET,
    POSITIONING,
    RELEASED,
    RESIDUAL,
    REST,
    SATURATED,
    SPEED_CHANGED,
    SPEED_NOT_CONSTANT,
    STALLED,
    TOO_SLOW,
    TUNING_TIME,
    WAITING,
    Pair,
)
from ringbalance.controller.eccentric_mass.scene_records import STEADY_RAD_S2
from ringbalance.controller.eccentric_mass.settings import Gates
from ringbalance.controller.eccentric_mass.targets import (
    aim_back,
    assign,
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
def supervise(
    gates: Gates, law: DriveLaw, memory: Record, motion: Motion, time: float, visible: bool
) -> None:
    """Decide stage, goal and state of the drives after a sample.

    Args: `visible`: True if the imbalance filter's model holds now.
    Source: Fig. 3 of the paper on eccentric masses, with gates on relative uncertainty and ways out.
    """
    if memory.stage == WAITING:
        if time >= gates.start:
            enter(memory, IMBALANCE, time, NONE)
    elif memory.stage == IMBALANCE:
        _imbalance(gates, law, memory, motion, time, visible)
    elif memory.stage == FRICTION:
        _friction(gates, memory, motion, time)
    elif memory.stage == POSITIONING:
        # Until the masses are at their targets or held by friction; the check shows the residual vibration.
        _watch_arrival(gates, memory, time, gates.arrival_angle)
        if _arrived(memory, time) or _held(gates, memory, time):
            enter(memory, CHECK, time, NONE)
        elif time - memory.entered >= gates.positioning_time:
            _stay(memory, FAILED, time, NOT_ARRIVED)
    elif memory.stage in (CHECK, CORRECTION) and not is_constant(motion):
        within = _is_balanced(gates, abs(memory.residual))
        _rest_at(memory, memory.best_goal, time, BALANCED if within else SPEED_CHANGED)
    elif memory.stage == CHECK:
        _check(gates, law, memory, motion, time)
    elif memory.stage == CORRECTION:
        # Until the masses are at the corrected targets or held by friction.
        _watch_arrival(gates, memory, time, gates.tuning_near)
        if _move_ended(gates, memory, time):
            enter(memory, CHECK, time, NONE)
    elif memory.stage == FINE_TUNING:
        _fine_tuning(gates, law, memory, motion, time)
    else:
        _rest(gates, law, memory, motion, time)


@in_place
def enter(memory: Record, stage: int, time: float, cause: int) -> None:
    """Begin a stage in which the masses move to their goal."""
    memory.stage, memory.entered, memory.cause = stage, time, cause
    _set_out(memory, time)


@in_place
def _set_out(memory: Record, time: float) -> None:
    memory.hold, memory.moving, memory.arrived = MOVING, time, NOT_YET
    memory.nearest, memory.nearer = math.inf, time
    _average_from(memory, NOT_YET)


@in_place
def _average_from(memory: Record, time: float) -> None:
    memory.averaging, memory.total, memory.averaged = time, 0.0j, 0


@in_place
def _stay(memory: Record, stage: int, time: float, cause: int) -> None:
    """Begin a stage in which the masses keep their positions."""
    set_pair(memory.goal, memory.angle[0], memory.angle[1])
    enter(memory, stage, time, cause)


@in_place
def _rest_at(memory: Record, angles: Sequence[float], time: float, cause: int) -> None:
    """Begin the stage of rest, with these angles as goal."""
    set_pair(memory.goal, angles[0], angles[1])
    enter(memory, REST, time, cause)


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
def _imbalance(
    gates: Gates, law: DriveLaw, memory: Record, motion: Motion, time: float, visible: bool
) -> None:
    """Estimate the imbalance until its error is small, relative to itself or, as vibration, to the limit."""
    precise = memory.deviation <= gates.imbalance_gate * abs(memory.imbalance)
    little = 2 * memory.deviation * abs(_influence_of(law, motion.speed)) <= 0.1 * gates.limit
    elapsed = time - memory.entered
    if visible and (precise or little) and elapsed >= gates.least_estimate:
        _stay(memory, FRICTION, time, NONE)
    elif elapsed >= gates.imbalance_time:
        cause = IMBALANCE_UNCERTAIN
        if abs(motion.speed) < gates.lowest_speed:
            cause = TOO_SLOW
        elif memory.filter.plateau < 0:
            cause = SPEED_NOT_CONSTANT
        elif not visible:
            cause = MASSES_MOVE
        _stay(memory, FAILED, time, cause)


@in_place
def _friction(gates: Gates, memory: Record, motion: Motion, time: float) -> None:
    """Estimate both friction arms until their errors are small, relative to the arms or for the arrival."""
    elapsed, precise = time - memory.entered, True
    # Without the time in which the drives start.
    if elapsed >= 0.5 * LEAST_DRIVE_TIME_S:
        memory.driven += 1
        memory.stalled += 1 if min(abs(memory.rate[0]), abs(memory.rate[1])) < gates.stall_rate else 0
    for i in range(2):
        arm, deviation, turning = memory.friction[i].arm, arm_noise(memory, i), motion.speed + memory.rate[i]
        # Standard deviation by the constants of an arm (T - C w)/(b (W + w)^2) less the rotor's load.
        memory.arm_doubt[i] = 0.0
        if elapsed > 0 and turning != 0:
            motor, back = memory.motor[i] / elapsed, memory.back_emf[i] / elapsed
            of_motor, of_both, of_back = gates.constants
            variance = motor * motor * of_motor - 2 * motor * back * of_both + back * back * of_back
            memory.arm_doubt[i] = math.sqrt(max(variance, 0.0)) / (gates.moment * turning * turning)
        relative = deviation <= gates.friction_gate * arm
        # Friction cannot drive a mass: an arm well below zero contradicts the filter's model.
        possible = arm >= -2 * arm_deviation(memory, i)
        little = deviation * gates.moment * motion.speed**2 <= gates.friction_torque
        precise = precise and possible and (relative or little)
    if precise and elapsed >= LEAST_DRIVE_TIME_S:
        (first, second), memory.saturated, memory.left = _goal(gates, memory.angle, memory.imbalance)
        set_pair(memory.goal, first, second)
        # The first targets, for the estimated imbalance, are corrected by the mean vibration there.
        memory.residual, memory.share, memory.steps = complex(math.inf, 0.0), 1.0, 0
        memory.corrected, memory.aim = memory.imbalance, memory.imbalance
        set_pair(memory.best_goal, first, second)
        set_pair(memory.aimed, first, second)
        enter(memory, POSITIONING, time, NONE)
    elif elapsed >= gates.friction_time:
        stalled = memory.stalled > STALLED_SHARE * memory.driven
        _stay(memory, FAILED, time, STALLED if stalled else FRICTION_UNCERTAIN)


@in_place
def arm_noise(memory: Record, mass: int) -> float:
    """Standard deviation of an estimated friction arm by noise, m."""
    return math.sqrt(max(memory.friction[mass].arm_variance, 0.0))


@in_place
def arm_deviation(memory: Record, mass: int) -> float:
    """Standard deviation of a friction arm by noise and by the constants of motor and masses, m."""
    return math.hypot(arm_noise(memory, mass), memory.arm_doubt[mass])


@in_place
def _goal(gates: Gates, angle: Sequence[float], imbalance: complex) -> tuple[Pair, int, float]:
    """Goal for an imbalance, rad: for each mass from its angle to the target that `assign` selects.

    Returns: Goal, 1 if saturated, and residual imbalance at the goal, kg m.
    """
    targets = target_angles(abs(imbalance), cmath.phase(imbalance), gates.moment, gates.gap)
    first, second = assign(angle[0], angle[1], targets.first, targets.second)
    goal = (angle[0] + first + gates.target_error[0], angle[1] + second + gates.target_error[1])
    return goal, 1 if targets.saturated else 0, targets.residual


@in_place
def _check(gates: Gates, law: DriveLaw, memory: Record, motion: Motion, time: float) -> None:
    """Average the vibration once the masses have arrived or are held, and correct the targets by the mean."""
    _rest(gates, law, memory, motion, time)
    if memory.hold == MOVING:
        return
    if memory.averaging == NOT_YET:
        _average_from(memory, time + gates.wait)
    if _averaged(gates, memory, motion, time):
        mean, influence = memory.total / memory.averaged, _influence_of(law, motion.speed)
        _correct(gates, memory, mean, influence, time)
        if memory.stage == REST:
            _learn(law, memory, mean, influence)


@in_place
def _learn(law: DriveLaw, memory: Record, mean: complex, influence: complex) -> None:
    """Keep the position, and set the imbalance of the drive law from the mean vibration, U = z/alpha - p.

    Not before: an error of the filter's estimate keeps the masses off all goals alike, so goals compare.
    """
    set_pair(memory.goal, memory.angle[0], memory.angle[1])
    if influence != 0:
        vector, _ = mass_vector(law.track.moment, (memory.angle[0], memory.angle[1]), (0.0, 0.0))
        memory.imbalance = mean / influence - vector


@in_place
def _correct(gates: Gates, memory: Record, mean: complex, influence: complex, time: float) -> None:
    """Move to better targets while that helps, then back to the best ones, or begin the next stage."""
    done = judge_correction(memory, mean, gates.margin, memory.short > gates.tuning_near)
    memory.objective = abs(memory.residual)
    far = memory.short > gates.arrival_angle
    within = far and _is_balanced(gates, abs(mean))
    done = done or within or gates.by_trials or influence == 0
    if not done and _aim_better(gates, memory, influence, far):
        enter(memory, CORRECTION, time, NONE)
    elif memory.residual != mean and not within:
        # Back to the best targets, for the last mean.
        aim_back(memory)
        memory.share = 0.0
        set_pair(memory.goal, memory.aimed[0], memory.aimed[1])
        enter(memory, CORRECTION, time, NONE)
    else:
        # These targets are final: rest, failure, or fine tuning.
        memory.objective, hold = abs(mean), memory.hold
        within = _is_balanced(gates, abs(mean))
        if within or memory.saturated:
            enter(memory, REST, time, BALANCED if within else SATURATED)
            memory.hold = hold
        elif far:
            _stay(memory, FAILED, time, NOT_ARRIVED)
        else:
            enter(memory, FINE_TUNING, time, NONE)
            begin_tuning(memory, gates.tuning_step)
            _try(gates, memory, time)


@in_place
def _aim_better(gates: Gates, memory: Record, influence: complex, far: bool) -> bool:
    """Set targets that also cancel the residual at the best ones. Returns: True if they differ."""
    best, error = memory.best_goal, gates.target_error
    aim = memory.corrected + memory.share * memory.residual / influence
    (first, second), saturated, left = _goal(gates, (best[0] - error[0], best[1] - error[1]), aim)
    if max(abs(first - best[0]), abs(second - best[1])) <= gates.tuning_near:
        return False
    # If friction keeps the masses far off, the aim exceeds the imbalance so that they break away.
    if not far:
        memory.saturated, memory.left = saturated, left
    memory.aim, memory.steps = aim, memory.steps + 1
    set_pair(memory.aimed, first, second)
    set_pair(memory.goal, first, second)
    return True


@in_place
def _fine_tuning(gates: Gates, law: DriveLaw, memory: Record, motion: Motion, time: float) -> None:
    """Judge each trial at the angles at which friction leaves the masses, even if not quite at the goal."""
    if not is_constant(motion):
        _rest_at(memory, memory.base, time, SPEED_CHANGED)
    elif time - memory.entered >= gates.fine_tuning_time:
        _rest_at(memory, memory.base, time, TUNING_TIME)
    elif memory.averaging == NOT_YET:
        _watch_arrival(gates, memory, time, max(0.1 * memory.move_size, gates.tuning_near))
        if _move_ended(gates, memory, time):
            _average_from(memory, time + gates.wait)
    elif _averaged(gates, memory, motion, time):
        mean = memory.total / memory.averaged
        next_trial(memory, abs(mean), gates.margin, gates.tuning_stop)
        memory.objective = memory.least
        if _is_balanced(gates, memory.least):
            _learn(law, memory, mean, _influence_of(law, motion.speed))
            enter(memory, REST, time, BALANCED)
        else:
            _try(gates, memory, time)


@in_place
def _try(gates: Gates, memory: Record, time: float) -> None:
    """Go to the next trial at which the masses do not overlap."""
    first, second = tuning_place(memory)
    while not memory.done and separation(first, second) < gates.gap:
        next_trial(memory, math.inf, gates.margin, gates.tuning_stop)
        first, second = tuning_place(memory)
    if memory.done:
        _rest_at(memory, memory.base, time, RESIDUAL)
    else:
        set_pair(memory.goal, first, second)
        _set_out(memory, time)


@in_place
def _rest(gates: Gates, law: DriveLaw, memory: Record, motion: Motion, time: float) -> None:
    """Move the masses to the goal; then switch the drives off while friction certainly holds, else hold."""
    _watch_arrival(gates, memory, time, gates.tuning_near)
    if memory.hold == MOVING and _move_ended(gates, memory, time):
        memory.hold, memory.short = RELEASED, _distance(memory)
        # Masses held far from their goal: the present angles become the goal.
        if memory.short > gates.arrival_angle:
            set_pair(memory.goal, memory.angle[0], memory.angle[1])
    if memory.hold == MOVING:
        return
    # Largest load on a mass at rest, as a fraction of its certain friction.
    load = 0.0
    angle = (memory.angle[0], memory.angle[1])
    quiet = Motion(motion.speed, motion.speed_rate, memory.position, memory.velocity, angle, (0.0, 0.0))
    torque = rotor_load(law, quiet, memory.imbalance, (0.0, 0.0))
    for i in range(2):
        least_arm = max(memory.friction[i].arm - 2 * arm_deviation(memory, i), 0.0)
        most = least_arm * law.track.moment * motion.speed * motion.speed
        load = max(load, abs(torque[i]) / most if most > 0 else math.inf)
    if _distance(memory) > 2 * gates.arrival_angle or load > _DRIVES_ON_LOAD:
        memory.hold = HELD
    elif load < _DRIVES_OFF_LOAD and (_arrived(memory, time) or _held(gates, memory, time)):
        memory.hold = RELEASED


@in_place
def _watch_arrival(gates: Gates, memory: Record, time: float, closeness: float) -> None:
    distance = _distance(memory)
    slow = max(abs(memory.rate[0]), abs(memory.rate[1])) <= gates.arrival_rate
    if not (distance <= closeness and slow):
        memory.arrived = NOT_YET
    elif memory.arrived == NOT_YET:
        memory.arrived = time
    if distance < memory.nearest - gates.noticeable:
        memory.nearest, memory.nearer = distance, time


@in_place
def _arrived(memory: Record, time: float) -> bool:
    return bool(memory.arrived != NOT_YET and time - memory.arrived >= _DWELL_TIME_S)


@in_place
def _held(gates: Gates, memory: Record, time: float) -> bool:
    """Return True if friction holds the masses: slow, and no approach to the goal for `_STILL_TIME_S`."""
    slow = max(abs(memory.rate[0]), abs(memory.rate[1])) <= gates.arrival_rate
    return bool(slow and time - memory.nearer >= _STILL_TIME_S)


@in_place
def _move_ended(gates: Gates, memory: Record, time: float) -> bool:
    """Return True if a move has ended, at its goal or short of it."""
    late = time - memory.moving >= _LONGEST_MOVE_S
    return late or _arrived(memory, time) or _held(gates, memory, time)


@in_place
def _distance(memory: Record) -> float:
    """Largest distance of a mass from its goal, rad."""
    first, second = memory.angle[0] - memory.goal[0], memory.angle[1] - memory.goal[1]
    return float(max(abs(first), abs(second)))


@in_place
def _averaged(gates: Gates, memory: Record, motion: Motion, time: float) -> bool:
    """Add a sample to the mean vibration; return True if it has the full averaging time.

    The mean is of the rotor-fixed vector, in which noise averages out; in amplitudes it does not.
    """
    if time >= memory.averaging:
        memory.total += motion.position
        memory.averaged += 1
    return bool(memory.averaged > 0 and time - memory.averaging >= gates.average)
