"""The kinds of balancers that there are, and where the parts of each are found.

`scene` knows no kind by itself.  The face registers each by one line, with the places of its parts as
"module:name", which are imported when the first such scene is met: imports keep pointing down, and a
calibration never loads what eccentric masses need.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, Literal

Part = Literal["scene", "balancer", "function"]

_PLACES: dict[tuple[Part, str], str] = {}
"""Of a part of a kind of balancer, or of a function by its name; the first kind is a scene file's default."""


def register(name: str, *, scene: str, balancer: str) -> None:
    """Make a kind of balancer known to every command.

    Args: `name`: word of the scene's key `balancer`. `scene`: place "module:name" of its
        `ringbalance.scene.kinds.SceneKind`. `balancer`: place of its class, of the shape of
        `ringbalance.controller.balancer.Balancer`.
    """
    _PLACES["scene", name], _PLACES["balancer", name] = scene, balancer


def register_function(name: str, *, place: str) -> None:
    """Make a function known by its place "module:name", which is imported when it is first asked for.

    It is one of a room above, or of a package that is slow to load.
    """
    _PLACES["function", name] = place


def balancers() -> tuple[str, ...]:
    """Words that the key `balancer` may have, the default first."""
    return tuple(name for part, name in _PLACES if part == "scene")


def registered(part: Part, name: str) -> Any:
    """Object registered under a name. Raises: KeyError: nothing was."""
    return imported(_PLACES[part, name])


def imported(place: str) -> Any:
    """Import what stands at a place "module:name"."""
    module, _, attribute = place.partition(":")
    return getattr(import_module(module), attribute)
