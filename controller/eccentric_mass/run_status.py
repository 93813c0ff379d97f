"""What a finished run knows: how it ended, in a word and in a sentence that says what to do; warnings."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from ringbalance.controller.eccentric_mass.run_record import EccentricOutcome, Remedy
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.strategy.plan import HELD, STAGE_NAMES, Cause, Findings, Stage
from ringbalance.controller.eccentric_mass.strategy.supervisor import STALLED_SHARE
from ringbalance.scene.arrays import FloatArray

_MICROMETRE: Final = 1e-6
_RPM: Final = 2 * math.pi / 60
_NOTICEABLE_STALL: Final = 0.05
"""Share of the friction stage with a mass nearly at a standstill that is worth a warning."""
_WRONG_MODEL: Final = 1.5
"""Mean normalised innovation squared beyond which the filter's model is called wrong; chance alone keeps it
within 1 +- 0.1 after 100 samples, by the chi-square distribution."""


@dataclass(frozen=True, kw_only=True)
class RunFacts:
    """What status, remedies and warnings are made of."""

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
    left: int | None
    """Sample of the largest vibration after the rotor was balanced, if that is above the limit."""
    innovation: float | None
    """Mean square of the normalised innovations."""
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
    friction_known: bool
    """Whether the friction stage came to its end: then its drives have done what they are there for."""

    @cached_property
    def outcome(self) -> EccentricOutcome:
        """SETTLED only when the strategy was content and the true amplitude stays within the limit after."""
        if self.diverged:
            return EccentricOutcome.DIVERGED
        kept = self.settling_time is not None and self.left is None
        if self.cause is Cause.BALANCED:
            return EccentricOutcome.SETTLED if kept else EccentricOutcome.RISES_AGAIN
        if kept and (self.cause is Cause.SPEED_CHANGED or self._corrects_within_limit):
            return EccentricOutcome.SETTLED
        cause = _cause(self)
        return EccentricOutcome.TIME_LIMIT if cause is Cause.NONE else EccentricOutcome(cause.name.lower())

    @property
    def _corrects_within_limit(self) -> bool:
        """Whether the run ended while what was measured to be within the limit was made better still."""
        correcting = self.stage in {Stage.CHECK, Stage.CORRECTION}
        return correcting and self.findings.objective <= self.scene.supervisor.limit

    @property
    def by_euler(self) -> bool:
        """Whether the filter is wrong, or says so, with the Euler transition: the cause to remove first."""
        told = self.scene.imbalance_filter
        unlike = self.innovation is not None and self.innovation > _WRONG_MODEL
        return told.discretisation == "euler" and (unlike or told.step > self.euler_limit)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know although the run continued."""
        return tuple(text for is_due, text in _warnings(self) if is_due)

    def status(self, remedies: Sequence[Remedy]) -> str:
        """One or two sentences: how the run ended, with its numbers, and what to do next."""
        advice = f": {', or '.join(remedy.text for remedy in remedies)}" if remedies else ""
        if self.outcome in _WHOLE_TEXTS:
            return _WHOLE_TEXTS[self.outcome](self) + advice
        return f"{_not_settled(self)}; {_REASONS[self.outcome](self)}{advice}"


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


def _warnings(facts: RunFacts) -> list[tuple[bool, str]]:
    scene, findings = facts.scene, facts.findings
    unlike = facts.innovation is not None and facts.innovation > _WRONG_MODEL
    share = findings.stalled / max(findings.driven, 1)
    gap = scene.masses.arc_length / scene.masses.guide_radius
    return [
        (
            share > _NOTICEABLE_STALL and not facts.friction_known,
            f"a drive nearly stalled during {100 * share:.3g} % of the friction stage: raise "
            "friction_filter.drive_speed or speed_gain, or motor.maximum_voltage",
        ),
        (
            facts.saturation > 0,
            f"a motor voltage was at motor.maximum_voltage for {facts.saturation:.3g} s",
        ),
        (
            facts.by_euler,
            f"the Euler transition of the imbalance filter is too coarse for imbalance_filter.step (its "
            f"stability limit here is {facts.euler_limit:.3g} s, and the estimate errs before that): "
            'set imbalance_filter.discretisation = "exact"',
        ),
        (
            unlike and not facts.by_euler,
            f"the mean square of the imbalance filter's innovations is {facts.innovation or 0:.3g} times "
            "what its model expects: check imbalance_filter.assumed_stiffness, assumed_damping and "
            "assumed_mass, and the noise that it assumes",
        ),
        (
            facts.hold == HELD,
            "the drives must stay on at the end: friction alone is not certain to hold the masses",
        ),
        (
            facts.least_gap < gap,
            f"the masses came within {math.degrees(facts.least_gap):.3g} deg of each other, less than their "
            f"own {math.degrees(gap):.3g} deg: the run continues as if they could pass",
        ),
    ]


