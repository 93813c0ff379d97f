"""Inputs that nobody gave: which of them a claim rests on, and how far they may move what is found."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import raw_value_at, with_values_at
from ringbalance.verification.case import RestsOn
from ringbalance.verification.evidence import Evidence
from ringbalance.verification.papers import changed

KNOWN: Final = ("given", "measured")
"""Origins of a value that somebody vouches for: it is taken as it stands."""


@dataclass(frozen=True, kw_only=True)
class Assumption:
    """An input that a claim rests on and nobody gave."""

    path: str
    origin: str
    """ "assumed", "inferred" or "default"."""
    value: float
    """In the scene, SI."""
    low: float
    high: float
    """Ends of its range, SI."""
    why: str
    """What the range rests on."""
    covered: str = ""
    """What accounts for the range other than computing at its ends."""


def assumptions_of(rests_on: Sequence[RestsOn], scene: Any) -> tuple[Assumption, ...]:
    """Inputs of a claim that a scene assumes, infers or leaves to a default, each with its range.

    The range is the claim's own where it has one. An inferred value has that of the scene's [uncertainty];
    one that was assumed has a documented one, or the scene's where that is wider: the tolerance of a part
    says nothing of a part that nobody described.
    Raises: ValueError: an input without any of these.
    """
    found = []
    for one in rests_on:
        origin, value = scene.origin_of(one.path), raw_value_at(scene, one.path)
        if origin in KNOWN or value is None:
            continue
        low, high, why = _range(one, scene, value, origin)
        ends = {"low": min(low, value), "high": max(high, value)}
        found.append(
            Assumption(path=one.path, origin=origin, value=value, why=why, covered=one.covered, **ends)
        )
    return tuple(found)


_CHANGES: Final[Mapping[str, Callable[..., Any]]] = {"eccentric_mass": changed}
"""How values are changed in scenes whose defaults follow from others."""


def overridden(scene: Any, overrides: Mapping[str, float | Literal["absent"]]) -> Any:
    """A scene of either balancer with some SI values changed by "table.key"; "absent" stands for None.

    Raises: ValueError: a table or quantity that a scene does not have.
    """
    for path, given in overrides.items():
        table, _, key = path.partition(".")
        if not hasattr(getattr(scene, table, None), key):
            raise ValueError(f'a scene has no quantity "{path}"')
        value = None if given == "absent" else given
        change: Callable[..., Any] = _CHANGES.get(scene.balancer, with_values_at)
        scene = change(scene, {path: value})
    return scene


def widened(
    evidence: Evidence, scene: Any, assumptions: Sequence[Assumption], *, at: Callable[[Any], Evidence]
) -> Evidence:
    """Evidence with the reach of its assumed inputs: the case computed at all corners of their ranges.

    What moves is the error, so an input that moves number and reference alike counts for nothing.
    Args: `at`: what is judged on another scene, or a part of it.
    """
    if not assumptions:
        return evidence

    def errors(of: Any) -> Mapping[str, float]:
        return {name: found.error for name, found in at(of).quantities.items()}

    here = errors(scene)
    paths = [one.path for one in assumptions]
    corners = itertools.product(*((one.low, one.high) for one in assumptions))
    moved = [errors(overridden(scene, dict(zip(paths, corner, strict=True)))) for corner in corners]
    found = dict(evidence.quantities)
    for name, error in here.items():
        changes = [one[name] - error for one in moved]
        found[name] = found[name].moved(min(changes), max(changes))
    return dataclasses.replace(evidence, quantities=found)


def _range(one: RestsOn, scene: Any, value: float, origin: str) -> tuple[float, float, str]:
    if one.low is not None and one.high is not None:
        return one.low, one.high, one.why
    stated = [
        stated.absolute(value)
        for stated in getattr(scene, "uncertainty", ())
        if stated.quantity == one.path.partition(".")[2] and not one.documented
    ]
    ends, why = _DOCUMENTED.get(one.path, (None, ""))
    if stated and (origin == "inferred" or ends is None):
        return value - stated[0], value + stated[0], "[uncertainty] of the scene"
    if ends is None:
        raise ValueError(f"{one.path}: nobody gave it, and no range is stated or documented")
    low, high = ends(scene, value)
    width = stated[0] if stated else 0.0
    return min(low, value - width), max(high, value + width), one.why or why


def _factor(low: float, high: float) -> Callable[[Any, float], tuple[float, float]]:
    return lambda _, value: (low * value, high * value)


def _between(low: float, high: float) -> Callable[[Any, float], tuple[float, float]]:
    return lambda _scene, _value: (low, high)


def _crest(scene: Scene, _: float) -> tuple[float, float]:
    """Inside the fullest ring the tube is disconnected at rest; it cannot lie inside the chamber's inner
    wall."""
    ring = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio))
    return scene.disc.inner_radius, min(0.999 * ring, scene.tube.port_radius)


_Ends = Callable[[Any, float], tuple[float, float]]
_DOCUMENTED: Final[Mapping[str, tuple[_Ends, str]]] = {
    "disc.plate_thickness": (
        lambda _, t: (max(0.0, t - 2e-4), t + 2e-4),
        "a width printed to 1 mm alone moves the thickness that fits the volume by 0.2 mm",
    ),
    "tube.hump_radius": (_crest, "between the chamber's inner wall and the fullest ring"),
    "tube.bore": (_factor(0.5, 1.5), "bores from half to one and a half times as wide are built"),
    "tube.extra_loss": (_between(0.0, 47.0), "from a bare tube to a restriction that makes k about 50"),
    "tube.length": (_factor(1.0, 3.0), "from the shortest path to three times as long"),
    "tube.roughness": (_factor(0.1, 10.0), "from polished to corroded"),
    "tube.hump_position": (_between(0.2, 0.8), "anywhere but at a port"),
    "rotor.influence_coefficient": (_factor(0.5, 2.0), "nobody measured it: half to twice"),
    **{
        f"sensor.{noise}_noise": (_factor(1 / 3, 3.0), "a third to three times the noise is usual")
        for noise in ("position", "velocity", "encoder", "encoder_rate")
    },
}
"""Ranges of inputs that no scene states, each with its reason: from scene and value to both ends, SI."""
