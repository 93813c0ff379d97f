"""Many designs of one kind at once: a scene whose numbers are arrays, and both sides of every input.

Functions of geometry, tube and regime broadcast over a scene's records, so that a scene of arrays passes
through them as one of plain numbers does; arrays with further axes, such as the fill, have the designs on the
last axis.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, cached_property
from operator import attrgetter
from typing import Any

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.errors import Uncertainty, with_places
from ringbalance.scene.models import Scene

_NUMBERS = (float, np.ndarray)


@dataclass(frozen=True, kw_only=True, eq=False)
class Designs:
    """Designs that differ only in numbers: shapes, kinds and modelled terms are common to all."""

    scene: Scene
    """Common scene; numbers that differ are arrays of shape (n,)."""
    size: int
    """Number of designs, n."""

    @classmethod
    def of(cls, scene: Scene, values: Mapping[str, FloatArray]) -> Designs:
        """Designs that differ from a scene in some of its numbers; nothing is checked.

        Args: `values`: SI, by path such as "tube.bore", arrays of one shape (n,).
        """
        (size,) = {np.shape(value) for value in values.values()} or {(1,)}
        tables: dict[str, dict[str, Any]] = {}
        for path, value in values.items():
            table, key = path.split(".")
            tables.setdefault(table, {})[key] = np.asarray(value)
        changed = {table: replace(getattr(scene, table), **keys) for table, keys in tables.items()}
        return cls(scene=replace(scene, **changed), size=size[0])

    @classmethod
    def stacked(cls, scenes: Sequence[Scene], *, each: int = 1) -> Designs:
        """The designs of scenes that differ only in numbers, in the order of the scenes.

        Args: `each`: number of designs n in each scene, whose numbers are then arrays of shape (n,).
        """
        return cls(scene=_stacked(scenes, each), size=each * len(scenes))

    def take(self, rows: IntArray) -> Designs:
        """Some of the designs, by number."""
        tables = {
            table: replace(record, **{key: _taken(getattr(record, key), rows) for key in keys})
            for table, keys in self.varied.items()
            for record in (getattr(self.scene, table),)
        }
        part = Designs(scene=replace(self.scene, **tables), size=rows.size)
        part.__dict__["varied"] = self.varied
        return part

    @cached_property
    def varied(self) -> Mapping[str, tuple[str, ...]]:
        """Keys whose numbers differ between the designs, by table."""
        tables = {
            f.name: tuple(key.name for key in fields(table) if _varies(getattr(table, key.name)))
            for f in fields(self.scene)
            if is_dataclass(table := getattr(self.scene, f.name))
        }
        return {table: keys for table, keys in tables.items() if keys}


@cache
def _fields(kind: type[Any]) -> tuple[tuple[str, ...], Callable[[Any], tuple[Any, ...]]]:
    """Names of a record's fields, and a function that returns their values; no names for any other type."""
    names = tuple(f.name for f in fields(kind)) if is_dataclass(kind) else ()
    return names, attrgetter(*names) if len(names) > 1 else lambda record: tuple(
        getattr(record, n) for n in names
    )


def _stacked(values: Sequence[Any], each: int) -> Any:
    first = values[0]
    if all(value is first for value in values) and (each == 1 or not _varies(first)):
        return first
    if isinstance(first, _NUMBERS):
        if all(isinstance(value, float) and value == first for value in values):
            return first
        if each == 1 and all(isinstance(value, float) for value in values):
            return np.array(values)
        return np.concatenate([np.broadcast_to(value, each) for value in values])
    if isinstance(first, ChamberGeometry):
        return first
    names, values_of = _fields(first.__class__)
    if names:
        parts = zip(names, zip(*map(values_of, values), strict=True), strict=True)
        return replace(first, **{name: _stacked(part, each) for name, part in parts})
    if isinstance(first, tuple):
        return tuple(_stacked(parts, each) for parts in zip(*values, strict=True))
    return first


