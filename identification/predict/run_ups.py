"""Vibration of a rotor over its speed, both eccentric masses clamped where they stand at the start."""

from __future__ import annotations

import numpy as np

from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.controller.eccentric_mass.plant.whirl import steady_whirl
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.vibration import parts, spread_out, vector_covariance, vectors
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene


def measured(observations: Observations) -> FloatArray:
    """Vibrations in the rotor's frame, real and then imaginary parts, m, shape (2 n,)."""
    return parts(vectors(observations))


def predict(scene: EccentricScene, observations: Observations) -> FloatArray:
    """The same at constant speed, as in a run-up that is slow against the decay of the rotor's motion."""
    plant, angles = plant_parameters(scene), scene.masses.initial_angle
    speeds = observations.columns["speed"].tolist()
    return parts(np.array([steady_whirl(plant, speed, angles) for speed in speeds], dtype=np.complex128))


def covariance(observations: Observations) -> FloatArray:
    """Of the measured parts, shape (2 n, 2 n); unit where the noise is not given."""
    return spread_out(vector_covariance(observations, given=noise_given(observations)))


def noise_given(observations: Observations) -> bool:
    """Whether the vibrations have their uncertainty."""
    return "amplitude" in observations.uncertainty


def free(observations: Observations) -> FloatArray:
    """Nothing beside the parameters is fitted."""
    return np.zeros((2 * len(observations), 0))
