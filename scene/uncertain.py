"""The scene quantities whose uncertainty may be given, and how to change one of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True)
class Uncertain:
    """Where an uncertain quantity stands in a scene."""

    table: str
    """Table of the file and attribute of `Scene`."""
    dimension: str | None
    """A key of `DIMENSIONS`; None without unit."""


def _entries(table: str, **dimensions: str | None) -> dict[str, Uncertain]:
    return {key: Uncertain(table=table, dimension=dimension) for key, dimension in dimensions.items()}


UNCERTAIN: Mapping[str, Uncertain] = MappingProxyType(
    _entries(
        "disc",
        outer_radius="length",
        inner_radius="length",
        axial_width="length",
        central_angle="angle",
        plate_thickness="length",
    )
    | _entries(
        "liquid",
        density="density",
        kinematic_viscosity="kinematic_viscosity",
        vapour_pressure="pressure",
    )
    | _entries(
        "tube",
        bore="length",
        port_radius="length",
        hump_radius="length",
        length="length",
        roughness="length",
        extra_loss=None,
        drag_coefficient=None,
    )
    | _entries(
        "gas",
        pressure="pressure",
        ambient_pressure="pressure",
        conductance="conductance",
        critical_ratio=None,
        dead_volume="volume",
        valve_lag="time",
    )
    | _entries("rotor", speed="speed", influence_coefficient="influence_coefficient", lag_angle="angle")
)


def nominal_value(*, scene: Scene, quantity: str) -> float | None:
    """Value of a quantity in a scene.

    Args:
        scene: the scene.
        quantity: a key of `UNCERTAIN`.

    Returns:
        SI; None when the scene does not ask for the term.

    Raises:
        ValueError: no such quantity.
    """
    value: float | None = getattr(getattr(scene, _entry(quantity).table), quantity)
    return value


def with_value(*, scene: Scene, quantity: str, value: float) -> Scene:
    """Copy a scene with one quantity changed; nothing is checked again.

    Args:
        scene: the scene.
        quantity: a key of `UNCERTAIN`.
        value: its new value, SI.

    Returns:
        The changed copy; it keeps the file's name and hash.

    Raises:
        ValueError: no such quantity.
    """
    table = _entry(quantity).table
    changed: dict[str, Any] = {table: replace(getattr(scene, table), **{quantity: value})}
    return replace(scene, **changed)


def _entry(quantity: str) -> Uncertain:
    if quantity not in UNCERTAIN:
        raise ValueError(f"{quantity!r} is none of {', '.join(UNCERTAIN)}")
    return UNCERTAIN[quantity]
