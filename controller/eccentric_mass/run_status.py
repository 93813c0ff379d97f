"""How a run ended, in a word and in a sentence that says what to do next; and what to be warned of."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.run_record import EccentricOutcome
from ringbalance.controller.eccentric_mass.sampled_loops import (
    RecommendedGains,
    SampledLoop,
    recommended_gains,
)
from ringbalance.controller.eccentric_mass.strategy.plan import HELD, Cause, Findings, Stage
from ringbalance.controller.eccentric_mass.strategy.supervisor import STALLED_SHARE
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.units import format_quantity

MICROMETRE: Final = 1e-6
RPM: Final = 2 * math.pi / 60
NOTICEABLE_STALL: Final = 0.05
"""Share of the friction stage with a mass nearly at a standstill that is worth a warning."""
CHATTER_SHARE: Final = 0.1
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


def outcome_of(facts: RunFacts) -> EccentricOutcome:
    """SETTLED only when the strategy was content and the true amplitude ends within the limit."""
    if facts.diverged:
        return EccentricOutcome.DIVERGED
    if facts.cause is Cause.BALANCED:
        settled = facts.settling_time is not None
        return EccentricOutcome.SETTLED if settled else EccentricOutcome.RISES_AGAIN
    if facts.cause is Cause.SPEED_CHANGED and facts.settling_time is not None:
        return EccentricOutcome.SETTLED
    cause = _cause(facts)
    return EccentricOutcome.TIME_LIMIT if cause is Cause.NONE else EccentricOutcome(cause.name.lower())


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
    """One or two sentences: how the run ended, with its numbers, and what to do next."""
    if outcome in _WHOLE_TEXTS:
        return _WHOLE_TEXTS[outcome](facts)
    return f"{_not_settled(facts)}; {_REASONS[outcome](facts)}"


def warnings_of(facts: RunFacts) -> tuple[str, ...]:
    """What the user should know although the run continued."""
    return tuple(text for is_due, text in _warnings(facts) if is_due)


def _warnings(facts: RunFacts) -> list[tuple[bool, str]]:
    scene, findings = facts.scene, facts.findings
    chatters = facts.saturation > CHATTER_SHARE * facts.time and facts.settling_time is None
    loops = _unstable(recommended_gains(scene)) if chatters and not facts.diverged else []
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


def _unstable(gains: RecommendedGains) -> list[str]:
    """What to lower to what, for each loop that is unstable by itself; the regulator first."""
    return [_lowered(loop) for loop in (gains.regulator, gains.speed) if not loop.stable]


def _lowered(loop: SampledLoop) -> str:
    unit = f" {loop.unit}" if loop.unit else ""
    return (
        f"lower {loop.key} = {loop.value:.4g} to {loop.recommended:.2g}{unit} or less "
        f"(largest sampled pole {loop.radius:.3g})"
    )


def length_text(length: float) -> str:
    """A vibration or a friction arm in millimetres, or in micrometres below a tenth of one."""
    small = abs(length) < 100 * MICROMETRE
    return f"{length / MICROMETRE:.4g} um" if small else f"{1e3 * length:.4g} mm"


def _end(facts: RunFacts) -> str:
    return f"{length_text(float(facts.amplitude[-1]))} at {facts.time:.4g} s"


def _limit(facts: RunFacts) -> str:
    return f"the limit of {length_text(facts.scene.supervisor.limit)}"


def _not_settled(facts: RunFacts) -> str:
    return f"not settled: {_end(facts)} against {_limit(facts)}"


def _settled(facts: RunFacts) -> str:
    return (
        f"settled: not above {_limit(facts)} from {facts.settling_time:.4g} s on, {_end(facts)}; no further "
        "correction needed"
    )


def _rises(facts: RunFacts) -> str:
    since = facts.checked or 0
    worst = since + int(np.argmax(facts.amplitude[since:]))
    return (
        f"not settled: balanced to within {_limit(facts)} as measured, but "
        f"{length_text(float(facts.amplitude[worst]))} came later, at {facts.speed[worst] / RPM:.4g} rpm, "
        f"and {_end(facts)}: lower imbalance_filter.gate, or raise supervisor.limit"
    )


def _diverged(facts: RunFacts) -> str:
    """The loop that drove the masses first: the speed control in the friction stage, else the regulator."""
    loops = _unstable(recommended_gains(facts.scene))
    if facts.stage is Stage.FRICTION:
        loops.reverse()
    step = format_quantity(facts.scene.lqr.step, "time", "s")
    if loops:
        also = f"; then, if the run still does not settle, {loops[1]}" if len(loops) > 1 else ""
        remedy = f"drives so light are unstable at a voltage held for {step}: {loops[0]}{also}"
    else:
        remedy = (
            f"each drive alone is stable at a voltage held for {step}: lower lqr.state_weight and "
            "friction_filter.speed_gain together, or set a motor.maximum_voltage"
        )
    return f"not settled: the loop diverged, and the run was stopped at {facts.time:.4g} s; {remedy}"


def _locked(facts: RunFacts) -> str:
    verdict = _not_settled(facts) if facts.settling_time is None else f"settled: {_end(facts)}"
    return f'{verdict}; the masses are locked: set supervisor.strategy = "whole" to balance'


def _saturated(facts: RunFacts) -> str:
    moment = facts.scene.masses.mass * facts.scene.masses.guide_radius
    return (
        f"the imbalance of {facts.imbalance:.4g} kg m is more than both masses can undo, {2 * moment:.4g} kg "
        f"m, and {facts.findings.residual:.4g} kg m is left: balance the rotor first, or use heavier masses"
    )


def _too_slow(facts: RunFacts) -> str:
    return (
        "the rotor turned slower than supervisor.lowest_speed, "
        f"{facts.scene.supervisor.lowest_speed / RPM:.4g} rpm, where an imbalance cannot be seen: estimate "
        "at a higher speed"
    )


def _imbalance_uncertain(facts: RunFacts) -> str:
    share = facts.deviation / facts.imbalance if facts.imbalance > 0 else math.inf
    return (
        f"after {facts.scene.supervisor.imbalance_time:.4g} s the imbalance is known to {100 * share:.3g} % "
        f"(one standard deviation; {facts.predicted:.3g} kg m was to be expected) and "
        f"{100 * facts.scene.imbalance_filter.gate:.3g} % is asked for: estimate at a higher speed or "
        "longer, use better sensors, or raise imbalance_filter.gate"
    )


def _friction_uncertain(facts: RunFacts) -> str:
    return (
        f"the friction did not become known to {100 * facts.scene.friction_filter.gate:.3g} %: raise "
        "supervisor.friction_time or friction_filter.gate, or use better encoders"
    )


def _not_arrived(facts: RunFacts) -> str:
    breaks_away = facts.scene.lqr.friction_compensation == "break_away"
    cure = "raise lqr.state_weight" if breaks_away else 'set lqr.friction_compensation = "break_away"'
    return (
        "the masses did not come to rest on their targets within "
        f"{facts.scene.supervisor.positioning_time:.4g} s: {cure}, or supervisor.arrival_angle"
    )


_Text = Callable[[RunFacts], str]
_WHOLE_TEXTS: Final[dict[EccentricOutcome, _Text]] = {
    EccentricOutcome.SETTLED: _settled,
    EccentricOutcome.RISES_AGAIN: _rises,
    EccentricOutcome.DIVERGED: _diverged,
    EccentricOutcome.LOCKED: _locked,
}
_REASONS: Final[dict[EccentricOutcome, _Text]] = {
    EccentricOutcome.SATURATED: _saturated,
    EccentricOutcome.RESIDUAL: lambda _: (
        "fine tuning came down to its smallest move: lower fine_tuning.stop, lengthen fine_tuning.average, "
        "or raise supervisor.limit"
    ),
    EccentricOutcome.TUNING_TIME: lambda _: (
        "fine tuning ran out of time: raise supervisor.fine_tuning_time, or the first fine_tuning.step"
    ),
    EccentricOutcome.SPEED_CHANGED: lambda _: (
        "the rotor's speed changed before the balancing was done: start earlier, or change the speed later "
        "in rotor.speed_profile"
    ),
    EccentricOutcome.TOO_SLOW: _too_slow,
    EccentricOutcome.SPEED_NOT_CONSTANT: lambda _: (
        "the rotor's speed was not constant, and the imbalance filter holds for constant speed only: give "
        "rotor.speed_profile a level stretch after supervisor.start"
    ),
    EccentricOutcome.MASSES_MOVE: lambda _: (
        "the masses did not stay at rest, and the imbalance filter holds for resting masses only: raise "
        "lqr.state_weight or motor.maximum_voltage, so that the drives can hold them"
    ),
    EccentricOutcome.IMBALANCE_UNCERTAIN: _imbalance_uncertain,
    EccentricOutcome.FRICTION_UNCERTAIN: _friction_uncertain,
    EccentricOutcome.STALLED: lambda _: (
        "the drives stalled, so that friction could not be found: raise motor.maximum_voltage, "
        "friction_filter.speed_gain or drive_speed"
    ),
    EccentricOutcome.NOT_ARRIVED: _not_arrived,
    EccentricOutcome.TIME_LIMIT: lambda _: "the run ended before the strategy did: raise run.time_limit",
}
