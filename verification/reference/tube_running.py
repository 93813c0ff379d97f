"""The velocity that a full tube takes by itself under a head, and its k there."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.physics.tube.loss import TubeLoss, tube_loss
from ringbalance.scene.models import Scene
from ringbalance.verification.reference.exact_chamber import wall_pressure_of

_VELOCITIES: Final = (1e-4, 3000.0, 401)
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
    reynolds: float
    flow_state: str

    @classmethod
    def under(cls, scene: Scene, *, head: float) -> Running:
        """The velocity with (k(u) + 1) u^2/2 = head, by interpolation in logarithms; the head grows with u.

        Args: `head`: H_A - H_C, m^2/s^2, positive.
        Raises: ValueError: a head beyond the velocities at hand.
        """
        curve = tube_curve(scene)
        heads = (curve.k.value + 1) * curve.velocity**2 / 2
        if not heads[0] <= head <= heads[-1]:
            raise ValueError(f"a head of {head:g} m^2/s^2 is outside the velocities of {_VELOCITIES[:2]} m/s")
        log_u = np.log(curve.velocity)
        at = float(np.interp(np.log(head), np.log(heads), log_u))
        velocity = float(np.exp(at))
        return cls(
            velocity=velocity,
            k=2 * head / velocity**2 - 1,
            half_width=float(np.interp(at, log_u, curve.k.uncertainty)),
            reynolds=float(np.exp(np.interp(at, log_u, np.log(curve.reynolds)))),
            flow_state=str(curve.flow_state[int(np.argmin(np.abs(log_u - at)))]),
        )


@lru_cache(maxsize=256)
def tube_curve(scene: Scene) -> TubeLoss:
    """k(u) of a scene's tube over all velocities that any scene may reach."""
    return tube_loss(scene, np.geomspace(*_VELOCITIES))


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
