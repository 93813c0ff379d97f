"""Values of a scene's records by path, such as "rotor.mass" or "masses.friction_arm[0]"; SI."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Final, TypeVar

from ringbalance.scene.origins import SceneFile

SomeScene = TypeVar("SomeScene", bound=SceneFile)
_PATH: Final = re.compile(r"(\w+)\.(\w+)(?:\[(\d+)\])?")


def value_at(scene: SceneFile, path: str) -> float:
    """One value."""
    return float(raw_value_at(scene, path))


def raw_value_at(scene: SceneFile, path: str) -> Any:
    """One value as it is, a text, a whole list, or None."""
    table, key, entry = _placed(path)
    value = getattr(getattr(scene, table), key)
    return value if entry is None else value[entry]


def with_values_at(scene: SomeScene, values: Mapping[str, Any]) -> SomeScene:
    """A copy with values in place of its own, text and whole lists as they are; nothing is checked again."""
    for path, value in values.items():
        if isinstance(value, int | float):
            scene = moved_at(scene, path, partial(_first, value))
        else:
            table, key, _ = _placed(path)
            changed: dict[str, Any] = {table: replace(getattr(scene, table), **{key: value})}
            scene = replace(scene, **changed)
    return scene


def moved_at(scene: SomeScene, path: str, move: Callable[[float], float]) -> SomeScene:
    """A copy with one value moved; without an entry, as in "masses.friction_arm", every value of a list."""
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


def _first(value: float, _: float) -> float:
    return value


def _placed(path: str) -> tuple[str, str, int | None]:
    match = _PATH.fullmatch(path)
    if match is None:
        raise ValueError(f"{path!r} is no path of a scene")
    return match[1], match[2], None if match[3] is None else int(match[3])
