"""The kinds of balancers that there are, and where the parts of each are found.

`scene` knows no kind by itself.  The face registers each by one line, with the paths of its parts as
"module:name", which are imported when the first such scene is met: imports keep pointing down, and a
calibration never loads what eccentric masses need.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, Literal

Part = Literal["scene", "balancer", "function"]

_PATHS: dict[tuple[Part, str], str] = {}
"""Path by part and name of a kind of balancer, or by name of a function; the first kind is the default."""


def register(name: str, *, scene: str, balancer: str) -> None:
    """Make a kind of balancer known to every command.

    Args: `name`: word of the scene's key `balancer`. `scene`: path "module:name" of its
        `ringbalance.scene.kinds.SceneKind`. `balancer`: path of its class, of the shape of
        `ringbalance.controller.balancer.Balancer`.
    """
    _PATHS["scene", name], _PATHS["balancer", name] = scene, balancer


def register_function(name: str, *, path: str) -> None:
    """Make a function known by its path "module:name", which is imported when it is first asked for.

    It is one of a room above, or of a package that is slow to load.
    """
    _PATHS["function", name] = path


def balancers() -> tuple[str, ...]:
    """Words that the key `balancer` may have, the default first."""
    return tuple(name for part, name in _PATHS if part == "scene")


def registered(part: Part, name: str) -> Any:
    """Object registered under a name. Raises: KeyError: nothing was."""
    return imported(_PATHS[part, name])


def imported(path: str) -> Any:
    """Import the object at a path "module:name"."""
    module, _, attribute = path.partition(":")
    return getattr(import_module(module), attribute)
