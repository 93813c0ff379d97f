"""How a run ended and what to do: its facts, what can be told before it, and values that would mend it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.imbalance_filter import (
    MassInput,
    ProcessNoise,
    encoder_covariance,
    predicted_deviation,
    start_estimate,
)
from ringbalance.controller.eccentric_mass.integration import longest_run
from ringbalance.controller.eccentric_mass.plan import HELD, STAGE_NAMES, Cause, Findings, Stage
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run_record import EccentricOutcome, Remedy
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import (
    FRICTION_ERROR,
    DriveLaw,
    believed_whirl,
    track_model,
)
from ringbalance.controller.eccentric_mass.supervisor import STALLED_SHARE
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


_LONGEST_STEPS: Final = 2_000
"""Steps in which a covariance is worked out; with fewer than the filter takes, each carries less noise."""
_ATTAINED: Final = 0.3
"""Share of what a gate allows that a filter should come down to when its walks are lowered."""
_ROUNDED: Final = 1.01
"""Times a value that a remedy has already come to, with its three digits: it is not advised again."""
_MARGIN: Final = 1.5
_TRIALS: Final = 40
"""Of fine tuning that a longer time should allow."""
_TIME: Final = "run.time_limit"
_NEARLY: Final = 0.99
"""Of the longest run: a remedy's value is rounded."""
_NOTABLY: Final = 1.05
"""Times the run's length, below which a longer run is no remedy."""
_NO_GATE: Final = 0.5
"""Relative standard deviation beyond which a gate lets anything pass."""


def expected_deviation(scene: EccentricScene, *, speed: float, duration: float | None = None) -> float:
    """Standard deviation of the imbalance that an estimation at constant speed comes to, kg m.

    Divide by the imbalance, or by the balancing capacity 2 m_b r_b, to see whether it can be resolved at all.
     At zero speed it is the earlier estimate, since a resting rotor shows nothing.
    Args: `duration`: of the estimation, s; default the longest that the scene allows.
    """
    told, masses = scene.imbalance_filter, scene.masses
    if speed == 0:
        return told.initial_unbalance
    longest = scene.supervisor.imbalance_time if duration is None else duration
    step = max(told.step, longest / _LONGEST_STEPS)
    fewer = told.step / step
    moment = masses.mass * masses.guide_radius
    encoders = encoder_covariance(moment, masses.initial_angle, scene.sensor.encoder_noise)
    found = predicted_deviation(
        start_estimate(told.initial_position, told.initial_velocity, told.initial_unbalance),
        model=believed_whirl(scene),
        noise=ProcessNoise(told.velocity_walk**2, told.unbalance_walk**2),
        variance=np.repeat([told.position_noise**2, told.velocity_noise**2], 2) * fewer,
        masses=MassInput(0.0j, 0.0j, encoders * fewer, 0.0),
        angular_velocity=speed,
        step=step,
        duration=longest,
        laboratory=scene.sensor.frame == "laboratory",
    )
    return float(found[-1])


def _friction_floor(scene: EccentricScene, *, speed: float) -> float:
    """Standard deviation, m, that a friction arm's estimate keeps for ever.

    P = s_mu sqrt(s_w^2 + 2 c s_mu r)/c with c = b W^2/(J + J_add), the walks of arm and rate and the density
    r of the encoder's noise: Riccati's equation of both.
    """
    told = scene.friction_filter
    if speed == 0:
        return math.inf
    c, r = _friction_sight(scene, speed=speed)
    return math.sqrt(
        told.friction_walk * math.hypot(told.rate_walk, math.sqrt(2 * c * told.friction_walk * r)) / c
    )


def _friction_sight(scene: EccentricScene, *, speed: float) -> tuple[float, float]:
    """Rate of a mass per second and metre of friction arm, and density of the noise on it, rad/s^0.5."""
    told, track = scene.friction_filter, track_model(scene)
    return track.moment * speed**2 / track.inertia, told.rate_noise * math.sqrt(told.step)


def _friction_allowed(scene: EccentricScene, *, arm: float, speed: float) -> float:
    """Standard deviation of a friction arm, m, that lets the strategy proceed."""
    torque = FRICTION_ERROR * DriveLaw.of(scene).position_gain * scene.supervisor.arrival_angle
    share = scene.friction_filter.gate * max(arm, 0.0)
    return max(share, torque / (track_model(scene).moment * speed**2)) if speed != 0 else math.inf


