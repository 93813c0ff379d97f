"""A scene of either kind, and the way from it to the kind that a function needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene

if TYPE_CHECKING:
    from ringbalance.scene.eccentric_models import EccentricScene

AnyScene: TypeAlias = "Scene | EccentricScene"


def liquid_ring_scene(scene: AnyScene) -> Scene:
    """The same scene, when its balancer is a liquid ring. Raises: SceneError: it has another."""
    if isinstance(scene, Scene):
        return scene
    problem = "this needs the disc, liquid, tube and gas of a liquid-ring balancer"
    raise _wrong_kind(scene, problem, 'a scene with balancer = "liquid_ring"; simulate and compare take both')


def eccentric_scene(scene: AnyScene) -> EccentricScene:
    """The same scene, when its balancer is two eccentric masses. Raises: SceneError: it has another."""
    if not isinstance(scene, Scene):
        return scene
    problem = "this needs the rotor, masses and motor of driven eccentric masses"
    allowed = 'a scene with balancer = "eccentric_mass"; simulate and compare take both'
    raise _wrong_kind(scene, problem, allowed)


def _wrong_kind(scene: AnyScene, problem: str, allowed: str) -> SceneError:
    value = f'"{scene.balancer}"'
    fault = Fault(file=scene.file, table="", key="balancer", value=value, problem=problem, allowed=allowed)
    return SceneError([fault])
