"""Conversion of the half-widths in a law's file of version 4 to the table of version 5."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.half_widths import HalfWidths
from ringbalance.reduced_model.law.sides import half_width_table
from ringbalance.reduced_model.pieces.table import Table
from ringbalance.reduced_model.tube.regime import CLEARING_UNCERTAINTY, TubePath
from ringbalance.scene.arrays import FloatArray

_HEADS: Final = ("siphon", "hump", "return_hump")
_LEAST_HEAD_FACTOR: Final = 0.1
"""Smallest factor on a head by an error."""


def split(document: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Document of a calibrated law in the form of version 5, and the half-widths that it held.

    Raises: KeyError, TypeError, ValueError: a document that is no such law.
    """
    law = {key: value for key, value in document.items() if key not in ("inputs", "variants")}
    inputs = {name: float(width) for name, width in document["inputs"].items() if name != "type"}
    held: dict[str, Any] = {**inputs, "variants": document.get("variants", [])}
    law["path"] = dict(law["path"])
    for name in ("cavity_fitted", "clearing_fitted"):
        held[name] = bool(law["path"].pop(name, False))
    law["levels"], held["levels"] = _without(law["levels"], slice(3, 4))
    law["heads"] = dict(law["heads"])
    for name in _HEADS:
        if (table := law["heads"].get(name)) is not None:
            # In the whole tube's table the half-width of the share follows that of the loss.
            law["heads"][name], held[name] = _without(table, slice(3, 5))
    return law, held


def _without(table: Mapping[str, Any], numbers: slice) -> tuple[dict[str, Any], FloatArray]:
    """Table without some columns, and the first of the removed columns."""
    columns = np.reshape(np.array(table["columns"], dtype=np.float64), (-1, len(table["knots"])))
    return {**table, "columns": np.delete(columns, numbers, axis=0).ravel().tolist()}, columns[numbers][0]


def half_widths(law: CalibratedLaw, held: Mapping[str, Any], variants: Sequence[CalibratedLaw]) -> HalfWidths:
    """Table of half-widths, from laws at both sides of every uncertainty in the file."""
    sides = [replace(law, path=path) for path in _paths(law.path, held)]
    levels, scaled = law.levels, {"density": held["relative_density"], "speed": 2 * held["relative_speed"]}
    moved = (levels.with_column(0, levels.column(0) + sign * held["levels"]) for sign in (-1, 1))
    sides += [replace(law, levels=each) for each in moved]
    for name, size in scaled.items():
        for factor in (1 - size, 1 + size):
            path = replace(
                law.path,
                density=law.density * (factor if name == "density" else 1.0),
                port_pressure=law.path.port_pressure * factor,
                hump_pressure=law.path.column_pressure * factor if law.path.crest else None,
            )
            sides.append(replace(law, path=path, levels=replace(levels, columns=levels.columns * factor)))
    factors = (1 + sign * held["relative_gas_pressure"] for sign in (-1, 1))
    sides += [replace(law, gas_factor=law.gas_factor * factor) for factor in factors]
    ways = {name: way for name in _HEADS if (way := getattr(law.heads, name)) is not None}
    for sign in (-1, 1):
        lost: dict[str, Any] = {name: _lost(way, 1 + sign * held[name]) for name, way in ways.items()}
        sides.append(replace(law, heads=replace(law.heads, **lost)))
    return half_width_table([law, *sides, *variants], gas_pressure=0.0)


def _paths(path: TubePath, held: Mapping[str, Any]) -> Iterator[TubePath]:
    """Paths at both sides of each uncertainty that acts at the crest alone."""
    if not path.crest:
        return
    for name in ("hump_pressure", "vapour_pressure"):
        yield from (replace(path, **{name: getattr(path, name) + sign * held[name]}) for sign in (-1, 1))
    if path.released and not held["cavity_fitted"]:
        yield from (replace(path, released=end) for end in (0.0, 1.0))
    if path.froude_velocity and not held["clearing_fitted"]:
        factors = (1 - CLEARING_UNCERTAINTY, 1 + CLEARING_UNCERTAINTY)
        yield from (replace(path, froude_velocity=path.froude_velocity * factor) for factor in factors)


def _lost(way: Table, factor: FloatArray) -> Table:
    """Table of heads multiplied by a factor at each knot."""
    root = np.maximum(factor, _LEAST_HEAD_FACTOR) ** 0.125
    powers = [4, 5, 6, *(number % 2 for number in range(way.count - 3))]
    columns = [way.column(number) / root**power for number, power in enumerate(powers)]
    return Table(knots=way.knots * root, columns=np.concatenate(columns))
