"""The tube's loss by models: the paper's k = 50, `fluids`, `fluids` with rotation, finite-element tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.bends import straight_length, turbulent_bend_loss
from ringbalance.physics.tube.ends import turbulent_entrance_loss
from ringbalance.physics.tube.friction import friction_factor
from ringbalance.physics.tube.numbers import reynolds_number, rotation_reynolds_number
from ringbalance.physics.tube.rotation import (
    STRAIGHT_CRITICAL_REYNOLDS,
    critical_reynolds,
    turbulent_friction_ratio,
)
from ringbalance.physics.tube.rotation_table import ito_nanbu_laminar
from ringbalance.physics.tube.state import tube_state
from ringbalance.reduced_model.paper.formulas import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.tube.path import crest_span, head_behind_crest, loss_along, to_crest_end
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene, Tube

CONSTANT: Final = "k = 50"
CORRELATIONS: Final = "fluids"
ROTATING: Final = "fluids with rotation"
TABLES: Final = "finite-element tables"
LOSSES: Final = (CONSTANT, CORRELATIONS, ROTATING, TABLES)
"""In order of increasing cost."""
FORMULAS: Final = {CONSTANT: 1, CORRELATIONS: 20, ROTATING: 60, TABLES: 260}
"""Formulas per call, as counted work; the tables' look-ups among them."""
_TURBULENT_PROFILE: Final = 1.06
_LEAST_KL: Final = 220.0
_MOST_STEPS: Final = 60
_ROUND_OFF: Final = 1e-14


@dataclass(frozen=True, kw_only=True)
class Loss:
    """Loss of the tube at velocities; arrays of one shape."""

    k: FloatArray
    upstream_k: FloatArray
    """Between the giving chamber and the crest."""
    kinetic_factor: FloatArray
    """alpha."""
    along: FloatArray
    """What of k is spread evenly along the path."""


LossFunction = Callable[[Scene, Tube, FloatArray], Loss]


def loss_at(scene: Scene, *, loss: str, velocity: npt.ArrayLike, tube: Tube | None = None) -> Loss:
    """Loss of a scene's tube by one model.

    Args: `loss`: one of `LOSSES`. `velocity`: u, m/s, any shape, positive. `tube`: in place of the scene's,
        such as the same one from its other end.
    Returns: Loss; a scene that prescribes k has that k on every model but `CONSTANT`, which then has it
        too.
    Raises: ValueError: a model that does not exist.
    """
    if loss not in _FUNCTIONS:
        raise ValueError(f"loss must be one of {', '.join(LOSSES)}, not {loss!r}")
    used, u = tube or scene.tube, np.asarray(velocity, dtype=np.float64)
    if scene.tube.drag_coefficient is not None:
        return _constant(scene, used, u)
    return _FUNCTIONS[loss](scene, used, u)


def _constant(scene: Scene, tube: Tube, velocity: FloatArray) -> Loss:
    fixed = scene.tube.drag_coefficient
    k = np.full(velocity.shape, PAPER_DRAG_COEFFICIENT if fixed is None else fixed)
    return Loss(k=k, upstream_k=crest_span(tube)[1] * k, kinetic_factor=np.ones(velocity.shape), along=k)


def _correlations(scene: Scene, tube: Tube, velocity: FloatArray) -> Loss:
    re = _reynolds(scene, tube, velocity)
    f = friction_factor(reynolds=re, relative_roughness=tube.roughness / tube.bore)
    return _summed(tube, f, straight_length(tube=tube) / tube.bore * f)


def _rotating(scene: Scene, tube: Tube, velocity: FloatArray) -> Loss:
    re, rough = _reynolds(scene, tube, velocity), tube.roughness / tube.bore
    rotation = _rotation(scene, tube)
    # At the lower end of its range, Kl = 220, the recalled formula is one; below, it would rise again.
    kl = np.maximum(rotation * re, _LEAST_KL)
    laminar = np.maximum(ito_nanbu_laminar(kl=kl), 1.0)
    f = friction_factor(reynolds=re, relative_roughness=rough)
    turning = friction_factor(
        reynolds=re,
        relative_roughness=rough,
        laminar_ratio=laminar,
        turbulent_ratio=turbulent_friction_ratio(reynolds=re, rotation_reynolds=rotation).value,
        critical_ratio=float(critical_reynolds(rotation_reynolds=rotation) / STRAIGHT_CRITICAL_REYNOLDS),
    )
    along = straight_length(tube=tube) / tube.bore * f + tube.length / tube.bore * (turning - f)
    return _summed(tube, f, along)


def _summed(tube: Tube, friction: FloatArray, along: FloatArray) -> Loss:
    """Entrance as in turbulent flow, bends, friction with or without rotation, extra; a turbulent profile."""
    bends = [turbulent_bend_loss(bend=b, bore=tube.bore, friction_factor=friction) for b in tube.bends]
    entrance = turbulent_entrance_loss(tube=tube)[0]
    share = crest_span(tube)[1]
    before = [k for i, k in enumerate(bends) if (i + 0.5) / len(bends) < share]
    spread = along + tube.extra_loss
    return Loss(
        k=np.asarray(entrance + spread + sum(bends)),
        upstream_k=np.asarray(entrance + share * spread + sum(before)),
        kinetic_factor=np.full(along.shape, _TURBULENT_PROFILE),
        along=np.asarray(spread),
    )


def _tables(scene: Scene, tube: Tube, velocity: FloatArray) -> Loss:
    state = tube_state(tube=tube, liquid=scene.liquid, angular_velocity=scene.rotor.speed, velocity=velocity)
    return Loss(
        k=state.k,
        upstream_k=state.upstream_loss(tube=to_crest_end(tube)),
        kinetic_factor=np.asarray(state.kinetic_factor),
        along=loss_along(state.terms),
    )


def _reynolds(scene: Scene, tube: Tube, velocity: FloatArray) -> FloatArray:
    return reynolds_number(
        velocity=velocity, bore=tube.bore, kinematic_viscosity=scene.liquid.kinematic_viscosity
    )


def _rotation(scene: Scene, tube: Tube) -> float:
    return rotation_reynolds_number(
        angular_velocity=scene.rotor.speed,
        bore=tube.bore,
        kinematic_viscosity=scene.liquid.kinematic_viscosity,
    )


_FUNCTIONS: Final[dict[str, LossFunction]] = {
    CONSTANT: _constant,
    CORRELATIONS: _correlations,
    ROTATING: _rotating,
    TABLES: _tables,
}


def head_at(
    scene: Scene, *, loss: str, velocity: FloatArray, to_crest: bool, tube: Tube | None = None
) -> FloatArray:
    """Head of a full tube, (k + 1) u^2/2, or of its column up to the crest's lowest pressure, m^2/s^2."""
    at = loss_at(scene, loss=loss, velocity=velocity, tube=tube)
    kinetic = velocity**2 / 2
    if not to_crest:
        return np.asarray((at.k + 1) * kinetic)
    behind = head_behind_crest(tube=tube or scene.tube, along=at.along * kinetic, square=scene.rotor.speed**2)
    return np.asarray((at.kinetic_factor + at.upstream_k) * kinetic + behind)


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
