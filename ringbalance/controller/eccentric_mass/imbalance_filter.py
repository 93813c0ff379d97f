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

from ringbalance.scene.arrays import FloatArray, Record, Records
from ringbalance.scene.platform.compiled import compiled, in_place

Numbers = Sequence[float] | FloatArray

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


IMBALANCE_FILTER: Final = np.dtype(
    [
        ("state", np.float64, (6,)),  # z, v and the imbalance along x and y; v is z' while the masses rest
        ("covariance", np.float64, (6, 6)),
        ("speed", np.float64),  # W that the matrices belong to, rad/s
        ("transition", np.float64, (6, 6)),  # to the state one step later
        ("process", np.float64, (6, 6)),  # covariance of the process noise of one step
        ("observation", np.float64, (4, 6)),  # matrix from state to noise-free sample
        ("half", np.float64, (6, 6)),  # workspace for products
        ("cross", np.float64, (6,)),
    ]
)
"""Estimate, and the matrices of one step of the filter."""


@compiled
def _write_transition(model: WhirlModel, angular_velocity: float, step: float, out: FloatArray) -> None:
    """Write the exact transition over one step, exp(A dt), in closed form.

    The deviation from the steady whirl is a free oscillation in the fixed frame, transformed to the rotor's
    frame; the imbalance sets the steady whirl.
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
    _write_identity(out)
    for i in range(2):
        for k in range(3):
            value = blocks[i][k]
            out[2 * i, 2 * k] = out[2 * i + 1, 2 * k + 1] = value.real
            out[2 * i, 2 * k + 1] = -value.imag
            out[2 * i + 1, 2 * k] = value.imag


def whirl_transition(model: WhirlModel, angular_velocity: float, step: float) -> FloatArray:
    """Exact transition exp(A dt) of the filter's state, shape (6, 6)."""
    out = np.empty((6, 6))
    _write_transition(model, angular_velocity, step, out)
    return out


@in_place
def _write_identity(out: FloatArray) -> None:
    for i in range(out.shape[0]):
        for k in range(6):
            out[i, k] = 1.0 if i == k else 0.0


@compiled
def _write_process(settings: FilterSettings, angular_velocity: float, out: FloatArray) -> None:
    """Write the covariance that white noise builds up within one step, positive semidefinite.

    Integral of E(s) diag(0, 0, q_a, q_a, q_m, q_m) E(s)^T over 0 to dt, by eight Gauss points.
    Source: Van Loan, "Computing integrals involving the matrix exponential", IEEE Trans. Automat. Contr. 23
    (1978), whose integral this is; in place of the paper's diag(O randn), which is no covariance.
    """
    part, half, grown, step = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6)), settings.step
    for i in range(6):
        for k in range(6):
            out[i, k] = 0.0
    for point in range(_GAUSS_POINTS.size):
        time = 0.5 * step * (1.0 + _GAUSS_POINTS[point])
        _write_transition(settings.model, angular_velocity, time, part)
        # Element by element, here and below: numba takes ten times as long to compile array expressions.
        for i in range(6):
            for k in range(6):
                grown[i, k] = 0.0
        grown[2, 2] = grown[3, 3] = settings.acceleration_noise
        grown[4, 4] = grown[5, 5] = settings.imbalance_noise
        _sandwich(part, grown, half)
        for i in range(6):
            for k in range(6):
                out[i, k] += 0.5 * step * _GAUSS_WEIGHTS[point] * grown[i, k]


@in_place
def _sandwich(a: FloatArray, p: FloatArray, half: FloatArray) -> None:
    """P <- A P A^T, symmetric to the last bit, in plain loops: at this size a library call does not pay."""
    for i in range(6):
        for k in range(6):
            half[i, k] = 0.0
        for j in range(6):
            for k in range(6):
                half[i, k] += a[i, j] * p[j, k]
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            for k in range(6):
                total += half[i, k] * a[j, k]
            p[i, j] = p[j, i] = total


@compiled
def set_speed(estimate: Record, settings: FilterSettings, speed: float) -> None:
    """Write the matrices at a speed, rad/s, into an element of type `IMBALANCE_FILTER`.

    A space-fixed sensor measures Z' = (z' + j W z) exp(j W t); turned back by the rotor's angle, which leaves
    the noise unchanged, this is z' + j W z.  A rotor-fixed sensor measures z'.
    Source: Eq. 17 of the paper on eccentric masses, corrected: its printed last row contains the imbalance,
        which the velocity does not depend on.
    """
    estimate.speed = speed
    if settings.euler:
        # Eq. 14 of the paper, I + A dt, whose steady whirl is exact but whose transient is not.
        (mass, damping, stiffness), w = settings.model, speed
        step, out = settings.step, estimate.transition
        _write_identity(out)
        out[0, 2] = out[1, 3] = step
        out[2, 0] = out[3, 1] = (w * w - stiffness / mass) * step
        out[2, 1], out[3, 0] = damping * w / mass * step, -damping * w / mass * step
        out[2, 2] = out[3, 3] = 1.0 - damping / mass * step
        out[2, 3], out[3, 2] = 2 * w * step, -2 * w * step
        out[2, 4] = out[3, 5] = w * w / mass * step
    else:
        _write_transition(settings.model, speed, settings.step, estimate.transition)
    _write_process(settings, speed, estimate.process)
    _write_identity(estimate.observation)
    if settings.laboratory:
        estimate.observation[2, 1], estimate.observation[3, 0] = -speed, speed


