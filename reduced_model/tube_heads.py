"""The tube's loss as tables of head against velocity, which a flow law can invert in microseconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube_loss import TubeLoss, tube_loss
from ringbalance.physics.tube_state import tube_state, upstream_loss
from ringbalance.reduced_model.hermite import HermiteTable
from ringbalance.reduced_model.hermite_fit import level_table, refined_table
from ringbalance.reduced_model.hump_path import reversed_tube
from ringbalance.scene.models import Scene, Tube

FloatArray = npt.NDArray[np.float64]

TABLE_VELOCITIES: Final = (1e-5, 1e3)
"""m/s; below, the flow creeps and the head is proportional to u; above, to a power of u."""
TABLE_ERROR: Final = 1e-9
"""Aimed at, relative, between the nodes."""
_SPREAD_NODES: Final = 2049


@dataclass(frozen=True, kw_only=True, eq=False)
class TubeHeads:
    """Heads of the full tube over ln u (u in m/s), natural logarithms of m^2/s^2."""

    head: HermiteTable
    """ln((k + 1) u^2/2): between the chambers."""
    hump_head: HermiteTable | None
    """ln((alpha + k_up) u^2/2): from the driven chamber to the hump; None without a hump."""
    return_hump_head: HermiteTable | None
    """The same from the opposite chamber, for reverse flow."""
    spread: HermiteTable
    """95 % half-width of k over k + 1."""
    hump_spread: HermiteTable
    """95 % half-width of k_up over alpha + k_up."""
    interpolation_error: float
    """Largest relative error of the head tables found between their nodes."""


def velocity_of(*, table: HermiteTable, head: npt.ArrayLike, where: npt.NDArray[np.bool_]) -> FloatArray:
    """Velocity that belongs to a head.

    Args:
        table: ln u to ln head.
        head: m^2/s^2, any shape.
        where: of that shape; elsewhere the velocity is zero and the head may be anything.

    Returns:
        u, m/s, the shape of `head`.
    """
    safe = np.where(where, head, 1.0)
    return np.where(where, np.exp(table.inverse(np.log(safe))), 0.0)


def tube_heads(scene: Scene) -> TubeHeads:
    """Tabulate the heads of a scene's tube.

    Args:
        scene: the scene.

    Returns:
        TubeHeads.

    Raises:
        ValueError: arcs of bends longer than the tube.

    Source: definition of k; the hump's energy balance with the profile's kinetic-energy factor alpha.
    """
    start, stop = (float(v) for v in np.log(TABLE_VELOCITIES))
    tube, returning = scene.tube, reversed_tube(scene.tube)
    wanted = [(tube, False)]
    if tube.hump_radius is not None:
        wanted += [(tube, True), (returning, True)]
    tables, errors = zip(*(_head_table(scene, t, hump, start, stop) for t, hump in wanted), strict=True)
    loss = _loss(scene, np.exp(np.linspace(start, stop, _SPREAD_NODES)))
    share = np.where(loss.k.value > 0, loss.upstream_k / np.where(loss.k.value > 0, loss.k.value, 1.0), 1.0)
    spread = loss.k.uncertainty / (loss.k.value + 1)
    hump_spread = loss.k.uncertainty * share / (loss.kinetic_factor + loss.upstream_k)
    return TubeHeads(
        head=tables[0],
        hump_head=tables[1] if len(tables) > 1 else None,
        return_hump_head=tables[2] if len(tables) > 1 else None,
        spread=level_table(start=start, stop=stop, value=spread),
        hump_spread=level_table(start=start, stop=stop, value=hump_spread),
        interpolation_error=max(errors),
    )


def _loss(scene: Scene, velocity: FloatArray) -> TubeLoss:
    return tube_loss(
        tube=scene.tube,
        liquid=scene.liquid,
        angular_velocity=scene.rotor.speed,
        velocity=velocity,
        inputs=scene.uncertainty,
    )


def _head_table(
    scene: Scene, tube: Tube, hump: bool, start: float, stop: float
) -> tuple[HermiteTable, float]:
    def log_head(log_velocity: FloatArray) -> FloatArray:
        state = tube_state(
            tube=tube,
            liquid=scene.liquid,
            angular_velocity=scene.rotor.speed,
            velocity=np.exp(log_velocity),
        )
        factor = state.kinetic_factor + upstream_loss(tube=tube, state=state) if hump else state.k + 1
        return np.asarray(np.log(factor / 2) + 2 * log_velocity, dtype=np.float64)

    table, error = refined_table(function=log_head, start=start, stop=stop, tolerance=TABLE_ERROR)
    if np.any(np.diff(table.value) <= 0):
        raise ValueError("the tube's head does not grow with the velocity: its loss terms are inconsistent")
    return table, error
