"""Flow through the tube alone, at rest: (k + 1) rho u^2/2 = p, Q = S u, k without rotation."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.device import Device, Models, device_of
from ringbalance.physics.tube.state import tube_state
from ringbalance.physics.tube.uncertainty import with_errors
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import FINEST_MODELS

_ROUNDS: Final = 12
_STEP: Final = 1e-4
"""In ln u, of the slope of ln (k + 1)."""
_DONE: Final = 1e-6
"""Change of ln u after which the next one, its square, is round-off."""


def predict(scene: Scene, observations: Observations, models: Models) -> FloatArray:
    """Q, m^3/s, shape (n,), by Newton's method in ln u.

    Source: definition of k, Eq. 14 of the liquid-ring paper, between two reservoirs at rest.
    """
    return device_of(scene, models).once(observations, _flow_rate)


def _flow_rate(device: Device, observations: Observations) -> FloatArray:
    scene = device.scene
    head = observations.columns["pressure_difference"] / scene.liquid.density
    log_u = np.log(np.sqrt(2 * head / (_loss(scene, np.sqrt(head)) + 1)))
    for _ in range(_ROUNDS):
        both = np.log(_loss(scene, np.exp(np.concatenate([log_u, log_u + _STEP]))) + 1)
        loss, nearby = both[: head.size], both[head.size :]
        change = (np.log(2 * head) - loss - 2 * log_u) / (2 + (nearby - loss) / _STEP)
        log_u = log_u + np.clip(change, -1.0, 1.0)
        if np.max(np.abs(change)) < _DONE:
            break
    return np.asarray(scene.tube.area * np.exp(log_u))


def _loss(scene: Scene, velocity: FloatArray) -> FloatArray:
    """k of the tube at rest, by the finest models: the scene's are chosen for its own velocities."""
    tube = replace(scene.tube, models=replace(FINEST_MODELS, errors=scene.tube.models.errors))
    still = replace(scene, rotor=replace(scene.rotor, speed=0.0))
    state = tube_state(still, velocity, tube=tube)
    return with_errors(tube=tube, state=state).k
