"""How a run ended and what to do: its facts, what can be told before it, and values that would mend it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.integration import longest_run
from ringbalance.controller.eccentric_mass.plan import HELD, STAGE_NAMES, Cause, Stage
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.resolution import (
    expected_deviation,
    friction_allowed,
    friction_floor,
    friction_sight,
)
from ringbalance.controller.eccentric_mass.run_facts import EccentricOutcome, RunFacts
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import believed_whirl
from ringbalance.results.rows import Finding, Value, sentences

_NOTICEABLE_STALL: Final = 0.05
"""Share of the friction stage with a mass nearly at a standstill that is worth a warning."""
_WRONG_MODEL: Final = 1.5
"""Mean normalised innovation squared beyond which the filter's model is called wrong; chance alone keeps it
within 1 +- 0.1 after 100 samples, by the chi-square distribution."""


def _by_euler(facts: RunFacts) -> bool:
    """Whether the filter is wrong, or says so, with the Euler transition: the cause to remove first."""
    told = facts.scene.imbalance_filter
    unlike = facts.innovation is not None and facts.innovation > _WRONG_MODEL
    return told.discretisation == "euler" and (unlike or told.step > _euler_limit(facts))


def _euler_limit(facts: RunFacts) -> float:
    """Longest step of the paper's transition at the highest speed of the estimation, s."""
    speeds = np.abs(facts.speed[facts.estimated_at])
    fastest = float(speeds.max()) if speeds.size else 0.0
    return float(believed_whirl(facts.scene).euler_step_limit(angular_velocity=fastest))


def warnings_of(facts: RunFacts) -> tuple[Finding, ...]:
    """What the user should know although the run continued."""
    numbers = {name: value for name, value in _numbers(facts).items() if value is not None}
    due = [code for code, is_due in _due(facts).items() if is_due]
    return tuple(
        Finding(code=code, values={name: numbers[name] for name in sentences()[code].values}) for code in due
    )


def ended(facts: RunFacts) -> Finding:
    """How the run ended, with its numbers."""
    code = f"masses_{facts.outcome.value}"
    if facts.outcome is EccentricOutcome.RISES_AGAIN and facts.left is None:
        code = "masses_not_kept"
    if facts.outcome is EccentricOutcome.LOCKED and facts.within_since is not None:
        code = "masses_locked_within"
    numbers = _numbers(facts)
    return Finding(code=code, values={name: numbers[name] for name in sentences()[code].values})


def _due(facts: RunFacts) -> dict[str, bool]:
    """Whether each warning is."""
    unlike = facts.innovation is not None and facts.innovation > _WRONG_MODEL
    return {
        "drive_nearly_stalled": _stalled(facts) > _NOTICEABLE_STALL and not facts.friction_known,
        "voltage_at_limit": facts.saturation > 0,
        "euler_too_coarse": _by_euler(facts),
        "innovations_unlike_model": unlike and not _by_euler(facts),
        "drives_stay_on": facts.hold == HELD,
        "masses_meet": facts.least_gap < _own_angle(facts.scene),
    }


def _stalled(facts: RunFacts) -> float:
    return facts.findings.stalled / max(facts.findings.driven, 1)


def _deviation(facts: RunFacts) -> float:
    """Standard deviation of the imbalance by noise, kg m."""
    return float(np.sqrt(np.max(np.linalg.eigvalsh(facts.estimates.imbalance_covariance[-1]))))


def _predicted(facts: RunFacts) -> float:
    """Standard deviation of the imbalance to be expected after the longest estimation, kg m."""
    if facts.cause is not Cause.IMBALANCE_UNCERTAIN:
        return 0.0
    speeds = np.abs(facts.speed[facts.estimated_at])
    return expected_deviation(facts.scene, speed=float(speeds.min()) if speeds.size else 0.0)


def _own_angle(scene: EccentricScene) -> float:
    return scene.masses.arc_length / scene.masses.guide_radius


