"""Which settings a balancer offers to try: levels along axes, and the settings at a point of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

Point = Mapping[str, float]
"""Level by name of the axis."""


@dataclass(frozen=True, kw_only=True)
class Axis:
    """What is varied."""

    name: str
    """Such as the path of a key."""
    levels: tuple[float, ...]
    """All that may be tried, increasing."""
    first: tuple[int, ...]
    """Places of those that are tried at first; their neighbours follow until the best is within them."""
    unit: str = "1"
    """SI."""


@dataclass(frozen=True, kw_only=True)
class Trials:
    """Settings of one kind of controller."""

    kind: str
    axes: tuple[Axis, ...]
    settings: Callable[[Point], Mapping[str, Any] | None]
    """At a point, by path, SI, rounded as a scene file has them; None: there is none."""
    stated: bool = True
    """Whether the scene states settings of its own that can be judged."""
    along: Axis | None = None
    """What is chosen only where the others do not suffice, or on request, and is answered for at every level,
    such as the supply's pressure; a point without it is at the scene's."""


def scaled(
    kind: str, values: Mapping[str, float], factors: tuple[float, ...], *, first: tuple[int, ...]
) -> Trials:
    """Every value of a scene times factors. Args: `values`: by path. `first`: as `Axis.first`."""
    axes = tuple(Axis(name=path, levels=factors, first=first) for path in values)

    def settings(point: Point) -> dict[str, float]:
        return {path: rounded(point[path] * value) for path, value in values.items()}

    return Trials(kind=kind, axes=axes, settings=settings)


def rounded(value: float, digits: int = 3) -> float:
    """To significant digits."""
    return float(f"{value:.{digits}g}")
