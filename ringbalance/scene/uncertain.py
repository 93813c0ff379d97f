"""Quantities whose uncertainty may be given, and changes of them, alone or along a joint distribution.

With C = L L' the covariance in [fitted], a quantity y computed from the scene has the variance J C J' = sum
(dy/d(column of L))^2: each column is a direction, one standard deviation long, independent of the others.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final, get_args

import numpy as np

from ringbalance.scene.arrays import plain
from ringbalance.scene.chamber_file.record import STRETCHED
from ringbalance.scene.fitted import LARGEST_ERROR, MODEL, ErrorCause, Fitted, ModelError, error_part
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.models import Scene, Tube

NORMAL_95: Final = 1.959963984540054
"""Expanded uncertainty (95 %) of a normal distribution in standard deviations."""
_ASSUMED_ROUGHNESS_UNCERTAINTY: Final = 0.5
"""Relative expanded uncertainty (95 %) of a roughness for which the scene states none."""
_ASSUMED_DRAW_DOWN_UNCERTAINTY: Final = 0.3
"""Relative expanded uncertainty (95 %) of the depth at which gas enters a port, where the scene states none.

Two theories of this depth differ by up to 18 % where the port is as wide as the liquid is deep; the depth is
somewhat larger in moving liquid than in liquid at rest; no measurement of such a port is known.
"""
_MAY_VANISH: Final = frozenset({"roughness", "extra_loss"})
"""Quantities of the tube that may become zero; others keep at least a tenth of their value."""
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
    """SI value of a key of `UNCERTAIN_QUANTITIES`; None when the scene does not model the term.

    None, too, for a dimension along which the mesh of a chamber cannot be stretched.
    """
    if quantity in SHAPE and quantity not in STRETCHED and scene.disc.geometry is not None:
        return None
    value: float | None = getattr(getattr(scene, _table_of(quantity)), quantity)
    return value


def with_value(*, scene: Scene, quantity: str, value: float) -> Scene:
    """Copy a scene with one of `UNCERTAIN_QUANTITIES` changed, SI; nothing is checked again.

    The mesh of a chamber is stretched to a changed dimension.
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
    """Absolute expanded uncertainties (95 %) of a scene's inputs, without correlations.

    The joint distribution takes precedence over stated uncertainties, and these over assumed ones and the
    liquid's own.
    Returns: SI half-width by quantity; only those above zero.
    """
    liquid = scene.liquid
    widths = {
        "roughness": _ASSUMED_ROUGHNESS_UNCERTAINTY * scene.tube.roughness,
        "draw_down_factor": _ASSUMED_DRAW_DOWN_UNCERTAINTY * scene.tube.draw_down_factor,
        "density": liquid.density_uncertainty * liquid.density,
        "kinematic_viscosity": liquid.viscosity_uncertainty * liquid.kinematic_viscosity,
    }
    for stated in scene.uncertainty:
        value = nominal_value(scene=scene, quantity=stated.quantity)
        if value is not None:
            widths[stated.quantity] = stated.absolute(value)
    fitted = zip(scene.fitted.quantities, scene.fitted.deviations.tolist(), strict=True)
    widths |= {each.key: NORMAL_95 * size for each, size in fitted if each.key in UNCERTAIN_QUANTITIES}
    return {name: width for name, width in widths.items() if np.any(np.greater(width, 0))}


def shifted_in_turn(scene: Scene, changes: Mapping[str, float]) -> tuple[Scene, tuple[str, ...]]:
    """The scene with changed quantities, SI, within physical limits; names of those that met a limit.

    A quantity that cannot be zero keeps at least a tenth of its value.
    """
    tube, clipped = scene.tube, []
    values: dict[str, dict[str, float]] = {}
    for quantity, change in changes.items():
        table, value = _table_of(quantity), nominal_value(scene=scene, quantity=quantity)
        if value is None:
            raise ValueError(f"the scene has no {quantity}")
        moved = _moved_value(tube, quantity, value, change)
        if np.any(moved != value + change):
            clipped.append(quantity)
        if table == "tube":
            # The tube's radii limit each other.
            tube = replace(tube, **{quantity: moved})
        elif quantity in SHAPE and scene.disc.geometry is not None:
            scene = with_value(scene=scene, quantity=quantity, value=moved)
        else:
            values.setdefault(table, {})[quantity] = moved
    tables = {table: replace(getattr(scene, table), **changed) for table, changed in values.items()}
    return replace(scene, tube=tube, **tables), tuple(clipped)


