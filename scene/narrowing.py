"""A scene of either kind, the way to the kind that a function needs, and options in place of what it has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene

if TYPE_CHECKING:
    from ringbalance.scene.eccentric_models import EccentricScene
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, TypeVar

from ringbalance.scene.units import FieldError, parse_quantity

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


Models = Literal["finest"]
FINEST: Final = 0.0
"""Tolerance at which all that is expensive is the finest."""
ALLOWED: Final = 'a fraction above 0 and below 1, such as 0.005 or "0.5 %"'

SomeScene = TypeVar("SomeScene", Scene, "EccentricScene", "Scene | EccentricScene")


def with_tolerance(
    scene: SomeScene, *, tolerance: str | None = None, models: Models | None = None
) -> SomeScene:
    """The scene with another tolerance; the same scene where neither option is given.

    Args: `tolerance`: such as "0.5 %" or "0.005". `models`: "finest" for a tolerance of zero.
    Raises: SceneError: no such tolerance, or both options.
    """
    if models is not None:
        if tolerance is not None:
            raise _error(
                tolerance,
                "--models finest is a tolerance of zero",
                "one of the two options",
            )
        return replace(scene, tolerance=FINEST)
    return scene if tolerance is None else replace(scene, tolerance=_read_tolerance(tolerance))


def _read_tolerance(text: str) -> float:
    """Relative tolerance of an option's text. Raises: SceneError: no fraction above 0 and below 1."""
    try:
        value = float(text)
    except ValueError:
        try:
            value = parse_quantity(text, "share")
        except FieldError as error:
            raise _error(text, error.problem, ALLOWED) from error
    if not 0 < value < 1:
        raise _error(text, "it must be above 0 and below 1", ALLOWED)
    return value


def _error(value: str, problem: str, allowed: str) -> SceneError:
    return SceneError.of_option(option="--tolerance", value=value, problem=problem, allowed=allowed)
