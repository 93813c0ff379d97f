"""Changes of a scene with eccentric masses to try where too few devices meet what is asked.

Masses and their arm are sized by the imbalances of drawn devices, which needs no run; a higher limit by the
vibration that runs come down to; unstable gains by their loops' poles.  What else may help goes by how runs
end, by factors: runs of the changed scene say which will do.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from ringbalance.controller.balancer import Outcomes, Remedy, Settings
from ringbalance.controller.eccentric_mass.outcome import EccentricOutcome
from ringbalance.controller.eccentric_mass.plant import PlantParameters, speed_at
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains, advised
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.origins import raw_value_at, value_at

_MOST: Final = 4
"""Kinds of change that are tried by how runs end."""
_SPARE: Final = (1.05, 1.5)
"""Times the masses that cancel the imbalance of nearly every device."""
_NEARLY: Final = 0.99
"""Of the devices, whose imbalance masses are sized by."""
_FINER: Final = {"": (0.5, 0.25), "finer_": (0.05,)}
"""Times the noise of a sensor; where half of it serves none, a twentieth is tried all the same."""
_SHORTER: Final = (0.5, 0.25, 0.125)
"""Times the wait before the vibration is averaged, which sets the pace of the strategy."""
_LIMITS: Final = (1.2, 2.0)
"""Times the largest amplitude that the drawn devices come down to."""
_BLIND: Final = frozenset(
    {
        EccentricOutcome.RISES_AGAIN,
        EccentricOutcome.RESIDUAL,
        EccentricOutcome.TUNING_TIME,
        EccentricOutcome.IMBALANCE_UNCERTAIN,
        EccentricOutcome.FRICTION_UNCERTAIN,
        EccentricOutcome.NOT_ARRIVED,
        EccentricOutcome.TIME_LIMIT,
    }
)
"""Ends of runs that less noise may mend."""
_SENSORS: Final[Mapping[str, tuple[str, ...]]] = {
    "encoder": ("sensor.encoder_noise", "sensor.encoder_rate_noise"),
    "sensor": (
        "sensor.position_noise",
        "sensor.velocity_noise",
        "imbalance_filter.position_noise",
        "imbalance_filter.velocity_noise",
    ),
}
"""Noises by the part that has them; a filter assumes what its sensor has."""
_STRONGER: Final = ("friction_filter.speed_gain", "friction_filter.drive_speed", "motor.maximum_voltage")
_WALKS: Final = ("friction_filter.rate_walk", "friction_filter.friction_walk")
_BY_END: Final[Mapping[EccentricOutcome, tuple[tuple[Mapping[str, float | str], ...], ...]]] = {
    EccentricOutcome.TIME_LIMIT: (tuple({"run.time_limit": factor} for factor in (2.0, 4.0, 16.0)),),
    EccentricOutcome.RISES_AGAIN: (({"supervisor.correction": "measured"},),),
    EccentricOutcome.TUNING_TIME: (({"supervisor.fine_tuning_time": 4.0, "run.time_limit": 2.0},),),
    EccentricOutcome.MASSES_MOVE: (
        ({"motor.maximum_voltage": 4.0},),
        ({"lqr.friction_compensation": "break_away"},),
    ),
    EccentricOutcome.IMBALANCE_UNCERTAIN: (
        tuple({"imbalance_filter.gate": factor} for factor in (2.0, 4.0)),
    ),
    EccentricOutcome.FRICTION_UNCERTAIN: (
        tuple(dict.fromkeys(_WALKS, factor) for factor in (0.1, 0.01)),
        ({"supervisor.friction_time": 4.0, "run.time_limit": 2.0},),
        ({"friction_filter.gate": 2.0},),
    ),
    EccentricOutcome.STALLED: (
        tuple(dict.fromkeys(_STRONGER, factor) for factor in (2.0, 4.0)),
        *(({path: 4.0},) for path in _STRONGER),
    ),
    EccentricOutcome.NOT_ARRIVED: (
        ({"lqr.friction_compensation": "break_away"},),
        tuple({"lqr.state_weight": factor} for factor in (4.0, 30.0)),
        ({"supervisor.arrival_angle": 4.0, "supervisor.arrival_rate": 10.0},),
    ),
    EccentricOutcome.DIVERGED: (({"lqr.state_weight": 1 / 30, "friction_filter.speed_gain": 0.25},),),
}
"""Kinds of change by how runs end, each with its sizes: times a value, or what is set."""


def remedies_of(
    scene: EccentricScene, drawn: Outcomes, own: Outcomes, shares: Sequence[float]
) -> tuple[Remedy, ...]:
    """Every change by itself: parts that are too small, what helps such ends, less noise, another limit.

    Those of one kind follow each other with the smallest first.

    Args: `drawn`: of some devices. `own`: of the scene's. `shares`: of many devices, imbalance over what the
        masses cancel.
    """
    first = tuple(_of_masses(scene, shares))
    ended = Counter((*own.ended, *drawn.ended))
    return (
        *first,
        *_of_loops(scene),
        *_of_ends(scene, ended),
        *_of_pace(scene, drawn),
        *_of_sensors(scene, drawn),
        *_of_limit(scene, drawn),
    )


def _of_loops(scene: EccentricScene) -> Iterator[Remedy]:
    """Gains that the drives bear, and the transition that bears every step."""
    if not _stable(scene):
        yield Remedy(code="gains", changes=advised(scene))
    if scene.imbalance_filter.discretisation == "euler":
        yield Remedy(code="discretisation", changes={"imbalance_filter.discretisation": "exact"})


def _stable(scene: EccentricScene) -> bool:
    return all(loop.stable for loop in RecommendedGains.of(scene).loops)


def _of_pace(scene: EccentricScene, drawn: Outcomes) -> Iterator[Remedy]:
    """A shorter wait, where devices settle later than the scene requires."""
    required, wait = scene.requirement.settling_time, scene.fine_tuning.wait
    if required is not None and wait > 0 and np.any(drawn.settled & (drawn.settling_time > required)):
        yield from (Remedy(code="wait", changes={"fine_tuning.wait": factor * wait}) for factor in _SHORTER)


def _of_ends(scene: EccentricScene, ended: Counter[str]) -> Iterator[Remedy]:
    """For the commonest end first; none that sets what the scene has, or that it leaves open."""
    kinds: dict[str, list[Settings]] = {}
    for end, _ in ended.most_common():
        # Drives that are unstable do not come to an end in any time.
        if end == EccentricOutcome.TIME_LIMIT and not _stable(scene):
            continue
        for sizes in _BY_END.get(EccentricOutcome(end), ()):
            code = "_and_".join(path.partition(".")[2] for path in sizes[0])
            changes = [_changed(scene, factors) for factors in sizes]
            kinds.setdefault(code, [each for each in changes if each])
    for code, several in list(kinds.items())[:_MOST]:
        yield from (Remedy(code=code, changes=each) for each in several)


def _changed(scene: EccentricScene, factors: Mapping[str, float | str]) -> Settings:
    """Changes of a scene by factors on its numbers or by other words, without those that change nothing."""
    changes: dict[str, float | str] = {}
    for path, factor in factors.items():
        before = raw_value_at(scene, path)
        if isinstance(factor, str):
            changes |= {path: factor} if before != factor else {}
        elif before:
            changes[path] = factor * before
    return changes


def _of_masses(scene: EccentricScene, shares: Sequence[float]) -> Iterator[Remedy]:
    """Heavier, or farther out, where some devices have more imbalance than the masses cancel."""
    needed = float(np.quantile(shares, _NEARLY))
    if needed > 1.0:
        for code, path in (("mass", "masses.mass"), ("guide_radius", "masses.guide_radius")):
            for spare in _SPARE:
                value = _rounded_up(spare * needed * value_at(scene, path))
                yield Remedy(code=code, changes={path: value}, continuous=True)


def _of_sensors(scene: EccentricScene, drawn: Outcomes) -> Iterator[Remedy]:
    if _BLIND.isdisjoint(drawn.ended):
        return
    for code, paths in _SENSORS.items():
        values = {path: value_at(scene, path) for path in paths}
        if any(value > 0 for path, value in values.items() if path.startswith("sensor.")):
            for prefix, factor in ((prefix, each) for prefix, some in _FINER.items() for each in some):
                finer = {path: factor * value for path, value in values.items() if value > 0}
                yield Remedy(code=prefix + code, changes=finer)


def _of_limit(scene: EccentricScene, drawn: Outcomes) -> Iterator[Remedy]:
    """As high as what is reached, below the vibration without balancing; or as low as a required residual."""
    limit, residual = scene.supervisor.limit, scene.requirement.residual
    reached = float(np.max(drawn.final_amplitude))
    if residual is not None:
        if residual < limit:
            yield Remedy(code="limit", changes={"supervisor.limit": residual})
    elif limit < reached < math.inf:
        speed, _ = speed_at(*scene.rotor.profile, scene.supervisor.start)
        before = (
            abs(PlantParameters.of(scene).steady_whirl(speed, scene.masses.initial_angle)) if speed else 0.0
        )
        for value in (_rounded_up(factor * reached) for factor in _LIMITS):
            if value < before:
                yield Remedy(code="limit", changes={"supervisor.limit": value})


def _rounded_up(value: float) -> float:
    """To two digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.2g}")
