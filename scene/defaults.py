"""Defaults that follow from other values of the scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from ringbalance.scene.fields import LETTERS
from ringbalance.scene.path import shortest_path
from ringbalance.scene.reading import Reading

_NEARLY_WHOLE = 1e-3


@dataclass(frozen=True, kw_only=True)
class Derived:
    """A default that follows from other values."""

    path: str
    """Of the value, "table.key"."""
    needs: tuple[str, ...]
    """Paths of the rule's arguments."""
    rule: Callable[..., Any]
    """From the values of `needs`; None when there is no default in this case."""


def even_number_of_chambers(central_angle: float) -> int | None:
    """Number of chambers that fill the circle.

    n = 2 pi / theta, when that is an even whole number to within 0.001, as drawings round angles.

    Args:
        central_angle: theta, rad.

    Returns:
        The number; None when it would not be even.
    """
    exact = 2 * math.pi / central_angle
    nearest = round(exact) if exact <= len(LETTERS) else 0
    close = abs(exact - nearest) <= _NEARLY_WHOLE
    return nearest if close and nearest >= 2 and nearest % 2 == 0 else None


def trial_sequence(chambers: int) -> tuple[str, ...]:
    """Order in which chambers are tried: each followed by its opposite.

    Args:
        chambers: their even number.

    Returns:
        Letters; A, C, B, D for four, as in the liquid-ring paper's section 6.
    """
    half = chambers // 2
    return tuple(LETTERS[chamber] for first in range(half) for chamber in (first, first + half))


_RULES = (
    Derived(path="disc.chambers", needs=("disc.central_angle",), rule=even_number_of_chambers),
    Derived(path="disc.initial_fill", needs=("disc.max_fill_ratio",), rule=lambda share: share / 2),
    Derived(path="tube.port_radius", needs=("disc.outer_radius",), rule=lambda radius: radius),
    Derived(
        path="tube.entrance_radius",
        needs=("tube.entrance",),
        rule=lambda entrance: None if entrance == "rounded" else 0.0,
    ),
    Derived(
        path="controller.assumed_influence_coefficient",
        needs=("rotor.influence_coefficient",),
        rule=lambda coefficient: coefficient,
    ),
    Derived(path="controller.assumed_lag_angle", needs=("rotor.lag_angle",), rule=lambda angle: angle),
    Derived(path="controller.sequence", needs=("disc.chambers",), rule=trial_sequence),
)


def completed(reading: Reading) -> Reading:
    """Fill in the defaults that follow from other values, as far as those are known.

    Args:
        reading: what the file says.

    Returns:
        The same with more values; what could not be read stays unknown.
    """
    reading = filled_in(reading, _RULES)
    return reading.adding(_decreed_length(reading))


def filled_in(reading: Reading, rules: Iterable[Derived]) -> Reading:
    """Fill in the name and some defaults that follow from other values, as far as those are known.

    Args:
        reading: what the file says.
        rules: in an order in which each finds what it needs.

    Returns:
        The same with more values.
    """
    if reading.lacks("name"):
        reading = reading.adding({"name": PurePath(reading.file).stem or "scene"})
    for derived in rules:
        if reading.lacks(derived.path) and reading.known(*derived.needs):
            result = derived.rule(*(reading.values[path] for path in derived.needs))
            reading = reading.adding({} if result is None else {derived.path: result})
    return reading


def _decreed_length(reading: Reading) -> Mapping[str, float]:
    """With k by decree the length only matters for the liquid's inertia: the shortest tube stands in."""
    hump_settled = reading.known("tube.hump_radius") or reading.lacks("tube.hump_radius")
    settled = reading.known("tube.drag_coefficient", "tube.port_radius") and hump_settled
    if not settled or not reading.lacks("tube.length"):
        return {}
    port_radius, hump_radius = reading.values["tube.port_radius"], reading.values.get("tube.hump_radius")
    if hump_radius is not None and hump_radius >= port_radius:
        return {}
    length = shortest_path(port_radius=port_radius, hump_radius=hump_radius, separation=math.pi)
    return {"tube.length": length}
