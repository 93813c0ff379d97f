"""Vibration of a rotor over its speed, both eccentric masses clamped where they stand at the start."""

from __future__ import annotations

import numpy as np

from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.controller.eccentric_mass.plant.whirl import steady_whirl
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.vibration import parts
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene


def predict(scene: EccentricScene, observations: Observations) -> FloatArray:
    """At constant speed, as in a run-up that is slow against the decay of the rotor's motion.

    Returns: in the rotor's frame, real and then imaginary parts, m, shape (2 n,).
    """
    plant, angles = plant_parameters(scene), scene.masses.initial_angle
    speeds = observations.columns["speed"].tolist()
    return parts(np.array([steady_whirl(plant, speed, angles) for speed in speeds], dtype=np.complex128))
