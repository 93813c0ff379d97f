"""The imbalance filter: a Kalman filter for rotor-fixed whirl with an unknown constant imbalance.

State of six: x, y, x', y' in the rotor-fixed frame, and the imbalance (kg m) along the same axes.  The rotor
turns at a constant speed W and the eccentric masses are locked to it:

    M (z'' + 2 j W z' - W^2 z) + C_B (z' + j W z) + K_B z = W^2 theta,    z = x + j y.

This holds at a speed rate of zero only.  The force of masses that move is, with
p = b sum exp(j phi_i), b sum [(W + phi_i')^2 - j phi_i''] exp(j phi_i) = W^2 p - 2 j W p' - p''.  With
v = z' + p'/M in place of z' no acceleration is left, and no noise of an encoder is differentiated:

    z' = v - p'/M,    M v' + 2 j W M v - M W^2 z + C_B (v + j W z) + K_B z = W^2 (theta + p) + C_B p'/M.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

from ringbalance.scene.arrays import ComplexArray, FloatArray, Record, as_real
from ringbalance.scene.platform.compiled import in_place

Numbers = Sequence[float] | FloatArray


class WhirlModel(NamedTuple):
    """The rotor on its bearing, as configured in the filter."""

    mass: float
    """M = m_r + 2 m_b, kg."""
    damping: float
    """C_B, N s/m."""
    stiffness: float
    """K_B, N/m."""

    def euler_step_limit(self, *, angular_velocity: npt.ArrayLike) -> FloatArray:
        """Longest step at which the explicit Euler transition of the paper is stable, s.

        Each eigenvalue p of the whirl in the rotor's frame must keep |1 + p dt| at most 1, so
        dt = min(-2 Re p / |p|^2), with p = s - j W and s the roots of M s^2 + C_B s + K_B.
        Returns: Shape of the angular velocity; zero without damping.
        Source: follows from Eq. 14 of the paper on eccentric masses.
        """
        w = np.asarray(angular_velocity, dtype=np.float64)
        half = self.damping / (2 * self.mass)
        root = cmath.sqrt(half**2 - self.stiffness / self.mass)
        limits = [-2 * s.real / np.abs(s - 1j * w) ** 2 for s in (-half + root, -half - root)]
        return np.asarray(np.minimum(*limits), dtype=np.float64)


class FilterSettings(NamedTuple):
    """Assumptions of the filter; process noises are white, given as variance per unit time."""

    model: WhirlModel
    acceleration_noise: float
    """Noise of the rotor's acceleration along each axis, m^2/s^3."""
    imbalance_noise: float
    """Random walk of the imbalance along each axis, variance per time, kg^2 m^2/s."""
    start: tuple[float, float, float]
    """Standard deviations before the first sample of displacement, m, velocity, m/s, and imbalance, kg m."""
    step: float
    """Time between two samples of the filter, s."""
    laboratory: bool
    """True if the sensor is fixed in space; its samples are turned back by the rotor's angle."""
    euler: bool
    """True for the paper's transition in place of the exact one."""


PLATEAU_FRACTION: Final = 0.01
"""Largest distance of a measured speed from a plateau whose matrices it takes, as a fraction of its speed."""


class FilterConstants(NamedTuple):
    """Matrices F, Q and H of one filter step at each speed that the rotor keeps, the plateaus of its profile.

    The model holds at constant speed only, so that no other speed needs matrices.  A measured speed takes
    those of the nearest plateau; farther than `PLATEAU_FRACTION` from all of them the filter waits.  A speed
    that is off by a fraction d changes the estimate by d |d ln alpha / d ln W| of itself, 2 d far below the
    critical speed, which the correction by measured vibration removes.
    """

    start: tuple[float, float, float]
    """Standard deviations before the first sample of displacement, m, velocity, m/s, and imbalance, kg m."""
    step: float
    """Time between two samples, s."""
    speed: FloatArray
    """W of the plateaus, rad/s, shape (n,)."""
    transition: FloatArray
    """F, to the state one step later, shape (n, 6, 6)."""
    process: FloatArray
    """Q, covariance of the process noise of one step, shape (n, 6, 6)."""
    observation: FloatArray
    """H, from the state to a sample without noise, shape (n, 4, 6)."""


