"""The tube's loss by models: the paper's k = 50, `fluids`, `fluids` with rotation, finite-element tables."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.state import TubeState, tube_state
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.tube.heads import crest_head
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import CORRELATION, FINEST_MODELS, LEFT_OUT, TubeModels

CONSTANT: Final = "k = 50"
CORRELATIONS: Final = "fluids"
ROTATING: Final = "fluids with rotation"
TABLES: Final = "finite-element tables"
CONSTANT_MODELS: Final = TubeModels(
    constant=PAPER_DRAG_COEFFICIENT, roughness=LEFT_OUT, rotation=LEFT_OUT, bends=LEFT_OUT, ends=LEFT_OUT
)
MODELS: Final = {
    CONSTANT: CONSTANT_MODELS,
    CORRELATIONS: TubeModels(rotation=LEFT_OUT, bends=CORRELATION, ends=CORRELATION),
    ROTATING: TubeModels(rotation=CORRELATION, bends=CORRELATION, ends=CORRELATION),
    TABLES: FINEST_MODELS,
}
LOSSES: Final = tuple(MODELS)
"""In order of increasing cost."""
_MOST_STEPS: Final = 60
_ROUND_OFF: Final = 1e-14


def with_loss(scene: Scene, loss: str) -> Scene:
    """The scene with one model of its tube's loss; where it prescribes k, with that k and alpha = 1 on all.

    Args: `loss`: one of `LOSSES`.
    Raises: ValueError: a model that does not exist.
    """
    if loss not in MODELS:
        raise ValueError(f"loss must be one of {', '.join(LOSSES)}, not {loss!r}")
    models = MODELS[loss] if scene.tube.drag_coefficient is None else CONSTANT_MODELS
    return replace(scene, tube=replace(scene.tube, models=models))


def loss_at(scene: Scene, *, loss: str, velocity: npt.ArrayLike) -> TubeState:
    """Loss of a scene's tube by one model of `LOSSES`, at velocities above zero, m/s, any shape.

    Raises: ValueError: a model that does not exist.
    """
    return tube_state(with_loss(scene, loss), velocity)


def head_at(scene: Scene, *, loss: str, velocity: FloatArray, to_crest: bool) -> FloatArray:
    """Head of a full tube, (k + 1) u^2/2, or of its column up to the crest's lowest pressure, m^2/s^2."""
    state = loss_at(scene, loss=loss, velocity=velocity)
    if not to_crest:
        return np.asarray((state.k + 1) * velocity**2 / 2)
    return crest_head(scene=scene, tube=scene.tube, state=state, velocity=velocity)


def velocity_under_head(
    scene: Scene, *, loss: str, head: npt.ArrayLike, to_crest: bool = False
) -> FloatArray:
    """Velocity of a full tube under a head, (k(u) + 1) u^2/2 = H, by bracketed secants in ln u and ln H.

    Args: `loss`: one of `LOSSES`. `head`: H, m^2/s^2, above zero, any shape. `to_crest`: whether the head
        acts up to the siphon crest alone: (alpha + k_up) u^2/2 = H.
    Source: definition of k; the head grows with u, so there is one root.
    """
    target = np.asarray(head, dtype=np.float64)
    low, high = np.full(target.shape, np.log(1e-8)), np.log(np.sqrt(2 * target) * 1.001 + 1e-6)
    y, slope, before = high, np.full(target.shape, 2.0), None
    for _ in range(_MOST_STEPS):
        found = head_at(scene, loss=loss, velocity=np.exp(y), to_crest=to_crest)
        excess = np.log(found / target)
        low, high = np.where(excess < 0, y, low), np.where(excess < 0, high, y)
        if before is not None:
            step, rise = y - before[0], excess - before[1]
            slope = np.where(np.abs(step) > 1e-9, rise / np.where(step == 0, 1.0, step), slope)
        before, ahead = (y, excess), y - excess / np.maximum(slope, 0.1)
        y = np.where((ahead > low) & (ahead < high), ahead, (low + high) / 2)
        y = np.where(np.abs(excess) < _ROUND_OFF, before[0], y)
        if np.all(np.abs(excess) < _ROUND_OFF):
            break
    return np.asarray(np.exp(y))
