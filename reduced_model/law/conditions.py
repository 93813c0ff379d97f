"""The arguments of a flow law, checked once and brought to one shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import BoolArray, FloatArray, clipped

FILL_SLACK: Final = 1e-9
"""Fill ratios this far outside the range are taken as its end: integrators land there by round-off."""


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """What a flow law is asked for; arrays of one shape."""

    fill_ratio: FloatArray
    """x of the driven chamber, within [0, max_fill_ratio]."""
    opposite_fill_ratio: FloatArray
    """x of the opposite chamber, within [0, max_fill_ratio]."""
    gas_pressure: FloatArray
    """Gauge, in the driven chamber, Pa."""
    primed: BoolArray
    """Whether the tube holds a continuous column beforehand."""


def checked_conditions(
    *,
    max_fill_ratio: float,
    ambient_pressure: float,
    fill_ratio: npt.ArrayLike,
    opposite_fill_ratio: npt.ArrayLike | None,
    gas_pressure: npt.ArrayLike,
    primed: npt.ArrayLike,
) -> Conditions:
    """Check and broadcast the arguments of `FlowLaw.evaluate`.

    Raises: ValueError: a fill ratio outside the range, a NaN, or a negative absolute pressure.
    """
    x = _within(fill_ratio, max_fill_ratio, "fill_ratio")
    opposite = max_fill_ratio - x if opposite_fill_ratio is None else opposite_fill_ratio
    y = _within(opposite, max_fill_ratio, "opposite_fill_ratio")
    p = np.asarray(gas_pressure, dtype=np.float64)
    if not (np.isfinite(p) & (p + ambient_pressure >= 0)).all():
        raise ValueError(
            f"gas_pressure must be finite and at least minus the ambient {ambient_pressure:g} Pa"
        )
    wet = np.asarray(primed, dtype=np.bool_)
    if not x.shape == y.shape == p.shape == wet.shape:
        x, y, p, wet = np.broadcast_arrays(x, y, p, wet)
    return Conditions(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=wet)


def _within(fill_ratio: npt.ArrayLike, largest: float, name: str) -> FloatArray:
    x = np.asarray(fill_ratio, dtype=np.float64)
    if not ((x >= -FILL_SLACK) & (x <= largest + FILL_SLACK)).all():
        raise ValueError(f"{name} must lie within [0, {largest:g}]")
    return clipped(x, 0.0, largest)
