"""What the two ends of the tube cost beyond the kinetic energy that the "+1" in k + 1 already counts."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt
from fluids.fittings import entrance_distance, entrance_rounded, entrance_sharp

from ringbalance.physics.tube_friction import turbulent_share
from ringbalance.scene.models import Tube

FloatArray = npt.NDArray[np.float64]

LAMINAR_ENTRY_EXCESS: Final = 0.28
"""Loss while a laminar profile develops, beyond its kinetic energy; published values run from 0.2 to 0.33."""
LAMINAR_ENTRY_LENGTH: Final = 0.056
"""Entry length of laminar flow in diameters per Re."""
_CREEPING: Final = 6 * np.pi


def kinetic_factor(*, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0) -> FloatArray:
    """Kinetic-energy factor alpha of the developed profile: 2 laminar, 1.06 turbulent, smooth between.

    Args:
        reynolds: Re, any shape, positive.
        critical_ratio: critical Re over the straight tube's, broadcasts.

    Returns:
        alpha, of the broadcast shape.

    Source: integral of (w/u)^3 over the bore: exact for Poiseuille flow; 1/7-power profile.
    """
    turned = turbulent_share(reynolds=reynolds, critical_ratio=critical_ratio)
    return np.asarray(2 - 0.94 * turned, dtype=np.float64)


def turbulent_entrance_loss(*, tube: Tube) -> tuple[float, float]:
    """Loss coefficient of the entrance at high Re, and its 95 % half-width.

    Args:
        tube: the tube; `entrance` is "sharp", "rounded" (with `entrance_radius`) or "projecting".

    Returns:
        K and its half-width: the spread of the published methods, 0.5 to 0.57 for a sharp edge and, because
        the wall thickness of a projecting tube is not known, 0.5 to 1.1 there.

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

    Laminar: 0.28 + 6 pi/Re, turbulent: the entrance's K, blended over the transition.

    Args:
        tube: the tube.
        reynolds: Re, any shape, positive.
        critical_ratio: critical Re over the straight tube's, broadcasts.

    Returns:
        K and its 95 % half-width, of the broadcast shape.

    Source: Shah and London, Laminar Flow Forced Convection in Ducts (1978), for developing flow; Dagan,
        Weinbaum and Pfeffer, J. Fluid Mech. 115 (1982) 505, for Re -> 0 (both ends together 12 pi/Re).
    """
    re = np.asarray(reynolds, dtype=np.float64)
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio)
    turbulent, half_width = turbulent_entrance_loss(tube=tube)
    laminar = LAMINAR_ENTRY_EXCESS + _CREEPING / re
    spread = (1 - turned) * (0.15 + 0.3 * _CREEPING / re) + turned * half_width
    gap = 2 * turned * (1 - turned) * (laminar - turbulent)
    return (1 - turned) * laminar + turned * turbulent, np.hypot(spread, gap)


def exit_loss(
    *, tube: Tube, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0
) -> tuple[FloatArray, FloatArray]:
    """What a laminar exit adds to the "+1": the stream carries twice u^2/2 away, and 6 pi/Re when creeping.

    Turbulent it is zero, because there the "+1" is the whole exit loss.

    Args:
        tube: the tube; one too short for a developed laminar profile widens the half-width.
        reynolds: Re, any shape, positive.
        critical_ratio: critical Re over the straight tube's, broadcasts.

    Returns:
        K and its 95 % half-width, of the broadcast shape.

    Source: Poiseuille's profile, alpha = 2; Dagan, Weinbaum and Pfeffer, J. Fluid Mech. 115 (1982) 505.
    """
    re = np.asarray(reynolds, dtype=np.float64)
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio)
    undeveloped = np.minimum(1.0, LAMINAR_ENTRY_LENGTH * re * tube.bore / tube.length)
    spread = (1 - turned) * (0.05 + 0.3 * undeveloped + 0.3 * _CREEPING / re) + 0.06 * turned
    gap = 2 * turned * (1 - turned)
    return (1 - turned) * (1 + _CREEPING / re), np.hypot(spread, gap)
