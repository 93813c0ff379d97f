"""The imbalance filter: a Kalman filter for rotor-fixed whirl with an unknown constant imbalance.

It holds while the speed is constant, also for masses that move.  With p = b sum exp(j phi_i) their force on
the rotor is b sum [(W + phi_i')^2 - j phi_i''] exp(j phi_i) = W^2 p - 2 j W p' - p''.  With v = z' + p'/M in
place of z' no acceleration is left, and no noise of an encoder is differentiated:

    z' = v - p'/M,    M v' + 2 j W M v - M W^2 z + C_B (v + j W z) + K_B z = W^2 (theta + p) + C_B p'/M.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.estimation.imbalance_model import (
    FilterMatrices,
    ProcessNoise,
    WhirlModel,
    filter_matrices,
    sandwich,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import compiled

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
    covariance = sandwich(a, estimate.covariance)
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


def predicted_deviation(
    start: ImbalanceEstimate,
    *,
    model: WhirlModel,
    noise: ProcessNoise,
    variance: FloatArray,
    angular_velocity: float,
    step: float,
    duration: float,
    laboratory: bool = False,
    masses: MassInput | None = None,
) -> FloatArray:
    """How well the imbalance can be known, before anything is measured.

    The covariance does not depend on the samples.  The steady whirl is W^2/|K_B - M W^2 + j C_B W| per
    imbalance, so that at low speed the deviation grows as 1/W^2.
    Args: `laboratory`: whether the sensor stands still.
    Returns: Standard deviation of the imbalance after each step, kg m, shape (duration/step,).
    Raises: ValueError: a rotor at rest.
    """
    matrices = filter_matrices(model, noise, angular_velocity, step, laboratory, False)
    blank = np.zeros((max(round(duration / step), 1), 4))
    _, covariances = imbalance_history(
        start, matrices=matrices, samples=blank, variance=variance, masses=masses
    )
    return np.array([imbalance_deviation(covariance) for covariance in covariances])
