"""Scene files: TOML with units read into frozen, validated, SI-only records, or all errors reported together.

The names below are loaded when they are first used, so that registering a kind of balancer loads no reader.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ringbalance.scene.describe import scene_fault as scene_fault
    from ringbalance.scene.describe import scene_table as scene_table
    from ringbalance.scene.faults import Fault as Fault
    from ringbalance.scene.faults import SceneError as SceneError
    from ringbalance.scene.liquids import KnownLiquid as KnownLiquid
    from ringbalance.scene.liquids import known_liquids as known_liquids
    from ringbalance.scene.liquids import liquid_at as liquid_at
    from ringbalance.scene.loader import bundled_scene as bundled_scene
    from ringbalance.scene.loader import load_scene as load_scene
    from ringbalance.scene.loader import read_scene as read_scene
    from ringbalance.scene.loader import scene_from as scene_from
    from ringbalance.scene.models import Scene as Scene
    from ringbalance.scene.narrowing import AnyScene as AnyScene
    from ringbalance.scene.narrowing import liquid_ring_scene as liquid_ring_scene
    from ringbalance.scene.platform.files import write_whole as write_whole

_NAMES = {
    "describe": ("scene_fault", "scene_table"),
    "faults": ("Fault", "SceneError"),
    "liquids": ("KnownLiquid", "known_liquids", "liquid_at"),
    "loader": ("bundled_scene", "load_scene", "read_scene", "scene_from"),
    "models": ("Scene",),
    "narrowing": ("AnyScene", "liquid_ring_scene"),
    "platform.files": ("write_whole",),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}
__all__ = sorted(_HOME)

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
