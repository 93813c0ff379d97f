"""Inputs moved together: the independent ones by themselves, fitted ones along their joint distribution.

With C = L L' the covariance in [fitted], a quantity y of the scene has the variance J C J' =
sum (dy/d(column of L))^2: each column is a direction, one standard deviation long, independent of the others.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, Final, TypeVar, get_args

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.fitted import MODEL, Fitted
from ringbalance.scene.model_errors import LARGEST_ERROR, ErrorCause, ModelError
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import NORMAL_95, UNCERTAIN_QUANTITIES, half_widths, shifted

FITTED: Final = "fitted"
"""Name of all inputs that were fitted together, where effects are listed by input."""
DIRECTION: Final = f"{FITTED} "
"""What the names of directions begin with; a number follows."""

Sides = tuple[Scene, Scene]


def without_fitted(scene: Scene) -> Scene:
    """The scene with its models as published and its inputs independent, for comparing models with models.

    Corrections are those of the models that were fitted, and hold for no others.
    """
    return replace(scene, tube=replace(scene.tube, model_errors=()), fitted=Fitted())


def independent_half_widths(scene: Scene) -> Mapping[str, float]:
    """`half_widths` of the inputs that are not fitted together."""
    together = {each.key for each in scene.fitted.quantities}
    return {name: width for name, width in half_widths(scene).items() if name not in together}


def input_sides(
    scene: Scene, *, among: Collection[str] = UNCERTAIN_QUANTITIES, errors: bool = True
) -> Mapping[str, Sides]:
    """The scene with each independent input, or direction of fitted ones, lower and higher.

    By its expanded uncertainty (95 %), as far as a device can have it. Effects combine by the root of the sum
    of squares.
    Args: `among`: inputs that count. `errors`: whether fitted errors of models count too.
    Returns: Both sides by input, or by direction, "fitted 1" and so on.
    """
    widths = independent_half_widths(scene)
    alone = {
        name: (_moved(scene, {name: -width}), _moved(scene, {name: width}))
        for name, width in widths.items()
        if name in among
    }
    return alone | direction_sides(scene, among=among, errors=errors)


def direction_sides(
    scene: Scene,
    *,
    among: Collection[str] = UNCERTAIN_QUANTITIES,
    errors: bool = True,
    turned: FloatArray | None = None,
) -> dict[str, Sides]:
    """The scene moved to both sides along each direction of its fitted inputs, as `input_sides`.

    Args: `turned`: orthonormal columns, other directions as combinations of these.
    """
    keys = [each.key for each in scene.fitted.quantities]
    which = [i for i, key in enumerate(keys) if (errors if key.startswith(MODEL) else key in among)]
    columns = NORMAL_95 * scene.fitted.directions(np.array(which, dtype=np.int64))
    changes = (columns if turned is None else columns @ turned).T.tolist()
    moves = [dict(zip((keys[i] for i in which), change, strict=True)) for change in changes]
    return {
        f"{DIRECTION}{place + 1}": (
            _moved(scene, {name: -change for name, change in move.items()}),
            _moved(scene, move),
        )
        for place, move in enumerate(moves)
    }


Effect = TypeVar("Effect", float, FloatArray)


def combined(effects: Mapping[str, Effect]) -> dict[str, Effect]:
    """Effects by input with those of all directions as one, "fitted", by the root of their squares' sum."""
    alone: dict[str, Any] = {name: e for name, e in effects.items() if not name.startswith(DIRECTION)}
    together = [effect for name, effect in effects.items() if name.startswith(DIRECTION)]
    if not together:
        return alone
    whole: Any = np.sqrt(sum(np.square(effect) for effect in together))
    return alone | {FITTED: whole if whole.ndim else float(whole)}


def fitted_causes(scene: Scene) -> frozenset[str]:
    """Causes of errors of models that the joint distribution holds, both parts of those of k."""
    names = {each.quantity for each in scene.fitted.quantities}
    return frozenset(
        cause
        for cause in get_args(ErrorCause)
        if {f"{MODEL}{cause}"} <= names or {f"{MODEL}{cause}, {part}" for part in ("even", "odd")} <= names
    )


def _moved(scene: Scene, changes: Mapping[str, float]) -> Scene:
    """The scene with changes of inputs, SI, and of errors of models, in standard deviations."""
    for name, change in changes.items():
        if name.startswith(MODEL):
            scene = with_model_error(scene, name, change)
        else:
            scene = shifted(scene=scene, quantity=name, change=change)
    return scene


def with_model_error(scene: Scene, name: str, change: float) -> Scene:
    """The scene with one error of its models larger, by standard deviations, within what models allow."""
    error, tube = ModelError.named(name, 1.0), scene.tube
    now = sum(
        each.even * error.even + each.odd * error.odd
        for each in tube.model_errors
        if each.cause == error.cause
    )
    largest = max(LARGEST_ERROR, abs(now))
    error = ModelError.named(name, min(max(now + change, -largest), largest) - now)
    return replace(scene, tube=replace(tube, model_errors=(*tube.model_errors, error)))
