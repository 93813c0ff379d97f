"""Scenes of any kind, narrowing to the kind that a function needs, and options in place of scene values."""

from __future__ import annotations

from dataclasses import replace
from typing import Final, TypeAlias, TypeVar

from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.units import FieldError, parse_quantity

AnyScene: TypeAlias = SceneFile
Kind = TypeVar("Kind", bound=SceneFile)


_REASON: Final = {"liquid_ring": ": its law is of a liquid in chambers"}
LIQUID_RING_ALONE: Final = "calibrate, extremes, plot, trade and verify"
"""Commands that need a scene of a liquid ring."""


def scene_as(kind: type[Kind], scene: SceneFile) -> Kind:
    """Narrow a scene to a kind. Raises: SceneError: it has another balancer."""
    if isinstance(scene, kind):
        return scene
    fault = Fault(
        file=scene.file,
        key="balancer",
        value=f'"{scene.balancer}"',
        problem=f"this needs a scene of the balancer {kind.balancer}{_REASON.get(kind.balancer, '')}",
        allowed=f'balancer = "{kind.balancer}"; all commands but {LIQUID_RING_ALONE} take any',
    )
    raise SceneError([fault])


def liquid_ring_scene(scene: SceneFile) -> Scene:
    """Narrow a scene to one of a liquid ring. Raises: SceneError: it has another balancer."""
    return scene_as(Scene, scene)


_ALLOWED: Final = 'a fraction below 1, such as 0.005 or "0.5 %"; 0 takes the finest of all that is expensive'


def with_tolerance(scene: Kind, tolerance: str | None) -> Kind:
    """The scene with the tolerance of an option, such as "0.5 %" or "0.005"; None: the same scene.

    Raises: SceneError: no such tolerance.
    """
    return scene if tolerance is None else replace(scene, tolerance=read_tolerance(tolerance))


def read_tolerance(text: str) -> float:
    """Relative tolerance of an option's text. Raises: SceneError: no fraction from 0 to below 1."""
    try:
        value = float(text)
    except ValueError:
        try:
            value = parse_quantity(text, "share")
        except FieldError as error:
            raise _error(text, error.problem) from error
    if not 0 <= value < 1:
        raise _error(text, "it must be at least 0 and below 1")
    return abs(value)


def _error(value: str, problem: str) -> SceneError:
    return SceneError.of_option(option="--tolerance", value=value, problem=problem, allowed=_ALLOWED)
