"""Changes of a scene with eccentric masses to try where too few devices meet what is asked.

Masses and their arm are sized by the imbalances of drawn devices, which needs no run; a higher limit by the
vibration that runs come down to.  What else may help, runs advise.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import Outcomes, Remedy
from ringbalance.controller.eccentric_mass.run_facts import EccentricOutcome
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.origins import value_at

MOST: Final = 4
"""Remedies that runs advise and that are tried."""
_SPARE: Final = (1.05, 1.5)
"""Times the masses that cancel the imbalance of nearly every device."""
_NEARLY: Final = 0.99
"""Of the devices, whose imbalance masses are sized by."""
_FINER: Final = (0.5, 0.25)
"""Times the noise of a sensor."""
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
_Kind = frozenset[tuple[str, str]]
"""Paths that change, each with "up", "down" or the text that is set."""


def remedies_of(
    scene: EccentricScene, drawn: Outcomes, runs: Sequence[Any], shares: Sequence[float]
) -> tuple[Remedy, ...]:
    """Every change by itself: parts that are too small, what runs advise, less noise, another limit.

    Those of one kind follow each other with the smallest first.

    Args: `drawn`: of some devices. `runs`: theirs and the scene's own, each an `EccentricRun`. `shares`: of
        many devices, imbalance over what the masses cancel.
    """
    first = tuple(_of_masses(scene, shares))
    last = (*_of_sensors(scene, drawn), *_of_limit(scene, drawn))
    codes = {each.code for each in (*first, *last)}
    advised = (each for each in advised_remedies(scene, runs) if each.code not in codes)
    return (*first, *advised, *last)


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
            for factor in _FINER:
                finer = {path: factor * value for path, value in values.items() if value > 0}
                yield Remedy(code=code, changes=finer)


def _of_limit(scene: EccentricScene, drawn: Outcomes) -> Iterator[Remedy]:
    """As high as what is reached; where the scene requires a residual, as low as that."""
    limit, residual = scene.supervisor.limit, scene.requirement.residual
    reached = float(np.max(drawn.final_amplitude))
    if residual is not None:
        if residual < limit:
            yield Remedy(code="limit", changes={"supervisor.limit": residual})
    elif limit < reached < math.inf:
        for factor in _LIMITS:
            yield Remedy(code="limit", changes={"supervisor.limit": _rounded_up(factor * reached)})


def _rounded_up(value: float) -> float:
    """To two digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.2g}")


def advised_remedies(scene: EccentricScene, runs: Iterable[Any]) -> tuple[Remedy, ...]:
    """Those that most runs advise first, each with its largest change.

    None that moves a value the other way than one before it: the two would undo each other.
    Args: `runs`: each an `EccentricRun`.
    """
    counted: Counter[_Kind] = Counter()
    largest: dict[_Kind, Mapping[str, float | str]] = {}
    for run in runs:
        for finding in run.remedies:
            kind = frozenset((path, _way(scene, path, value)) for path, value in finding.change.items())
            counted[kind] += 1
            if kind not in largest or _size(scene, finding.change) > _size(scene, largest[kind]):
                largest[kind] = finding.change
    found, ways = [], dict[str, str]()
    for kind, _ in counted.most_common():
        if all(ways.get(path, way) == way for path, way in kind):
            ways |= dict(kind)
            found.append(Remedy(code=_code(kind), changes=dict(largest[kind])))
    return tuple(found[:MOST])


def _way(scene: EccentricScene, path: str, value: float | str) -> str:
    if isinstance(value, str):
        return value
    before = _before(scene, path)
    return "up" if before is None or value > before else "down"


def _before(scene: EccentricScene, path: str) -> float | None:
    table, _, key = path.partition(".")
    return None if getattr(getattr(scene, table), key) is None else value_at(scene, path)


def _size(scene: EccentricScene, changes: Mapping[str, float | str]) -> float:
    numbers = [(_before(scene, path), value) for path, value in changes.items() if not isinstance(value, str)]
    return math.fsum(abs(math.log(value / before)) for before, value in numbers if before and value > 0)


def _code(kind: _Kind) -> str:
    return "_and_".join(sorted(path.partition(".")[2] for path, _ in kind))
