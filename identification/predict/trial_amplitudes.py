"""Amplitude of the vibration with known unbalances, |V0 + K U exp(j angle)|, where no phase was measured.

V0 is the scene's vibration at the start, one for all rows: without phases it cannot be eliminated, so its
amplitude and its phase are parameters. Only its phase against K U matters, so the phase and the lag are not
identified by themselves.  Source: Eq. 23 of the liquid-ring paper.
"""

from __future__ import annotations

import cmath

import numpy as np

from ringbalance.controller.rotor import influence
from ringbalance.identification.data.observations import Observations
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


def predict(scene: Scene, observations: Observations) -> FloatArray:
    """m zero to peak, shape (n,)."""
    rotor, columns = scene.rotor, observations.columns
    k = influence(coefficient=rotor.influence_coefficient, lag_angle=rotor.lag_angle)
    start = cmath.rect(rotor.initial_amplitude, rotor.initial_phase)
    return np.asarray(np.abs(start + k * columns["unbalance"] * np.exp(1j * columns["angle"])))
