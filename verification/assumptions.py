"""Inputs neither given nor measured: those that a claim rests on, and their effect on its numbers."""

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
"""Origins of a value that is not varied: stated or measured."""


@dataclass(frozen=True, kw_only=True)
class Assumption:
    """An input that a claim rests on and that is neither given nor measured."""

    path: str
    origin: str
    """ "assumed", "inferred" or "default"."""
    value: float
    """Value in the scene, SI."""
    low: float
    high: float
    """Ends of its range, SI."""
    why: str
    """Reason for the range."""
    covered: str = ""
    """Reason why the case is not computed at the ends of the range: something else accounts for it."""


def assumptions_of(rests_on: Sequence[RestsOn], scene: Any) -> tuple[Assumption, ...]:
    """Inputs of a claim that a scene assumes, infers or leaves to a default, each with its range.

    A range that the claim states comes first. An inferred value has that of the scene's [uncertainty]; an
    assumed one has a documented range, or the scene's where that is wider, since the tolerance of a part does
    not apply to a part that is not specified.
    Raises: ValueError: an input without any of these.
    """
    assumptions = []
    for needed in rests_on:
        origin, value = scene.origin_of(needed.path), raw_value_at(scene, needed.path)
        if origin not in KNOWN and value is not None:
            low, high, why = _range(needed, scene, value, origin)
            ends = {"low": min(low, value), "high": max(high, value)}
            assumptions.append(
                Assumption(
                    path=needed.path, origin=origin, value=value, why=why, covered=needed.covered, **ends
                )
            )
    return tuple(assumptions)


_CHANGES: Final[Mapping[str, Callable[..., Any]]] = {"eccentric_mass": changed}
"""Function that changes values, by the balancer of scenes whose defaults follow from others."""


def overridden(scene: Any, overrides: Mapping[str, float | Literal["absent"]]) -> Any:
    """A scene of either balancer with some SI values changed by "table.key"; "absent" stands for None.

    Raises: ValueError: a table or quantity that a scene does not have.
    """
    for path, override in overrides.items():
        table, _, key = path.partition(".")
        if not hasattr(getattr(scene, table, None), key):
            raise ValueError(f'a scene has no quantity "{path}"')
        change: Callable[..., Any] = _CHANGES.get(scene.balancer, with_values_at)
        scene = change(scene, {path: None if override == "absent" else override})
    return scene


def widened(
    evidence: Evidence, scene: Any, assumptions: Sequence[Assumption], *, at: Callable[[Any], Evidence]
) -> Evidence:
    """Evidence with the reach of its assumed inputs: the case computed at all corners of their ranges.

    The reach is that of the error: an input that changes number and reference alike adds nothing.
    Args: `at`: evidence of another scene, or a part of it.
    """
    if not assumptions:
        return evidence

    def errors(varied: Any) -> Mapping[str, float]:
        return {name: number.error for name, number in at(varied).quantities.items()}

    nominal = errors(scene)
    paths = [assumption.path for assumption in assumptions]
    corners = itertools.product(*((assumption.low, assumption.high) for assumption in assumptions))
    at_corners = [errors(overridden(scene, dict(zip(paths, corner, strict=True)))) for corner in corners]
    quantities = dict(evidence.quantities)
    for name, error in nominal.items():
        changes = [corner[name] - error for corner in at_corners]
        quantities[name] = quantities[name].moved(min(changes), max(changes))
    return dataclasses.replace(evidence, quantities=quantities)


def _range(needed: RestsOn, scene: Any, value: float, origin: str) -> tuple[float, float, str]:
    if needed.low is not None and needed.high is not None:
        return needed.low, needed.high, needed.why
    half_widths = [
        stated.absolute(value)
        for stated in getattr(scene, "uncertainty", ())
        if stated.quantity == needed.path.partition(".")[2] and not needed.documented
    ]
    ends, why = _DOCUMENTED.get(needed.path, (None, ""))
    if half_widths and (origin == "inferred" or ends is None):
        return value - half_widths[0], value + half_widths[0], "[uncertainty] of the scene"
    if ends is None:
        raise ValueError(f"{needed.path}: nobody gave it, and no range is stated or documented")
    low, high = ends(scene, value)
    half_width = half_widths[0] if half_widths else 0.0
    return min(low, value - half_width), max(high, value + half_width), needed.why or why


def _factor(low: float, high: float) -> Callable[[Any, float], tuple[float, float]]:
    return lambda _, value: (low * value, high * value)


def _between(low: float, high: float) -> Callable[[Any, float], tuple[float, float]]:
    return lambda _scene, _value: (low, high)


def _crest(scene: Scene, _: float) -> tuple[float, float]:
    # Inside the fullest ring the tube is disconnected at rest; it cannot lie inside the chamber's inner wall.
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