def length_text(length: float) -> str:
    """A vibration or a friction arm in millimetres, or in micrometres below a tenth of one."""
    small = abs(length) < 100 * _MICROMETRE
    return f"{length / _MICROMETRE:.4g} um" if small else f"{1e3 * length:.4g} mm"


def _end(facts: RunFacts) -> str:
    return f"{length_text(float(facts.amplitude[-1]))} at {facts.time:.4g} s"


def _limit(facts: RunFacts) -> str:
    return f"the limit of {length_text(facts.scene.supervisor.limit)}"


def _not_settled(facts: RunFacts) -> str:
    within = facts.amplitude[-1] <= facts.scene.supervisor.limit
    return f"not settled: {_end(facts)}, {'within' if within else 'above'} {_limit(facts)}"


def _settled(facts: RunFacts) -> str:
    return (
        f"settled: within {_limit(facts)} from {facts.settling_time:.4g} s on, {_end(facts)}; no further "
        "correction needed"
    )


def _rises(facts: RunFacts) -> str:
    if facts.left is None:
        return f"{_not_settled(facts)}, though balanced to within it as measured"
    return (
        f"not settled: balanced to within {_limit(facts)} as measured, but "
        f"{length_text(float(facts.amplitude[facts.left]))} came later, at "
        f"{facts.speed[facts.left] / _RPM:.4g} rpm, and {_end(facts)}; correct what imbalance_filter assumes "
        "of the rotor, or accept more"
    )


def _locked(facts: RunFacts) -> str:
    verdict = _not_settled(facts) if facts.settling_time is None else f"settled: {_end(facts)}"
    return f'{verdict}; the masses are locked: set supervisor.strategy = "whole" to balance'


def _saturated(facts: RunFacts) -> str:
    moment = facts.scene.masses.mass * facts.scene.masses.guide_radius
    return (
        f"the imbalance of {facts.imbalance:.4g} kg m is more than both masses can undo, {2 * moment:.4g} kg "
        f"m, and {facts.findings.residual:.4g} kg m is left; balance the rotor first, or use heavier masses"
    )


def _too_slow(facts: RunFacts) -> str:
    return (
        "the rotor turned slower than supervisor.lowest_speed, "
        f"{facts.scene.supervisor.lowest_speed / _RPM:.4g} rpm, where an imbalance cannot be seen; estimate "
        "at a higher speed of rotor.speed_profile"
    )


def _imbalance_uncertain(facts: RunFacts) -> str:
    share = facts.deviation / facts.imbalance if facts.imbalance > 0 else math.inf
    return (
        f"after {facts.scene.supervisor.imbalance_time:.4g} s the imbalance is known to {100 * share:.3g} % "
        f"(one standard deviation; {facts.predicted:.3g} kg m was to be expected) and "
        f"{100 * facts.scene.imbalance_filter.gate:.3g} % is asked for by imbalance_filter.gate"
    )


_Text = Callable[[RunFacts], str]
_WHOLE_TEXTS: Final[dict[EccentricOutcome, _Text]] = {
    EccentricOutcome.SETTLED: _settled,
    EccentricOutcome.RISES_AGAIN: _rises,
    EccentricOutcome.DIVERGED: lambda facts: (
        f"not settled: the loop diverged, and the run was stopped at {facts.time:.4g} s"
    ),
    EccentricOutcome.LOCKED: _locked,
}
_REASONS: Final[dict[EccentricOutcome, _Text]] = {
    EccentricOutcome.SATURATED: _saturated,
    EccentricOutcome.RESIDUAL: lambda _: "fine tuning came down to its smallest move",
    EccentricOutcome.TUNING_TIME: lambda _: "fine tuning ran out of time",
    EccentricOutcome.SPEED_CHANGED: lambda _: (
        "the rotor's speed changed before the balancing was done; change it later in rotor.speed_profile"
    ),
    EccentricOutcome.TOO_SLOW: _too_slow,
    EccentricOutcome.SPEED_NOT_CONSTANT: lambda _: (
        "the rotor's speed was not constant, and the imbalance filter holds for constant speed only; give "
        "rotor.speed_profile a level stretch after supervisor.start"
    ),
    EccentricOutcome.MASSES_MOVE: lambda _: (
        "the masses moved too fast for the imbalance filter: the drives could not hold them"
    ),
    EccentricOutcome.IMBALANCE_UNCERTAIN: _imbalance_uncertain,
    EccentricOutcome.FRICTION_UNCERTAIN: lambda facts: (
        "the friction did not become known to friction_filter.gate, "
        f"{100 * facts.scene.friction_filter.gate:.3g} %"
    ),
    EccentricOutcome.STALLED: lambda _: "the drives stalled, so that friction could not be found",
    EccentricOutcome.NOT_ARRIVED: lambda facts: (
        "the masses did not come to rest on their targets within "
        f"{facts.scene.supervisor.positioning_time:.4g} s"
    ),
    EccentricOutcome.TIME_LIMIT: lambda facts: (
        f"the run ended during the stage {STAGE_NAMES[facts.stage]}, before the strategy was done"
    ),
}