def found_beforehand(scene: EccentricScene, *, friction_known: bool = False) -> tuple[str, ...]:
    """Loops that are unstable, drives too weak and gates that cannot be reached, each with what would do.

    Args: `friction_known`: a run has shown that the drives are strong enough for the friction stage.
    """
    if scene.supervisor.strategy == "locked":
        return ()
    gains = RecommendedGains.of(scene)
    found = [
        f"the sampled loop of the {loop.name} is unstable (largest pole {loop.radius:.3g} per step): "
        f"{_remedy(scene, (loop.key, loop.recommended)).text}, "
        f"or hold the voltage for {loop.recommended_step:.2g} s"
        for loop in gains.loops
        if not loop.stable and not (loop is gains.pair and not gains.speed.stable)
    ]
    speed = scene.rotor.speed_profile[0].speed
    if speed != 0:
        found += ([] if friction_known else _weak_drive(scene)) + _gates(scene, speed)
    return tuple(found)


def _weak_drive(scene: EccentricScene) -> list[str]:
    missing = _stall_remedy(scene, margin=1.0)
    return (
        [f"the drives cannot overcome the friction in the friction stage: {missing.text}"] if missing else []
    )


def _gates(scene: EccentricScene, speed: float) -> list[str]:
    found, plant = [], PlantParameters.of(scene)
    deviation = expected_deviation(scene, speed=speed)
    reach = abs(plant.influence(speed)) if plant.damping > 0 else math.inf
    needed = 2 * deviation * reach > 0.1 * scene.supervisor.limit
    if needed and deviation > scene.imbalance_filter.gate * plant.unbalance:
        remedy = _imbalance_remedy(scene, deviation=deviation, imbalance=plant.unbalance, reach=reach)
        found.append(f"the imbalance filter cannot reach its gate at this speed: {remedy.text}")
    for arm in scene.masses.friction_arm:
        allowed = _friction_allowed(scene, arm=arm, speed=speed)
        if _friction_floor(scene, speed=speed) > allowed:
            text = _friction_remedy(scene, arm=arm, speed=speed).text
            found.append(f"the friction filter cannot reach its gate: {text}")
            break
    return found


def _imbalance_remedy(scene: EccentricScene, *, deviation: float, imbalance: float, reach: float) -> Remedy:
    """A gate that is reached, or an amplitude that makes no more precision necessary."""
    share = _MARGIN * deviation / imbalance if imbalance > 0 else math.inf
    if share < _NO_GATE:
        return _remedy(scene, ("imbalance_filter.gate", share))
    return _remedy(scene, ("supervisor.limit", _MARGIN * 20 * deviation * reach))


def _friction_remedy(scene: EccentricScene, *, arm: float, speed: float) -> Remedy:
    """A slower walk of the rate if the filter's own floor is above the gate; else more time, and a wider
    gate.
    """
    target = _ATTAINED * _friction_allowed(scene, arm=arm, speed=speed)
    if _friction_floor(scene, speed=speed) > _ROUNDED * target:
        return _remedy(scene, *_slower_walks(scene, target, speed=speed))
    longer = 4 * scene.supervisor.friction_time
    total = scene.run.time_limit + longer
    return _remedy(scene, ("supervisor.friction_time", longer), (_TIME, total))


def _slower_walks(scene: EccentricScene, target: float, *, speed: float) -> list[tuple[str, float]]:
    """Walks with which the floor is the target, m; that of the arm only where noise alone is above it."""
    told, (c, r) = scene.friction_filter, _friction_sight(scene, speed=speed)
    # Without a walk of the rate P = s_mu^1.5 sqrt(2 r/c); half of that walk leaves room for the other one.
    most = (target**2 / math.sqrt(2 * r / c)) ** (2 / 3) / 2 if r > 0 else math.inf
    arm = min(told.friction_walk, most)
    rate = math.sqrt((target**2 * c / arm) ** 2 - 2 * c * arm * r)
    changes = [("friction_filter.rate_walk", rate)] if rate < told.rate_walk else []
    return changes if arm == told.friction_walk else [*changes, ("friction_filter.friction_walk", arm)]


def _gain_remedy(scene: EccentricScene) -> Remedy | None:
    """Stable values of all gains whose loops are not; None when all are stable."""
    gains = RecommendedGains.of(scene)
    changes = [(loop.key, loop.recommended) for loop in gains.loops if not loop.stable]
    if not gains.speed.stable and gains.pair.recommended >= gains.pair.value:
        changes = [change for change in changes if change[0] != gains.pair.key]
    if not gains.speed.stable and gains.drive_speed > scene.friction_filter.drive_speed:
        changes.append(("friction_filter.drive_speed", gains.drive_speed))
    return _remedy(scene, *changes) if changes else None


