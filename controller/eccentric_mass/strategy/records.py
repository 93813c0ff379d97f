"""Settings, state and sampled inputs of the strategy."""

from __future__ import annotations

from typing import NamedTuple

from ringbalance.controller.eccentric_mass.estimation.friction_filter import (
    FrictionEstimate,
    FrictionNoise,
    TrackModel,
)
from ringbalance.controller.eccentric_mass.estimation.imbalance_filter import ImbalanceEstimate
from ringbalance.controller.eccentric_mass.estimation.imbalance_model import (
    FilterMatrices,
    ProcessNoise,
    WhirlModel,
)
from ringbalance.controller.eccentric_mass.strategy.plan import Gates, Plan
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


class DriveLaw(NamedTuple):
    """What the law of the voltages knows of masses, drives and sensors."""

    whirl: WhirlModel
    track: TrackModel
    mass_inertia: float
    """J of one mass alone, kg m^2."""
    torque_per_volt: float
    """B_add, N m/V."""
    maximum_voltage: float
    """V; infinite for no limit."""
    position_gain: float
    rate_gain: float
    breaks_away: bool
    """Whether friction is compensated so that a mass at rest breaks away; else it is not compensated."""
    slow: float
    """Rate below which a mass counts as resting, rad/s."""
    near: float
    """Distance from its place within which a resting mass is left to friction, rad."""


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


class ImbalanceSettings(NamedTuple):
    """Of the imbalance filter."""

    noise: ProcessNoise
    position_deviation: float
    """Of the displacement sensors as assumed, m."""
    velocity_deviation: float
    """Of the velocity sensors as assumed, m/s."""
    start_position: float
    """Standard deviation before the first sample, m."""
    start_velocity: float
    start_imbalance: float
    encoder_deviation: float
    encoder_rate_deviation: float
    euler: bool
    """The paper's transition in place of the exact one."""
    every: int
    """Samples between two steps."""


class FrictionSettings(NamedTuple):
    """Of the friction filter and the drive meanwhile."""

    start: FrictionEstimate
    noise: FrictionNoise
    track: TrackModel
    """Whose inertia is less by b^2/M, as the rotor gives way."""
    least_motion: float
    """Smoothed rate below which a mass teaches the filter nothing."""
    euler: bool
    """The paper's transition in place of the exponential one."""
    every: int
    """Samples between two steps."""
    drive_speed: float
    speed_gain: float
    """gamma, V s/rad."""
    pair_gain: float
    """V/rad; zero: the paper's law."""


class StrategySettings(NamedTuple):
    """All that does not change."""

    step: float
    """Between samples, s."""
    laboratory: bool
    """Whether the vibration is measured in the fixed frame."""
    smoothing: float
    """Share of a new sample in the smoothed angles, rates and vibration."""
    voltage_every: int
    """Samples for which a voltage is held."""
    law: DriveLaw
    gates: Gates
    imbalance: ImbalanceSettings
    friction: FrictionSettings


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