IMBALANCE_FILTER: Final = np.dtype(
    [
        ("state", np.float64, (6,)),  # z, v and the imbalance along x and y; v is z' while the masses rest
        ("covariance", np.float64, (6, 6)),
        ("plateau", np.int64),  # index of the matrices in use; -1 for none
        ("half", np.float64, (6, 6)),  # workspace for products
        ("cross", np.float64, (6,)),
    ]
)
"""Estimate of the filter."""


def _generator(model: WhirlModel, speed: float) -> ComplexArray:
    """A of (z, v, theta)' = A (z, v, theta), shape (3, 3).

    Source: Eq. 13 of the paper on eccentric masses.
    """
    (mass, damping, stiffness), w = model, speed
    pull = w * w - (stiffness + 1j * damping * w) / mass
    return np.array([[0, 1, 0], [pull, -damping / mass - 2j * w, w * w / mass], [0, 0, 0]])


def whirl_transition(model: WhirlModel, speed: float, step: float) -> FloatArray:
    """Exact transition exp(A dt) of the filter's state, shape (6, 6)."""
    return as_real(expm(_generator(model, speed) * step))


def imbalance_filter(settings: FilterSettings, *, speeds: npt.ArrayLike) -> FilterConstants:
    """Matrices of a filter at the speeds of the plateaus, rad/s, shape (n,).

    With A of the whirl and S = diag(0, q_a, q_m), exp([[-A, S], [0, A^H]] dt) holds F^H at lower right and
    F^-1 Q at upper right.  F^-1 grows with the damping; a long step is therefore halved k times, and
    Q(2 dt) = F Q F^H + Q leads back.  The paper's transition I + A dt has an exact steady whirl but not an
    exact transient; its process noise diag(O randn) is no covariance.
    A space-fixed sensor measures Z' = (z' + j W z) exp(j W t); turned back by the rotor's angle, which leaves
    the noise unchanged, this is z' + j W z.  A rotor-fixed sensor measures z'.
    Source: Van Loan, "Computing integrals involving the matrix exponential", IEEE Trans. Automat. Contr. 23
    (1978); Eqs. 14 and 17 of the paper on eccentric masses, the latter without the imbalance in its printed
    last row, on which the velocity does not depend.
    """
    plateaus, model = np.atleast_1d(np.asarray(speeds, dtype=np.float64)), settings.model
    transition, process = np.empty((2, plateaus.size, 6, 6))
    observation = np.zeros((plateaus.size, 4, 6))
    power = np.diag([0.0, settings.acceleration_noise, settings.imbalance_noise])
    halvings = math.ceil(math.log2(max(model.damping / model.mass * settings.step, 1.0)))
    for i, w in enumerate(plateaus):
        generator = _generator(model, w)
        block = np.block([[-generator, power], [np.zeros((3, 3)), generator.conj().T]])
        exponential = expm(block * (settings.step / 2**halvings))
        exact = exponential[3:, 3:].conj().T
        noise = exact @ exponential[:3, 3:]
        for _ in range(halvings):
            exact, noise = exact @ exact, exact @ noise @ exact.conj().T + noise
        transition[i] = as_real(np.eye(3) + generator * settings.step if settings.euler else exact)
        process[i] = as_real(0.5 * (noise + noise.conj().T))
        observation[i, range(4), range(4)] = 1.0
        if settings.laboratory:
            observation[i, 2, 1], observation[i, 3, 0] = -w, w
    return FilterConstants(settings.start, settings.step, plateaus, transition, process, observation)


@in_place
def plateau_at(constants: FilterConstants, speed: float) -> int:
    """Index of the nearest plateau within `PLATEAU_FRACTION` of its speed, rad/s; -1 if there is none."""
    nearest, least = -1, math.inf
    for i in range(constants.speed.size):
        away = abs(speed - constants.speed[i])
        if away < least and away <= PLATEAU_FRACTION * abs(constants.speed[i]):
            nearest, least = i, away
    return nearest