def _numbers(facts: RunFacts) -> dict[str, Value]:
    """Of which a sentence takes what it names."""
    scene, left = facts.scene, facts.left
    supervisor = scene.supervisor
    return {
        "final_amplitude": float(facts.amplitude[-1]),
        "time": facts.end,
        "limit": supervisor.limit,
        "settling_time": facts.within_since,
        "later_amplitude": None if left is None else float(facts.amplitude[left]),
        "later_speed": None if left is None else float(facts.speed[left]),
        "imbalance": abs(facts.imbalance),
        "reach": 2 * scene.masses.mass * scene.masses.guide_radius,
        "residual": float(facts.findings.residual),
        "lowest_speed": supervisor.lowest_speed,
        "imbalance_time": supervisor.imbalance_time,
        "deviation_ratio": _deviation(facts) / abs(facts.imbalance) if facts.imbalance else None,
        "predicted": _predicted(facts),
        "imbalance_gate": scene.imbalance_filter.gate,
        "friction_gate": scene.friction_filter.gate,
        "positioning_time": supervisor.positioning_time,
        "stage": STAGE_NAMES[facts.stage],
        "stalled_fraction": _stalled(facts),
        "saturation": facts.saturation,
        "euler_limit": _euler_limit(facts),
        "innovation": facts.innovation,
        "least_gap": facts.least_gap,
        "own_angle": _own_angle(scene),
    }


_Changes = dict[str, float | str]
"""New values by key, such as "lqr.state_weight", SI, that are made together."""
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
    "masses.mass": ("kg", 1.0),
    "motor.maximum_voltage": ("V", 1.0),
    "lqr.state_weight": ("", 1.0),
}
"""In which a changed value is rounded and written; others are in seconds."""


def found_beforehand(scene: EccentricScene, *, friction_known: bool = False) -> tuple[Finding, ...]:
    """Loops that are unstable, drives too weak and gates that cannot be reached, each with what would do.

    Args: `friction_known`: a run has shown that the drives are strong enough for the friction stage.
    """
    if scene.supervisor.strategy == "locked":
        return ()
    gains = RecommendedGains.of(scene)
    unstable = (
        _advised(
            scene,
            {loop.key: loop.recommended},
            "loop_unstable",
            loop=loop.name,
            radius=loop.radius,
            hold=loop.recommended_step,
        )
        for loop in gains.loops
        if not loop.stable and not (loop is gains.pair and not gains.speed.stable)
    )
    speed = scene.rotor.speed_profile[0].speed
    if speed == 0:
        return tuple(unstable)
    missing = None if friction_known else _stall_changes(scene, margin=1.0)
    weak = (_advised(scene, missing, "drives_too_weak"),) if missing else ()
    return (*unstable, *weak, *_gates(scene, speed))


def _gates(scene: EccentricScene, speed: float) -> Iterator[Finding]:
    plant, deviation = PlantParameters.of(scene), expected_deviation(scene, speed=speed)
    reach = abs(plant.influence(speed)) if plant.damping > 0 else math.inf
    needed = 2 * deviation * reach > 0.1 * scene.supervisor.limit
    if needed and deviation > scene.imbalance_filter.gate * plant.unbalance:
        changes = _imbalance_changes(deviation=deviation, imbalance=plant.unbalance, reach=reach)
        yield _advised(scene, changes, "imbalance_gate_out_of_reach")
    floor = friction_floor(scene, speed=speed)
    for arm in scene.masses.friction_arm:
        if floor > friction_allowed(scene, arm=arm, speed=speed):
            changes = _friction_changes(scene, arm=arm, speed=speed)
            yield _advised(scene, changes, "friction_gate_out_of_reach")
            break


def remedies_of(facts: RunFacts) -> tuple[Finding, ...]:
    """What would mend the run, the likeliest first.  An unstable loop comes before all else."""
    outcome, scene = facts.outcome, facts.scene
    if outcome in {EccentricOutcome.SETTLED, EccentricOutcome.LOCKED}:
        return ()
    every = list(_REMEDIES[outcome](facts)) if outcome in _REMEDIES else []
    if _by_euler(facts):
        every.insert(0, {"imbalance_filter.discretisation": "exact"})
    if outcome is not EccentricOutcome.TIME_LIMIT and (gains := _gain_changes(scene)):
        every.insert(0, gains)
    return tuple(_advised(scene, changes, "masses_remedy") for changes in every)


def _advised(scene: EccentricScene, changes: _Changes, code: str, **values: Value) -> Finding:
    """A finding with changes to three digits each, which its sentence names."""
    rounded = _rounded(scene, changes)
    text = " and ".join(_change_text(scene, key, value) for key, value in rounded.items())
    return Finding(code=code, values={"text": text, **values}, change=rounded)


def _rounded(scene: EccentricScene, changes: _Changes) -> _Changes:
    """No run longer than allowed."""
    longest, rounded = _NEARLY * longest_run(scene), changes.copy()
    for key, value in changes.items():
        if not isinstance(value, str):
            factor = _UNITS.get(key, ("s", 1.0))[1]
            most = longest if key == _TIME else math.inf
            rounded[key] = float(f"{min(value, most) / factor:.3g}") * factor
    return rounded