def _moved_value(tube: Tube, quantity: str, value: Any, change: Any) -> Any:
    """A changed value within physical limits; an array where the scene is many designs."""
    low: Any = 0.0 if quantity in _MAY_VANISH else 0.1 * value
    high: Any = math.inf
    if quantity == "length":
        low = np.maximum(low, sum(b.angle * b.radius for b in tube.bends))
    if quantity == "hump_position":
        low, high = 0.0, 1.0
    if quantity == "hump_radius":
        high = tube.port_radius
    if quantity == "port_radius" and tube.hump_radius is not None:
        low = tube.hump_radius
    if isinstance(value, float) and isinstance(change, float):
        return float(min(max(value + change, low if value > 0.0 else min(value, 0.0)), high))
    low = np.where(np.less_equal(value, 0), np.minimum(value, 0.0), low)
    moved = np.minimum(np.maximum(value + change, low), high)
    return moved if moved.ndim else float(moved)


def _table_of(quantity: str) -> str:
    if quantity not in UNCERTAIN_QUANTITIES:
        raise ValueError(f"{quantity!r} is none of {', '.join(UNCERTAIN_QUANTITIES)}")
    return UNCERTAIN_QUANTITIES[quantity]


def without_fitted(scene: Scene) -> Scene:
    """The scene with its models as published and its inputs independent, for comparing models with models.

    Fitted corrections hold only for the models that were fitted.
    """
    return replace(scene, tube=replace(scene.tube, model_errors=()), fitted=Fitted())


def independent_half_widths(scene: Scene) -> Mapping[str, float]:
    """`half_widths` of the inputs that are not fitted together."""
    together = {each.key for each in scene.fitted.quantities}
    return {name: width for name, width in half_widths(scene).items() if name not in together}


def fitted_causes(scene: Scene) -> frozenset[str]:
    """Causes of model errors in the joint distribution; those of k only if it has both parts."""
    names = {each.quantity for each in scene.fitted.quantities}
    return frozenset(
        cause
        for cause in get_args(ErrorCause)
        if {f"{MODEL}{cause}"} <= names or {f"{MODEL}{cause}, {part}" for part in ("even", "odd")} <= names
    )


def moved(scene: Scene, changes: Mapping[str, float]) -> Scene:
    """The scene with changes of inputs, SI, and of errors of models, in standard deviations."""
    errors = {name: change for name, change in changes.items() if name.startswith(MODEL)}
    inputs = {name: change for name, change in changes.items() if name not in errors}
    scene = shifted_in_turn(scene, inputs)[0] if inputs else scene
    return with_model_errors(scene, errors) if errors else scene


def with_model_errors(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """The scene with larger errors of its models, by standard deviations, within `LARGEST_ERROR`.

    A cause keeps its place in the list, so that scenes differ only in numbers.
    """
    sums: dict[ErrorCause, list[Any]] = {}
    for each in scene.tube.model_errors:
        parts = sums.setdefault(each.cause, [0.0, 0.0])
        parts[0], parts[1] = parts[0] + each.even, parts[1] + each.odd
    for name, change in changes.items():
        cause, part = error_part(name)
        parts = sums.setdefault(cause, [0.0, 0.0])
        now = parts[part]
        if isinstance(now, float) and isinstance(change, float):
            largest = max(LARGEST_ERROR, abs(now))
            parts[part] = min(max(now + change, -largest), largest)
        else:
            most = np.maximum(LARGEST_ERROR, np.abs(now))
            parts[part] = plain(np.clip(now + change, -most, most))
    errors = tuple(ModelError(cause=c, even=even, odd=odd) for c, (even, odd) in sums.items())
    return replace(scene, tube=replace(scene.tube, model_errors=errors))
