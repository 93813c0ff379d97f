"""Rules of the joint distribution in [fitted]."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, get_args

import numpy as np

from ringbalance.scene.faults import Fault, did_you_mean
from ringbalance.scene.fitted import ERROR_NAME, MODEL, NO_UNIT, ErrorCause, FittedQuantity
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.toml import toml_text
from ringbalance.scene.units import DIMENSIONS

_PATH: Final = re.compile(r"(\w+)\.(\w+)(?:\[[01]\])?")
_ROUND_OFF: Final = 1e-6
"""Accepted rounding error of a correlation; files state at least seven digits."""


def fitted_faults(reading: SceneReading) -> Iterator[Fault]:
    """One error for each wrong quantity, unit or list of correlations; else at most one for the matrix."""
    quantities: tuple[FittedQuantity, ...] = reading.values.get("fitted.quantities", ())
    if not quantities:
        return
    tables = reading.schema.tables.items()
    uncertain = {
        f"{name}.{key}": each for name, table in tables for key, each in table.keys.items() if each.uncertain
    }
    count, faulty = len(quantities), False
    for number, each in enumerate(quantities, start=1):
        match = _PATH.fullmatch(each.quantity)
        path = f"{match[1]}.{match[2]}" if match else ""
        dimension = uncertain[path].takes.dimension if path in uncertain else None
        units = tuple(DIMENSIONS[dimension].units) if dimension else (NO_UNIT,)
        before = [other.quantity for other in quantities[: number - 1]]
        largest = max(map(abs, each.correlations), default=0.0)
        wrong: dict[str, tuple[str, str] | None] = {
            "quantity": _quantity_error(reading, each.quantity, before, list(uncertain))
        }
        if each.unit not in units:
            wrong["unit"] = "it is not a unit of that quantity", ", ".join(units)
        allowed = f"{count} numbers from -1 to 1, number {number} of them 1"
        if len(each.correlations) != count:
            wrong["correlations"] = (
                f"a list of {len(each.correlations)} numbers for {count} quantities",
                allowed,
            )
        elif largest > 1 + _ROUND_OFF or abs(each.correlations[number - 1] - 1) > _ROUND_OFF:
            wrong["correlations"] = "these are no correlations", allowed
        for key, error in wrong.items():
            if error is not None:
                faulty = True
                yield _fault(reading, f"quantities[{number}].{key}", getattr(each, key), *error)
    if faulty:
        return
    # Symmetric, and no combination with a negative variance, within round-off.
    correlations = np.array([each.correlations for each in quantities])
    apart = np.abs(correlations - correlations.T)
    if np.max(apart) > _ROUND_OFF:
        i, j = (int(k) + 1 for k in np.unravel_index(np.argmax(apart), apart.shape))
        problem = f"the correlation of quantity {i} with {j} is not that of {j} with {i}"
        value = f"{correlations[i - 1, j - 1]:g} and {correlations[j - 1, i - 1]:g}"
        yield _fault(reading, "quantities", value, problem, "a symmetric table of correlations")
    elif (least := float(np.linalg.eigvalsh(correlations)[0])) < -_ROUND_OFF * count:
        problem = "some combination of these quantities has a negative variance"
        allowed = "correlations that can be true together: no eigenvalue below zero"
        yield _fault(reading, "quantities", f"smallest eigenvalue {least:.3g}", problem, allowed)


def _quantity_error(
    reading: SceneReading, name: str, before: list[str], uncertain: list[str]
) -> tuple[str, str] | None:
    """Error of a name that is no uncertain quantity of the scene, or that occurs twice."""
    if name in before:
        return "it stands there twice", "each quantity once"
    causes = get_args(ErrorCause) if reading.schema is LIQUID_RING else ()
    match = ERROR_NAME.fullmatch(name)
    if match is not None and match[1] in causes:
        return None
    if name.startswith(MODEL):
        return "there is no such error of a model", f'"{MODEL}" and one of: {", ".join(causes) or "none"}'
    path = _PATH.fullmatch(name)
    if path is None or f"{path[1]}.{path[2]}" not in uncertain:
        return f"it is no quantity that may be uncertain{did_you_mean(name, uncertain)}", ", ".join(uncertain)
    if not reading.known(f"{path[1]}.{path[2]}"):
        return "the scene has no such value", f"a scene with [{path[1]}] {path[2]}"
    return None


def _fault(reading: SceneReading, key: str, value: object, problem: str, allowed: str) -> Fault:
    text = toml_text(list(value) if isinstance(value, tuple) else value)
    return Fault(file=reading.file, table="fitted", key=key, value=text, problem=problem, allowed=allowed)