@in_place
def begin_whirl(estimate: Record, constants: FilterConstants) -> None:
    """Write the state before the first sample: rotor at rest at its centre, imbalance as estimated before."""
    position, velocity, _ = constants.start
    for i in range(4):
        estimate.state[i] = 0.0
        for k in range(6):
            estimate.covariance[i, k] = estimate.covariance[k, i] = 0.0
    estimate.covariance[0, 0] = estimate.covariance[1, 1] = position * position
    estimate.covariance[2, 2] = estimate.covariance[3, 3] = velocity * velocity


@in_place
def begin_filter(estimate: Record, constants: FilterConstants) -> None:
    """Write the state before the first sample: rotor at rest at its centre, no imbalance, first plateau.

    Args: `estimate`: an element of type `IMBALANCE_FILTER`, of zeros.
    """
    begin_whirl(estimate, constants)
    estimate.covariance[4, 4] = estimate.covariance[5, 5] = constants.start[2] * constants.start[2]


class MassInput(NamedTuple):
    """Effect of the eccentric masses within one step of the filter."""

    imbalance: complex
    """p + C_B p'/(M W^2), mean over the step."""
    drift: complex
    """Integral of p'/M over the step, m."""
    covariance: tuple[float, float, float]
    """Covariance of the imbalance by encoder noise, xx, xy and yy, kg^2 m^2."""
    drift_variance: float
    """Variance of each coordinate of the drift by encoder noise, m^2."""


def locked_masses(imbalance: complex) -> MassInput:
    """Effect of masses at rest at angles that are known exactly."""
    return MassInput(imbalance, 0.0j, (0.0, 0.0, 0.0), 0.0)


@in_place
def mass_vector(moment: float, angle: Numbers, rate: Numbers) -> tuple[complex, complex]:
    """p = b sum exp(j phi_i), kg m, and its time derivative."""
    vector, vector_rate = 0.0j, 0.0j
    for i in range(2):
        arm = moment * complex(math.cos(angle[i]), math.sin(angle[i]))
        vector += arm
        vector_rate += complex(0.0, rate[i]) * arm
    return vector, vector_rate


@in_place
def encoder_covariance(moment: float, angle: Numbers, deviation: float) -> tuple[float, float, float]:
    """Covariance of p by encoder noise of standard deviation `deviation`, xx, xy and yy, kg^2 m^2."""
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(2):
        x, y = -moment * deviation * math.sin(angle[i]), moment * deviation * math.cos(angle[i])
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
    return xx, xy, yy


@in_place
def predict(constants: FilterConstants, estimate: Record, masses: MassInput) -> None:
    """Predict the estimate over one step; half of the drift acts at its beginning, half at its end.

    Source: Eqs. 14 and 15 of the paper on eccentric masses, with the whole force of moving masses.
    """
    x, p, half, (xx, xy, yy) = estimate.state, estimate.covariance, estimate.half, masses.covariance
    a, q = constants.transition[estimate.plateau], constants.process[estimate.plateau]
    shift = 0.5 * masses.drift
    x[0], x[1] = x[0] - shift.real, x[1] - shift.imag
    drive = (x[0], x[1], x[2], x[3], x[4] + masses.imbalance.real, x[5] + masses.imbalance.imag)
    for i in range(4):
        x[i] = 0.0
        for k in range(6):
            x[i] += a[i, k] * drive[k]
    x[0], x[1] = x[0] - shift.real, x[1] - shift.imag
    # P <- A P A^T + Q, symmetric to the last bit, in plain loops: at this size a library call does not pay.
    for i in range(6):
        for k in range(6):
            half[i, k] = 0.0
        for j in range(6):
            for k in range(6):
                half[i, k] += a[i, j] * p[j, k]
    for i in range(6):
        for k in range(i + 1):
            total = q[i, k]
            for j in range(6):
                total += half[i, j] * a[k, j]
            p[i, k] = p[k, i] = total
    for i in range(4):
        for k in range(4):
            p[i, k] += a[i, 4] * xx * a[k, 4]
            p[i, k] += a[i, 4] * xy * a[k, 5]
            p[i, k] += a[i, 5] * xy * a[k, 4]
            p[i, k] += a[i, 5] * yy * a[k, 5]
    p[0, 0] += masses.drift_variance
    p[1, 1] += masses.drift_variance


