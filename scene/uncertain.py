"""The scene quantities whose uncertainty may be given, and how to change one of them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ringbalance.scene.chamber_file.record import STRETCHED
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.models import InputUncertainty, Scene

if TYPE_CHECKING:
    from ringbalance.scene.eccentric_models import EccentricScene

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
_PATH: Final = re.compile(r"(\w+)\.(\w+)(?:\[([01])\])?")
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


def _table_of(quantity: str) -> str:
    if quantity not in UNCERTAIN_QUANTITIES:
        raise ValueError(f"{quantity!r} is none of {', '.join(UNCERTAIN_QUANTITIES)}")
    return UNCERTAIN_QUANTITIES[quantity]


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