def _change_text(scene: EccentricScene, key: str, value: float | str) -> str:
    table, name = key.split(".")
    old = getattr(getattr(scene, table), name)
    if isinstance(value, str):
        return f'set {key} = "{value}"'
    unit, factor = _UNITS.get(key, ("s", 1.0))
    new = f"{value / factor:.3g} {unit}".rstrip()
    if old is None:
        return f"set {key} = {new}"
    return f"{'raise' if value > old else 'lower'} {key} from {old / factor:.3g} to {new}"


def _imbalance_changes(*, deviation: float, imbalance: float, reach: float) -> _Changes:
    """A gate that is reached, or an amplitude that makes no more precision necessary."""
    share = _MARGIN * deviation / imbalance if imbalance > 0 else math.inf
    if share < _NO_GATE:
        return {"imbalance_filter.gate": share}
    return {"supervisor.limit": _MARGIN * 20 * deviation * reach}


def _friction_changes(scene: EccentricScene, *, arm: float, speed: float) -> _Changes:
    """Slower walks if the filter's own floor is above the gate; else more time."""
    target = _ATTAINED * friction_allowed(scene, arm=arm, speed=speed)
    if friction_floor(scene, speed=speed) > _ROUNDED * target:
        return _slower_walks(scene, target, speed=speed)
    longer = 4 * scene.supervisor.friction_time
    return {"supervisor.friction_time": longer, _TIME: scene.run.time_limit + longer}


def _slower_walks(scene: EccentricScene, target: float, *, speed: float) -> _Changes:
    """Walks with which the floor is the target, m; that of the arm only where noise alone is above it."""
    told, (c, r) = scene.friction_filter, friction_sight(scene, speed=speed)
    # Without a walk of the rate P = s_mu^1.5 sqrt(2 r/c); half of that walk leaves room for the other one.
    most = (target**2 / math.sqrt(2 * r / c)) ** (2 / 3) / 2 if r > 0 else math.inf
    arm = min(told.friction_walk, most)
    rate = math.sqrt((target**2 * c / arm) ** 2 - 2 * c * arm * r)
    changes: _Changes = {"friction_filter.rate_walk": rate} if rate < told.rate_walk else {}
    return changes if arm == told.friction_walk else changes | {"friction_filter.friction_walk": arm}


def _gain_changes(scene: EccentricScene) -> _Changes:
    """Stable values of all gains whose loops are not; empty when all are stable."""
    gains = RecommendedGains.of(scene)
    changes: _Changes = {loop.key: loop.recommended for loop in gains.loops if not loop.stable}
    if not gains.speed.stable and gains.pair.recommended >= gains.pair.value:
        changes.pop(gains.pair.key, None)
    if not gains.speed.stable and gains.drive_speed > scene.friction_filter.drive_speed:
        changes["friction_filter.drive_speed"] = gains.drive_speed
    return changes


def _stall_changes(scene: EccentricScene, *, margin: float = _MARGIN) -> _Changes:
    """Gain, drive speed and voltage whose torque is friction's with a margin; empty: the scene's have it."""
    plant, told, gains = PlantParameters.of(scene), scene.friction_filter, RecommendedGains.of(scene)
    speed = abs(scene.rotor.speed_profile[0].speed) + told.drive_speed
    volts = max(scene.masses.friction_arm) * plant.moment * speed**2 / plant.drive_gain
    changes: _Changes = {}
    if told.speed_gain * told.drive_speed < margin * volts:
        gain = min(max(_MARGIN * volts / told.drive_speed, told.speed_gain), gains.speed.recommended)
        changes["friction_filter.speed_gain"] = gain
        if gain * told.drive_speed < _MARGIN * volts * (1 - 1e-9):
            changes["friction_filter.drive_speed"] = 2 * _MARGIN * volts / gain
    # What the whirl asks for comes on top of friction.
    if plant.maximum_voltage < 2 * margin * volts:
        changes["motor.maximum_voltage"] = 4 * _MARGIN * volts
    return changes


def _of_time(facts: RunFacts) -> list[_Changes]:
    """For all that the stages may take, so that the next run does not end within one."""
    told, tuning = facts.scene.supervisor, facts.scene.fine_tuning
    stages = told.start + told.imbalance_time + told.friction_time + told.positioning_time
    tuned = told.fine_tuning_time if facts.stage >= Stage.CHECK else 0.0
    total = _rounded(facts.scene, {_TIME: stages + tuning.wait + tuning.average + tuned + facts.end})
    return [total] if float(total[_TIME]) > _NOTABLY * facts.scene.run.time_limit else []


