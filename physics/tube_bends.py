"""Loss of the tube's smooth bends."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt
from fluids.fittings import bend_rounded

from ringbalance.physics.tube_friction import turbulent_share
from ringbalance.scene.models import Bend, Tube

FloatArray = npt.NDArray[np.float64]

BEND_SPREAD: Final = 0.25
"""95 % half-width of a turbulent bend's loss, relative: the spread of the published methods."""
LAMINAR_BEND_SPREAD: Final = 0.6
"""The same in laminar flow, for which the formula has no data."""


def bend_loss(*, bend: Bend, bore: float, friction_factor: npt.ArrayLike) -> FloatArray:
    """Loss coefficient of one bend, with the friction of its own arc in it.

    K = f phi r/d + (0.10 + 2.4 f) sin(phi/2) + 6.6 f (sqrt(sin(phi/2)) + sin(phi/2)) (d/r)^(4 phi/pi)

    Args:
        bend: angle phi and centre-line radius r.
        bore: d, m.
        friction_factor: f (Darcy) of the straight tube at the same Re, any shape.

    Returns:
        K, the shape of `friction_factor`.

    Range: turbulent flow in smooth tubes, phi up to 180 degrees, r/d of at least 0.5.

    Source: Rennels and Hudson, Pipe Flow (2012), through `fluids.fittings.bend_rounded`.
    """
    f = np.asarray(friction_factor, dtype=np.float64)
    # K is affine in f, so two scalar calls serve any array.  The friction factor is always passed: left to
    # itself the library calls a turbulent formula at laminar Re.
    smooth, unit = (
        bend_rounded(Di=bore, angle=math.degrees(bend.angle), rc=bend.radius, fd=fd, method="Rennels")
        for fd in (0.0, 1.0)
    )
    return np.asarray(smooth + (unit - smooth) * f, dtype=np.float64)


def bend_in_range(*, bend: Bend, bore: float) -> bool:
    """Whether a bend's shape lies within the formula's range.

    Args:
        bend: the bend.
        bore: d, m.

    Returns:
        True for an angle up to 180 degrees and r/d of at least 0.5.

    Source: Rennels and Hudson, Pipe Flow (2012).
    """
    return bend.angle <= math.pi * (1 + 1e-9) and bend.radius >= bore / 2


def straight_length(*, tube: Tube) -> float:
    """Length of the tube without the arcs of its bends, whose friction their loss includes.

    Args:
        tube: the tube.

    Returns:
        Length, m.

    Raises:
        ValueError: arcs longer than the tube.

    Source: geometry.
    """
    straight = tube.length - sum(b.angle * b.radius for b in tube.bends)
    if straight < -1e-9 * tube.length:
        raise ValueError("the bends' arcs are longer than the tube: lengthen tube.length or take a bend away")
    return max(straight, 0.0)


def bend_spread(*, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0) -> FloatArray:
    """Relative 95 % half-width of a bend's loss, from 60 % laminar to 25 % turbulent.

    Args:
        reynolds: Re, any shape, positive.
        critical_ratio: critical Re over the straight tube's, broadcasts.

    Returns:
        Relative half-width, of the broadcast shape.

    Source: spread of the methods of Rennels, Miller, Ito and Crane; the laminar figure is assigned.
    """
    turned = turbulent_share(reynolds=reynolds, critical_ratio=critical_ratio)
    return np.asarray(LAMINAR_BEND_SPREAD + (BEND_SPREAD - LAMINAR_BEND_SPREAD) * turned)
