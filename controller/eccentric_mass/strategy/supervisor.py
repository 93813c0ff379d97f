"""The order of the stages: estimate, drive round, go, look, tune by trial, rest; and when each is left."""

from __future__ import annotations

import cmath
import math
from typing import Final

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.eccentric_mass.strategy.plan import (
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
    Progress,
    Stage,
)
from ringbalance.controller.eccentric_mass.strategy.targets import (
    Tuning,
    assign,
    separation,
    target_angles,
    tuning_next,
    tuning_place,
    tuning_start,
)

# Plain numbers: the compiler takes enumerations, but not as fast.
WAITING, IMBALANCE, FRICTION, POSITIONING, CHECK, FINE_TUNING, REST, FAILED = map(int, Stage)
_CAUSES: Final = tuple(map(int, Cause))
NONE, BALANCED, SATURATED, RESIDUAL, TUNING_TIME, SPEED_CHANGED, TOO_SLOW, SPEED_NOT_CONSTANT = _CAUSES[:8]
IMBALANCE_UNCERTAIN, FRICTION_UNCERTAIN, STALLED, NOT_ARRIVED, LOCKED, MASSES_MOVE = _CAUSES[8:]

_HOLDS_FOR_SURE: Final = 0.7
"""Share of the friction known to be there that the drives may be switched off on."""
STALLED_SHARE: Final = 0.5
"""Of the friction stage, beyond which its failure is blamed on the drive."""


@compiled
def first_plan(goal: Pair, time: float) -> Plan:
    """The plan before the first sample. Returns: Plan, waiting."""
    nothing = Findings(False, 0.0, math.inf, 0, 0)
    tuning = tuning_start(goal[0], goal[1], math.inf, 1.0)
    return Plan(0, time, 0, goal, MOVING, _setting_out(time), tuning, nothing)


@compiled
def _setting_out(time: float) -> Progress:
    """Progress at the beginning of a move. Returns: Progress, with nothing arrived or averaged yet."""
    return Progress(time, NOT_YET, NOT_YET, 0.0j, 0)


