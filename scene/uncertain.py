"""The scene quantities whose uncertainty may be given, and how to change one of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.models import Scene

UNCERTAIN_QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        name: table
        for table, content in LIQUID_RING.tables.items()
        for name, key in content.keys.items()
        if key.uncertain
    }
)
"""Keys of [uncertainty], each with the table of its quantity, which is an attribute of `Scene` too."""


def nominal_value(*, scene: Scene, quantity: str) -> float | None:
    """Value of a quantity in a scene.

    Args: `quantity`: a key of `UNCERTAIN_QUANTITIES`.
    Returns: SI; None when the scene does not ask for the term.
    Raises: ValueError: no such quantity.
    """
    value: float | None = getattr(getattr(scene, _table_of(quantity)), quantity)
    return value


def with_value(*, scene: Scene, quantity: str, value: float) -> Scene:
    """Copy a scene with one quantity changed; nothing is checked again.

    Args: `quantity`: a key of `UNCERTAIN_QUANTITIES`. `value`: its new value, SI.
    Returns: The changed copy; it keeps the file's name and hash.
    Raises: ValueError: no such quantity.
    """
    table = _table_of(quantity)
    changed: dict[str, Any] = {table: replace(getattr(scene, table), **{quantity: value})}
    return replace(scene, **changed)


def _table_of(quantity: str) -> str:
    if quantity not in UNCERTAIN_QUANTITIES:
        raise ValueError(f"{quantity!r} is none of {', '.join(UNCERTAIN_QUANTITIES)}")
    return UNCERTAIN_QUANTITIES[quantity]
