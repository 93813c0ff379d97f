"""The scene quantities whose uncertainty may be given, and how to change one of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from ringbalance.scene.chamber_file.stretching import STRETCHED, stretched
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.models import Scene

NORMAL_95: Final = 1.959963984540054
"""Expanded uncertainty (95 %) of a normal distribution in standard deviations."""
UNCERTAIN_QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        name: table
        for table, content in LIQUID_RING.tables.items()
        for name, key in content.keys.items()
        if key.uncertain
    }
)
"""Keys of [uncertainty], each with the table of its quantity, which is an attribute of `Scene` too."""


_SHAPE: Final = (*STRETCHED, "plate_thickness")


def nominal_value(*, scene: Scene, quantity: str) -> float | None:
    """SI value of a key of `UNCERTAIN_QUANTITIES`; None when the scene does not ask for the term."""
    value: float | None = getattr(getattr(scene, _table_of(quantity)), quantity)
    return value


def with_value(*, scene: Scene, quantity: str, value: float) -> Scene:
    """Copy a scene with one of `UNCERTAIN_QUANTITIES` changed, SI; nothing is checked again.

    The mesh of a chamber is stretched with its dimension.
    Raises: ValueError: a mesh has no such dimension of its own.
    """
    table = _table_of(quantity)
    changed: dict[str, Any] = {quantity: value}
    disc, geometry = scene.disc, scene.disc.geometry
    if geometry is not None and quantity in _SHAPE:
        if quantity not in STRETCHED:
            raise ValueError(f"the mesh of a chamber has no {quantity} of its own")
        dimensions = {each: getattr(disc, each) for each in STRETCHED}
        changed["geometry"] = stretched(geometry, dimensions=dimensions, quantity=quantity, value=value)
    return replace(scene, **{table: replace(getattr(scene, table), **changed)})


def _table_of(quantity: str) -> str:
    if quantity not in UNCERTAIN_QUANTITIES:
        raise ValueError(f"{quantity!r} is none of {', '.join(UNCERTAIN_QUANTITIES)}")
    return UNCERTAIN_QUANTITIES[quantity]
