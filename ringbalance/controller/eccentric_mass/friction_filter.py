"""The friction filter: an extended Kalman filter for the friction arm of each eccentric mass.

While a mass moves, with W the rotor's speed, w its own rate along the track and d = sgn w,

    (J + J_add) w' = -C_add w - d mu b (W + w)^2 + tau,

where tau is the known torque: that of the drive less the load by whirl and speed rate of the rotor.
Friction at rest may take any value up to a bound, so that a sticking mass gives no information on it.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from ringbalance.scene.arrays import Record
from ringbalance.scene.platform.compiled import in_place


class TrackModel(NamedTuple):
    """One eccentric mass on its track, with its drive."""

    inertia: float
    """J + J_add of mass, motor and gears, seen at the mass, kg m^2."""
    damping: float
    """C_add of the motor's back-EMF, seen at the mass, N m s."""
    moment: float
    """b = m_b r_b, kg m."""


class FrictionNoise(NamedTuple):
    """Random parts of the friction filter's model."""

    rate_variance: float
    """Variance of the encoder's rate, rad^2/s^2."""
    acceleration: float
    """White noise on the mass's acceleration, rad^2/s^3."""
    arm: float
    """Random walk of the friction arm, variance per time, m^2/s."""


FRICTION_FILTER: Final = np.dtype(
    [
        ("rate", np.float64),  # of the mass, w, rad/s
        ("arm", np.float64),  # friction arm mu, m
        ("rate_variance", np.float64),  # rad^2/s^2
        ("covariance", np.float64),  # of rate and arm, rad m/s
        ("arm_variance", np.float64),  # m^2
    ]
)
"""Estimate of one mass."""


@in_place
def friction_flow(
    model: TrackModel, rate: float, arm: float, speed: float, torque: float, step: float, euler: bool
) -> tuple[float, float, float]:
    """Integrate a moving mass over one step by the exponential Rosenbrock-Euler rule, stable for any step.

    Returns: w one step later, rad/s, its derivative by the w before, and by mu, rad/(s m).
    Source: Eqs. 31 to 36 of the paper on eccentric masses, rederived: the printed Jacobian has a factor mu
        too many in d/d mu, and lacks inertia and back-EMF of the drive.
    """
    direction = math.copysign(1.0, rate)
    load = direction * model.moment * (speed + rate) ** 2
    slope = (model.damping + 2 * direction * arm * model.moment * (speed + rate)) / model.inertia
    acceleration = (torque - model.damping * rate - arm * load) / model.inertia
    if euler:
        return rate + step * acceleration, 1 - slope * step, -step * load / model.inertia
    decay = math.exp(-slope * step)
    span = step if abs(slope * step) < 1e-9 else -math.expm1(-slope * step) / slope
    return rate + span * acceleration, decay, -span * load / model.inertia


@in_place
def friction_step(
    estimate: Record,
    model: TrackModel,
    noise: FrictionNoise,
    measured_rate: float,
    speed: float,
    torque: float,
    step: float,
    euler: bool,
) -> None:
    """Predict estimate and covariance over one step, and correct them by the encoder's rate.

    Source: Eqs. 32 to 38 of the paper on eccentric masses, with `friction_flow` as transition and Joseph's
        update.
    """
    rate, by_rate, by_arm = friction_flow(model, estimate.rate, estimate.arm, speed, torque, step, euler)
    wander, r = noise.arm * step, noise.rate_variance
    p11 = (
        by_rate**2 * estimate.rate_variance
        + 2 * by_rate * by_arm * estimate.covariance
        + by_arm**2 * (estimate.arm_variance + wander / 3)
        + noise.acceleration * step
    )
    p12 = by_rate * estimate.covariance + by_arm * (estimate.arm_variance + wander / 2)
    p22 = estimate.arm_variance + wander
    seen = p11 + r > 0 and math.isfinite(measured_rate)
    k1, k2 = (p11 / (p11 + r), p12 / (p11 + r)) if seen else (0.0, 0.0)
    innovation = measured_rate - rate if seen else 0.0
    estimate.rate = rate + k1 * innovation
    estimate.arm += k2 * innovation
    estimate.rate_variance = (1 - k1) ** 2 * p11 + r * k1 * k1
    estimate.covariance = (1 - k1) * (p12 - k2 * p11) + r * k1 * k2
    estimate.arm_variance = p22 - 2 * k2 * p12 + k2 * k2 * p11 + r * k2 * k2


@in_place
def friction_restart(estimate: Record, noise: FrictionNoise, measured_rate: float) -> None:
    """Restart a mass that sticks or reverses: rate from the encoder alone, friction arm unchanged."""
    estimate.rate, estimate.rate_variance, estimate.covariance = measured_rate, noise.rate_variance, 0.0