def _varies(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return True
    if isinstance(value, tuple):
        return any(map(_varies, value))
    if not is_dataclass(value) or isinstance(value, ChamberGeometry):
        return False
    return any(_varies(getattr(value, f.name)) for f in fields(value))


def _taken(value: Any, rows: IntArray) -> Any:
    """The value with its arrays reduced to some rows."""
    if isinstance(value, np.ndarray):
        return value[rows]
    if isinstance(value, tuple):
        return tuple(_taken(part, rows) for part in value)
    if not is_dataclass(value) or isinstance(value, type):
        return value
    return replace(value, **{f.name: _taken(getattr(value, f.name), rows) for f in fields(value)})


def _alike(first: Any, second: Any) -> bool:
    """True for two values that differ only in numbers."""
    if first is second or (isinstance(first, _NUMBERS) and isinstance(second, _NUMBERS)):
        return True
    if type(first) is not type(second):
        return False
    names, values_of = _fields(first.__class__)
    if names and not isinstance(first, ChamberGeometry):
        return all(map(_alike, values_of(first), values_of(second)))
    if isinstance(first, tuple):
        return len(first) == len(second) and all(map(_alike, first, second))
    return bool(np.all(first == second))


def alike(scenes: Sequence[Scene]) -> list[list[int]]:
    """Indices of scenes, grouped so that those of a group differ only in numbers."""
    batches: list[list[int]] = []
    for number, scene in enumerate(scenes):
        same = next((rows for rows in batches if _alike(scenes[rows[0]], scene)), None)
        if same is None:
            batches.append([number])
        else:
            same.append(number)
    return batches


def in_batches(
    scenes: Sequence[Scene], function: Callable[[Designs], FloatArray], *, each: int | None = None
) -> FloatArray:
    """Values of a function of designs for scenes that may differ in more than numbers; one call per group.

    Args: `function`: returns an array whose last axis runs over the designs. `each`: number of designs n
        in every scene, whose numbers are then arrays of shape (n,).
    Returns: Array over the scenes, in their order, on its last axis; with `each`, a further last axis of n.
    """
    parts, batches = [], alike(scenes)
    for rows in batches:
        value = function(Designs.stacked([scenes[i] for i in rows], each=each or 1))
        # One value holds for all rows where no number that the function uses differs between them.
        all_rows = np.broadcast_to(value, (*value.shape[:-1], len(rows) * (each or 1)))
        parts.append(all_rows.reshape(*value.shape[:-1], len(rows), -1))
    order = np.argsort(np.concatenate(batches))
    values = np.concatenate(parts, axis=-2)[..., order, :]
    return values[..., 0] if each is None else values


def changes_of(
    scene: Scene,
    function: Callable[[Designs], FloatArray],
    errors: Sequence[Uncertainty],
    *,
    each: int | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Values of a scene and their changes with each uncertainty, from one batch of 2 m + 1 rows.

    Each uncertain quantity moves to its 2.5 and 97.5 % quantiles, because a derivative at the nominal value
    misses curvature within the interval.  Dependent quantities, such as the velocity at which k is evaluated,
    follow unless the function fixes them.
    Args: `function`: as for `in_batches`. `each`: as for `in_batches`.
    Returns: The scene's values, and their changes at the low and the high side, shape (m, 2, ...); NaN
        where a quantity does not exist at a side, zero for an uncertainty that changes nothing in the scene.
    Source: ASME V&V 20-2009, one input at a time.
    """
    numbers = [number for number, error in enumerate(errors) if error.change]
    base = with_places(scene, errors)
    scenes = [base, *(side for number in numbers for side in errors[number].sides(base))]
    values = in_batches(scenes, function, each=each or 1)
    nominal, moved = values[..., 0, :], np.moveaxis(values[..., 1:, :], -2, 0)
    changes = np.zeros((len(errors), 2, *nominal.shape))
    changes[numbers] = moved.reshape(-1, 2, *nominal.shape) - nominal
    return (nominal, changes) if each is not None else (nominal[..., 0], changes[..., 0])