def _stall_remedy(scene: EccentricScene, *, margin: float = _MARGIN) -> Remedy | None:
    """Gain, drive speed and voltage whose torque is friction's with a margin; None when the scene's have
    it.
    """
    plant, told, gains = PlantParameters.of(scene), scene.friction_filter, RecommendedGains.of(scene)
    speed = abs(scene.rotor.speed_profile[0].speed) + told.drive_speed
    volts = max(scene.masses.friction_arm) * plant.moment * speed**2 / plant.drive_gain
    changes: list[tuple[str, float]] = []
    if told.speed_gain * told.drive_speed < margin * volts:
        gain = min(max(_MARGIN * volts / told.drive_speed, told.speed_gain), gains.speed.recommended)
        changes.append(("friction_filter.speed_gain", gain))
        if gain * told.drive_speed < _MARGIN * volts * (1 - 1e-9):
            changes.append(("friction_filter.drive_speed", 2 * _MARGIN * volts / gain))
    # What the whirl asks for comes on top of friction.
    if plant.maximum_voltage < 2 * margin * volts:
        changes.append(("motor.maximum_voltage", 4 * _MARGIN * volts))
    return _remedy(scene, *changes) if changes else None


def remedies_of(facts: RunFacts) -> tuple[Remedy, ...]:
    """What would mend the run, the likeliest first.  An unstable loop comes before all else."""
    outcome = facts.outcome
    if outcome in {EccentricOutcome.SETTLED, EccentricOutcome.LOCKED}:
        return ()
    own = _REMEDIES[outcome](facts) if outcome in _REMEDIES else ()
    if facts.by_euler:
        own = (_remedy(facts.scene, ("imbalance_filter.discretisation", "exact")), *own)
    gains = None if outcome is EccentricOutcome.TIME_LIMIT else _gain_remedy(facts.scene)
    return (gains, *own) if gains else own


_UNITS: Final = {
    "friction_filter.speed_gain": ("V*s/rad", 1.0),
    "friction_filter.pair_gain": ("V/rad", 1.0),
    "friction_filter.drive_speed": ("rpm", 2 * math.pi / 60),
    "friction_filter.rate_walk": ("rad/s", 1.0),
    "friction_filter.friction_walk": ("mm", 1e-3),
    "friction_filter.gate": ("%", 0.01),
    "imbalance_filter.gate": ("%", 0.01),
    "supervisor.limit": ("mm", 1e-3),
    "supervisor.arrival_angle": ("deg", math.pi / 180),
    "supervisor.arrival_rate": ("deg/s", math.pi / 180),
    "supervisor.positioning_time": ("s", 1.0),
    "supervisor.fine_tuning_time": ("s", 1.0),
    "supervisor.friction_time": ("s", 1.0),
    "supervisor.lowest_speed": ("rpm", 2 * math.pi / 60),
    "fine_tuning.stop": ("deg", math.pi / 180),
    "masses.mass": ("kg", 1.0),
    "motor.maximum_voltage": ("V", 1.0),
    "run.time_limit": ("s", 1.0),
    "lqr.state_weight": ("", 1.0),
}


def _remedy(scene: EccentricScene, *changes: tuple[str, float | str]) -> Remedy:
    """Changes that are made together, to three digits each, with their text; no run longer than allowed."""
    longest = _NEARLY * longest_run(scene)
    changes = tuple(
        (key, min(value, longest) if key == _TIME and not isinstance(value, str) else value)
        for key, value in changes
    )
    rounded = [(key, value if isinstance(value, str) else _rounded(key, value)) for key, value in changes]
    return Remedy(changes=tuple(rounded), text=" and ".join(_change_text(scene, *each) for each in rounded))


def _rounded(key: str, value: float) -> float:
    factor = _UNITS[key][1]
    return float(f"{value / factor:.3g}") * factor


def _change_text(scene: EccentricScene, key: str, value: float | str) -> str:
    table, name = key.split(".")
    old = getattr(getattr(scene, table), name)
    if isinstance(value, str):
        return f'set {key} = "{value}"'
    unit, factor = _UNITS[key]
    new = f"{value / factor:.3g} {unit}".rstrip()
    if old is None:
        return f"set {key} = {new}"
    return f"{'raise' if value > old else 'lower'} {key} from {old / factor:.3g} to {new}"


