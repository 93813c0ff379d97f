"""Vibration of the rotor with known unbalances, V = V0 + K U exp(j angle), K = kappa exp(-j lag).

V0 is that of the series and not of the scene: it is fitted with every parameter, and known beforehand to
nobody.  Where no phase was measured it cannot be eliminated: then it is the scene's vibration at the start,
and its amplitude and its phase are parameters.  Only its phase against K U matters, so that the phase and the
lag are not identified by themselves.  Source: Eq. 23 of the liquid-ring paper.
"""

from __future__ import annotations

import cmath

import numpy as np

from ringbalance.controller.rotor import influence
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.vibration import parts
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.models import Scene


def predict(scene: Scene, observations: Observations) -> FloatArray:
    """Change of the vibration by the trial weights, real and then imaginary parts, m, shape (2 n,)."""
    return parts(_change(scene, observations))


def amplitudes(scene: Scene, observations: Observations) -> FloatArray:
    """|V0 + K U exp(j angle)| with the scene's V0, m zero to peak, shape (n,)."""
    start = cmath.rect(scene.rotor.initial_amplitude, scene.rotor.initial_phase)
    return np.asarray(np.abs(start + _change(scene, observations)))


def _change(scene: Scene, observations: Observations) -> ComplexArray:
    k = influence(coefficient=scene.rotor.influence_coefficient, lag_angle=scene.rotor.lag_angle)
    unbalance = observations.columns["unbalance"] * np.exp(1j * observations.columns["angle"])
    return np.asarray(k * unbalance, dtype=np.complex128)


def free(observations: Observations) -> FloatArray:
    """Effect of the two parts of every series' V0, shape (2 n, 2 series)."""
    names = np.unique(observations.series)
    belongs = (observations.series[:, None] == names[None, :]).astype(np.float64)
    return np.kron(np.eye(2), belongs)
