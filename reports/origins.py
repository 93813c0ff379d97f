"""Inputs by name and origin: which of them nobody gave, as a reader knows them."""

from __future__ import annotations

from typing import Final

from ringbalance.reports.prose import key_words
from ringbalance.reports.section import Record

_CERTAIN: Final = ("given", "measured")
_OWNERS: Final = {"lqr": "regulator", "masses": "eccentric masses"}
"""What a table of the scene file stands for, where that is another word."""
_ALONE: Final = ("accuracy", "environment", "run", "gas.ambient_pressure")
"""Tables, and a key, whose keys need no owner."""
_MESH: Final = "disc.mesh"


def resting(evidence: Record, *paths: str) -> str:
    """The inputs among some that are neither given nor measured, with their origin."""
    origins = evidence["scene"].get("origins") or {}
    by_origin: dict[str, list[str]] = {}
    for named in paths:
        # What follows from the mesh of an imported chamber rests on that.
        path = _MESH if origins.get(named) == "derived" else named
        if (origin := origins.get(path, "given")) not in _CERTAIN:
            by_origin.setdefault(origin, []).append(key_words(path))
    return "; ".join(f"{origin}: {', '.join(names)}" for origin, names in by_origin.items())


def named_with_origin(evidence: Record, path: str) -> str:
    """An input's name, with its origin where it is neither given nor measured."""
    origin = (evidence["scene"].get("origins") or {}).get(path, "given")
    return input_name(path) + ("" if origin in _CERTAIN else f" ({origin})")


def input_name(path: str) -> str:
    """The name of an input that a path in the scene file stands for, such as "bore of the tube"."""
    table, _, key = path.partition(".")
    owner = _OWNERS.get(table, table.replace("_", " "))
    if not key or path.startswith(_ALONE) or owner in key_words(path).split():
        return key_words(path) if key else path
    return f"{key_words(path)} of the {owner}"
