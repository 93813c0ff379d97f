"""Pressure of the turning liquid over that of its gas, rho omega^2 (r^2 - a^2)/2."""

from __future__ import annotations

import numpy as np

from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.scalars import scalar_covariance
from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


def measured(observations: Observations) -> FloatArray:
    """Pa, shape (n,)."""
    return observations.columns["pressure"]


def predict(scene: Scene, observations: Observations) -> FloatArray:
    """The same; zero above the liquid. Source: Eq. 11 of the liquid-ring paper, integrated."""
    columns = observations.columns
    surface = columns.get("surface_radius")
    if surface is None:
        surface = surface_radius(disc=scene.disc, fill_ratio=columns["fill_ratio"])
    speed = columns.get("speed", np.full(len(observations), scene.rotor.speed))
    depth = np.maximum(columns["radius"] ** 2 - surface**2, 0.0)
    return np.asarray(scene.liquid.density * speed**2 * depth / 2)


def covariance(observations: Observations) -> FloatArray:
    """Of what was measured; unit where the noise is not given."""
    return scalar_covariance(observations, "pressure")


def noise_given(observations: Observations) -> bool:
    """Whether what was measured has its uncertainty."""
    return "pressure" in observations.uncertainty


def free(observations: Observations) -> FloatArray:
    """Nothing beside the parameters is fitted."""
    return np.zeros((len(observations), 0))
