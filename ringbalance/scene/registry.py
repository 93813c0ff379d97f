"""Registry of the kinds of balancers and of the paths of their parts.

`scene` contains no kind by itself.  `ringbalance/__init__.py` registers each kind with paths "module:name"
of its parts, which are imported for the first scene of the kind: lower packages import no higher one, and a
calibration never loads modules of eccentric masses.
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
    """Register a function by its path "module:name", which is imported at first use.

    For functions of a higher package, or of one that is slow to load.
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
