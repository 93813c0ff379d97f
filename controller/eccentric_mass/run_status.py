"""How a run ended, in a word and in a sentence that says what to do next; and what to be warned of."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.controller.eccentric_mass.plant.whirl import influence
from ringbalance.controller.eccentric_mass.remedies import (
    found_beforehand,
    friction_floor,
    friction_remedy,
    gain_remedy,
    imbalance_remedy,
    remedy,
    stall_remedy,
)
from ringbalance.controller.eccentric_mass.run_record import EccentricOutcome, Remedy
from ringbalance.controller.eccentric_mass.sampled_loops import recommended_gains
from ringbalance.controller.eccentric_mass.strategy.plan import HELD, Cause, Findings, Stage
from ringbalance.controller.eccentric_mass.strategy.supervisor import STALLED_SHARE
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene

MICROMETRE: Final = 1e-6
RPM: Final = 2 * math.pi / 60
NOTICEABLE_STALL: Final = 0.05
"""Share of the friction stage with a mass nearly at a standstill that is worth a warning."""
TRIALS: Final = 40
"""Of fine tuning that a longer time should allow."""
WRONG_MODEL: Final = 1.5
"""Mean normalised innovation squared beyond which the filter's model is called wrong; chance alone keeps it
within 1 +- 0.1 after 100 samples, by the chi-square distribution."""


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


def outcome_of(facts: RunFacts) -> EccentricOutcome:
    """SETTLED only when the strategy was content and the true amplitude stays within the limit ever after."""
    if facts.diverged:
        return EccentricOutcome.DIVERGED
    kept = facts.settling_time is not None and facts.left is None
    if facts.cause is Cause.BALANCED:
        return EccentricOutcome.SETTLED if kept else EccentricOutcome.RISES_AGAIN
    if facts.cause is Cause.SPEED_CHANGED and kept:
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


def status_text(facts: RunFacts, outcome: EccentricOutcome, remedies: Sequence[Remedy]) -> str:
    """One or two sentences: how the run ended, with its numbers, and what to do next."""
    advice = f": {', or '.join(remedy.text for remedy in remedies)}" if remedies else ""
    if outcome in _WHOLE_TEXTS:
        return _WHOLE_TEXTS[outcome](facts) + advice
    return f"{_not_settled(facts)}; {_REASONS[outcome](facts)}{advice}"


def remedies_of(facts: RunFacts, outcome: EccentricOutcome) -> tuple[Remedy, ...]:
    """What would mend the run, the likeliest first.  An unstable loop comes before all else."""
    if outcome in {EccentricOutcome.SETTLED, EccentricOutcome.LOCKED}:
        return ()
    own = _REMEDIES[outcome](facts) if outcome in _REMEDIES else ()
    gains = None if outcome is EccentricOutcome.TIME_LIMIT else gain_remedy(facts.scene)
    return (gains, *own) if gains else own


def warnings_of(facts: RunFacts) -> tuple[str, ...]:
    """What the user should know although the run continued."""
    return (*found_beforehand(facts.scene), *(text for is_due, text in _warnings(facts) if is_due))


def _warnings(facts: RunFacts) -> list[tuple[bool, str]]:
    scene, findings = facts.scene, facts.findings
    unlike = facts.innovation is not None and facts.innovation > WRONG_MODEL
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
            unlike,
            f"the mean square of the imbalance filter's innovations is {facts.innovation or 0:.3g} times "
            "what its model expects: check imbalance_filter.assumed_stiffness, assumed_damping and "
            "assumed_mass, and the noise that it assumes",
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
    if facts.left is None:
        return f"{_not_settled(facts)}, though balanced to within it as measured"
    return (
        f"not settled: balanced to within {_limit(facts)} as measured, but "
        f"{length_text(float(facts.amplitude[facts.left]))} came later, at "
        f"{facts.speed[facts.left] / RPM:.4g} rpm, and {_end(facts)}; correct what imbalance_filter assumes "
        "of the rotor, or accept more"
    )


def _diverged(facts: RunFacts) -> str:
    return f"not settled: the loop diverged, and the run was stopped at {facts.time:.4g} s"


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
        f"{facts.scene.supervisor.lowest_speed / RPM:.4g} rpm, where an imbalance cannot be seen; estimate "
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
    EccentricOutcome.DIVERGED: _diverged,
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
    EccentricOutcome.TIME_LIMIT: lambda _: "the run ended before the strategy did",
}


def _more_time(facts: RunFacts) -> tuple[Remedy, ...]:
    """For all that the stages may take, so that the next run does not end within one."""
    told, tuning = facts.scene.supervisor, facts.scene.fine_tuning
    stages = told.start + told.imbalance_time + told.friction_time + told.positioning_time
    tuned = told.fine_tuning_time if facts.stage >= Stage.CHECK else 0.0
    return (
        remedy(facts.scene, ("run.time_limit", stages + tuning.wait + tuning.average + tuned + facts.time)),
    )


def _more_volts(facts: RunFacts) -> list[Remedy]:
    volts = facts.scene.motor.maximum_voltage
    if volts is None or facts.saturation == 0:
        return []
    return [remedy(facts.scene, ("motor.maximum_voltage", 4 * volts))]


def _stalled_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    found = stall_remedy(facts.scene)
    faster = remedy(facts.scene, ("friction_filter.drive_speed", 4 * facts.scene.friction_filter.drive_speed))
    return (*([found] if found else []), *_more_volts(facts), *([] if found else [faster]))


def _arrival_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    scene = facts.scene
    if scene.lqr.friction_compensation != "break_away":
        return (remedy(scene, ("lqr.friction_compensation", "break_away")),)
    found = _more_volts(facts)
    most, weight = recommended_gains(scene).regulator.recommended, scene.lqr.state_weight
    if most > 2 * weight:
        found.append(remedy(scene, ("lqr.state_weight", min(30 * weight, most))))
    angle, rate = 4 * scene.supervisor.arrival_angle, 10 * scene.supervisor.arrival_rate
    found.append(remedy(scene, ("supervisor.arrival_angle", angle), ("supervisor.arrival_rate", rate)))
    return tuple(found)


def _limit_remedy(facts: RunFacts) -> tuple[Remedy, ...]:
    last = float(np.max(facts.amplitude[-(facts.amplitude.size // 20 + 1) :]))
    worst = last if facts.left is None else max(last, float(facts.amplitude[facts.left]))
    return (remedy(facts.scene, ("supervisor.limit", 1.2 * max(worst, facts.scene.supervisor.limit))),)


def _tuning_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    told = facts.scene.fine_tuning
    longer = max(3 * facts.scene.supervisor.fine_tuning_time, TRIALS * (told.wait + told.average))
    total = facts.scene.run.time_limit + longer
    more = remedy(facts.scene, ("supervisor.fine_tuning_time", longer), ("run.time_limit", total))
    return (more, *_limit_remedy(facts))


def _imbalance_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    reach = abs(influence(plant_parameters(facts.scene), float(facts.speed[-1])))
    told = (facts.deviation, facts.imbalance, reach)
    return (imbalance_remedy(facts.scene, deviation=told[0], imbalance=told[1], reach=told[2]),)


def _friction_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    scene, speed = facts.scene, float(facts.speed[-1])
    arm = min(scene.masses.friction_arm)
    found, gate = [friction_remedy(scene, arm=arm, speed=speed)], 2 * friction_floor(scene, speed=speed)
    if scene.friction_filter.gate * arm < gate < 0.5 * arm:
        found.append(remedy(scene, ("friction_filter.gate", gate / arm)))
    return tuple(found)


def _heavier(facts: RunFacts) -> tuple[Remedy, ...]:
    masses = facts.scene.masses
    reach = 2 * masses.guide_radius * math.cos(0.5 * masses.arc_length / masses.guide_radius)
    return (remedy(facts.scene, ("masses.mass", 1.2 * facts.imbalance / reach)),) if reach > 0 else ()


def _weaker(facts: RunFacts) -> tuple[Remedy, ...]:
    if gain_remedy(facts.scene):
        return ()
    weight, gain = facts.scene.lqr.state_weight / 30, facts.scene.friction_filter.speed_gain / 4
    return (remedy(facts.scene, ("lqr.state_weight", weight), ("friction_filter.speed_gain", gain)),)


_REMEDIES: Final[dict[EccentricOutcome, Callable[[RunFacts], tuple[Remedy, ...]]]] = {
    EccentricOutcome.RISES_AGAIN: _limit_remedy,
    EccentricOutcome.SATURATED: _heavier,
    EccentricOutcome.RESIDUAL: _limit_remedy,
    EccentricOutcome.TUNING_TIME: _tuning_remedies,
    EccentricOutcome.MASSES_MOVE: lambda facts: tuple(_more_volts(facts)) or _arrival_remedies(facts),
    EccentricOutcome.IMBALANCE_UNCERTAIN: _imbalance_remedies,
    EccentricOutcome.FRICTION_UNCERTAIN: _friction_remedies,
    EccentricOutcome.STALLED: _stalled_remedies,
    EccentricOutcome.NOT_ARRIVED: _arrival_remedies,
    EccentricOutcome.TIME_LIMIT: _more_time,
    EccentricOutcome.DIVERGED: _weaker,
}
