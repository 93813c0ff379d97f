"""The liquid-ring paper, Eqs. 20 to 23: explicit segments, correction mass and moment, residual vibration."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.paper.chamber import chamber_volume_paper
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.models import Disc

PAPER_LAMBDA: Final = 72e-3
"""lambda, m: balancing moment per unit mass of liquid, "72 mm within 0.7 %" (section 5.2)."""


def explicit_segment(
    *,
    fill_ratio: npt.ArrayLike,
    velocity: npt.ArrayLike,
    tube_area: float,
    chamber_volume: float,
    time_step: npt.ArrayLike,
) -> FloatArray:
    """Fill ratio after one explicit segment of valve-open time, x_i = x_(i-1) - u_(i-1) S dt/V.

    Args: `fill_ratio`: x_(i-1) of the driven chamber, any shape. `velocity`: u_(i-1), m/s, any shape that
        broadcasts. `tube_area`: S, m^2. `chamber_volume`: V, m^3. `time_step`: dt, s, any shape that
        broadcasts.
    Returns: x_i, of the broadcast shape.
    Source: Eq. 20.
    """
    x, u, dt = (np.asarray(v, dtype=np.float64) for v in (fill_ratio, velocity, time_step))
    return np.asarray(x - u * tube_area * dt / chamber_volume, dtype=np.float64)


def correction_mass(*, disc: Disc, density: float, fill_ratio: npt.ArrayLike) -> FloatArray:
    """Mass difference of a pair of opposite chambers, m = rho V (2 x_a - 0.5).

    Args: `disc`: the disc; its `max_fill_ratio` stands for the paper's 0.5. `density`: rho, kg/m^3.
        `fill_ratio`: x_a, any shape.
    Returns: Mass, kg, positive towards the chamber that has `fill_ratio`, the shape of `fill_ratio`.
    Source: Eq. 21; twice the transferred mass.
    """
    x = np.asarray(fill_ratio, dtype=np.float64)
    volume = chamber_volume_paper(disc=disc)
    return np.asarray(density * volume * (2 * x - disc.max_fill_ratio), dtype=np.float64)


def correction_moment(
    *, real_mass: npt.ArrayLike, imaginary_mass: npt.ArrayLike, moment_per_mass: float = PAPER_LAMBDA
) -> ComplexArray:
    """Correction moment of the disc, U = lambda (m_Re + i m_Im).

    Args: `real_mass`: m_Re of Eq. 21 along chambers A and C, kg, any shape. `imaginary_mass`: m_Im of Eq. 21
        along chambers B and D, kg, any shape that broadcasts.
    Returns: Complex moment, kg m, of the broadcast shape; its argument is the paper's delta.
    Source: Eq. 22 taken literally. With lambda = 72 mm it is twice Eq. 7's moment: 72 mm belongs to the
        transferred mass, half of Eq. 21's difference.
    """
    real, imaginary = (np.asarray(m, dtype=np.float64) for m in (real_mass, imaginary_mass))
    return np.asarray(moment_per_mass * (real + 1j * imaginary), dtype=np.complex128)


def residual_vibration(
    *, initial_vibration: npt.ArrayLike, influence: complex, moment: npt.ArrayLike
) -> ComplexArray:
    """Vibration after a balancing operation, V_1 = V_0 + K U.

    Args: `initial_vibration`: V_0, complex, m zero-to-peak, any shape. `influence`: K, complex, m/(kg m).
        `moment`: U, complex, kg m, any shape that broadcasts.
    Returns: V_1, complex, m, of the broadcast shape.
    Source: Eq. 23.
    """
    v0, u = (np.asarray(v, dtype=np.complex128) for v in (initial_vibration, moment))
    return np.asarray(v0 + influence * u, dtype=np.complex128)
