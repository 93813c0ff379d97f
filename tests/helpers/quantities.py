"""Quantities of a result and of its JSON, by key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ringbalance.results.rows import Parts, Quantity


def by_key(document: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Quantities of a JSON document."""
    return {each["key"]: each for each in document["quantities"]}


def half_width(quantity: Mapping[str, Any]) -> float:
    """Root of the sum of the squares of a quantity's parts."""
    return math.hypot(*quantity["parts"].values())


def parts_of(quantity: Quantity) -> Parts:
    """Of a quantity that has them."""
    assert quantity.parts is not None
    return quantity.parts


def inputs_of(quantity: Quantity) -> dict[str, float]:
    """Half-widths by inputs of the scene."""
    return {path: size for path, size in quantity.causes.items() if not path.startswith("model: ")}


def sides_of(quantity: Quantity) -> tuple[float, float]:
    """Distances of the value from both ends of its interval; zeros without one."""
    if quantity.value is None or quantity.lower is None or quantity.upper is None:
        return 0.0, 0.0
    return quantity.value - quantity.lower, quantity.upper - quantity.value