def _of_voltage(facts: RunFacts) -> list[_Changes]:
    volts = facts.scene.motor.maximum_voltage
    return [] if volts is None or facts.saturation == 0 else [{"motor.maximum_voltage": 4 * volts}]


def _of_stall(facts: RunFacts) -> list[_Changes]:
    if changes := _stall_changes(facts.scene):
        # More volts alone do nothing for a gain that is too low.
        return [changes]
    faster = 4 * facts.scene.friction_filter.drive_speed
    return [*_of_voltage(facts), {"friction_filter.drive_speed": faster}]


def _of_arrival(facts: RunFacts) -> list[_Changes]:
    scene = facts.scene
    if scene.lqr.friction_compensation != "break_away":
        return [{"lqr.friction_compensation": "break_away"}]
    most, weight = RecommendedGains.of(scene).regulator.recommended, scene.lqr.state_weight
    stronger: list[_Changes] = [{"lqr.state_weight": min(30 * weight, most)}] if most > 2 * weight else []
    angle, rate = 4 * scene.supervisor.arrival_angle, 10 * scene.supervisor.arrival_rate
    wider: _Changes = {"supervisor.arrival_angle": angle, "supervisor.arrival_rate": rate}
    return [*_of_voltage(facts), *stronger, wider]


def _of_limit(facts: RunFacts) -> list[_Changes]:
    last = float(np.max(facts.amplitude[-(facts.amplitude.size // 20 + 1) :]))
    worst = last if facts.left is None else max(last, float(facts.amplitude[facts.left]))
    return [{"supervisor.limit": 1.2 * max(worst, facts.scene.supervisor.limit)}]


def _of_tuning(facts: RunFacts) -> list[_Changes]:
    told = facts.scene.fine_tuning
    longer = max(3 * facts.scene.supervisor.fine_tuning_time, _TRIALS * (told.wait + told.average))
    more: _Changes = {"supervisor.fine_tuning_time": longer, _TIME: facts.scene.run.time_limit + longer}
    return [more, *_of_limit(facts)]


def _of_imbalance(facts: RunFacts) -> list[_Changes]:
    reach = abs(PlantParameters.of(facts.scene).influence(float(facts.speed[-1])))
    return [_imbalance_changes(deviation=_deviation(facts), imbalance=abs(facts.imbalance), reach=reach)]


def _of_friction(facts: RunFacts) -> list[_Changes]:
    scene, speed = facts.scene, float(facts.speed[-1])
    arm, gate = min(scene.masses.friction_arm), 2 * friction_floor(scene, speed=speed)
    first = _friction_changes(scene, arm=arm, speed=speed)
    wider = scene.friction_filter.gate * arm < gate < 0.5 * arm
    return [first, {"friction_filter.gate": gate / arm}] if wider else [first]


def _of_mass(facts: RunFacts) -> list[_Changes]:
    masses = facts.scene.masses
    reach = 2 * masses.guide_radius * math.cos(0.5 * masses.arc_length / masses.guide_radius)
    return [{"masses.mass": 1.2 * abs(facts.imbalance) / reach}] if reach > 0 else []


def _of_gains(facts: RunFacts) -> list[_Changes]:
    """Weaker ones, though every loop is stable by its poles."""
    if _gain_changes(facts.scene):
        return []
    weight, gain = facts.scene.lqr.state_weight / 30, facts.scene.friction_filter.speed_gain / 4
    return [{"lqr.state_weight": weight, "friction_filter.speed_gain": gain}]


_REMEDIES: Final[Mapping[EccentricOutcome, Callable[[RunFacts], list[_Changes]]]] = {
    EccentricOutcome.RISES_AGAIN: _of_limit,
    EccentricOutcome.SATURATED: _of_mass,
    EccentricOutcome.RESIDUAL: _of_limit,
    EccentricOutcome.TUNING_TIME: _of_tuning,
    EccentricOutcome.MASSES_MOVE: lambda facts: _of_voltage(facts) or _of_arrival(facts),
    EccentricOutcome.IMBALANCE_UNCERTAIN: _of_imbalance,
    EccentricOutcome.FRICTION_UNCERTAIN: _of_friction,
    EccentricOutcome.STALLED: _of_stall,
    EccentricOutcome.NOT_ARRIVED: _of_arrival,
    EccentricOutcome.TIME_LIMIT: _of_time,
    EccentricOutcome.DIVERGED: _of_gains,
}
