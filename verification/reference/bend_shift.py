"""What a bend of a turning tube costs in laminar flow: its curvature adds to the rotation, or takes from it.

Across the path the stream is driven by 2 omega u, to its right when the disc turns to the left, and in a bend
by u^2/r away from the bend's centre.  In a bend to the left (with the rotation) both act to the same side, in
one to the right they oppose each other: the bend then costs less than the straight tube.
"""

from __future__ import annotations

from ringbalance.physics.tube.bends import MOMENTUM_FACTOR
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio


def rotation_with_curvature(*, reynolds: float, rotation_reynolds: float, curvature: float) -> float:
    """Rotation Reynolds number of the straight tube in which liquid is driven aside as strongly.

    R' = R + (4/3) Re kappa d/2, from 2 omega' U = 2 omega U + mean(u^2) kappa, to first order; negative where
    the curvature outweighs the rotation.
    Args: `curvature`: kappa d of the path, positive where it turns in the sense of rotation.
    """
    return rotation_reynolds + MOMENTUM_FACTOR * reynolds * curvature / 2


def bend_shift(
    *, reynolds: float, rotation_reynolds: float, angle: float, radius: float, with_rotation: bool
) -> float:
    """What a bend adds to the rotating friction of its own arc, laminar: (64/Re) phi (r/d) (F(R') - F(R)).

    Args: `radius`: r/d, of the path. `with_rotation`: the path turns in the sense of the disc's rotation.
    Returns: K, negative where the bend turns against a rotation that outweighs it.
    Range: R well above Re d/r; the stream's recovery behind the bend is left out.
    """
    curvature = (1.0 if with_rotation else -1.0) / radius
    shifted = rotation_with_curvature(
        reynolds=reynolds, rotation_reynolds=rotation_reynolds, curvature=curvature
    )
    ratios = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=[abs(shifted), rotation_reynolds])
    return float(64 / reynolds * angle * radius * (ratios.value[0] - ratios.value[1]))
