"""Scene files: from TOML with units to frozen, validated, SI-only records, or every error at once."""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )

from typing import TYPE_CHECKING

from ringbalance.scene import deferred
from ringbalance.scene.describe import Row, scene_fault, scene_table
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.liquids import KnownLiquid, known_liquids, liquid_at
from ringbalance.scene.loader import bundled_scene, load_scene, read_scene, scene_from
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene, eccentric_scene, liquid_ring_scene
from ringbalance.scene.platform.files import write_whole

if TYPE_CHECKING:
    from ringbalance.scene.eccentric_models import EccentricScene

__all__ = [
    "AnyScene",
    "EccentricScene",
    "Fault",
    "KnownLiquid",
    "Row",
    "Scene",
    "SceneError",
    "bundled_scene",
    "eccentric_scene",
    "known_liquids",
    "liquid_at",
    "liquid_ring_scene",
    "load_scene",
    "read_scene",
    "scene_fault",
    "scene_from",
    "scene_table",
    "write_whole",
]


def __getattr__(name: str) -> object:
    """Records of the other balancer are loaded when they are first used."""
    if name != "EccentricScene":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = deferred.EccentricScene
    return found
