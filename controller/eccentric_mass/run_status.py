"""How a run ended, in a word and in a sentence that says what to do next; and what to be warned of."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ringbalance.controller.eccentric_mass.divergence_text import divergence_remedy, unstable_loops
from ringbalance.controller.eccentric_mass.run_record import EccentricOutcome
from ringbalance.controller.eccentric_mass.strategy.plan import HELD, Cause, Findings, Stage
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene

MILLIMETRE = 1e-3
MICROMETRE = 1e-6
RPM = 2 * math.pi / 60
STALLED_SHARE = 0.5
"""Share of the friction stage with a mass nearly at a standstill that is to blame for its failure."""
NOTICEABLE_STALL = 0.05
"""Share of the friction stage with a mass nearly at a standstill that is worth a warning."""

CHATTER_SHARE = 0.1
"""Share of a run at the voltage's limit that an unstable loop is looked for behind."""


@dataclass(frozen=True, kw_only=True)
class RunFacts:
    """What status and warnings are made of."""

    scene: EccentricScene
    cause: Cause
    stage: Stage
    """At the end of the run."""
    findings: Findings
    time: float
    """End of the run, s."""
    diverged: bool
    """Whether it ended early, at the last sample that means anything."""
    speed: FloatArray
    """rad/s, shape (n,)."""
    amplitude: FloatArray
    """m, shape (n,)."""
    checked: int | None
    """Sample at which the strategy was content; None when it never was."""
    settling_time: float | None
    """From when on the amplitude is within the limit, s; None when it is not at the end."""
    deviation: float
    """Standard deviation of the imbalance, kg m."""
    imbalance: float
    """Its estimated magnitude, kg m."""
    saturation: float
    """Seconds for which a voltage was at its limit."""
    hold: int
    """Of the drives at the end."""
    least_gap: float
    """Smallest angle between the masses on the way, rad."""
    euler_limit: float
    """Longest step of the paper's transition at the highest speed of the estimation, s."""
    predicted: float
    """Standard deviation of the imbalance to be expected after the longest estimation, kg m."""


OUTCOMES = {
    Cause.SATURATED: EccentricOutcome.SATURATED,
    Cause.RESIDUAL: EccentricOutcome.RESIDUAL,
    Cause.TUNING_TIME: EccentricOutcome.TUNING_TIME,
    Cause.SPEED_CHANGED: EccentricOutcome.SPEED_CHANGED,
    Cause.TOO_SLOW: EccentricOutcome.TOO_SLOW,
    Cause.SPEED_NOT_CONSTANT: EccentricOutcome.SPEED_NOT_CONSTANT,
    Cause.IMBALANCE_UNCERTAIN: EccentricOutcome.IMBALANCE_UNCERTAIN,
    Cause.FRICTION_UNCERTAIN: EccentricOutcome.FRICTION_UNCERTAIN,
    Cause.STALLED: EccentricOutcome.STALLED,
    Cause.NOT_ARRIVED: EccentricOutcome.NOT_ARRIVED,
    Cause.MASSES_MOVE: EccentricOutcome.MASSES_MOVE,
}


def outcome_of(facts: RunFacts) -> EccentricOutcome:
    """Classify how a run ended.

    Returns: Outcome; SETTLED only when the strategy was content and the true amplitude ends within the limit.
    """
    if facts.diverged:
        return EccentricOutcome.DIVERGED
    if facts.cause is Cause.LOCKED:
        return EccentricOutcome.LOCKED
    if facts.cause is Cause.BALANCED:
        settled = facts.settling_time is not None
        return EccentricOutcome.SETTLED if settled else EccentricOutcome.RISES_AGAIN
    if facts.cause is Cause.SPEED_CHANGED and facts.settling_time is not None:
        return EccentricOutcome.SETTLED
    return OUTCOMES.get(_cause(facts), EccentricOutcome.TIME_LIMIT)


def _cause(facts: RunFacts) -> Cause:
    """Of the end; a run that ends within a stage may show already why the stage would have failed."""
    if facts.stage is Stage.IMBALANCE:
        if abs(facts.speed[-1]) < facts.scene.supervisor.lowest_speed:
            return Cause.TOO_SLOW
        steady = facts.speed.size < 2 or facts.speed[-1] == facts.speed[-2]
        return facts.cause if steady else Cause.SPEED_NOT_CONSTANT
    findings = facts.findings
    if facts.stage is Stage.FRICTION and findings.stalled > STALLED_SHARE * findings.driven:
        return Cause.STALLED
    return facts.cause


