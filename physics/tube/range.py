"""Where the tube's correlations are used outside what their sources state."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.physics.tube.bends import bend_in_range
from ringbalance.physics.tube.ends import LAMINAR_ENTRY_LENGTH
from ringbalance.physics.tube.rotation import STRAIGHT_CRITICAL_REYNOLDS
from ringbalance.physics.tube.rotation_table import rotation_table_covers
from ringbalance.physics.tube.state import TubeState
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Tube

FULLY_TURBULENT_REYNOLDS: Final = 4000.0
"""Re above which a straight tube's flow is taken as turbulent."""
LARGEST_REYNOLDS: Final = 1e6
"""End of the data that the friction formula is compared with."""
LARGEST_ROUGHNESS: Final = 0.05
"""eps/d up to which the friction formula is compared with data, rounded up from 0.033."""
VELOCITIES: Final = (0.1, 20.0)
"""m/s: range for which k is calibrated."""


def range_notes(*, tube: Tube, state: TubeState, velocity: FloatArray) -> dict[str, BoolArray]:
    """For each sentence that holds anywhere on why a correlation is stretched, where it holds."""
    re, rotation = state.reynolds, state.rotation_reynolds
    laminar = re < state.critical_ratio * STRAIGHT_CRITICAL_REYNOLDS
    unsteady = ~laminar & (re < state.critical_ratio * FULLY_TURBULENT_REYNOLDS)
    low, high = VELOCITIES
    notes = {"velocity outside 0.1 to 20 m/s": (velocity < low * (1 - 1e-9)) | (velocity > high * (1 + 1e-9))}
    if tube.drag_coefficient is None:
        shapes = all(bend_in_range(bend=b, bore=tube.bore) for b in tube.bends)
        untested = ~rotation_table_covers(reynolds=re, rotation_reynolds=rotation)
        developing = LAMINAR_ENTRY_LENGTH * re * tube.bore > tube.length
        notes |= {
            "friction: Re above 1e6": re > LARGEST_REYNOLDS,
            "friction: relative roughness above 0.05": np.full(
                re.shape, tube.roughness > LARGEST_ROUGHNESS * tube.bore
            ),
            "rotation: laminar factor beyond Kl = 1e7 or R_Om = 1e5": (laminar | unsteady) & untested,
            "rotation: critical Re extrapolated beyond R_Om = 2000": unsteady & (rotation > 2000),
            "bends: scaled from one computed shape in laminar flow": (laminar | unsteady) & bool(tube.bends),
            "bends: angle above 180 deg or radius below d/2": np.full(re.shape, not shapes),
            "ends: tube too short for a developed laminar profile": laminar & developing,
        }
    return {text: where for text, where in notes.items() if np.any(where)}
