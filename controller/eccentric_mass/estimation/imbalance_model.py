"""What the imbalance filter takes the rotor for: a whirl with an unknown constant imbalance, one step on.

State of six: x, y, x', y' in the rotor-fixed frame, and the imbalance (kg m) along the same axes.  The rotor
turns at a constant speed W and the eccentric masses are locked to it:

    M (z'' + 2 j W z' - W^2 z) + C_B (z' + j W z) + K_B z = W^2 theta,    z = x + j y.

With another speed rate than zero, or with masses that move, none of this holds.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import compiled

_GAUSS_POINTS: FloatArray
_GAUSS_WEIGHTS: FloatArray
_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


class WhirlModel(NamedTuple):
    """The rotor on its bearing, as configured in the filter."""

    mass: float
    """M = m_r + 2 m_b, kg."""
    damping: float
    """C_B, N s/m."""
    stiffness: float
    """K_B, N/m."""

    def euler_step_limit(self, *, angular_velocity: npt.ArrayLike) -> FloatArray:
        """Longest step at which the explicit Euler transition of the paper does not grow.

        Each eigenvalue p of the whirl in the rotor's frame must keep |1 + p dt| at most 1, so
        dt = min(-2 Re p / |p|^2), with p = s - j W and s the roots of M s^2 + C_B s + K_B.
        Returns: Longest step, s, of that shape; zero without damping.
        Source: follows from Eq. 14 of the paper on eccentric masses.
        """
        w = np.asarray(angular_velocity, dtype=np.float64)
        half = self.damping / (2 * self.mass)
        root = cmath.sqrt(half**2 - self.stiffness / self.mass)
        limits = [-2 * s.real / np.abs(s - 1j * w) ** 2 for s in (-half + root, -half - root)]
        return np.asarray(np.minimum(*limits), dtype=np.float64)


class ProcessNoise(NamedTuple):
    """White noise that drives the state, as power per unit time."""

    acceleration: float
    """Of the rotor along each axis, m^2/s^3."""
    imbalance: float
    """Of the imbalance along each axis, kg^2 m^2/s: how fast it may wander."""


class FilterMatrices(NamedTuple):
    """Everything that one step of the imbalance filter multiplies with, at one speed."""

    speed: float
    """W that they belong to, rad/s."""
    transition: FloatArray
    """Shape (6, 6): the state one step later."""
    process: FloatArray
    """Shape (6, 6): covariance that the process noise adds in one step."""
    observation: FloatArray
    """Shape (4, 6): what the sensor would show of a state."""


@compiled
def whirl_transition(model: WhirlModel, angular_velocity: float, step: float) -> FloatArray:
    """The state one step later, exactly: exp(A dt) in closed form.

    The whirl is an oscillator in the fixed frame, seen from the rotor; the imbalance adds what lies between
    the steady whirl and where the oscillator would take it.
    Returns: Transition, shape (6, 6).
    Source: solution of Eq. 13 of the paper on eccentric masses.
    """
    mass, damping, stiffness = model
    w = angular_velocity
    half, square = damping / (2 * mass), stiffness / mass
    root = cmath.sqrt(complex(square - half * half, 0.0))
    angle = root * step
    small = abs(angle) < 1e-4
    sine = step * (1 - angle * angle / 6) if small else cmath.sin(angle) / root
    decay = math.exp(-half * step)
    s, c = decay * sine.real, decay * cmath.cos(angle).real
    # To Z = z exp(j W t), Z' = (z' + j W z) exp(j W t) and back, around one step of the oscillator.
    turn = cmath.exp(complex(0.0, -w * step))
    e00 = turn * complex(c + half * s, w * s)
    e01 = turn * s
    e10 = turn * s * complex(w * w - square, -2 * w * half)
    e11 = turn * complex(c - half * s, -w * s)
    gain = w * w / complex(stiffness - mass * w * w, damping * w)
    blocks = ((e00, e01, (1 - e00) * gain), (e10, e11, -e10 * gain))
    found = np.zeros((6, 6))
    for i in range(2):
        for k in range(3):
            value = blocks[i][k]
            found[2 * i, 2 * k] = found[2 * i + 1, 2 * k + 1] = value.real
            found[2 * i, 2 * k + 1] = -value.imag
            found[2 * i + 1, 2 * k] = value.imag
    found[4, 4] = found[5, 5] = 1.0
    return found


@compiled
def euler_transition(model: WhirlModel, angular_velocity: float, step: float) -> FloatArray:
    """The paper's transition I + A dt, shape (6, 6), which keeps the steady whirl but not the way there.

    Source: Eq. 14 of the paper on eccentric masses.
    """
    mass, damping, stiffness = model
    w = angular_velocity
    found = np.zeros((6, 6))
    for i in range(6):
        found[i, i] = 1.0
    found[0, 2] = found[1, 3] = step
    found[2, 0] = found[3, 1] = (w * w - stiffness / mass) * step
    found[2, 1], found[3, 0] = damping * w / mass * step, -damping * w / mass * step
    found[2, 2] = found[3, 3] = 1.0 - damping / mass * step
    found[2, 3], found[3, 2] = 2 * w * step, -2 * w * step
    found[2, 4] = found[3, 5] = w * w / mass * step
    return found


@compiled
def _process_covariance(
    model: WhirlModel, noise: ProcessNoise, angular_velocity: float, step: float
) -> FloatArray:
    """Covariance that white noise builds up within one step.

    Integral of E(s) diag(0, 0, q_a, q_a, q_m, q_m) E(s)^T over 0 to dt, by eight Gauss points.
    Returns: Covariance, shape (6, 6), positive semidefinite.
    Source: Van Loan, "Computing integrals involving the matrix exponential", IEEE Trans. Automat. Contr. 23
    (1978), whose integral this is; in place of the paper's diag(O randn), which is no covariance.
    """
    power = np.zeros((6, 6))
    power[2, 2] = power[3, 3] = noise.acceleration
    power[4, 4] = power[5, 5] = noise.imbalance
    found = np.zeros((6, 6))
    for i in range(_GAUSS_POINTS.size):
        part = whirl_transition(model, angular_velocity, 0.5 * step * (1.0 + _GAUSS_POINTS[i]))
        grown, weight = sandwich(part, power), 0.5 * step * _GAUSS_WEIGHTS[i]
        # An element at a time: numba compiles expressions of arrays ten times as long.
        for j in range(6):
            for k in range(6):
                found[j, k] += weight * grown[j, k]
    return found


@compiled
def sandwich(a: FloatArray, p: FloatArray) -> FloatArray:
    """A P A^T, symmetric to the last bit, by plain sums: too small for a library call to pay."""
    half, full = np.zeros((6, 6)), np.zeros((6, 6))
    for i in range(6):
        for j in range(6):
            for k in range(6):
                half[i, k] += a[i, j] * p[j, k]
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            for k in range(6):
                total += half[i, k] * a[j, k]
            full[i, j] = full[j, i] = total
    return full


@compiled
def _sensor_matrix(angular_velocity: float, laboratory: bool) -> FloatArray:
    """What a displacement and a velocity sensor show of the state.

    A laboratory sensor shows Z' = (z' + j W z) exp(j W t); turned back by the rotor's angle, which leaves the
    noise as it is, that is z' + j W z.  A rotor-fixed sensor shows z'.
    Args: `laboratory`: whether the sensor stands still, its sample turned back by the rotor's angle.
    Returns: H, shape (4, 6); the printed one lets the imbalance into the last row, where it is not seen.
    Source: Eq. 17 of the paper on eccentric masses, corrected.
    """
    found = np.zeros((4, 6))
    for i in range(4):
        found[i, i] = 1.0
    if laboratory:
        found[2, 1], found[3, 0] = -angular_velocity, angular_velocity
    return found


@compiled
def filter_matrices(
    model: WhirlModel,
    noise: ProcessNoise,
    angular_velocity: float,
    step: float,
    laboratory: bool,
    euler: bool,
) -> FilterMatrices:
    """All matrices of the imbalance filter at one speed, of a sensor that turns or stands still."""
    exact = whirl_transition(model, angular_velocity, step)
    return FilterMatrices(
        angular_velocity,
        euler_transition(model, angular_velocity, step) if euler else exact,
        _process_covariance(model, noise, angular_velocity, step),
        _sensor_matrix(angular_velocity, laboratory),
    )
