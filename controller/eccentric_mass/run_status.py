"""What a finished run knows: how it ended, with its numbers, and what the user should know beside."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

from ringbalance.controller.eccentric_mass.run_record import EccentricOutcome
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.strategy.plan import HELD, STAGE_NAMES, Cause, Findings, Stage
from ringbalance.controller.eccentric_mass.strategy.supervisor import STALLED_SHARE
from ringbalance.results.rows import Finding, Value, sentences
from ringbalance.scene.arrays import FloatArray

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
    def warnings(self) -> tuple[Finding, ...]:
        """What the user should know although the run continued."""
        numbers = {name: value for name, value in _numbers(self).items() if value is not None}
        due = [code for code, is_due in _due(self).items() if is_due]
        return tuple(
            Finding(code=code, values={name: numbers[name] for name in sentences()[code].values})
            for code in due
        )

    @property
    def ended(self) -> Finding:
        """How the run ended, with its numbers."""
        code = f"masses_{self.outcome.value}"
        if self.outcome is EccentricOutcome.RISES_AGAIN and self.left is None:
            code = "masses_not_kept"
        if self.outcome is EccentricOutcome.LOCKED and self.settling_time is not None:
            code = "masses_locked_within"
        return _finding(self, code)


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


def _due(facts: RunFacts) -> dict[str, bool]:
    """Whether each warning is."""
    unlike = facts.innovation is not None and facts.innovation > _WRONG_MODEL
    return {
        "drive_nearly_stalled": _stalled(facts) > _NOTICEABLE_STALL and not facts.friction_known,
        "voltage_at_limit": facts.saturation > 0,
        "euler_too_coarse": facts.by_euler,
        "innovations_unlike_model": unlike and not facts.by_euler,
        "drives_stay_on": facts.hold == HELD,
        "masses_meet": facts.least_gap < _own_angle(facts.scene),
    }


def _stalled(facts: RunFacts) -> float:
    return facts.findings.stalled / max(facts.findings.driven, 1)


def _own_angle(scene: EccentricScene) -> float:
    return scene.masses.arc_length / scene.masses.guide_radius


def _finding(facts: RunFacts, code: str) -> Finding:
    numbers = _numbers(facts)
    return Finding(code=code, values={name: numbers[name] for name in sentences()[code].values})


def _numbers(facts: RunFacts) -> dict[str, Value]:
    """Of which a sentence takes what it names."""
    scene, left = facts.scene, facts.left
    supervisor = scene.supervisor
    return {
        "final_amplitude": float(facts.amplitude[-1]),
        "time": facts.time,
        "limit": supervisor.limit,
        "settling_time": facts.settling_time,
        "later_amplitude": None if left is None else float(facts.amplitude[left]),
        "later_speed": None if left is None else float(facts.speed[left]),
        "imbalance": facts.imbalance,
        "reach": 2 * scene.masses.mass * scene.masses.guide_radius,
        "residual": float(facts.findings.residual),
        "lowest_speed": supervisor.lowest_speed,
        "imbalance_time": supervisor.imbalance_time,
        "deviation_ratio": facts.deviation / facts.imbalance if facts.imbalance > 0 else None,
        "predicted": facts.predicted,
        "imbalance_gate": scene.imbalance_filter.gate,
        "friction_gate": scene.friction_filter.gate,
        "positioning_time": supervisor.positioning_time,
        "stage": STAGE_NAMES[facts.stage],
        "stalled_fraction": _stalled(facts),
        "saturation": facts.saturation,
        "euler_limit": facts.euler_limit,
        "innovation": facts.innovation,
        "least_gap": facts.least_gap,
        "own_angle": _own_angle(scene),
    }
