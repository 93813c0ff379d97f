"""How a run ended and what its user should know, as findings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.drive_law import believed_whirl
from ringbalance.controller.eccentric_mass.memory import HELD, STAGE_NAMES
from ringbalance.controller.eccentric_mass.run_facts import EccentricOutcome, RunFacts
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
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
    return (
        *_unstable(facts.scene),
        *(
            Finding(code=code, values={name: numbers[name] for name in sentences()[code].values})
            for code in due
        ),
    )


def _unstable(scene: EccentricScene) -> Iterator[Finding]:
    """Loops whose poles are outside the unit circle, each with the gain or the hold that would do."""
    if scene.supervisor.strategy == "locked":
        return
    gains = RecommendedGains.of(scene)
    for loop in gains.loops:
        if not loop.stable and not (loop is gains.pair and not gains.speed.stable):
            numbers = {"radius": loop.radius, "gain": loop.recommended, "hold": loop.recommended_step}
            yield Finding(
                code="loop_unstable",
                values={"loop": loop.name, "key": loop.key, **numbers},
                change={loop.key: loop.recommended},
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
        "drives_stay_on": int(facts.history["hold"][-1]) == HELD,
        "masses_meet": facts.least_gap < _own_angle(facts.scene),
    }


def _stalled(facts: RunFacts) -> float:
    return int(facts.memory["stalled"]) / max(int(facts.memory["driven"]), 1)


def _deviation(facts: RunFacts) -> float:
    """Standard deviation of the imbalance by noise, kg m."""
    return float(np.sqrt(np.max(np.linalg.eigvalsh(facts.history["imbalance_covariance"][-1]))))


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
        "residual": float(facts.memory["left"]),
        "lowest_speed": supervisor.lowest_speed,
        "imbalance_time": supervisor.imbalance_time,
        "deviation_ratio": _deviation(facts) / abs(facts.imbalance) if facts.imbalance else None,
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