def status_text(facts: RunFacts, outcome: EccentricOutcome) -> str:
    """One or two sentences: how the run ended, with its numbers, and what to do next.

    Args: `outcome`: as classified.
    """
    return TEXTS[outcome](facts)


def warnings_of(facts: RunFacts) -> tuple[str, ...]:
    """What the user should know although the run went on. Returns: Sentences."""
    return tuple(text for is_due, text in _warnings(facts) if is_due)


def _warnings(facts: RunFacts) -> list[tuple[bool, str]]:
    scene, findings = facts.scene, facts.findings
    chatters = facts.saturation > CHATTER_SHARE * facts.time and facts.settling_time is None
    loops = unstable_loops(scene) if chatters and not facts.diverged else []
    share = findings.stalled / max(findings.driven, 1)
    gap = scene.masses.arc_length / scene.masses.guide_radius
    euler = scene.imbalance_filter.discretisation == "euler"
    step = scene.imbalance_filter.step
    return [
        (
            share > NOTICEABLE_STALL,
            f"a drive nearly stalled during {100 * share:.3g} % of the friction stage: raise "
            "friction_filter.drive_speed or speed_gain, or motor.maximum_voltage",
        ),
        (
            facts.saturation > 0,
            f"a motor voltage was at motor.maximum_voltage for {facts.saturation:.3g} s",
        ),
        (
            bool(loops),
            f"a drive's sampled loop is unstable and swings between the voltage's limits: {'; '.join(loops)}",
        ),
        (
            facts.hold == HELD,
            "the drives hold the masses at the end: friction is not known to do it",
        ),
        (
            facts.least_gap < gap,
            f"the masses came within {math.degrees(facts.least_gap):.3g} deg of each other, less than their "
            f"own {math.degrees(gap):.3g} deg: the run continues as if they could pass",
        ),
        (
            euler and step > facts.euler_limit,
            f"imbalance_filter.step is beyond the stability limit of the Euler transition, "
            f'{facts.euler_limit:.3g} s at this speed: set discretisation = "exact"',
        ),
    ]


def length_text(length: float) -> str:
    """A vibration or a friction arm as a person reads it.

    Args: `length`: m.
    Returns: In millimetres, or in micrometres below a tenth of one.
    """
    small = abs(length) < 0.1 * MILLIMETRE
    return f"{length / MICROMETRE:.4g} um" if small else f"{length / MILLIMETRE:.4g} mm"


def _end(facts: RunFacts) -> str:
    return f"{length_text(float(facts.amplitude[-1]))} at {facts.time:.4g} s"


def _settled(facts: RunFacts) -> str:
    return (
        f"settled: not above the limit of {length_text(facts.scene.supervisor.limit)} from "
        f"{facts.settling_time:.4g} s on, {_end(facts)}; no further correction needed"
    )


def _rises(facts: RunFacts) -> str:
    since = facts.checked or 0
    worst = since + int(np.argmax(facts.amplitude[since:]))
    limit, most = length_text(facts.scene.supervisor.limit), length_text(float(facts.amplitude[worst]))
    return (
        f"not settled: balanced to within the limit of {limit} as measured, but {most} came later, at "
        f"{facts.speed[worst] / RPM:.4g} rpm, and {_end(facts)}: lower imbalance_filter.gate, or raise "
        "supervisor.limit"
    )


def _not_settled(facts: RunFacts) -> str:
    return f"not settled: {_end(facts)} against the limit of {length_text(facts.scene.supervisor.limit)}"


def _saturated(facts: RunFacts) -> str:
    moment = facts.scene.masses.mass * facts.scene.masses.guide_radius
    return (
        f"{_not_settled(facts)}; the imbalance of {facts.imbalance:.4g} kg m is more than both masses can "
        f"undo, {2 * moment:.4g} kg m, and {facts.findings.residual:.4g} kg m is left: balance the rotor "
        "first, or use heavier masses"
    )


def _residual(facts: RunFacts) -> str:
    return (
        f"{_not_settled(facts)}; fine tuning came down to its smallest move: lower fine_tuning.stop, "
        "lengthen fine_tuning.average, or raise supervisor.limit"
    )


def _tuning_time(facts: RunFacts) -> str:
    return (
        f"{_not_settled(facts)}; fine tuning ran out of time: raise supervisor.fine_tuning_time, or the "
        "first fine_tuning.step"
    )


