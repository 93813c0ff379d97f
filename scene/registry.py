"""The kinds of balancers that there are, and where the parts of each are found.

`scene` knows no kind by itself.  The face registers each by one line, with the places of its parts as
"module:name", which are imported when the first such scene is met: imports keep pointing down, and a
calibration never loads what eccentric masses need.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True, kw_only=True)
class _Places:
    scene: str
    balancer: str


_FUNCTIONS: dict[str, str] = {}
_REGISTERED: dict[str, _Places] = {}
"""By the word of the key `balancer`; the first is the default of a scene file."""


def register(name: str, *, scene: str, balancer: str) -> None:
    """Make a kind of balancer known to every command.

    Args: `name`: word of the scene's key `balancer`. `scene`: place "module:name" of its
        `ringbalance.scene.kinds.SceneKind`. `balancer`: place of its class, of the shape of
        `ringbalance.controller.balancer.Balancer`.
    """
    _REGISTERED[name] = _Places(scene=scene, balancer=balancer)


def balancers() -> tuple[str, ...]:
    """Words that the key `balancer` may have, the default first."""
    return tuple(_REGISTERED)


def registered_scene(name: str) -> Any:
    """What was registered as the kind of scene of a balancer. Raises: KeyError: there is no such balancer."""
    return _at(_REGISTERED[name].scene)


def balancer_class(name: str) -> Any:
    """What makes the balancer of a scene of that kind. Raises: KeyError: there is no such balancer."""
    return _at(_REGISTERED[name].balancer)


def register_function(name: str, *, place: str) -> None:
    """Make a function known that methods of a scene use, by its place "module:name"; it imports scenes."""
    _FUNCTIONS[name] = place


def registered_function(name: str) -> Any:
    """The function that was registered under a name. Raises: KeyError: none was."""
    return _at(_FUNCTIONS[name])


def _at(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
