"""What the two ends of the tube cost beyond the kinetic energy that the "+1" in k + 1 already counts."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt
from fluids.fittings import entrance_distance, entrance_rounded, entrance_sharp

from ringbalance.physics.tube.end_losses_table import laminar_entrance_loss, laminar_exit_loss
from ringbalance.physics.tube.friction import turbulent_share
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Tube

LAMINAR_ENTRY_LENGTH: Final = 0.056
"""Entry length of laminar flow in diameters per Re."""
ROTATING_PROFILE_UNCERTAINTY: Final = 0.15
"""Expanded uncertainty (95 %) of the kinetic-energy factor of laminar flow in rotation."""
TURBULENT_KINETIC_FACTOR: Final = 1.06
"""alpha of the 1/7-power profile."""
_CREEPING: Final = 6 * np.pi
_OTHER_ENTRANCE: Final = 0.15
"""Spread of the laminar loss of an entrance that is not sharp: published excesses run from 0.2 to 0.33."""


def kinetic_factor(
    *, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0, friction_ratio: npt.ArrayLike = 1.0
) -> FloatArray:
    """Kinetic-energy factor alpha of the developed profile: laminar 2, less in rotation; turbulent 1.06.

    Laminar alpha = 1.2 + 0.8/F^1.5, smooth between laminar and turbulent: Coriolis forces blunt the profile,
    down to u ~ (depth along the axis of rotation)^1.5 in fast rotation, which has alpha = 1.199.
    Args: `critical_ratio`: critical Re over the straight tube's, broadcasts. `friction_ratio`: F of developed
        laminar flow, broadcasts.
    Range: laminar within `ROTATING_PROFILE_UNCERTAINTY` of finite-element solutions for R Re up to 3e5.
    Source: integral of (w/u)^3 over the bore: exact for Poiseuille flow and for fast rotation without
        inertia, our interpolation between; 1/7-power profile.
    """
    turned = turbulent_share(reynolds=reynolds, critical_ratio=critical_ratio)
    laminar = _laminar_kinetic_factor(np.asarray(friction_ratio, dtype=np.float64))
    return np.asarray((1 - turned) * laminar + TURBULENT_KINETIC_FACTOR * turned, dtype=np.float64)


def _laminar_kinetic_factor(friction_ratio: FloatArray) -> FloatArray:
    return np.asarray(1.2 + 0.8 * friction_ratio**-1.5)


def turbulent_entrance_loss(*, tube: Tube) -> tuple[float, float]:
    """Loss coefficient of the entrance at high Re, and its expanded uncertainty (95 %).

    Args: `tube`: the tube; `entrance` is "sharp", "rounded" (with `entrance_radius`) or "projecting".
    Returns: K and its half-width: the spread of the published methods, 0.5 to 0.57 for a sharp edge and,
        because the wall thickness of a projecting tube is not known, 0.5 to 1.1 there.
    Source: Rennels and Hudson, Pipe Flow (2012), for sharp and rounded, Crane TP-410 for projecting, through
        `fluids.fittings`.
    """
    if tube.entrance == "sharp":
        return float(entrance_sharp(method="Rennels")), 0.08
    if tube.entrance == "rounded":
        loss = float(entrance_rounded(Di=tube.bore, rc=tube.entrance_radius, method="Rennels"))
        return loss, 0.03 + 0.2 * loss
    return float(entrance_distance(Di=tube.bore, method="Crane")), 0.3


def entrance_loss(
    *, tube: Tube, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Entrance loss beyond the profile's kinetic energy, (p_reservoir - p_tube) 2/(rho u^2) - f L/d - alpha.

    Laminar: K_ent - 2 of a sharp entrance by finite elements, turbulent: the entrance's K, blended over the
    transition.
    Args: `critical_ratio`: critical Re over the straight tube's, broadcasts.
    Returns: K and its expanded uncertainty (95 %), of the broadcast shape.
    Source: the table of `end_losses_table`; an entrance that is not sharp has the same laminar value with a
        wider half-width.
    """
    re = np.asarray(reynolds, dtype=np.float64)
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio)
    turbulent, half_width = turbulent_entrance_loss(tube=tube)
    table = laminar_entrance_loss(reynolds=re)
    laminar = table.value - 2
    unlike = 0.0 if tube.entrance == "sharp" else _OTHER_ENTRANCE + 0.2 * _CREEPING / re
    uncertainty_95 = (1 - turned) * (table.uncertainty + unlike) + turned * half_width
    gap = 2 * turned * (1 - turned) * (laminar - turbulent)
    return (1 - turned) * laminar + turned * turbulent, np.hypot(uncertainty_95, gap)


def exit_loss(
    *,
    tube: Tube,
    reynolds: npt.ArrayLike,
    critical_ratio: npt.ArrayLike = 1.0,
    friction_ratio: npt.ArrayLike = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """What a laminar exit adds to the "+1": alpha - 1 + K_exit, as the stream carries alpha u^2/2 away.

    Turbulent it is zero, because there the "+1" is the whole exit loss.
    Args: `tube`: the tube; one too short for a developed laminar profile widens the half-width. `reynolds`:
        Re, any shape, positive. `critical_ratio`: critical Re over the straight tube's, broadcasts.
        `friction_ratio`: F of developed laminar flow, broadcasts.
    Returns: K and its expanded uncertainty (95 %), of the broadcast shape.
    Source: alpha of `kinetic_factor`; K_exit from the table of `end_losses_table`, which is for the profile
        without rotation.
    """
    re, ratio = (np.asarray(v, dtype=np.float64) for v in (reynolds, friction_ratio))
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio)
    undeveloped = np.minimum(1.0, LAMINAR_ENTRY_LENGTH * re * tube.bore / tube.length)
    table = laminar_exit_loss(reynolds=re)
    blunted = ROTATING_PROFILE_UNCERTAINTY * np.minimum(1.0, (ratio - 1) / 0.1)
    uncertainty_95 = (1 - turned) * (table.uncertainty + 0.3 * undeveloped + blunted) + 0.06 * turned
    gap = 2 * turned * (1 - turned)
    carried = _laminar_kinetic_factor(ratio) - 1
    return (1 - turned) * (carried + table.value), np.hypot(uncertainty_95, gap)
