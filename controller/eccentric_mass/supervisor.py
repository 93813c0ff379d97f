"""The order of the stages: estimate, drive round, go, look, correct, rest; and when each is left."""

from __future__ import annotations

import cmath
import math
from typing import Final

from ringbalance.controller.eccentric_mass.plan import (
    HELD,
    MOVING,
    NOT_YET,
    RELEASED,
    Cause,
    Facts,
    Findings,
    Gates,
    Pair,
    Plan,
    Stage,
    averaging_from,
    enter,
    setting_out,
    with_arrival,
    with_correction,
    with_findings,
    with_goal,
    with_hold,
    with_nearest,
    with_objective,
    with_progress,
    with_sample,
    with_short,
    with_stall,
    with_targets,
    with_trial,
)
from ringbalance.controller.eccentric_mass.targets import (
    Correction,
    Tuning,
    assign,
    correction_aim,
    correction_back,
    correction_ends,
    correction_judged,
    correction_start,
    correction_step,
    separation,
    target_angles,
    tuning_next,
    tuning_place,
    tuning_start,
)
from ringbalance.scene.platform.compiled import compiled

# Plain numbers: the compiler takes enumerations, but not as fast.
WAITING, IMBALANCE, FRICTION, POSITIONING, CHECK, CORRECTION, FINE_TUNING, REST, FAILED = map(int, Stage)
_CAUSES: Final = tuple(map(int, Cause))
NONE, BALANCED, SATURATED, RESIDUAL, TUNING_TIME, SPEED_CHANGED, TOO_SLOW, SPEED_NOT_CONSTANT = _CAUSES[:8]
IMBALANCE_UNCERTAIN, FRICTION_UNCERTAIN, STALLED, NOT_ARRIVED, LOCKED, MASSES_MOVE = _CAUSES[8:]

_HOLDS_FOR_SURE: Final = 0.7
"""Share of the friction known to be there that the drives may be switched off on."""
STALLED_SHARE: Final = 0.5
"""Of the friction stage, beyond which its failure is blamed on the drive."""
_STILL_TIME: Final = 1.0
"""For which masses must have come no nearer to their goal to count as held by friction, s."""


@compiled
def first_plan(goal: Pair, time: float) -> Plan:
    """The plan before the first sample. Returns: Plan, waiting."""
    nothing = Findings(False, 0.0, math.inf, 0.0, 0, 0)
    tuning = tuning_start(goal[0], goal[1], math.inf, 1.0)
    begin = setting_out(time)
    return Plan(0, time, 0, goal, MOVING, begin, correction_start(goal, 0.0j), tuning, nothing)


