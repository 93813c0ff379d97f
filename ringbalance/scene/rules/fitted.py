"""Rules of the joint distribution in [fitted]."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final, get_args

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import Fault, closest
from ringbalance.scene.fitted import ERROR_NAME, MODEL, NO_UNIT, ErrorCause, FittedQuantity
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.toml import toml_text
from ringbalance.scene.units import DIMENSIONS

_PATH: Final = re.compile(r"(\w+)\.(\w+)(?:\[[01]\])?")
_ROUND_OFF: Final = 1e-6
"""Of a correlation: files have at least seven digits."""


def fitted_faults(reading: SceneReading) -> Iterator[Fault]:
    """One error for each quantity, unit or list of correlations that cannot be; else one for all of them."""
    quantities: tuple[FittedQuantity, ...] = reading.values.get("fitted.quantities", ())
    wrong = [
        (place, key, *said)
        for place, each in enumerate(quantities)
        for key, said in (
            ("quantity", _name(reading, each, [other.quantity for other in quantities[:place]])),
            ("unit", _unit(reading, each)),
            ("correlations", _row(each, place, len(quantities))),
        )
        if said is not None
    ]
    for place, key, problem, allowed in wrong:
        yield _fault(
            reading, f"quantities[{place + 1}].{key}", getattr(quantities[place], key), problem, allowed
        )
    if quantities and not wrong:
        yield from _matrix(reading, np.array([each.correlations for each in quantities]))


_Said = tuple[str, str] | None


def _name(reading: SceneReading, each: FittedQuantity, before: list[str]) -> _Said:
    """Error when the scene has no such uncertain quantity, or has it twice."""
    if each.quantity in before:
        return "it stands there twice", "each quantity once"
    match = ERROR_NAME.fullmatch(each.quantity)
    if match is not None and reading.schema is LIQUID_RING and match[1] in get_args(ErrorCause):
        return None
    if each.quantity.startswith(MODEL):
        causes = ", ".join(get_args(ErrorCause)) if reading.schema is LIQUID_RING else "none"
        return "there is no such error of a model", f'"{MODEL}" and one of: {causes}'
    path = _PATH.fullmatch(each.quantity)
    names = _uncertain(reading)
    if path is None or f"{path[1]}.{path[2]}" not in names:
        near = closest(each.quantity, names)
        hint = f' (did you mean "{near}"?)' if near else ""
        return f"it is no quantity that may be uncertain{hint}", ", ".join(names)
    if not reading.known(f"{path[1]}.{path[2]}"):
        return "the scene has no such value", f"a scene with [{path[1]}] {path[2]}"
    return None


def _uncertain(reading: SceneReading) -> list[str]:
    """Paths of all quantities that may be uncertain."""
    tables = reading.schema.tables.items()
    return [f"{name}.{key}" for name, table in tables for key, each in table.keys.items() if each.uncertain]


def _unit(reading: SceneReading, each: FittedQuantity) -> _Said:
    path = _PATH.fullmatch(each.quantity)
    if path is None or f"{path[1]}.{path[2]}" not in _uncertain(reading):
        allowed: tuple[str, ...] = (NO_UNIT,)
    else:
        dimension = reading.schema.key_at((path[1], path[2])).takes.dimension
        allowed = tuple(DIMENSIONS[dimension].units) if dimension else (NO_UNIT,)
    return None if each.unit in allowed else ("it is not a unit of that quantity", ", ".join(allowed))


def _row(each: FittedQuantity, place: int, count: int) -> _Said:
    allowed = f"{count} numbers from -1 to 1, number {place + 1} of them 1"
    if len(each.correlations) != count:
        return f"a list of {len(each.correlations)} numbers for {count} quantities", allowed
    if max(map(abs, each.correlations)) > 1 + _ROUND_OFF or abs(each.correlations[place] - 1) > _ROUND_OFF:
        return "these are no correlations", allowed
    return None


def _matrix(reading: SceneReading, correlations: FloatArray) -> Iterator[Fault]:
    """Symmetric, and no combination with a negative variance, within round-off."""
    apart = np.abs(correlations - correlations.T)
    if np.max(apart) > _ROUND_OFF:
        i, j = (int(k) + 1 for k in np.unravel_index(np.argmax(apart), apart.shape))
        problem = f"the correlation of quantity {i} with {j} is not that of {j} with {i}"
        value: Mapping[str, Any] | str = f"{correlations[i - 1, j - 1]:g} and {correlations[j - 1, i - 1]:g}"
        yield _fault(reading, "quantities", value, problem, "a symmetric table of correlations")
    elif (least := float(np.linalg.eigvalsh(correlations)[0])) < -_ROUND_OFF * len(correlations):
        problem = "some combination of these quantities has a negative variance"
        allowed = "correlations that can be true together: no eigenvalue below zero"
        yield _fault(reading, "quantities", f"smallest eigenvalue {least:.3g}", problem, allowed)


def _fault(reading: SceneReading, key: str, value: object, problem: str, allowed: str) -> Fault:
    text = toml_text(value) if not isinstance(value, tuple) else toml_text(list(value))
    return Fault(file=reading.file, table="fitted", key=key, value=text, problem=problem, allowed=allowed)
