"""Where values stand in a scene file, and how they are written there."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from ringbalance.scene.describe import usual_unit
from ringbalance.scene.keys.fields import Reader
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.registry import balancers
from ringbalance.scene.units import DIMENSIONS, format_quantity, unit_factor, unit_of

_DIGITS: Final = 9
"""Of a saved number: far more than any fit has, so that saving changes nothing."""
_ENTRY: Final = re.compile(r"(\w+)\.(\w+)(?:\[(\d)\])?")
_ENTRIES: Final = 2
"""Of a list, one for each mass."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a value stands in a scene file, and how it is written there."""

    table: str
    key: str
    entry: int | None
    """Of a list; None for a single value."""
    by_table: bool
    """Whether [uncertainty] has a table for each table."""
    dimension: str | None
    unit: str
    """Empty for a number without unit."""

    def written(self, value: float) -> str | float:
        """A value as it stands in the file."""
        number = self.number(value)
        return number if self.dimension is None else f"{number!r} {self.unit}"

    def number(self, value: float) -> float:
        """A value, SI, in the unit."""
        if self.dimension is None:
            return float(f"{value:.{_DIGITS}g}")
        return float(format_quantity(value, self.dimension, self.unit, digits=_DIGITS).split(" ")[0])

    def difference(self, value: float) -> float:
        """A difference of two values, SI, in the unit."""
        return float(f"{value / (unit_factor(self.unit) if self.unit else 1.0):.{_DIGITS}g}")

    def put(self, document: dict[str, Any], value: float) -> bool:
        """Write a value, SI; whether that changes the document."""
        content, written = document.setdefault(self.table, {}), self.written(value)
        before = content.get(self.key)
        if self.entry is None:
            content[self.key] = written
        else:
            both = list(before or [self.written(0.0)] * _ENTRIES)
            both[self.entry] = written
            content[self.key] = both
        return bool(content[self.key] != before)


def place_of(path: str, document: Mapping[str, Any]) -> Place:
    """The place of a path such as "tube.bore" or "masses.friction_arm[0]".

    Raises: ValueError: a scene file has no such value.
    """
    schema = scene_kind(document.get("balancer", balancers()[0])).schema
    match = _ENTRY.fullmatch(path)
    if match is None or match[1] not in schema.tables or match[2] not in schema.tables[match[1]].keys:
        raise ValueError(f"a scene file has no value {path!r}")
    table, key, entry = match.groups()
    takes = schema.key_at((table, key)).takes
    dimension = takes.dimension if isinstance(takes, Reader) else None
    here = document.get(table, {}).get(key)
    return Place(
        table=table,
        key=key,
        entry=None if entry is None else int(entry),
        by_table=table in schema.tables["uncertainty"].keys,
        dimension=dimension,
        unit=_unit(here, path, dimension),
    )


def _unit(here: object, path: str, dimension: str | None) -> str:
    """The unit that the file has there, else the one in which such a value is described, else the SI unit."""
    if dimension is None:
        return ""
    one = here[0] if isinstance(here, list) and here else here
    return (
        (unit_of(one) if isinstance(one, str) else "")
        or usual_unit(path)
        or next(iter(DIMENSIONS[dimension].units))
    )
