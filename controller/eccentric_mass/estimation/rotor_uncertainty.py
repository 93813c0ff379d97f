"""What is not known of the rotor, in the estimated imbalance: a ratio of dynamic stiffnesses.

The filter finds (D_b/D)(theta + p) - p_b, with D = K_B - M W^2 + j C_B W of the rotor, D_b as configured and
p = b sum exp(j phi_i) of the masses, so that to first order its error is

    -(theta + p) dD/D + p - p_b,    dD = dK_B - W^2 dM + j W dC_B.
"""

from __future__ import annotations

import cmath
from collections.abc import Iterator

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.uncertain import NORMAL_95, eccentric_value


def rotor_covariance(scene: EccentricScene, *, imbalance: complex, speed: float) -> FloatArray:
    """Covariance that the stated uncertainties of rotor and masses give an imbalance, kg^2 m^2.

    Args: `imbalance`: estimated, kg m. `speed`: at which it was estimated, rad/s.
    Returns: Shape (2, 2), along the rotor's axes; zero without stated uncertainties, and for a rotor at rest.
    """
    found = np.zeros((2, 2))
    for change in _changes(scene, imbalance, speed) if speed != 0 else ():
        along = np.array([change.real, change.imag])
        found += np.outer(along, along)
    return found


def _changes(scene: EccentricScene, imbalance: complex, speed: float) -> Iterator[complex]:
    """Change of the estimate with one standard deviation of each input, kg m."""
    rotor, masses = scene.rotor, scene.masses
    whole = rotor.mass + 2 * masses.mass
    dynamic = complex(rotor.stiffness - whole * speed**2, rotor.damping * speed)
    place = masses.mass * masses.guide_radius * sum(cmath.exp(1j * angle) for angle in masses.initial_angle)
    seen = imbalance + place
    by_unit = {
        "rotor.stiffness": -seen / dynamic,
        "rotor.mass": seen * speed**2 / dynamic,
        "rotor.damping": -1j * speed * seen / dynamic,
        "masses.mass": 2 * seen * speed**2 / dynamic + place / masses.mass,
        "masses.guide_radius": place / masses.guide_radius,
    }
    for each in scene.uncertainty:
        if each.quantity in by_unit:
            value = eccentric_value(scene, each.quantity)
            yield by_unit[each.quantity] * each.absolute(value) / NORMAL_95