@compiled
def supervise(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Decide what to do next; the same arguments always give the same answer.

    Source: Fig. 3 of the paper on eccentric masses, with gates on relative uncertainty and ways out.
    """
    if plan.stage == WAITING:
        begins = facts.time >= gates.start
        return enter(plan, IMBALANCE, facts.time, NONE, plan.goal) if begins else plan
    if plan.stage == IMBALANCE:
        return _imbalance(gates, plan, facts)
    if plan.stage == FRICTION:
        return _friction(gates, plan, facts)
    if plan.stage == POSITIONING:
        return _positioning(gates, plan, facts)
    if plan.stage == CHECK:
        return _check(gates, plan, facts)
    if plan.stage == CORRECTION:
        return _correction(gates, plan, facts)
    if plan.stage == FINE_TUNING:
        return _fine_tuning(gates, plan, facts)
    return _rest(gates, plan, facts)


@compiled
def _imbalance(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Until the imbalance is known relative to itself, or so well that it makes no difference."""
    known = facts.deviation <= gates.imbalance_gate * abs(facts.imbalance)
    settled = 2 * facts.deviation * abs(facts.influence) <= 0.1 * gates.limit
    if facts.visible and (known or settled) and facts.time - plan.entered >= gates.least_estimate:
        return enter(plan, FRICTION, facts.time, NONE, facts.angle)
    if facts.time - plan.entered < gates.imbalance_time:
        return plan
    cause = IMBALANCE_UNCERTAIN
    if abs(facts.speed) < gates.lowest_speed:
        cause = TOO_SLOW
    elif not facts.constant:
        cause = SPEED_NOT_CONSTANT
    elif not facts.visible:
        cause = MASSES_MOVE
    return enter(plan, FAILED, facts.time, cause, facts.angle)


@compiled
def _friction(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Until both friction arms are known relative to themselves, or so well that it makes no difference."""
    elapsed = facts.time - plan.entered
    now = _watched(gates, plan, facts)
    known = True
    for i in range(2):
        torque = facts.arm_deviation[i] * gates.moment * facts.speed**2
        relative = facts.arm_deviation[i] <= gates.friction_gate * facts.arm[i]
        # Friction does not drive: an arm well below zero contradicts the filter's model.
        possible = facts.arm[i] >= -2 * facts.arm_deviation[i]
        known = known and possible and (relative or torque <= gates.friction_torque)
    if known and elapsed >= gates.least_drive:
        return _towards(gates, now, facts)
    if elapsed < gates.friction_time:
        return now
    stalled = now.findings.stalled > STALLED_SHARE * now.findings.driven
    cause = STALLED if stalled else FRICTION_UNCERTAIN
    return enter(now, FAILED, facts.time, cause, facts.angle)


@compiled
def _watched(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Count the samples in which a mass hardly moves, once the drives have had a moment to get going."""
    if facts.time - plan.entered < 0.5 * gates.least_drive:
        return plan
    slow = min(abs(facts.rate[0]), abs(facts.rate[1])) < gates.stall_rate
    return with_findings(plan, with_stall(plan.findings, slow))


@compiled
def _towards(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Go to the targets for the estimated imbalance."""
    goal, saturated, residual = _goal(gates, facts.angle, facts.imbalance)
    now = with_findings(plan, with_targets(plan.findings, saturated, residual))
    now = with_correction(now, correction_start(goal, facts.imbalance))
    return enter(now, POSITIONING, facts.time, NONE, goal)


@compiled
def _goal(gates: Gates, angle: Pair, imbalance: complex) -> tuple[Pair, bool, float]:
    """Targets for an imbalance, and who goes where from these angles.

    Returns: Goal, whether it is saturated, and the imbalance that it leaves, kg m.
    """
    targets = target_angles(abs(imbalance), cmath.phase(imbalance), gates.moment, gates.gap)
    travel = assign(angle[0], angle[1], targets.first, targets.second)
    goal = (
        angle[0] + travel.first + gates.target_error[0],
        angle[1] + travel.second + gates.target_error[1],
    )
    return goal, targets.saturated, targets.residual


@compiled
def _positioning(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Until the masses are at their targets, or friction holds them: the check tells what that leaves."""
    now = _arriving(gates, plan, facts, gates.arrival_angle)
    if _there(gates, now, facts) or _held(gates, now, facts):
        return enter(now, CHECK, facts.time, NONE, now.goal)
    late = facts.time - now.entered >= gates.positioning_time
    return enter(now, FAILED, facts.time, NOT_ARRIVED, facts.angle) if late else now


@compiled
def _check(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Average the vibration once the masses are left to friction, and correct the targets by it."""
    if not facts.constant:
        return _cut_short(gates, plan, facts)
    now = _rest(gates, plan, facts)
    if now.hold == MOVING:
        return now
    if now.progress.averaging == NOT_YET:
        now = with_progress(now, averaging_from(now.progress, facts.time + gates.wait))
    now = _sampled(now, facts)
    if not _averaged(gates, now, facts):
        return now
    return _corrected(gates, now, now.progress.total / now.progress.samples, facts)


@compiled
def _corrected(gates: Gates, plan: Plan, mean: complex, facts: Facts) -> Plan:
    """Go on to better targets while that helps, back to the best place, or on to what comes after."""
    held = plan.findings.short > gates.tuning_near
    best = correction_judged(plan.correction, mean, gates.margin, held)
    now = _judged(with_correction(plan, best), abs(best.residual))
    far = plan.findings.short > gates.arrival_angle
    enough = far and abs(mean) <= gates.limit
    over = enough or gates.by_trials or facts.influence == 0 or correction_ends(best, gates.margin)
    if not over:
        aim = correction_aim(best, facts.influence)
        goal, saturated, residual = _goal(gates, _without_error(gates, best.place), aim)
        if _distance(goal, best.place) > gates.tuning_near:
            # Where friction keeps the masses far off, the aim goes beyond the imbalance to pull them free.
            if not far:
                now = with_findings(now, with_targets(now.findings, saturated, residual))
            return _set_out(now, correction_step(best, aim, goal), facts)
    if best.residual != mean and not enough:
        return _set_out(now, correction_back(best), facts)
    return _decided(gates, _judged(now, abs(mean)), facts)


@compiled
def _set_out(plan: Plan, correction: Correction, facts: Facts) -> Plan:
    """Begin the move of a correction."""
    return enter(with_correction(plan, correction), CORRECTION, facts.time, NONE, correction.goal)


@compiled
def _decided(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """After the last correction: content with this place, or what is left to do from here."""
    if plan.findings.objective <= gates.limit:
        return with_hold(enter(plan, REST, facts.time, BALANCED, plan.goal), plan.hold)
    if plan.findings.saturated:
        return with_hold(enter(plan, REST, facts.time, SATURATED, plan.goal), plan.hold)
    if plan.findings.short > gates.arrival_angle:
        return enter(plan, FAILED, facts.time, NOT_ARRIVED, facts.angle)
    first = tuning_start(plan.goal[0], plan.goal[1], plan.findings.objective, gates.tuning_step)
    return _try(gates, enter(plan, FINE_TUNING, facts.time, NONE, plan.goal), first, facts)


@compiled
def _cut_short(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """The speed has changed during a check or a correction: the best place so far is kept."""
    content = abs(plan.correction.residual) <= gates.limit
    cause = BALANCED if content else SPEED_CHANGED
    return enter(plan, REST, facts.time, cause, plan.correction.place)


@compiled
def _correction(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Until the masses are at the corrected targets, or where friction leaves them."""
    if not facts.constant:
        return _cut_short(gates, plan, facts)
    now = _arriving(gates, plan, facts, gates.tuning_near)
    return enter(now, CHECK, facts.time, NONE, now.goal) if _over(gates, now, facts) else now


@compiled
def _fine_tuning(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    if not facts.constant:
        return enter(plan, REST, facts.time, SPEED_CHANGED, plan.tuning.base)
    if facts.time - plan.entered >= gates.fine_tuning_time:
        return enter(plan, REST, facts.time, TUNING_TIME, plan.tuning.base)
    if plan.progress.averaging == NOT_YET:
        return _moving(gates, plan, facts)
    now = _sampled(plan, facts)
    if not _averaged(gates, now, facts):
        return now
    tuning = tuning_next(now.tuning, _mean(now), gates.margin, gates.tuning_stop)
    told = _judged(now, tuning.best)
    if tuning.best <= gates.limit:
        return enter(told, REST, facts.time, BALANCED, tuning.base)
    return _try(gates, told, tuning, facts)


@compiled
def _moving(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """A trial counts from where friction leaves the masses, even if not quite where they should be."""
    now = _arriving(gates, plan, facts, max(0.1 * plan.tuning.step, gates.tuning_near))
    if not _over(gates, now, facts):
        return now
    return with_progress(now, averaging_from(now.progress, facts.time + gates.wait))


@compiled
def _try(gates: Gates, plan: Plan, tuning: Tuning, facts: Facts) -> Plan:
    """Go to the next trial at which the masses do not overlap."""
    chosen = tuning
    place = tuning_place(chosen)
    while not chosen.done and separation(place[0], place[1]) < gates.gap:
        chosen = tuning_next(chosen, math.inf, gates.margin, gates.tuning_stop)
        place = tuning_place(chosen)
    if chosen.done:
        return enter(plan, REST, facts.time, RESIDUAL, chosen.base)
    return with_trial(plan, facts.time, chosen, place)


@compiled
def _rest(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Bring the masses home; then the drives rest while friction holds for sure, or hold from then on."""
    now = _arriving(gates, plan, facts, gates.tuning_near)
    hold = now.hold
    if hold == MOVING and _over(gates, now, facts):
        hold, now = RELEASED, _left_there(gates, now, facts)
    astray = False
    for i in range(2):
        astray = astray or abs(facts.angle[i] - now.goal[i]) > 2 * gates.arrival_angle
    if hold == RELEASED and (astray or facts.load > _HOLDS_FOR_SURE):
        hold = HELD
    return with_hold(now, hold)


@compiled
def _left_there(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Where friction has the masses is their place from now on, if that is far short of their goal."""
    short = _distance(facts.angle, plan.goal)
    now = with_findings(plan, with_short(plan.findings, short))
    return with_goal(now, facts.angle) if short > gates.arrival_angle else now


@compiled
def _arriving(gates: Gates, plan: Plan, facts: Facts, closeness: float) -> Plan:
    there = True
    for i in range(2):
        close = abs(facts.angle[i] - plan.goal[i]) <= closeness
        there = there and close and abs(facts.rate[i]) <= gates.arrival_rate
    since = facts.time if plan.progress.arrived == NOT_YET else plan.progress.arrived
    now = with_arrival(plan.progress, since if there else NOT_YET)
    distance = _distance(facts.angle, plan.goal)
    nearer = distance < now.nearest - gates.noticeable
    return with_progress(plan, with_nearest(now, distance, facts.time) if nearer else now)


@compiled
def _there(gates: Gates, plan: Plan, facts: Facts) -> bool:
    return plan.progress.arrived != NOT_YET and facts.time - plan.progress.arrived >= gates.dwell


@compiled
def _held(gates: Gates, plan: Plan, facts: Facts) -> bool:
    """Whether friction holds the masses: slow, and for a while no nearer to their goal."""
    slow = max(abs(facts.rate[0]), abs(facts.rate[1])) <= gates.arrival_rate
    return slow and facts.time - plan.progress.nearer >= _STILL_TIME


@compiled
def _over(gates: Gates, plan: Plan, facts: Facts) -> bool:
    """Whether a move has come to its end, at its goal or short of it."""
    late = facts.time - plan.progress.moving >= gates.move_time
    return late or _there(gates, plan, facts) or _held(gates, plan, facts)


@compiled
def _distance(one: Pair, other: Pair) -> float:
    """Larger distance of both masses between two places, rad."""
    return max(abs(one[0] - other[0]), abs(one[1] - other[1]))


@compiled
def _without_error(gates: Gates, place: Pair) -> Pair:
    """Targets of a goal, without the error that the scene adds to them, rad."""
    return place[0] - gates.target_error[0], place[1] - gates.target_error[1]


@compiled
def _sampled(plan: Plan, facts: Facts) -> Plan:
    """The mean is of the rotor-fixed vector: noise averages out of it, but not out of amplitudes."""
    if facts.time < plan.progress.averaging:
        return plan
    return with_progress(plan, with_sample(plan.progress, facts.position))


@compiled
def _averaged(gates: Gates, plan: Plan, facts: Facts) -> bool:
    return plan.progress.samples > 0 and facts.time - plan.progress.averaging >= gates.average


@compiled
def _mean(plan: Plan) -> float:
    return abs(plan.progress.total) / plan.progress.samples


@compiled
def _judged(plan: Plan, objective: float) -> Plan:
    return with_findings(plan, with_objective(plan.findings, objective))
