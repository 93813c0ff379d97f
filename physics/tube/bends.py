"""Loss of the tube's smooth bends: by correlation where flow is turbulent, by finite elements where laminar.

What a laminar bend costs beyond the friction of its own arc was computed for r = 2 d and 90 degrees at rest:
0.18, 0.55, 0.94 and 1.14 at Re 20, 50, 100 and 200 (`verification.reference.bent_tube`).
K_0 De^2/(De^2 + De_0^2) with the Dean number De = Re sqrt(d/2r) meets them within 0.05; other shapes are
scaled by it and carry a wide half-width.  In a tube that turns, curvature acts as rotation, R' = R +- s with
s = (4/3) Re d/2r (`verification.reference.bent_tube`): a bend then costs more or less by its sense of
turning, which a scene does not give.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.friction import turbulent_share
from ringbalance.physics.tube.rotation_table import laminar_ratio
from ringbalance.scene.arrays import BoolArray, FloatArray, plain
from ringbalance.scene.models import Bend, Tube

BEND_UNCERTAINTY: Final = 0.25
"""Expanded uncertainty (95 %) of a turbulent bend's loss, relative: the spread of the published methods."""
LAMINAR_BEND_UNCERTAINTY: Final = 0.6
"""The same of what a laminar bend adds at rest: for shapes other than the one that was computed."""
LARGEST_EXCESS: Final = 1.25
"""K_0, for 90 degrees and r = 2 d."""
HALF_WAY_DEAN: Final = 28.0
"""De_0."""
MOMENTUM_FACTOR: Final = 4 / 3
"""Mean of u^2 over U^2 in Poiseuille flow."""


def bend_loss(
    *,
    bend: Bend,
    bore: float,
    friction_factor: npt.ArrayLike,
    reynolds: npt.ArrayLike,
    rotation_reynolds: npt.ArrayLike = 0.0,
    critical_ratio: npt.ArrayLike = 1.0,
) -> FloatArray:
    """Loss coefficient of one bend, with the friction of its own arc in it.

    K = f phi r/d + (1 - w) K_lam + w (K_tur - f phi r/d), w from laminar to turbulent;
    K_lam = K_0 (phi/90 deg) 2 sqrt(d/2r) De^2/(De^2 + De_0^2) s^2/(s^2 + R^2).
    Args:
        bend: angle phi and centre-line radius r.
        friction_factor: f (Darcy) of the straight tube at rest at the same Re, any shape.
        critical_ratio: critical Re over the straight tube's, broadcasts.
    Range: computed for r = 2 d and 90 degrees up to Re 200 at rest, and at Re 200, R 118; elsewhere scaled.
    Source: finite elements, see the head of this module; `turbulent_bend_loss`.
    """
    f, re, rotation = np.broadcast_arrays(
        *(np.asarray(v, dtype=np.float64) for v in (friction_factor, reynolds, rotation_reynolds))
    )
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio)
    arc = f * bend.angle * bend.radius / bore
    rest, shift = _laminar_excess(bend, bore, re)
    added = rest * shift**2 / (shift**2 + rotation**2)
    turbulent = turbulent_bend_loss(bend=bend, bore=bore, friction_factor=f)
    return np.asarray(arc + (1 - turned) * added + turned * (turbulent - arc))


def bend_uncertainty(
    *,
    bend: Bend,
    bore: float,
    friction_factor: npt.ArrayLike,
    reynolds: npt.ArrayLike,
    rotation_reynolds: npt.ArrayLike = 0.0,
    critical_ratio: npt.ArrayLike = 1.0,
) -> FloatArray:
    """Expanded uncertainty (95 %) of `bend_loss`; the friction of the arc counts as known."""
    f, re, rotation = np.broadcast_arrays(
        *(np.asarray(v, dtype=np.float64) for v in (friction_factor, reynolds, rotation_reynolds))
    )
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio)
    rest, shift = _laminar_excess(bend, bore, re)
    more, less = laminar_ratio(reynolds=re, rotation_reynolds=np.abs([rotation + shift, rotation - shift]))
    turning = 64 / re * bend.angle * bend.radius / bore * (more - less) / 2
    laminar = np.hypot(LAMINAR_BEND_UNCERTAINTY * rest, turning)
    turbulent = turbulent_bend_loss(bend=bend, bore=bore, friction_factor=f)
    return np.asarray((1 - turned) * laminar + turned * BEND_UNCERTAINTY * turbulent)


def _laminar_excess(bend: Bend, bore: float, re: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What a laminar bend at rest adds to the friction of its arc, and s, its curvature as a rotation."""
    tight = bore / (2 * bend.radius)
    dean, shift = re * np.sqrt(tight), MOMENTUM_FACTOR * re * tight
    shape = bend.angle / (math.pi / 2) * np.sqrt(tight) / 0.5
    return LARGEST_EXCESS * shape * dean**2 / (dean**2 + HALF_WAY_DEAN**2), shift


def turbulent_bend_loss(*, bend: Bend, bore: float, friction_factor: npt.ArrayLike) -> FloatArray:
    """Loss coefficient of one bend in turbulent flow, with the friction of its own arc in it.

    K = f phi r/d + (0.10 + 2.4 f) sin(phi/2) + 6.6 f (sqrt(sin(phi/2)) + sin(phi/2)) (d/r)^(4 phi/pi)
    Args: `bend`: angle phi and centre-line radius r. `friction_factor`: f (Darcy) of the straight tube at the
        same Re, any shape.
    Range: turbulent flow in smooth tubes, phi up to 180 degrees, r/d of at least 0.5.
    Source: Rennels and Hudson, Pipe Flow (2012), as in `fluids.fittings.bend_rounded`, which takes no arrays.
    """
    f, sine = np.asarray(friction_factor, dtype=np.float64), np.sin(bend.angle / 2)
    tight = (bore / bend.radius) ** (4 * bend.angle / math.pi)
    turning = (0.10 + 2.4 * f) * sine + 6.6 * f * (np.sqrt(sine) + sine) * tight
    return np.asarray(f * bend.angle * bend.radius / bore + turning, dtype=np.float64)


def bend_in_range(*, bend: Bend, bore: npt.ArrayLike) -> BoolArray:
    """Whether a bend lies within the formula's range: an angle up to 180 degrees and r/d of at least 0.5."""
    return np.asarray((bend.angle <= math.pi * (1 + 1e-9)) & (bend.radius >= np.asarray(bore) / 2))


def straight_length(*, tube: Tube) -> float:
    """Length of the tube, m, without the arcs of its bends, whose friction their loss includes.

    Raises: ValueError: arcs longer than the tube.
    """
    straight = tube.length - sum(b.angle * b.radius for b in tube.bends)
    if np.any(straight < -1e-9 * tube.length):
        raise ValueError("the bends' arcs are longer than the tube: lengthen tube.length or take a bend away")
    longest: float = plain(np.maximum(straight, 0.0))
    return longest
