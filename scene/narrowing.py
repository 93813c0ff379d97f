"""A scene of either kind, and the way from it to the kind that a function needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene

if TYPE_CHECKING:
    from ringbalance.scene.eccentric_models import EccentricScene

AnyScene: TypeAlias = "Scene | EccentricScene"
CALIBRATED: Final = "calibrated"
"""The law of a liquid ring where no other is asked for."""


def liquid_ring_scene(scene: AnyScene) -> Scene:
    """The same scene, when its balancer is a liquid ring. Raises: SceneError: it has another."""
    if isinstance(scene, Scene):
        return scene
    problem = "this needs the disc, liquid, tube and gas of a liquid-ring balancer"
    raise _wrong_kind(scene, problem, "liquid_ring")


def eccentric_scene(scene: AnyScene) -> EccentricScene:
    """The same scene, when its balancer is two eccentric masses. Raises: SceneError: it has another."""
    if not isinstance(scene, Scene):
        return scene
    problem = "this needs the rotor, masses and motor of driven eccentric masses"
    raise _wrong_kind(scene, problem, "eccentric_mass")


def checked_law(scene: AnyScene, law: str) -> None:
    """Raises: SceneError: the option `--law` of a scene whose balancer has no flow law."""
    if not isinstance(scene, Scene) and law != CALIBRATED:
        problem = f"the balancer of {scene.source} has no flow law"
        raise SceneError.of_option(
            option="--law", value=law, problem=problem, allowed="this option with a liquid ring alone"
        )


def _wrong_kind(scene: AnyScene, problem: str, kind: str) -> SceneError:
    value = f'"{scene.balancer}"'
    allowed = f'a scene with balancer = "{kind}"; report, simulate, tune, compare and fit take both'
    fault = Fault(file=scene.file, key="balancer", value=value, problem=problem, allowed=allowed)
    return SceneError([fault])