@in_place
def begin_whirl(estimate: Record, settings: FilterSettings) -> None:
    """Write the state before the first sample: rotor at rest at its centre, imbalance as estimated before."""
    position, velocity, _ = settings.start
    for i in range(4):
        estimate.state[i] = 0.0
        for k in range(6):
            estimate.covariance[i, k] = estimate.covariance[k, i] = 0.0
    estimate.covariance[0, 0] = estimate.covariance[1, 1] = position * position
    estimate.covariance[2, 2] = estimate.covariance[3, 3] = velocity * velocity


@compiled
def begin_filter(estimate: Record, settings: FilterSettings, speed: float) -> None:
    """Write the state before the first sample, at a speed, rad/s: rotor at rest at its centre, no imbalance.

    Args: `estimate`: an element of type `IMBALANCE_FILTER`, of zeros.
    """
    begin_whirl(estimate, settings)
    estimate.covariance[4, 4] = estimate.covariance[5, 5] = settings.start[2] * settings.start[2]
    set_speed(estimate, settings, speed)


def imbalance_filter(settings: FilterSettings, *, speed: float) -> Records:
    """Filter before its first sample, type `IMBALANCE_FILTER`, shape (1,)."""
    estimate = np.zeros(1, dtype=IMBALANCE_FILTER)
    begin_filter(estimate[0], settings, speed)
    return estimate


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
def predict(estimate: Record, masses: MassInput) -> None:
    """Predict the estimate over one step; half of the drift acts at its beginning, half at its end.

    Source: Eqs. 14 and 15 of the paper on eccentric masses, with the whole force of moving masses.
    """
    x, a, p, (xx, xy, yy) = estimate.state, estimate.transition, estimate.covariance, masses.covariance
    drive = (
        x[0] - 0.5 * masses.drift.real,
        x[1] - 0.5 * masses.drift.imag,
        x[2],
        x[3],
        x[4] + masses.imbalance.real,
        x[5] + masses.imbalance.imag,
    )
    for i in range(4):
        x[i] = 0.0
        for k in range(6):
            x[i] += a[i, k] * drive[k]
    x[0] -= 0.5 * masses.drift.real
    x[1] -= 0.5 * masses.drift.imag
    _sandwich(a, p, estimate.half)
    for i in range(6):
        for k in range(6):
            p[i, k] += estimate.process[i, k]
    for i in range(4):
        for k in range(4):
            p[i, k] += a[i, 4] * xx * a[k, 4]
            p[i, k] += a[i, 4] * xy * a[k, 5]
            p[i, k] += a[i, 5] * xy * a[k, 4]
            p[i, k] += a[i, 5] * yy * a[k, 5]
    p[0, 0] += masses.drift_variance
    p[1, 1] += masses.drift_variance


@in_place
def correct(estimate: Record, sample: Numbers, variance: Numbers) -> float:
    """Correct the estimate by one sample, channel by channel; return the normalised innovation squared.

    With a true model that square has a chi-square distribution with four degrees of freedom, independent of
    earlier samples.

    Joseph's form P+ = (I - k h) P (I - k h)^T + r k k^T stays symmetric and positive despite round-off.
    Args: `sample`, `variance`: x, y, x', y', and the noise variance of each.
    Source: Eqs. 16 to 21 of the paper on eccentric masses; Bucy and Joseph, "Filtering for Stochastic
    Processes with Applications to Guidance" (1968).
    """
    state, p, cross, surprise = estimate.state, estimate.covariance, estimate.cross, 0.0
    for m in range(4):
        h, r = estimate.observation[m], variance[m]
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
            _joseph(p, total, h, cross, r)
    return surprise


@in_place
def _joseph(p: FloatArray, total: float, h: FloatArray, cross: FloatArray, r: float) -> None:
    """P <- (I - k h) P (I - k h)^T + r k k^T in place; `cross` is P h^T, k = `cross`/`total`."""
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


@in_place
def imbalance_deviation(covariance: FloatArray) -> float:
    """Largest standard deviation of the imbalance in any direction, kg m."""
    a, b, c = covariance[4, 4], covariance[4, 5], covariance[5, 5]
    return math.sqrt(max(0.5 * (a + c) + math.hypot(0.5 * (a - c), b), 0.0))


def imbalance_history(
    estimate: Records, *, samples: FloatArray, variance: FloatArray, masses: MassInput | None = None
) -> tuple[FloatArray, FloatArray]:
    """Run a filter over a record: for each sample, predict and then correct.

    Args: `estimate`: type `IMBALANCE_FILTER`, shape (1,), one step before the first sample; not changed.
    Returns: States, shape (n, 6), and covariances, shape (n, 6, 6), after each sample.
    Raises: ValueError: a rotor at rest, which shows no imbalance.
    Source: section 3.1 of the paper on eccentric masses.
    """
    if estimate["speed"][0] == 0:
        raise ValueError("a rotor at rest shows no imbalance: the speed must not be zero")
    states, covariances = np.empty((len(samples), 6)), np.empty((len(samples), 6, 6))
    seen = np.ascontiguousarray(samples, dtype=np.float64)
    _history(estimate.copy()[0], seen, variance, masses or locked_masses(0.0j), states, covariances)
    return states, covariances


@in_place
def _history(
    estimate: Record,
    samples: FloatArray,
    variance: FloatArray,
    masses: MassInput,
    states: FloatArray,
    covariances: FloatArray,
) -> None:
    for i in range(samples.shape[0]):
        predict(estimate, masses)
        correct(estimate, samples[i], variance)
        for j in range(6):
            states[i, j] = estimate.state[j]
            for k in range(6):
                covariances[i, j, k] = estimate.covariance[j, k]
