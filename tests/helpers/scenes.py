"""Scenes of tests, with other values in their tables than the checks of a scene file would let pass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from typing import Any, TypeVar, cast

import ringbalance
from ringbalance.scene.models import Scene

Record = TypeVar("Record")


def with_tables(scene: Record, **tables: Any) -> Record:
    """A copy of a scene with values in its tables, unchecked: `with_tables(scene, tube={"bore": 1e-3})`.

    Args: `tables`: values by key in a table, or a whole table.
    """
    changes = {}
    for name, values in tables.items():
        table = getattr(scene, name)
        inside = is_dataclass(table) and isinstance(values, Mapping)
        changes[name] = replace(table, **values) if inside else values
    copy: Record = replace(scene, **changes)  # type: ignore[type-var]
    return copy


def bundled(name: str, values: Mapping[str, object] | None = None) -> Scene:
    """A bundled scene of a liquid ring with other values, checked."""
    scene = cast("Scene", ringbalance.load_scene(ringbalance.bundled_scene(name)))
    return scene.with_values(values) if values else scene