@in_place
def correct(constants: FilterConstants, estimate: Record, sample: Numbers, variance: Numbers) -> float:
    """Correct the estimate by one sample, channel by channel; return the normalised innovation squared.

    With a true model that square has a chi-square distribution with four degrees of freedom, independent of
    earlier samples.

    Joseph's form P+ = (I - k h) P (I - k h)^T + r k k^T, with P h^T as `cross`, stays symmetric and positive
    despite round-off.
    Args: `sample`, `variance`: x, y, x', y', and the noise variance of each.
    Source: Eqs. 16 to 21 of the paper on eccentric masses; Bucy and Joseph, "Filtering for Stochastic
    Processes with Applications to Guidance" (1968).
    """
    state, p, cross, surprise = estimate.state, estimate.covariance, estimate.cross, 0.0
    for m in range(4):
        h, r = constants.observation[estimate.plateau, m], variance[m]
        innovation, total = sample[m], r
        for i in range(6):
            innovation -= h[i] * state[i]
            cross[i] = 0.0
            for k in range(6):
                cross[i] += p[i, k] * h[k]
            total += h[i] * cross[i]
        if total > 0 and math.isfinite(innovation):
            surprise += innovation * innovation / total
            for i in range(6):
                state[i] += cross[i] / total * innovation
            for i in range(6):
                seen, gain = 0.0, cross[i] / total
                for k in range(6):
                    p[i, k] -= gain * cross[k]
                    seen += p[i, k] * h[k]
                for k in range(6):
                    p[i, k] += (r * gain - seen) * cross[k] / total
            for i in range(6):
                for k in range(i):
                    p[i, k] = p[k, i] = 0.5 * (p[i, k] + p[k, i])
    return surprise


@in_place
def imbalance_deviation(covariance: FloatArray) -> float:
    """Largest standard deviation of the imbalance in any direction, kg m."""
    a, b, c = covariance[4, 4], covariance[4, 5], covariance[5, 5]
    return math.sqrt(max(0.5 * (a + c) + math.hypot(0.5 * (a - c), b), 0.0))


def imbalance_history(
    constants: FilterConstants, *, samples: FloatArray, variance: FloatArray, masses: MassInput | None = None
) -> tuple[FloatArray, FloatArray]:
    """Run a filter over a record at its first plateau: for each sample, predict and then correct.

    Returns: States, shape (n, 6), and covariances, shape (n, 6, 6), after each sample.
    Raises: ValueError: a rotor at rest, which shows no imbalance.
    Source: section 3.1 of the paper on eccentric masses.
    """
    if constants.speed[0] == 0:
        raise ValueError("a rotor at rest shows no imbalance: the speed must not be zero")
    history = np.zeros(len(samples) + 1, dtype=IMBALANCE_FILTER)
    begin_filter(history[0], constants)
    measured = np.ascontiguousarray(samples, dtype=np.float64)
    _fill(constants, measured, variance, masses or locked_masses(0.0j), history)
    return history["state"][1:], history["covariance"][1:]


@in_place
def _fill(
    constants: FilterConstants, samples: FloatArray, variance: FloatArray, masses: MassInput, history: Record
) -> None:
    for i in range(samples.shape[0]):
        estimate = history[i + 1]
        for j in range(6):
            estimate.state[j] = history[i].state[j]
            for k in range(6):
                estimate.covariance[j, k] = history[i].covariance[j, k]
        predict(constants, estimate, masses)
        correct(constants, estimate, samples[i], variance)