@compiled
def supervise(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Decide what to do next; the same arguments always give the same answer.

    Source: Fig. 3 of the paper on eccentric masses, with gates on relative uncertainty and ways out.
    """
    if plan.stage == WAITING:
        begins = facts.time >= gates.start
        return _enter(plan, IMBALANCE, facts.time, NONE, plan.goal) if begins else plan
    if plan.stage == IMBALANCE:
        return _imbalance(gates, plan, facts)
    if plan.stage == FRICTION:
        return _friction(gates, plan, facts)
    if plan.stage == POSITIONING:
        return _positioning(gates, plan, facts)
    if plan.stage == CHECK:
        return _check(gates, plan, facts)
    if plan.stage == FINE_TUNING:
        return _fine_tuning(gates, plan, facts)
    return _rest(gates, plan, facts)


@compiled
def _imbalance(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Until the imbalance is known relative to itself, or so well that it makes no difference."""
    known = facts.deviation <= gates.imbalance_gate * abs(facts.imbalance)
    settled = 2 * facts.deviation * facts.reach <= 0.1 * gates.limit
    if facts.visible and (known or settled) and facts.time - plan.entered >= gates.least_estimate:
        return _enter(plan, FRICTION, facts.time, NONE, facts.angle)
    if facts.time - plan.entered < gates.imbalance_time:
        return plan
    cause = IMBALANCE_UNCERTAIN
    if abs(facts.speed) < gates.lowest_speed:
        cause = TOO_SLOW
    elif not facts.constant:
        cause = SPEED_NOT_CONSTANT
    elif not facts.visible:
        cause = MASSES_MOVE
    return _enter(plan, FAILED, facts.time, cause, facts.angle)


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
    return _enter(now, FAILED, facts.time, cause, facts.angle)


@compiled
def _watched(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Count the samples in which a mass hardly moves, once the drives have had a moment to get going."""
    if facts.time - plan.entered < 0.5 * gates.least_drive:
        return plan
    slow = min(abs(facts.rate[0]), abs(facts.rate[1])) < gates.stall_rate
    return _with_findings(plan, _with_stall(plan.findings, slow))


@compiled
def _towards(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Targets for the estimated imbalance, and who goes where."""
    phase = cmath.phase(facts.imbalance)
    targets = target_angles(abs(facts.imbalance), phase, gates.moment, gates.gap)
    travel = assign(facts.angle[0], facts.angle[1], targets.first, targets.second)
    goal = (
        facts.angle[0] + travel.first + gates.target_error[0],
        facts.angle[1] + travel.second + gates.target_error[1],
    )
    found = _with_targets(plan.findings, targets.saturated, targets.residual)
    return _enter(_with_findings(plan, found), POSITIONING, facts.time, NONE, goal)


@compiled
def _positioning(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    now = _arriving(gates, plan, facts, gates.arrival_angle)
    if _there(gates, now, facts):
        found = _enter(now, CHECK, facts.time, NONE, now.goal)
        return _with_progress(found, _averaging_from(found.progress, facts.time + gates.wait))
    late = facts.time - now.entered >= gates.positioning_time
    return _enter(now, FAILED, facts.time, NOT_ARRIVED, facts.angle) if late else now


@compiled
def _check(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    if not facts.constant:
        return _enter(plan, REST, facts.time, SPEED_CHANGED, plan.goal)
    now = _sampled(_rest(gates, plan, facts), facts)
    if not _averaged(gates, now, facts):
        return now
    told = _judged(now, _mean(now))
    if told.findings.objective <= gates.limit:
        return _enter(told, REST, facts.time, BALANCED, now.goal)
    if told.findings.saturated:
        return _enter(told, REST, facts.time, SATURATED, now.goal)
    first = tuning_start(now.goal[0], now.goal[1], told.findings.objective, gates.tuning_step)
    return _try(gates, _enter(told, FINE_TUNING, facts.time, NONE, now.goal), first, facts)


@compiled
def _fine_tuning(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    if not facts.constant:
        return _enter(plan, REST, facts.time, SPEED_CHANGED, plan.tuning.base)
    if facts.time - plan.entered >= gates.fine_tuning_time:
        return _enter(plan, REST, facts.time, TUNING_TIME, plan.tuning.base)
    if plan.progress.averaging == NOT_YET:
        return _moving(gates, plan, facts)
    now = _sampled(plan, facts)
    if not _averaged(gates, now, facts):
        return now
    tuning = tuning_next(now.tuning, _mean(now), gates.margin, gates.tuning_stop)
    told = _judged(now, tuning.best)
    if tuning.best <= gates.limit:
        return _enter(told, REST, facts.time, BALANCED, tuning.base)
    return _try(gates, told, tuning, facts)


@compiled
def _moving(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """A trial counts from where friction leaves the masses, even if not quite where they should be."""
    now = _arriving(gates, plan, facts, max(0.1 * plan.tuning.step, gates.tuning_near))
    late = facts.time - now.progress.moving >= gates.move_time
    if not late and not _there(gates, now, facts):
        return now
    return _with_progress(now, _averaging_from(now.progress, facts.time + gates.wait))


@compiled
def _try(gates: Gates, plan: Plan, tuning: Tuning, facts: Facts) -> Plan:
    """Go to the next trial at which the masses do not overlap."""
    chosen = tuning
    place = tuning_place(chosen)
    while not chosen.done and separation(place[0], place[1]) < gates.gap:
        chosen = tuning_next(chosen, math.inf, gates.margin, gates.tuning_stop)
        place = tuning_place(chosen)
    if chosen.done:
        return _enter(plan, REST, facts.time, RESIDUAL, chosen.base)
    return _with_trial(plan, facts.time, chosen, place)


@compiled
def _rest(gates: Gates, plan: Plan, facts: Facts) -> Plan:
    """Bring the masses home; then the drives rest while friction holds for sure, or hold from then on."""
    now = _arriving(gates, plan, facts, gates.tuning_near)
    hold = now.hold
    if hold == MOVING and (_there(gates, now, facts) or facts.time - now.progress.moving >= gates.move_time):
        hold = RELEASED
    astray = False
    for i in range(2):
        astray = astray or abs(facts.angle[i] - now.goal[i]) > 2 * gates.arrival_angle
    if hold == RELEASED and (astray or facts.load > _HOLDS_FOR_SURE):
        hold = HELD
    return _with_hold(now, hold)


@compiled
def _arriving(gates: Gates, plan: Plan, facts: Facts, closeness: float) -> Plan:
    there = True
    for i in range(2):
        close = abs(facts.angle[i] - plan.goal[i]) <= closeness
        there = there and close and abs(facts.rate[i]) <= gates.arrival_rate
    since = facts.time if plan.progress.arrived == NOT_YET else plan.progress.arrived
    return _with_progress(plan, _with_arrival(plan.progress, since if there else NOT_YET))


@compiled
def _there(gates: Gates, plan: Plan, facts: Facts) -> bool:
    return plan.progress.arrived != NOT_YET and facts.time - plan.progress.arrived >= gates.dwell


@compiled
def _sampled(plan: Plan, facts: Facts) -> Plan:
    """The mean is of the rotor-fixed vector: noise averages out of it, but not out of amplitudes."""
    if facts.time < plan.progress.averaging:
        return plan
    return _with_progress(plan, _with_sample(plan.progress, facts.position))


@compiled
def _averaged(gates: Gates, plan: Plan, facts: Facts) -> bool:
    return plan.progress.samples > 0 and facts.time - plan.progress.averaging >= gates.average


@compiled
def _mean(plan: Plan) -> float:
    return abs(plan.progress.total) / plan.progress.samples


@compiled
def _judged(plan: Plan, objective: float) -> Plan:
    return _with_findings(plan, _with_objective(plan.findings, objective))


# Numba builds tuples by position alone: each is rebuilt here and nowhere else.


@compiled
def _enter(plan: Plan, stage: int, time: float, cause: int, goal: Pair) -> Plan:
    """Begin a stage. Returns: The plan, with its tuning and findings."""
    return Plan(stage, time, cause, goal, MOVING, _setting_out(time), plan.tuning, plan.findings)


@compiled
def _with_progress(plan: Plan, progress: Progress) -> Plan:
    """The plan, farther on in its move or its mean."""
    return Plan(
        plan.stage, plan.entered, plan.cause, plan.goal, plan.hold, progress, plan.tuning, plan.findings
    )


@compiled
def _with_findings(plan: Plan, findings: Findings) -> Plan:
    """The plan with what a stage leaves behind."""
    return Plan(
        plan.stage, plan.entered, plan.cause, plan.goal, plan.hold, plan.progress, plan.tuning, findings
    )


@compiled
def _with_hold(plan: Plan, hold: int) -> Plan:
    """The plan with its drives moving, released or holding."""
    return Plan(
        plan.stage, plan.entered, plan.cause, plan.goal, hold, plan.progress, plan.tuning, plan.findings
    )


@compiled
def _with_trial(plan: Plan, time: float, tuning: Tuning, goal: Pair) -> Plan:
    """The plan that sets out to a trial of fine tuning."""
    return Plan(plan.stage, plan.entered, plan.cause, goal, MOVING, _setting_out(time), tuning, plan.findings)


@compiled
def _averaging_from(progress: Progress, begins: float) -> Progress:
    """Progress that begins its mean at a time, s."""
    return Progress(progress.moving, progress.arrived, begins, 0.0j, 0)


@compiled
def _with_arrival(progress: Progress, arrived: float) -> Progress:
    """Progress with the time of arrival, s; NOT_YET."""
    return Progress(progress.moving, arrived, progress.averaging, progress.total, progress.samples)


@compiled
def _with_sample(progress: Progress, position: complex) -> Progress:
    """Progress with one sample more in its mean."""
    total, samples = progress.total + position, progress.samples + 1
    return Progress(progress.moving, progress.arrived, progress.averaging, total, samples)


@compiled
def _with_stall(findings: Findings, stalled: bool) -> Findings:
    """Findings with one sample more of the friction stage."""
    more = findings.stalled + (1 if stalled else 0)
    return Findings(findings.saturated, findings.residual, findings.objective, findings.driven + 1, more)


@compiled
def _with_targets(findings: Findings, saturated: bool, residual: float) -> Findings:
    """Findings with what the targets leave, kg m."""
    return Findings(saturated, residual, findings.objective, findings.driven, findings.stalled)


@compiled
def _with_objective(findings: Findings, objective: float) -> Findings:
    """Findings with the mean amplitude at the present place, m."""
    return Findings(findings.saturated, findings.residual, objective, findings.driven, findings.stalled)
