"""A plan with one of its parts replaced: numba builds tuples by position alone, here and nowhere else."""

from __future__ import annotations

import math

from ringbalance.controller.eccentric_mass.strategy.correction import Correction
from ringbalance.controller.eccentric_mass.strategy.plan import (
    MOVING,
    NOT_YET,
    Findings,
    Pair,
    Plan,
    Progress,
)
from ringbalance.controller.eccentric_mass.strategy.targets import Tuning
from ringbalance.scene.platform.compiled import compiled


@compiled
def setting_out(time: float) -> Progress:
    """Progress at the beginning of a move. Returns: Progress, with nothing arrived or averaged yet."""
    return Progress(time, NOT_YET, math.inf, time, NOT_YET, 0.0j, 0)


@compiled
def enter(plan: Plan, stage: int, time: float, cause: int, goal: Pair) -> Plan:
    """Begin a stage. Returns: The plan, with its tuning and findings."""
    begin = setting_out(time)
    return Plan(stage, time, cause, goal, MOVING, begin, plan.correction, plan.tuning, plan.findings)


@compiled
def with_progress(plan: Plan, progress: Progress) -> Plan:
    """The plan, farther on in its move or its mean."""
    return Plan(
        plan.stage,
        plan.entered,
        plan.cause,
        plan.goal,
        plan.hold,
        progress,
        plan.correction,
        plan.tuning,
        plan.findings,
    )


@compiled
def with_findings(plan: Plan, findings: Findings) -> Plan:
    """The plan with what a stage leaves behind."""
    return Plan(
        plan.stage,
        plan.entered,
        plan.cause,
        plan.goal,
        plan.hold,
        plan.progress,
        plan.correction,
        plan.tuning,
        findings,
    )


@compiled
def with_hold(plan: Plan, hold: int) -> Plan:
    """The plan with its drives moving, released or holding."""
    return Plan(
        plan.stage,
        plan.entered,
        plan.cause,
        plan.goal,
        hold,
        plan.progress,
        plan.correction,
        plan.tuning,
        plan.findings,
    )


@compiled
def with_trial(plan: Plan, time: float, tuning: Tuning, goal: Pair) -> Plan:
    """The plan that sets out to a trial of fine tuning."""
    begin = setting_out(time)
    return Plan(
        plan.stage, plan.entered, plan.cause, goal, MOVING, begin, plan.correction, tuning, plan.findings
    )


@compiled
def with_goal(plan: Plan, goal: Pair) -> Plan:
    """The plan with another goal for the same move."""
    return Plan(
        plan.stage,
        plan.entered,
        plan.cause,
        goal,
        plan.hold,
        plan.progress,
        plan.correction,
        plan.tuning,
        plan.findings,
    )


@compiled
def with_correction(plan: Plan, correction: Correction) -> Plan:
    """The plan with another correction."""
    return Plan(
        plan.stage,
        plan.entered,
        plan.cause,
        plan.goal,
        plan.hold,
        plan.progress,
        correction,
        plan.tuning,
        plan.findings,
    )


@compiled
def averaging_from(progress: Progress, begins: float) -> Progress:
    """Progress that begins its mean at a time, s."""
    return Progress(progress.moving, progress.arrived, progress.nearest, progress.nearer, begins, 0.0j, 0)


@compiled
def with_arrival(progress: Progress, arrived: float) -> Progress:
    """Progress with the time of arrival, s; NOT_YET."""
    nearest, nearer = progress.nearest, progress.nearer
    return Progress(
        progress.moving, arrived, nearest, nearer, progress.averaging, progress.total, progress.samples
    )


@compiled
def with_nearest(progress: Progress, nearest: float, since: float) -> Progress:
    """Progress of masses that have come as near to their goal as this, rad, at a time, s."""
    moving, arrived = progress.moving, progress.arrived
    return Progress(moving, arrived, nearest, since, progress.averaging, progress.total, progress.samples)


@compiled
def with_sample(progress: Progress, position: complex) -> Progress:
    """Progress with one sample more in its mean."""
    total, samples = progress.total + position, progress.samples + 1
    nearest, nearer = progress.nearest, progress.nearer
    return Progress(progress.moving, progress.arrived, nearest, nearer, progress.averaging, total, samples)


@compiled
def with_stall(findings: Findings, stalled: bool) -> Findings:
    """Findings with one sample more of the friction stage."""
    more, driven = findings.stalled + (1 if stalled else 0), findings.driven + 1
    return Findings(findings.saturated, findings.residual, findings.objective, findings.short, driven, more)


@compiled
def with_targets(findings: Findings, saturated: bool, residual: float) -> Findings:
    """Findings with what the targets leave, kg m."""
    return Findings(
        saturated, residual, findings.objective, findings.short, findings.driven, findings.stalled
    )


@compiled
def with_objective(findings: Findings, objective: float) -> Findings:
    """Findings with the mean amplitude at the present place, m."""
    return Findings(
        findings.saturated, findings.residual, objective, findings.short, findings.driven, findings.stalled
    )


@compiled
def with_short(findings: Findings, short: float) -> Findings:
    """Findings with the distance at which friction was left to hold a mass short of its goal, rad."""
    return Findings(
        findings.saturated,
        findings.residual,
        findings.objective,
        short,
        findings.driven,
        findings.stalled,
    )
