"""What the controller gets to see of the vibration."""

from __future__ import annotations

import cmath
from collections.abc import Callable

import numpy as np

from ringbalance.controller.algorithms.algorithm import Measurement
from ringbalance.scene import loop_models

Sensor = Callable[[float, complex], Measurement | None]
"""Takes the time (s) and the vibration (m, complex); None is a dropped sample."""


def noisy_sensor(*, sensor: loop_models.Sensor, seed: int) -> Sensor:
    """A sensor with independent Gaussian noise on amplitude and phase from numpy's default generator.

    An amplitude that noise would make negative is folded back, as a rectifying instrument shows it.
    """
    random = np.random.default_rng(seed)

    def measure(time: float, vibration: complex) -> Measurement:
        amplitude_noise, phase_noise = random.standard_normal(2)
        return Measurement(
            time=time,
            amplitude=abs(abs(vibration) + sensor.amplitude_noise * float(amplitude_noise)),
            phase=cmath.phase(vibration) + sensor.phase_noise * float(phase_noise),
        )

    return measure
