"""Liquid that one injection moves out of a chamber of known fill, by mass or by volume."""

from __future__ import annotations

import numpy as np

from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.device import Device, Models, device_of
from ringbalance.identification.predict.scalars import scalar_covariance
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


def column(observations: Observations) -> str:
    """Which of both was measured."""
    return "mass" if "mass" in observations.columns else "volume"


def measured(observations: Observations) -> FloatArray:
    """kg or m^3, shape (n,)."""
    return observations.columns[column(observations)]


def predict(scene: Scene, observations: Observations, models: Models) -> FloatArray:
    """V (x_before - x_after), times rho for a mass, once the liquid rests again."""
    device = device_of(scene, models)
    volume = device.law.chamber_volume * device.once(observations, _moved)
    return np.asarray(scene.liquid.density * volume if column(observations) == "mass" else volume)


def _moved(device: Device, observations: Observations) -> FloatArray:
    columns, total = observations.columns, 2 * device.scene.disc.initial_fill
    rows = zip(columns["fill_ratio"], columns["pressure"], columns["gas_time"], strict=True)
    return np.array(
        [
            min(x, total)
            - device.injected(fill=min(float(x), total), chamber=0, pressure=float(p), gas_time=float(t))
            for x, p, t in rows
        ]
    )


def covariance(observations: Observations) -> FloatArray:
    """Of what was measured; unit where the noise is not given."""
    return scalar_covariance(observations, column(observations))


def noise_given(observations: Observations) -> bool:
    """Whether what was measured has its uncertainty."""
    return column(observations) in observations.uncertainty


def free(observations: Observations) -> FloatArray:
    """Nothing beside the parameters is fitted."""
    return np.zeros((len(observations), 0))
