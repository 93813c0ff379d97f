"""What reading and describing a kind of scene needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.keys.schema import Schema
from ringbalance.scene.registry import registered_scene


class _Reads(Protocol):
    def __call__(
        self, document: Mapping[str, Any], *, file: str, folder: Path, derived: Mapping[str, Any]
    ) -> tuple[Reading, tuple[Fault, ...]]: ...


@dataclass(frozen=True, kw_only=True)
class SceneKind:
    """A kind of scene file."""

    schema: Schema
    """Its keys, and the record that they become."""
    read: _Reads
    """Values of a document with the defaults that follow, and everything that is wrong with them."""
    main: tuple[tuple[str, ...], ...]
    """Paths of the values that stand for the scene in a terminal, line by line."""
    usual_units: Mapping[str, str] = field(default_factory=dict)
    """By dimension, of values whose declaration names no unit to show; else the SI unit."""


def scene_kind(name: str) -> SceneKind:
    """The kind of scene of a registered balancer. Raises: KeyError: none of that name is registered."""
    kind: SceneKind = registered_scene(name)
    return kind
