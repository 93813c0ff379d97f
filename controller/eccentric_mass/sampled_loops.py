"""Poles of the drives' loops as they run: a voltage held over a step, on one mass with its drive.

Friction, the rotor's motion and the voltage limit are left out.  A loop is stable when all of its poles are
within the unit circle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import expm

from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.controller.eccentric_mass.strategy.lqr import lqr_gain
from ringbalance.controller.eccentric_mass.strategy.settings import track_model
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene

GAIN_MARGIN: Final = 2.0
"""Factor by which the gains that are recommended could be higher before a pole leaves the unit circle."""
_HALVINGS: Final = 60
_DECADES: Final = 30.0


@dataclass(frozen=True, kw_only=True)
class SampledLoop:
    """One loop of a drive."""

    radius: float
    """Largest magnitude of its poles."""
    recommended: float
    """The largest value of the loop's key with a gain margin of two: V s/rad, or q."""

    @property
    def stable(self) -> bool:
        """Whether it is stable."""
        return self.radius < 1


def speed_loop(scene: EccentricScene) -> SampledLoop:
    """The speed control of the friction stage, `friction_filter.speed_gain`.

    Returns: SampledLoop, with one pole a - gamma b.
    """
    move, push = _sampled(scene)
    pole, per_gain = float(move[1, 1]), float(push[1, 0]) * plant_parameters(scene).drive_gain
    radius = abs(pole - per_gain * scene.friction_filter.speed_gain)
    return SampledLoop(radius=radius, recommended=(1 + pole) / per_gain / GAIN_MARGIN)


def regulator_loop(scene: EccentricScene) -> SampledLoop:
    """The regulator of all other stages, `lqr.state_weight`."""
    low, high = -_DECADES, _DECADES
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _radius(scene, 10.0**middle, GAIN_MARGIN) < 1:
            low = middle
        else:
            high = middle
    return SampledLoop(radius=_radius(scene, scene.lqr.state_weight, 1.0), recommended=10.0**low)


def _radius(scene: EccentricScene, state_weight: float, factor: float) -> float:
    gain = lqr_gain(
        track=track_model(scene), state_weight=state_weight, input_weight=scene.lqr.input_weight
    ).gain
    move, push = _sampled(scene)
    feedback = factor * np.array([[gain[0, 0], gain[0, 2]]])
    return float(np.max(np.abs(np.linalg.eigvals(move - push @ feedback))))


def _sampled(scene: EccentricScene) -> tuple[FloatArray, FloatArray]:
    """F, shape (2, 2), and G, shape (2, 1), of angle and rate over a step with a held torque."""
    track = track_model(scene)
    whole = np.array(
        [[0.0, 1.0, 0.0], [0.0, -track.damping / track.inertia, 1 / track.inertia], [0.0, 0.0, 0.0]]
    )
    power = expm(whole * scene.lqr.step)
    return power[:2, :2], power[:2, 2:]
