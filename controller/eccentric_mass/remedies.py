"""What runs of drawn devices advise, as changes of their scene to try."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, Final

from ringbalance.controller.balancer import Remedy
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.paths import value_at

MOST: Final = 4
"""Remedies that are tried."""
_Kind = frozenset[tuple[str, str]]
"""Paths that change, each with "up", "down" or the text that is set."""


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
