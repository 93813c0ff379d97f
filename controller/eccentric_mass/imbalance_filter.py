"""The imbalance filter: a Kalman filter for rotor-fixed whirl with an unknown constant imbalance.

State of six: x, y, x', y' in the rotor-fixed frame, and the imbalance (kg m) along the same axes.  The rotor
turns at a constant speed W and the eccentric masses are locked to it:

    M (z'' + 2 j W z' - W^2 z) + C_B (z' + j W z) + K_B z = W^2 theta,    z = x + j y.

With another speed rate than zero none of this holds.  The force of masses that move is, with
p = b sum exp(j phi_i), b sum [(W + phi_i')^2 - j phi_i''] exp(j phi_i) = W^2 p - 2 j W p' - p''.  With
v = z' + p'/M in place of z' no acceleration is left, and no noise of an encoder is differentiated:

    z' = v - p'/M,    M v' + 2 j W M v - M W^2 z + C_B (v + j W z) + K_B z = W^2 (theta + p) + C_B p'/M.
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
def _euler_transition(model: WhirlModel, angular_velocity: float, step: float) -> FloatArray:
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
        grown, weight = _sandwich(part, power), 0.5 * step * _GAUSS_WEIGHTS[i]
        # An element at a time: numba compiles expressions of arrays ten times as long.
        for j in range(6):
            for k in range(6):
                found[j, k] += weight * grown[j, k]
    return found


@compiled
def _sandwich(a: FloatArray, p: FloatArray) -> FloatArray:
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
        _euler_transition(model, angular_velocity, step) if euler else exact,
        _process_covariance(model, noise, angular_velocity, step),
        _sensor_matrix(angular_velocity, laboratory),
    )


Pair = tuple[float, float]


class ImbalanceEstimate(NamedTuple):
    """Estimate of the imbalance filter."""

    state: FloatArray
    """Shape (6,): z, v and the imbalance along x and y, rotor-fixed; v is z' while the masses rest."""
    covariance: FloatArray
    """Shape (6, 6)."""


class MassInput(NamedTuple):
    """What the eccentric masses do within one step of the filter."""

    imbalance: complex
    """p + C_B p'/(M W^2), mean over the step."""
    drift: complex
    """Integral of p'/M over the step, m."""
    covariance: FloatArray
    """That the encoders' angles give the imbalance, shape (2, 2)."""
    drift_variance: float
    """That the encoders' rates give each coordinate of the drift, m^2."""


@compiled
def locked_masses(imbalance: complex) -> MassInput:
    """Masses at rest at angles that are known exactly."""
    return MassInput(imbalance, 0.0j, np.zeros((2, 2)), 0.0)


@compiled
def mass_vector(moment: float, angle: Pair, rate: Pair) -> tuple[complex, complex]:
    """p = b sum exp(j phi_i), kg m, and its time derivative."""
    place, pace = 0.0j, 0.0j
    for i in range(2):
        arm = moment * complex(math.cos(angle[i]), math.sin(angle[i]))
        place += arm
        pace += complex(0.0, rate[i]) * arm
    return place, pace


@compiled
def encoder_covariance(moment: float, angle: Pair, deviation: float) -> FloatArray:
    """Of p, from encoders with this standard deviation, kg^2 m^2, shape (2, 2)."""
    found = np.zeros((2, 2))
    for i in range(2):
        x, y = -moment * deviation * math.sin(angle[i]), moment * deviation * math.cos(angle[i])
        found[0, 0] += x * x
        found[1, 1] += y * y
        found[0, 1] += x * y
    found[1, 0] = found[0, 1]
    return found


@compiled
def predict(estimate: ImbalanceEstimate, matrices: FilterMatrices, masses: MassInput) -> ImbalanceEstimate:
    """Carry the estimate one step on; the drift acts half at its beginning and half at its end.

    Source: Eqs. 14 and 15 of the paper on eccentric masses, with the whole force of moving masses.
    """
    x, a = estimate.state, matrices.transition
    drive = x.copy()
    drive[0] -= 0.5 * masses.drift.real
    drive[1] -= 0.5 * masses.drift.imag
    drive[4] += masses.imbalance.real
    drive[5] += masses.imbalance.imag
    state = np.zeros(6)
    for i in range(4):
        for k in range(6):
            state[i] += a[i, k] * drive[k]
    state[0] -= 0.5 * masses.drift.real
    state[1] -= 0.5 * masses.drift.imag
    state[4], state[5] = x[4], x[5]
    covariance = _sandwich(a, estimate.covariance)
    # An element at a time, here and below: numba compiles expressions of arrays ten times as long.
    for i in range(6):
        for k in range(6):
            covariance[i, k] += matrices.process[i, k]
    for i in range(4):
        for k in range(4):
            for m in range(2):
                for n in range(2):
                    covariance[i, k] += a[i, 4 + m] * masses.covariance[m, n] * a[k, 4 + n]
    covariance[0, 0] += masses.drift_variance
    covariance[1, 1] += masses.drift_variance
    return ImbalanceEstimate(state, covariance)


