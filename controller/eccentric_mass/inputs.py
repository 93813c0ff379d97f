"""Values of a scene with two eccentric masses by their paths: read, moved, and drawn from what it states."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.origins import InputUncertainty
from ringbalance.scene.uncertain import NORMAL_95

_PATH: Final = re.compile(r"(\w+)\.(\w+)(?:\[([01])\])?")


def eccentric_value(scene: EccentricScene, path: str) -> float:
    """SI value at a path, such as "rotor.mass" or "masses.friction_arm[0]"."""
    table, key, entry = _placed(path)
    value = getattr(getattr(scene, table), key)
    return float(value if entry is None else value[entry])


def eccentric_moved(scene: EccentricScene, path: str, move: Callable[[float], float]) -> EccentricScene:
    """Copy a scene of eccentric masses with the value at a path moved, SI; nothing is checked again.

    A path without an entry, such as "masses.friction_arm", moves the values of both masses.
    """
    table, key, entry = _placed(path)
    record = getattr(scene, table)
    value = getattr(record, key)
    moved: Any
    if isinstance(value, tuple):
        moved = tuple(move(old) if entry in (None, place) else old for place, old in enumerate(value))
    else:
        moved = move(value)
    changed: dict[str, Any] = {table: replace(record, **{key: moved})}
    return replace(scene, **changed)


def eccentric_with(scene: EccentricScene, value: float, *, name: str) -> EccentricScene:
    """The same with a value in place of the one at a path."""
    return eccentric_moved(scene, name, lambda _: value)


def _placed(path: str) -> tuple[str, str, int | None]:
    match = _PATH.fullmatch(path)
    if match is None:
        raise ValueError(f"{path!r} is no path of a scene")
    return match[1], match[2], None if match[3] is None else int(match[3])


def eccentric_drawn(scene: EccentricScene, random: np.random.Generator) -> EccentricScene:
    """The scene with every stated input drawn: relative ones log-normal, so that none changes its sign.

    Those that were fitted together are drawn together, positive ones by their logarithms.
    """
    together = {each.quantity for each in scene.fitted.quantities}
    for uncertain in scene.uncertainty:
        move = _drawn(uncertain, random.standard_normal() / NORMAL_95)
        if uncertain.quantity in together:
            continue
        both = [f"{uncertain.quantity}[{place}]" for place in (0, 1)]
        alone = [name for name in both if name not in together]
        for path in [uncertain.quantity] if len(alone) == len(both) else alone:
            scene = eccentric_moved(scene, path, move)
    for each, change in zip(scene.fitted.quantities, scene.fitted.drawn(random).tolist(), strict=True):
        scene = eccentric_moved(scene, each.quantity, partial(_by, change, each.unit in _ANGLES))
    return scene


_ANGLES: Final = ("rad", "mrad", "deg")


def _by(change: float, linear: bool, value: float) -> float:
    """Args: `linear`: whether the quantity may have any sign."""
    return value + change if linear or value <= 0 else value * math.exp(change / value)


def _drawn(uncertain: InputUncertainty, part: float) -> Callable[[float], float]:
    """Args: `part`: of the half-width, a normal deviate."""
    if uncertain.relative:
        return lambda value: value * math.exp(math.log1p(uncertain.half_width) * part)
    return lambda value: value + uncertain.half_width * part
