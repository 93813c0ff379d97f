"""Natural frequencies of liquid between two plates, beside the program's finite elements.

A chamber whose radius is large against its width is a rectangular tank under gravity: its Coriolis force
vanishes beside waves that are many times faster than its rotation.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.identification.data.measurements import Measurements, MeasurementsError
from ringbalance.physics.sloshing.range import FREQUENCY_UNCERTAINTY
from ringbalance.physics.sloshing.system import sloshing_system
from ringbalance.scene.models import Disc
from ringbalance.verification.validation.kinds import Kind, Prediction

_RADIUS: Final = 1e4
"""Of the chamber, in widths of the tank."""
_DEPTHS: Final = (0.01, 10.0)
_CELLS: Final = (8, 16)


def _predict(data: Measurements) -> Prediction:
    given = data.columns["depth_over_width"]
    if not np.all((given >= _DEPTHS[0]) & (given <= _DEPTHS[1])):
        raise MeasurementsError(f"depth_over_width must lie from {_DEPTHS[0]} to {_DEPTHS[1]} in every row")
    depths, place = np.unique(given, return_inverse=True)
    found = np.array([tank_frequency(float(depth)) for depth in depths])[place]
    return Prediction(value=found, stated=FREQUENCY_UNCERTAINTY * found)


def tank_frequency(depth: float) -> float:
    """Lowest natural frequency of a rectangular tank, sigma sqrt(L/g). Args: `depth`: in widths L."""
    disc = Disc(
        outer_radius=_RADIUS,
        inner_radius=_RADIUS - 2 * depth,
        axial_width=1.0,
        central_angle=1 / _RADIUS,
        chambers=4,
        plate_thickness=0.0,
        max_fill_ratio=1.0,
        initial_fill=0.5,
    )
    surface = _RADIUS - depth
    lowest = sloshing_system(disc=disc, surface_radius=surface, cells=_CELLS).natural_frequencies()[0]
    # Gravity of the rotation is omega^2 a, so sigma = s omega = s sqrt(g/a).
    return float(lowest) / math.sqrt(surface)


WAVE_FREQUENCY: Final = Kind(
    title="lowest natural frequency of liquid in a rectangular tank, sigma sqrt(L/g)",
    measured="frequency_ratio",
    columns={"depth_over_width": "depth of the liquid over the width L of the tank"},
    predict=_predict,
)
