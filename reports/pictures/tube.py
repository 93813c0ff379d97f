"""The connecting tube in three dimensions, coloured by the pressure of its operating point."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.operating.pressure_profile import hump_profile
from ringbalance.reports.numbers import given
from ringbalance.scene import Scene
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.loops import calibration_of

Record = dict[str, Any]

_POINTS: Final = 241
_FILLS: Final = {
    Regime.SIPHON: "liquid fills it all the way",
    Regime.SEPARATED: "the column is separated at the siphon crest, and a cavity follows",
    Regime.UNDECIDED: "whether liquid fills it all the way or separates at the siphon crest cannot be told",
    Regime.BLOCKED: "gas stands over the siphon crest and nothing flows",
}


def tube_field(scene: Scene) -> Record | None:
    """Centre line and pressure of the tube at equal fills under the scene's gas.

    Returns: Points of the centre line (m, shape (n, 3) as lists), pressure (Pa), whether liquid fills the
    bore there, and the picture's text; None for a tube without a crest.
    Raises: SceneError: a scene that cannot be calibrated.
    """
    if scene.tube.hump_radius is None:
        return None
    calibration = calibration_of(scene)
    scene, law = calibration.scene, calibration.flow_law
    equal = law.max_fill_ratio / 2
    found = hump_profile(scene=scene, law=law, fill_ratio=equal, opposite_fill_ratio=equal, points=_POINTS)
    # Where a step stands twice, the later entry is kept: a line may not stand still.
    last = np.append(np.diff(found.path) > 0, True)
    share = found.path[last] / scene.tube.length
    return {
        "points": _spiral(share=share, radius=found.radius[last]).tolist(),
        "pressure": found.pressure[last].tolist(),
        "full": found.full[last].astype(int).tolist(),
        "hump": int(np.argmin(found.radius[last])),
        "text": _FILLS.get(found.regime, "the column flows back"),
        "gas": given(scene.gas.pressure, "Pa"),
    }


def _spiral(*, share: FloatArray, radius: FloatArray) -> FloatArray:
    """Half a turn about the shaft at a given radius, from the first chamber to the opposite one.

    Args: `share`: s/L, shape (n,). `radius`: r, m, shape (n,).
    Returns: Points, m, shape (n, 3), in the plane across the shaft.
    """
    angle = np.pi * share
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(angle.size)], axis=1)