@compiled
def correct(
    estimate: ImbalanceEstimate, matrices: FilterMatrices, sample: FloatArray, variance: FloatArray
) -> tuple[ImbalanceEstimate, float]:
    """Take in one sample, one sensor after the other, in Joseph's form, and square its innovation.

    The latter, normalised, has a chi-square distribution of four degrees of freedom, independent of earlier
    samples, when the model is right.

    P+ = (I - k h) P (I - k h)^T + r k k^T stays symmetric and positive whatever rounding does to the gain.
    Source: Eqs. 16 to 21 of the paper on eccentric masses; Bucy and Joseph, "Filtering for Stochastic
    Processes with Applications to Guidance" (1968).
    """
    state, covariance = estimate.state.copy(), estimate.covariance.copy()
    cross_covariance, surprise = np.zeros(6), 0.0
    for m in range(4):
        h, r = matrices.observation[m], variance[m]
        innovation, total = sample[m], r
        for i in range(6):
            innovation -= h[i] * state[i]
            cross_covariance[i] = 0.0
            for k in range(6):
                cross_covariance[i] += covariance[i, k] * h[k]
            total += h[i] * cross_covariance[i]
        if total > 0 and math.isfinite(innovation):
            surprise += innovation * innovation / total
            for i in range(6):
                state[i] += cross_covariance[i] / total * innovation
            _joseph(covariance, total, h, cross_covariance, r)
    return ImbalanceEstimate(state, covariance), surprise


@compiled
def _joseph(p: FloatArray, total: float, h: FloatArray, cross_covariance: FloatArray, r: float) -> None:
    """P <- (I - k h) P (I - k h)^T + r k k^T in place; `cross_covariance` is P h^T, k that over `total`."""
    for i in range(6):
        seen, gain = 0.0, cross_covariance[i] / total
        for k in range(6):
            p[i, k] -= gain * cross_covariance[k]
            seen += p[i, k] * h[k]
        for k in range(6):
            p[i, k] += (r * gain - seen) * cross_covariance[k] / total
    for i in range(6):
        for k in range(i):
            p[i, k] = p[k, i] = 0.5 * (p[i, k] + p[k, i])


@compiled
def turned_back(sample: FloatArray, rotor_angle: float) -> FloatArray:
    """A laboratory sensor's sample along the rotor's axes; the velocity is still seen from outside."""
    c, s = math.cos(rotor_angle), math.sin(rotor_angle)
    return np.array(
        [
            c * sample[0] + s * sample[1],
            c * sample[1] - s * sample[0],
            c * sample[2] + s * sample[3],
            c * sample[3] - s * sample[2],
        ]
    )


@compiled
def imbalance_deviation(covariance: FloatArray) -> float:
    """Largest standard deviation of the imbalance in any direction, kg m."""
    a, b, c = covariance[4, 4], covariance[4, 5], covariance[5, 5]
    return math.sqrt(max(0.5 * (a + c) + math.hypot(0.5 * (a - c), b), 0.0))


@compiled
def start_estimate(position: float, velocity: float, imbalance: float) -> ImbalanceEstimate:
    """Initial estimate, before the first sample: nothing moves and nothing is out of balance."""
    covariance = np.zeros((6, 6))
    covariance[0, 0] = covariance[1, 1] = position * position
    covariance[2, 2] = covariance[3, 3] = velocity * velocity
    covariance[4, 4] = covariance[5, 5] = imbalance * imbalance
    return ImbalanceEstimate(np.zeros(6), covariance)


def imbalance_history(
    start: ImbalanceEstimate,
    *,
    matrices: FilterMatrices,
    samples: FloatArray,
    variance: FloatArray,
    masses: MassInput | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Run the filter over a record: predict, then take in the sample, for each.

    Args: `start`: one step before the first sample.
    Returns: States, shape (n, 6), and covariances, shape (n, 6, 6), after each sample.
    Raises: ValueError: a rotor at rest, which shows no imbalance.
    Source: section 3.1 of the paper on eccentric masses.
    """
    if matrices.speed == 0:
        raise ValueError("a rotor at rest shows no imbalance: the speed must not be zero")
    return _history(
        start,
        matrices,
        np.ascontiguousarray(samples, dtype=np.float64),
        variance,
        masses or locked_masses(0.0j),
    )


@compiled
def _history(
    start: ImbalanceEstimate,
    matrices: FilterMatrices,
    samples: FloatArray,
    variance: FloatArray,
    masses: MassInput,
) -> tuple[FloatArray, FloatArray]:
    count = samples.shape[0]
    states, covariances = np.zeros((count, 6)), np.zeros((count, 6, 6))
    estimate = start
    for i in range(count):
        estimate, _ = correct(predict(estimate, matrices, masses), matrices, samples[i], variance)
        for j in range(6):
            states[i, j] = estimate.state[j]
            for k in range(6):
                covariances[i, j, k] = estimate.covariance[j, k]
    return states, covariances
