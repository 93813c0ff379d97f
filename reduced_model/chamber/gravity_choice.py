"""Whether a calibration's means over a turn need gravity: estimated, then checked by the tilted ring."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.reduced_model.chamber.gravity import closed_ring
from ringbalance.reduced_model.chamber.values import ChamberValues, by_closed_form, by_quadrature
from ringbalance.reduced_model.selection.contribution import NEGLIGIBLE
from ringbalance.scene.models import Scene

CHECKED: Final = (0.25, 0.5, 1.0)
"""Fills at which it is checked, as shares of max_fill_ratio."""


@dataclass(frozen=True, kw_only=True)
class GravityChoice:
    """The choice for the means over a turn."""

    share: float
    """Estimated contribution at the worst fill of the range."""
    measured: float | None
    """Largest contribution at the checked fills; None where nothing was checked."""
    modelled: bool
    told: str
    """What the check said, for people."""


@lru_cache(maxsize=8)
def gravity_choice(*, scene: Scene, share: float) -> GravityChoice:
    """Choose by the estimate, then run the next finer model at a few fills.

    The next model is the free surface under gravity to all orders, by quadrature; where it finds more than
    the tolerance the next finer model is chosen, and where it finds less than that gravity is left out.
    Args: `share`: estimated second-order contribution.
    Returns: GravityChoice; where gravity leaves no closed ring, or is worth less than a thousandth of the
        tolerance, the estimate stands unchecked.
    Source: `tilted_ring` against the closed forms.
    """
    first = share > scene.tolerance
    if share <= NEGLIGIBLE * scene.tolerance:
        return GravityChoice(
            share=share, measured=None, modelled=first, told="too little for a check to be worth it"
        )
    fills = _closed_fills(scene)
    if fills.size == 0:
        return GravityChoice(
            share=share, measured=None, modelled=first, told="not checked: gravity leaves no closed ring"
        )
    worth = [_change(by_quadrature(scene, float(x)), by_closed_form(scene, float(x))) for x in fills]
    measured = max(worth)
    modelled = measured > scene.tolerance
    verb = "confirms it" if modelled is first else ("climbs" if modelled else "leaves it out after all")
    return GravityChoice(
        share=share,
        measured=measured,
        modelled=modelled,
        told=f"the check by quadrature at {fills.size} fills finds {measured:.1e} and {verb}",
    )


def _closed_fills(scene: Scene) -> np.ndarray:
    fills = scene.disc.max_fill_ratio * np.array(CHECKED)
    closed = closed_ring(
        disc=scene.disc,
        angular_velocity=scene.rotor.speed,
        gravity=scene.environment.gravity,
        vertical=scene.environment.shaft == "vertical",
        fill_ratio=fills,
    )
    return np.asarray(fills[closed])


def _change(found: ChamberValues, plain: ChamberValues) -> float:
    """Of wall pressure or moment, means over a turn."""
    pressure = abs(found.wall_pressure / plain.wall_pressure - 1)
    return max(pressure, abs(found.moment / plain.moment - 1))