def _more_time(facts: RunFacts) -> tuple[Remedy, ...]:
    """For all that the stages may take, so that the next run does not end within one."""
    told, tuning = facts.scene.supervisor, facts.scene.fine_tuning
    stages = told.start + told.imbalance_time + told.friction_time + told.positioning_time
    tuned = told.fine_tuning_time if facts.stage >= Stage.CHECK else 0.0
    found = _remedy(facts.scene, (_TIME, stages + tuning.wait + tuning.average + tuned + facts.time))
    longer = _NOTABLY * facts.scene.run.time_limit
    return tuple(found for _, value in found.changes if not isinstance(value, str) and value > longer)


def _more_volts(facts: RunFacts) -> list[Remedy]:
    volts = facts.scene.motor.maximum_voltage
    if volts is None or facts.saturation == 0:
        return []
    return [_remedy(facts.scene, ("motor.maximum_voltage", 4 * volts))]


def _stalled_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    found = _stall_remedy(facts.scene)
    faster = _remedy(
        facts.scene, ("friction_filter.drive_speed", 4 * facts.scene.friction_filter.drive_speed)
    )
    # More volts alone do nothing for a gain that is too low.
    return (found,) if found else (*_more_volts(facts), faster)


def _arrival_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    scene = facts.scene
    if scene.lqr.friction_compensation != "break_away":
        return (_remedy(scene, ("lqr.friction_compensation", "break_away")),)
    found = _more_volts(facts)
    most, weight = RecommendedGains.of(scene).regulator.recommended, scene.lqr.state_weight
    if most > 2 * weight:
        found.append(_remedy(scene, ("lqr.state_weight", min(30 * weight, most))))
    angle, rate = 4 * scene.supervisor.arrival_angle, 10 * scene.supervisor.arrival_rate
    found.append(_remedy(scene, ("supervisor.arrival_angle", angle), ("supervisor.arrival_rate", rate)))
    return tuple(found)


def _limit_remedy(facts: RunFacts) -> tuple[Remedy, ...]:
    last = float(np.max(facts.amplitude[-(facts.amplitude.size // 20 + 1) :]))
    worst = last if facts.left is None else max(last, float(facts.amplitude[facts.left]))
    return (_remedy(facts.scene, ("supervisor.limit", 1.2 * max(worst, facts.scene.supervisor.limit))),)


def _tuning_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    told = facts.scene.fine_tuning
    longer = max(3 * facts.scene.supervisor.fine_tuning_time, _TRIALS * (told.wait + told.average))
    total = facts.scene.run.time_limit + longer
    more = _remedy(facts.scene, ("supervisor.fine_tuning_time", longer), (_TIME, total))
    return (more, *_limit_remedy(facts))


def _imbalance_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    reach = abs(PlantParameters.of(facts.scene).influence(float(facts.speed[-1])))
    told = (facts.deviation, facts.imbalance, reach)
    return (_imbalance_remedy(facts.scene, deviation=told[0], imbalance=told[1], reach=told[2]),)


def _friction_remedies(facts: RunFacts) -> tuple[Remedy, ...]:
    scene, speed = facts.scene, float(facts.speed[-1])
    arm = min(scene.masses.friction_arm)
    found, gate = [_friction_remedy(scene, arm=arm, speed=speed)], 2 * _friction_floor(scene, speed=speed)
    if scene.friction_filter.gate * arm < gate < 0.5 * arm:
        found.append(_remedy(scene, ("friction_filter.gate", gate / arm)))
    return tuple(found)


def _heavier(facts: RunFacts) -> tuple[Remedy, ...]:
    masses = facts.scene.masses
    reach = 2 * masses.guide_radius * math.cos(0.5 * masses.arc_length / masses.guide_radius)
    return (_remedy(facts.scene, ("masses.mass", 1.2 * facts.imbalance / reach)),) if reach > 0 else ()


def _weaker(facts: RunFacts) -> tuple[Remedy, ...]:
    if _gain_remedy(facts.scene):
        return ()
    weight, gain = facts.scene.lqr.state_weight / 30, facts.scene.friction_filter.speed_gain / 4
    return (_remedy(facts.scene, ("lqr.state_weight", weight), ("friction_filter.speed_gain", gain)),)


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
