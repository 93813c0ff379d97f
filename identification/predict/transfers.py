"""Liquid that one injection moves out of a chamber of known fill, by mass or by volume."""

from __future__ import annotations

import numpy as np

from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.device import Device, Models, device_of
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


def column(observations: Observations) -> str:
    """Which of both was measured."""
    return "mass" if "mass" in observations.columns else "volume"


def predict(scene: Scene, observations: Observations, models: Models) -> FloatArray:
    """V (x_before - x_after), m^3, times rho for a mass, kg, once the liquid rests again."""
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
