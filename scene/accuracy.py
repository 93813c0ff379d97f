"""The tolerance of a run in place of the scene file's: the options `--tolerance` and `--models finest`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal, TypeVar

from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.units import FieldError, parse_quantity

if TYPE_CHECKING:
    from ringbalance.scene.eccentric_models import EccentricScene

Models = Literal["finest"]
FINEST: Final = 0.0
"""Tolerance at which every term is modelled that has a model."""
ALLOWED: Final = 'a fraction above 0 and below 1, such as 0.005 or "0.5 %"'

SomeScene = TypeVar("SomeScene", Scene, "EccentricScene", "Scene | EccentricScene")


def with_tolerance(
    scene: SomeScene, *, tolerance: str | None = None, models: Models | None = None
) -> SomeScene:
    """The scene with another tolerance; the same scene where neither option is given.

    Args: `tolerance`: such as "0.5 %" or "0.005". `models`: "finest" models every term that has a model.
    Raises: SceneError: no such tolerance, or both options.
    """
    if models is not None:
        if tolerance is not None:
            raise _error(
                tolerance,
                "--models finest models every term, whatever the tolerance",
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
