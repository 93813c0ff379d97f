"""Pressure of the turning liquid over that of its gas, rho omega^2 (r^2 - a^2)/2."""

from __future__ import annotations

import numpy as np

from ringbalance.identification.data.observations import Observations
from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


def predict(scene: Scene, observations: Observations) -> FloatArray:
    """Pa, shape (n,); zero above the liquid. Source: Eq. 11 of the liquid-ring paper, integrated."""
    columns = observations.columns
    surface = columns.get("surface_radius")
    if surface is None:
        surface = surface_radius(disc=scene.disc, fill_ratio=columns["fill_ratio"])
    speed = columns.get("speed", np.full(len(observations), scene.rotor.speed))
    depth = np.maximum(columns["radius"] ** 2 - surface**2, 0.0)
    return np.asarray(scene.liquid.density * speed**2 * depth / 2)
