"""Changes of a scene with eccentric masses to try if too few devices meet the requirements.

Masses and their radius are sized by the imbalances of random devices, without a run; a higher limit by the
residual vibration of runs; unstable gains by their loops' poles.  Further changes, by fixed factors, follow
from the outcomes of runs; runs of the changed scene show which changes suffice.
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
from ringbalance.controller.eccentric_mass.static_answers import required_residual
from ringbalance.scene.origins import raw_value_at, value_at

_MAX_KINDS: Final = 4
"""Number of kinds of change that are tried for the outcomes of runs."""
_SIZE_FACTORS: Final = (1.05, 1.5)
"""Masses to try, over the mass that cancels the imbalance of nearly every device; radii likewise."""
_SIZING_QUANTILE: Final = 0.99
"""Quantile of the devices' imbalances by which masses are sized."""
_NOISE_FACTORS: Final = (("", 0.5), ("", 0.25), ("finer_", 0.05))
"""Sensor noises to try, over the present noise; a twentieth is tried even if half helps no device."""
_WAIT_FACTORS: Final = (0.5, 0.25, 0.125)
"""Waiting times before averaging to try, over the present one: they set the strategy's pace."""
_LIMIT_FACTORS: Final = (1.2, 2.0)
"""Amplitude limits to try, over the largest residual amplitude of the random devices."""
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
"""Outcomes that less sensor noise may improve."""
_SENSORS: Final[Mapping[str, tuple[str, ...]]] = {
    "encoder": ("sensor.encoder_noise", "sensor.encoder_rate_noise"),
    "sensor": (
        "sensor.position_noise",
        "sensor.velocity_noise",
        "imbalance_filter.position_noise",
        "imbalance_filter.velocity_noise",
    ),
}
"""Noise keys by sensor, with those of the filter that assumes this noise."""
_STRONGER: Final = ("friction_filter.speed_gain", "friction_filter.drive_speed", "motor.maximum_voltage")
_WALKS: Final = ("friction_filter.rate_walk", "friction_filter.friction_walk")
_BY_END: Final[Mapping[EccentricOutcome, tuple[tuple[Mapping[str, float | str], ...], ...]]] = {
    EccentricOutcome.TIME_LIMIT: (tuple({"run.time_limit": factor} for factor in (2.0, 4.0, 16.0)),),
    EccentricOutcome.RISES_AGAIN: (
        ({"supervisor.correction": "measured"},),
        tuple({"fine_tuning.average": factor} for factor in (4.0, 16.0)),
    ),
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
"""Kinds of change by outcome, each with its sizes: factors on a value, or the new value."""


def remedies_of(
    scene: EccentricScene, nominal: Outcomes, sample: Outcomes, imbalances: Sequence[float]
) -> Iterator[Remedy]:
    """Yield single changes: larger parts, changes for the outcomes of runs, less noise, another limit.

    Changes of one kind follow each other, the smallest first.

    Args: `nominal`: run of the scene's device. `sample`: runs of some random devices. `imbalances`: of many
        devices, over the largest imbalance that the masses cancel.
    """
    # Heavier masses, or a larger radius, if some devices have more imbalance than the masses cancel.
    needed = float(np.quantile(imbalances, _SIZING_QUANTILE))
    for code, path in (("mass", "masses.mass"), ("guide_radius", "masses.guide_radius")):
        for factor in _SIZE_FACTORS if needed > 1.0 else ():
            value = _rounded_up(factor * needed * value_at(scene, path))
            yield Remedy(code=code, changes={path: value}, continuous=True)
    # Gains with which the drives are stable, and the transition that is stable at any step.
    stable = all(loop.stable for loop in RecommendedGains.of(scene).loops)
    if not stable:
        yield Remedy(code="gains", changes=advised(scene))
    if scene.imbalance_filter.discretisation == "euler":
        yield Remedy(code="discretisation", changes={"imbalance_filter.discretisation": "exact"})
    yield from _by_ends(scene, Counter((*nominal.ended, *sample.ended)), stable=stable)
    required, wait = scene.requirement.settling_time, scene.fine_tuning.wait
    if required is not None and wait > 0 and np.any(sample.settled & (sample.settling_time > required)):
        yield from (Remedy(code="wait", changes={"fine_tuning.wait": each * wait}) for each in _WAIT_FACTORS)
    for code, paths in () if _BLIND.isdisjoint(sample.ended) else _SENSORS.items():
        values = {path: value_at(scene, path) for path in paths}
        if any(value > 0 for path, value in values.items() if path.startswith("sensor.")):
            for prefix, factor in _NOISE_FACTORS:
                finer = {path: factor * value for path, value in values.items() if value > 0}
                yield Remedy(code=prefix + code, changes=finer)
    # A limit at the required residual; or at what runs reach, if below the vibration before balancing.
    limit, residual = scene.supervisor.limit, required_residual(scene)
    reached = float(np.max(sample.final_amplitude))
    if residual is not None and residual < limit:
        yield Remedy(code="limit", changes={"supervisor.limit": residual})
    elif residual is None and limit < reached < math.inf:
        speed, _ = speed_at(*scene.rotor.profile, scene.supervisor.start)
        whirl = PlantParameters.of(scene).steady_whirl(speed, scene.masses.initial_angle) if speed else 0.0
        for value in (_rounded_up(factor * reached) for factor in _LIMIT_FACTORS):
            if value < abs(whirl):
                yield Remedy(code="limit", changes={"supervisor.limit": value})


def _by_ends(scene: EccentricScene, ended: Counter[str], *, stable: bool) -> Iterator[Remedy]:
    """Yield changes for the outcomes, the most frequent first; none of a value equal to the scene's or unset.

    Args: `stable`: True if the loops of the drives are stable; with unstable ones more time does not help.
    """
    kinds: dict[str, list[Settings]] = {}
    for end, _ in ended.most_common():
        if end == EccentricOutcome.TIME_LIMIT and not stable:
            continue
        for sizes in _BY_END.get(EccentricOutcome(end), ()):
            code = "_and_".join(path.partition(".")[2] for path in sizes[0])
            several: list[Settings] = []
            for factors in sizes:
                before = {path: raw_value_at(scene, path) for path in factors}
                changes = {
                    path: factor if isinstance(factor, str) else factor * before[path]
                    for path, factor in factors.items()
                    if (before[path] != factor if isinstance(factor, str) else before[path])
                }
                if changes:
                    several.append(changes)
            kinds.setdefault(code, several)
    for code, sized in list(kinds.items())[:_MAX_KINDS]:
        yield from (Remedy(code=code, changes=each) for each in sized)


def _rounded_up(value: float) -> float:
    """Round up to two significant digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.2g}")
