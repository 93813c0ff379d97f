"""The scene quantities whose uncertainty may be given, and how to change one of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from ringbalance.scene.chamber_file.record import STRETCHED
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.models import Scene

NORMAL_95: Final = 1.959963984540054
"""Expanded uncertainty (95 %) of a normal distribution in standard deviations."""
ASSUMED_ROUGHNESS_UNCERTAINTY: Final = 0.5
"""Relative expanded uncertainty (95 %) of a roughness for which the scene states none."""
ASSUMED_DRAW_DOWN_UNCERTAINTY: Final = 0.3
"""Relative expanded uncertainty (95 %) of the depth at which gas enters a port, where the scene states none.

The two theories of it differ by up to 18 % where the port is as wide as the liquid is deep, liquid that still
moves needs somewhat more than liquid at rest, and no measurement of such a port is known.
"""
_MAY_VANISH: Final = frozenset({"roughness", "extra_loss"})
"""Quantities of the tube that may be zero; where others would reach it, a tenth of the value counts."""
UNCERTAIN_QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        name: table
        for table, content in LIQUID_RING.tables.items()
        for name, key in content.keys.items()
        if key.uncertain
    }
)
"""Keys of [uncertainty], each with the table of its quantity, which is an attribute of `Scene` too."""


SHAPE: Final = (*STRETCHED, "plate_thickness")
"""Keys of [disc] that follow from a mesh where there is one."""


def nominal_value(*, scene: Scene, quantity: str) -> float | None:
    """SI value of a key of `UNCERTAIN_QUANTITIES`; None when the scene does not ask for the term.

    None too for what the mesh of a chamber cannot be stretched by.
    """
    if quantity in SHAPE and quantity not in STRETCHED and scene.disc.geometry is not None:
        return None
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
    if geometry is not None and quantity in SHAPE:
        if quantity not in STRETCHED:
            raise ValueError(f"the mesh of a chamber has no {quantity} of its own")
        dimensions = {each: getattr(disc, each) for each in STRETCHED}
        changed["geometry"] = geometry.stretched(dimensions=dimensions, quantity=quantity, value=value)
    return replace(scene, **{table: replace(getattr(scene, table), **changed)})


def half_widths(scene: Scene) -> Mapping[str, float]:
    """Absolute expanded uncertainties (95 %) of a scene's inputs, each by itself; the liquid's own where the
    scene states none, and those of the joint distribution where it has the input.
    Returns: SI half-width by quantity; only those above zero.
    """
    liquid = scene.liquid
    found = {
        "roughness": ASSUMED_ROUGHNESS_UNCERTAINTY * scene.tube.roughness,
        "draw_down_factor": ASSUMED_DRAW_DOWN_UNCERTAINTY * scene.tube.draw_down_factor,
        "density": liquid.density_uncertainty * liquid.density,
        "kinematic_viscosity": liquid.viscosity_uncertainty * liquid.kinematic_viscosity,
    }
    for stated in scene.uncertainty:
        value = nominal_value(scene=scene, quantity=stated.quantity)
        if value is not None:
            found[stated.quantity] = stated.absolute(value)
    fitted = zip(scene.fitted.quantities, scene.fitted.deviations.tolist(), strict=True)
    found |= {each.key: NORMAL_95 * size for each, size in fitted if each.key in UNCERTAIN_QUANTITIES}
    return {name: width for name, width in found.items() if width > 0}


def shifted(*, scene: Scene, quantity: str, change: float) -> Scene:
    """The scene with one of its quantities changed, as far as a device can have it.

    An interval that would reach zero or below reports "unknown"; a tenth of the value already shows that.
    """
    value = nominal_value(scene=scene, quantity=quantity)
    if value is None:
        raise ValueError(f"the scene has no {quantity}")
    low, high = 0.0 if quantity in _MAY_VANISH else 0.1 * value, math.inf
    if quantity == "length":
        low = max(low, sum(b.angle * b.radius for b in scene.tube.bends))
    if quantity == "hump_position":
        low, high = 0.0, 1.0
    if quantity == "hump_radius":
        high = scene.tube.port_radius
    if quantity == "port_radius":
        low = scene.tube.hump_radius or low
    if value <= 0:
        low = min(value, 0.0)
    return with_value(scene=scene, quantity=quantity, value=min(max(value + change, low), high))


def _table_of(quantity: str) -> str:
    if quantity not in UNCERTAIN_QUANTITIES:
        raise ValueError(f"{quantity!r} is none of {', '.join(UNCERTAIN_QUANTITIES)}")
    return UNCERTAIN_QUANTITIES[quantity]
