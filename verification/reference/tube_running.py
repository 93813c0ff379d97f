"""The velocity that a full tube takes by itself under a head, and its k there."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.selection.range_flow import TABLES, velocity_under_head
from ringbalance.scene.models import Scene
from ringbalance.verification.reference.exact_chamber import wall_pressure_of

_LEAST: Final = 0.05
"""Smallest head asked for, in units of the gas pressure's: below it lies a stall."""


@dataclass(frozen=True, kw_only=True)
class Running:
    """A full tube at its own velocity."""

    velocity: float
    """m/s."""
    k: float
    half_width: float
    """95 %, of k."""
    exit_loss: float
    """What a laminar exit adds to k."""
    reynolds: float
    flow_state: str


def running_tube(scene: Scene, *, head: float) -> Running:
    """The velocity with (k(u) + 1) u^2/2 = head, m^2/s^2, above zero."""
    return running_tubes(scene, (head,))[0]


@lru_cache(maxsize=64)
def running_tubes(scene: Scene, heads: tuple[float, ...]) -> tuple[Running, ...]:
    """The same under several heads at once."""
    found = tube_loss(scene, velocity_under_head(scene, loss=TABLES, head=heads))
    leaving = found.terms.get("exit", np.zeros(len(heads)))
    return tuple(
        Running(
            velocity=float(found.velocity[i]),
            k=float(found.k.value[i]),
            half_width=float(found.k.uncertainty[i]),
            exit_loss=float(leaving[i]),
            reynolds=float(found.reynolds[i]),
            flow_state=str(found.flow_state[i]),
        )
        for i in range(len(heads))
    )


def driving_head(scene: Scene, *, share: float) -> float:
    """Head between two chambers, H = [p0 + p_wall(x) - p_wall(x_max - x)]/rho, m^2/s^2.

    At least a twentieth of the gas pressure's own, short of a stall.
    Args: `share`: fill of the driven chamber in units of the largest.
    """
    fills = np.array([share, 1 - share]) * scene.disc.max_fill_ratio
    wall = wall_pressure_of(scene, fills)
    driving = scene.gas.pressure + float(wall[0] - wall[1])
    return max(driving, _LEAST * scene.gas.pressure) / scene.liquid.density


def with_bore(scene: Scene, factor: float) -> Scene:
    """A scene whose bore is multiplied; a bend's radius is at least the bore, so a wide tube still bends."""
    tube, bore = scene.tube, factor * scene.tube.bore
    bends = tuple(dataclasses.replace(bend, radius=max(bend.radius, bore)) for bend in tube.bends)
    return dataclasses.replace(scene, tube=dataclasses.replace(tube, bore=bore, bends=bends))
