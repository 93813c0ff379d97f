"""The gains that bring the masses to their targets: the linear-quadratic regulator in closed form.

With whirl and friction compensated, each mass is its own: (J + J_add) phi'' + C_add phi' = u.
"""

from __future__ import annotations

import math

from ringbalance.controller.eccentric_mass.estimation.friction_filter import TrackModel


def lqr_gain(track: TrackModel, *, state_weight: float, input_weight: float) -> tuple[float, float]:
    """Gains k_p, N m/rad, and k_d, N m s/rad, of u = -k_p (phi - phi_d) - k_d phi'.

    They minimise the integral of 0.1 q (phi - phi_d)^2 + 0.01 q phi'^2 + 0.1 r u^2, with q the state weight
    and r the input weight, both above zero.  The spectrum of the cost factors: k_p^2 = q/r and
    (C_add + k_d)^2 = C_add^2 + 2 (J + J_add) k_p + 0.1 q/r.
    Source: Eqs. 42 to 49 of the paper on eccentric masses, whose back-EMF in Eq. 42 lost the minus sign.
    """
    ratio = state_weight / input_weight
    position = math.sqrt(ratio)
    more = 2 * track.inertia * position + 0.1 * ratio
    return position, more / (math.sqrt(track.damping**2 + more) + track.damping)
