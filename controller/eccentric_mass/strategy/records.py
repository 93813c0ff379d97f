"""State and sampled inputs of the strategy."""

from __future__ import annotations

from typing import NamedTuple

from ringbalance.controller.eccentric_mass.estimation.friction_filter import FrictionEstimate
from ringbalance.controller.eccentric_mass.estimation.imbalance_filter import ImbalanceEstimate
from ringbalance.controller.eccentric_mass.estimation.imbalance_model import FilterMatrices
from ringbalance.controller.eccentric_mass.strategy.plan import Plan
from ringbalance.scene.arrays import FloatArray

Pair = tuple[float, float]


class EccentricMeasurement(NamedTuple):
    """One sample of everything that the strategy may look at."""

    time: float
    speed: float
    """W, rad/s."""
    speed_rate: float
    """W', rad/s^2."""
    rotor_angle: float
    """Of the rotor's first axis, rad."""
    vibration: FloatArray
    """Displacement (m) and velocity (m/s) in the sensor's frame: x, y, x', y', shape (4,)."""
    angle: Pair
    """Of the masses, rad, not wrapped."""
    rate: Pair
    """Of the masses, rad/s."""


class Motion(NamedTuple):
    """What the law sees of rotor and masses, in the rotor's frame."""

    speed: float
    """W, rad/s."""
    speed_rate: float
    """W', rad/s^2."""
    position: complex
    """z, m."""
    velocity: complex
    """z', m/s."""
    angle: Pair
    rate: Pair


class Smoothed(NamedTuple):
    """Slow copies of what is measured, in the rotor's frame."""

    position: complex
    velocity: complex
    angle: Pair
    rate: Pair


class Whirl(NamedTuple):
    """The imbalance filter's part of the memory."""

    estimate: ImbalanceEstimate
    matrices: FilterMatrices
    running: bool
    """Whether the filter took in the last sample that was its turn."""
    place: complex
    """p = b sum exp(j phi_i) of the masses at that sample."""
    pace: complex
    """Its time derivative."""
    surprise: float
    """Sum of the normalised innovations squared."""
    judged: int
    """Samples in that sum."""


class Beliefs(NamedTuple):
    """The filters' estimates, as far as the voltages depend on them."""

    imbalance: complex
    deviation: float
    """Largest standard deviation of the imbalance, kg m."""
    friction: tuple[FrictionEstimate, FrictionEstimate]


class StrategyState(NamedTuple):
    """All that changes."""

    sample: int
    """Number of the next sample."""
    plan: Plan
    smoothed: Smoothed
    whirl: Whirl
    beliefs: Beliefs
    torque: Pair
    """Known torques summed over the samples since the friction filter's last step, N m."""
    last_rate: Pair
    """Of the masses, as measured at that step."""
    voltage: Pair
