"""The friction filter: an extended Kalman filter for the friction arm of each eccentric mass.

While a mass moves, with W the rotor's speed, w its own rate along the track and d = sgn w,

    (J + J_add) w' = -C_add w - d mu b (W + w)^2 + tau,

where tau is all that is known: the drive's torque less what the whirl and the rotor's speed rate ask for.
Friction at rest is a set, not a number, so nothing is learnt from a mass that sticks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ringbalance.scene.platform.compiled import compiled


class TrackModel(NamedTuple):
    """One eccentric mass on its track, with its drive."""

    inertia: float
    """J + J_add of mass, motor and gears, seen at the mass, kg m^2."""
    damping: float
    """C_add of the motor's back-EMF, seen at the mass, N m s."""
    moment: float
    """b = m_b r_b, kg m."""


class FrictionNoise(NamedTuple):
    """What the friction filter takes to be random."""

    rate_variance: float
    """Of the encoder's rate, rad^2/s^2."""
    acceleration: float
    """White noise on the mass's acceleration, rad^2/s^3."""
    arm: float
    """How fast the friction arm may wander, m^2/s."""


class FrictionEstimate(NamedTuple):
    """Estimate of one mass's state."""

    rate: float
    """w, rad/s."""
    arm: float
    """Friction arm mu, m."""
    rate_variance: float
    covariance: float
    """Of rate and arm, rad m/s."""
    arm_variance: float


class _FrictionFlow(NamedTuple):
    """The motion of a mass over one step and how it hangs on rate and arm."""

    rate: float
    """w one step later, rad/s."""
    by_rate: float
    """d w_k/d w_(k-1)."""
    by_arm: float
    """d w_k/d mu, rad/(s m)."""


@compiled
def _friction_flow(
    model: TrackModel, rate: float, arm: float, speed: float, torque: float, step: float, euler: bool
) -> _FrictionFlow:
    """Carry a moving mass one step on, by the exponential Rosenbrock-Euler rule, which bears any step.

    Returns: The flow and its derivatives; the printed Jacobian carries the arm once too often in d/d mu, and
    leaves the drive's inertia and back-EMF out.
    Source: Eqs. 31 to 36 of the paper on eccentric masses, rederived.
    """
    direction = math.copysign(1.0, rate)
    load = direction * model.moment * (speed + rate) ** 2
    slope = (model.damping + 2 * direction * arm * model.moment * (speed + rate)) / model.inertia
    acceleration = (torque - model.damping * rate - arm * load) / model.inertia
    if euler:
        return _FrictionFlow(rate + step * acceleration, 1 - slope * step, -step * load / model.inertia)
    decay = math.exp(-slope * step)
    span = step if abs(slope * step) < 1e-9 else -math.expm1(-slope * step) / slope
    return _FrictionFlow(rate + span * acceleration, decay, -span * load / model.inertia)


@compiled
def friction_step(
    estimate: FrictionEstimate,
    model: TrackModel,
    noise: FrictionNoise,
    measured_rate: float,
    speed: float,
    torque: float,
    step: float,
    euler: bool,
) -> FrictionEstimate:
    """Predict by the flow, its covariance by the flow's derivatives, and take in the encoder's rate.

    Source: Eqs. 32 to 38 of the paper on eccentric masses, with the flow as transition and Joseph's update.
    """
    flow = _friction_flow(model, estimate.rate, estimate.arm, speed, torque, step, euler)
    wander = noise.arm * step
    p11 = (
        flow.by_rate**2 * estimate.rate_variance
        + 2 * flow.by_rate * flow.by_arm * estimate.covariance
        + flow.by_arm**2 * (estimate.arm_variance + wander / 3)
        + noise.acceleration * step
    )
    p12 = flow.by_rate * estimate.covariance + flow.by_arm * (estimate.arm_variance + wander / 2)
    p22 = estimate.arm_variance + wander
    total = p11 + noise.rate_variance
    if not (total > 0 and math.isfinite(measured_rate)):
        return FrictionEstimate(flow.rate, estimate.arm, p11, p12, p22)
    k1, k2, r = p11 / total, p12 / total, noise.rate_variance
    innovation = measured_rate - flow.rate
    return FrictionEstimate(
        flow.rate + k1 * innovation,
        estimate.arm + k2 * innovation,
        (1 - k1) ** 2 * p11 + r * k1 * k1,
        (1 - k1) * (p12 - k2 * p11) + r * k1 * k2,
        p22 - 2 * k2 * p12 + k2 * k2 * p11 + r * k2 * k2,
    )


@compiled
def friction_restart(
    estimate: FrictionEstimate, noise: FrictionNoise, measured_rate: float
) -> FrictionEstimate:
    """Rate from the encoder alone, arm as known, of a mass that sticks or turns: no flow holds there."""
    return FrictionEstimate(measured_rate, estimate.arm, noise.rate_variance, 0.0, estimate.arm_variance)
