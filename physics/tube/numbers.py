"""The dimensionless numbers of a tube that turns about an axis across it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray


def reynolds_number(*, velocity: npt.ArrayLike, bore: float, kinematic_viscosity: float) -> FloatArray:
    """Reynolds number of the tube, Re = |u| d/nu, u the mean over the bore."""
    return np.asarray(np.abs(np.asarray(velocity, dtype=np.float64)) * bore / kinematic_viscosity)


def rotation_reynolds_number(*, angular_velocity: float, bore: float, kinematic_viscosity: float) -> float:
    """Rotation Reynolds number, R_Om = omega d^2/nu, the inverse of an Ekman number.

    Args: `angular_velocity`: omega, rad/s, of either sign. `bore`: d, m. `kinematic_viscosity`: nu, m^2/s.
    Returns: R_Om; with Re it makes Kl = R_Om Re (laminar), Kt = R_Om^2/Re (turbulent) and S = R_Om/Re.
    Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383, definitions.
    """
    return abs(angular_velocity) * bore**2 / kinematic_viscosity
