"""Vibration of the rotor with known unbalances, V = V0 + K U exp(j angle), K = kappa exp(-j lag).

V0 is that of the series and not of the scene: it is fitted with every parameter, and known beforehand to
nobody.  Source: Eq. 23 of the liquid-ring paper.
"""

from __future__ import annotations

import numpy as np

from ringbalance.controller.rotor import influence
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.vibration import parts, spread_out, vector_covariance, vectors
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


def measured(observations: Observations) -> FloatArray:
    """Vibrations, real and then imaginary parts, m, shape (2 n,)."""
    return parts(vectors(observations))


def predict(scene: Scene, observations: Observations) -> FloatArray:
    """Their change by the trial weights, likewise."""
    k = influence(coefficient=scene.rotor.influence_coefficient, lag_angle=scene.rotor.lag_angle)
    unbalance = observations.columns["unbalance"] * np.exp(1j * observations.columns["angle"])
    return parts(np.asarray(k * unbalance, dtype=np.complex128))


def covariance(observations: Observations) -> FloatArray:
    """Of the measured parts, shape (2 n, 2 n); unit where the noise is not given."""
    return spread_out(vector_covariance(observations, given=noise_given(observations)))


def noise_given(observations: Observations) -> bool:
    """Whether the vibrations have their uncertainty."""
    return "amplitude" in observations.uncertainty


def free(observations: Observations) -> FloatArray:
    """Effect of the two parts of every series' V0, shape (2 n, 2 series)."""
    names = np.unique(observations.series)
    belongs = (observations.series[:, None] == names[None, :]).astype(np.float64)
    return np.kron(np.eye(2), belongs)