def _speed_changed(facts: RunFacts) -> str:
    return (
        f"{_not_settled(facts)}; the rotor's speed changed before the balancing was done: start earlier, or "
        "change the speed later in rotor.speed_profile"
    )


def _too_slow(facts: RunFacts) -> str:
    return (
        f"{_not_settled(facts)}; the rotor turned slower than supervisor.lowest_speed, "
        f"{facts.scene.supervisor.lowest_speed / RPM:.4g} rpm, where an imbalance cannot be seen: estimate "
        "at a higher speed"
    )


def _not_constant(facts: RunFacts) -> str:
    return (
        f"{_not_settled(facts)}; the rotor's speed was not constant, and the imbalance filter holds for "
        "constant speed only: give rotor.speed_profile a level stretch after supervisor.start"
    )


def _masses_move(facts: RunFacts) -> str:
    return (
        f"{_not_settled(facts)}; the masses did not stay at rest, and the imbalance filter holds for resting "
        "masses only: raise lqr.state_weight or motor.maximum_voltage, so that the drives can hold them"
    )


def _imbalance_uncertain(facts: RunFacts) -> str:
    share = facts.deviation / facts.imbalance if facts.imbalance > 0 else math.inf
    return (
        f"{_not_settled(facts)}; after {facts.scene.supervisor.imbalance_time:.4g} s the imbalance is known "
        f"to {100 * share:.3g} % (one standard deviation; {facts.predicted:.3g} kg m was to be expected) and "
        f"{100 * facts.scene.imbalance_filter.gate:.3g} % is asked for: estimate at a higher speed or "
        "longer, use better sensors, or raise imbalance_filter.gate"
    )


def _friction_uncertain(facts: RunFacts) -> str:
    return (
        f"{_not_settled(facts)}; the friction did not become known to "
        f"{100 * facts.scene.friction_filter.gate:.3g} %: raise supervisor.friction_time or "
        "friction_filter.gate, or use better encoders"
    )


def _stalled(facts: RunFacts) -> str:
    return (
        f"{_not_settled(facts)}; the drives stalled, so that friction could not be found: raise "
        "motor.maximum_voltage, friction_filter.speed_gain or drive_speed"
    )


def _not_arrived(facts: RunFacts) -> str:
    kind = facts.scene.lqr.friction_compensation
    cure = (
        'set lqr.friction_compensation = "break_away"' if kind != "break_away" else "raise lqr.state_weight"
    )
    return (
        f"{_not_settled(facts)}; the masses did not come to rest on their targets within "
        f"{facts.scene.supervisor.positioning_time:.4g} s: {cure}, or supervisor.arrival_angle"
    )


def _time_limit(facts: RunFacts) -> str:
    return f"{_not_settled(facts)}; the run ended before the strategy did: raise run.time_limit"


def _diverged(facts: RunFacts) -> str:
    return (
        f"not settled: the loop diverged, and the run was stopped at {facts.time:.4g} s; "
        f"{divergence_remedy(facts.scene, friction_stage=facts.stage is Stage.FRICTION)}"
    )


def _locked(facts: RunFacts) -> str:
    settled = facts.settling_time is not None
    verdict = f"settled: {_end(facts)}" if settled else _not_settled(facts)
    return f'{verdict}; the masses are locked: set supervisor.strategy = "whole" to balance'


TEXTS: dict[EccentricOutcome, Callable[[RunFacts], str]] = {
    EccentricOutcome.SETTLED: _settled,
    EccentricOutcome.RISES_AGAIN: _rises,
    EccentricOutcome.SATURATED: _saturated,
    EccentricOutcome.RESIDUAL: _residual,
    EccentricOutcome.TUNING_TIME: _tuning_time,
    EccentricOutcome.SPEED_CHANGED: _speed_changed,
    EccentricOutcome.TOO_SLOW: _too_slow,
    EccentricOutcome.SPEED_NOT_CONSTANT: _not_constant,
    EccentricOutcome.MASSES_MOVE: _masses_move,
    EccentricOutcome.IMBALANCE_UNCERTAIN: _imbalance_uncertain,
    EccentricOutcome.FRICTION_UNCERTAIN: _friction_uncertain,
    EccentricOutcome.STALLED: _stalled,
    EccentricOutcome.NOT_ARRIVED: _not_arrived,
    EccentricOutcome.TIME_LIMIT: _time_limit,
    EccentricOutcome.DIVERGED: _diverged,
    EccentricOutcome.LOCKED: _locked,
}
