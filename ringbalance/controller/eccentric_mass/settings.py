"""Constants of the strategy, derived from a scene."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.drive_law import (
    SLOWEST_RATE_RAD_S,
    SMOOTHING_TIME_S,
    DriveLaw,
    believed_whirl,
    track_model,
)
from ringbalance.controller.eccentric_mass.friction_filter import FrictionNoise, TrackModel
from ringbalance.controller.eccentric_mass.imbalance_filter import (
    FilterConstants,
    FilterSettings,
    imbalance_filter,
)
from ringbalance.controller.eccentric_mass.memory import Pair
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.origins import value_at, with_values_at
from ringbalance.scene.uncertain import NORMAL_95

_LEAST_DECAY_TIMES = 2.0
"""Shortest imbalance estimation, in decay times of the rotor."""
_LONGEST_ESTIMATE_FRACTION = 0.5
"""Upper bound of the shortest imbalance estimation, as a fraction of its time limit."""
_NOTICEABLE_FRACTION = 0.25
"""Noticeable travel, as a fraction of the arrival angle."""
_CERTAIN_SIGMA = 5.0
"""Standard deviations of a smoothed rate beyond which a mass counts as moving."""
_CONSTANTS = (
    *("motor.torque_constant", "motor.back_emf_constant", "motor.resistance"),
    *("masses.mass", "masses.guide_radius"),
)
"""Inputs whose uncertainty passes to the friction arms."""
_FRICTION_ERROR_FRACTION = 0.1
"""Distance from the goal at which unknown friction may hold a mass, as a fraction of the arrival angle."""


class Gates(NamedTuple):
    """Limits between the stages; fields named as keys of [supervisor] or [fine_tuning] have their values."""

    start: float
    limit: float
    lowest_speed: float
    arrival_angle: float
    arrival_rate: float
    imbalance_time: float
    friction_time: float
    positioning_time: float
    fine_tuning_time: float
    target_error: Pair
    noticeable: float
    """Smallest approach to the goal within 1 s of masses that are not held, rad."""
    imbalance_gate: float
    """Relative standard deviation of the imbalance at which its estimation ends."""
    friction_gate: float
    """Relative standard deviation of a friction arm at which its estimation ends."""
    constants: tuple[float, float, float]
    """Relative variance of B_add/b, relative covariance of B_add/b and C_add/b, relative variance of C_add/b.

    While the masses circulate, B_add V = C_add w + mu b (W + w)^2 + load, and the rotor's load has the factor
    b: both ratios limit the accuracy of a friction arm, even without noise.
    """
    friction_torque: float
    """Standard deviation of the friction torque below which it does not affect arrival, N m."""
    least_estimate: float
    """Shortest time of imbalance estimation, s."""
    stall_rate: float
    """Rate below which the drive nearly stalls, rad/s."""
    tuning_step: float
    tuning_stop: float
    tuning_near: float
    """Smallest distance from its goal to which a mass can be brought, rad."""
    wait: float
    average: float
    margin: float
    """Noise of a mean vibration (95 %), m: a trial or a correction counts as better beyond it."""
    gap: float
    """Angle that one mass occupies on the track, rad."""
    by_trials: bool
    """True if the masses are tuned by trials alone, as in the paper."""

    @classmethod
    def of(cls, scene: EccentricScene, law: DriveLaw) -> Gates:
        """Derive the limits of a scene."""
        keys, tuning, whirl = scene.supervisor, scene.fine_tuning, law.whirl
        values = vars(tuning) | vars(keys)
        # Long enough for the rotor's transient, which depends most on the assumed bearing, to decay.
        least_estimate = _LONGEST_ESTIMATE_FRACTION * keys.imbalance_time
        if whirl.damping > 0:
            least_estimate = min(_LEAST_DECAY_TIMES * 2 * whirl.mass / whirl.damping, least_estimate)
        constants, ratios = np.zeros((2, 2)), _drive_ratios(scene)
        for plant in off_by_one(scene, _CONSTANTS):
            change = np.divide(_drive_ratios(plant) - ratios, ratios, out=np.zeros(2), where=ratios > 0)
            constants += np.outer(change, change)
        return cls(
            **{name: values[name] for name in cls._fields if name in values},
            noticeable=max(_NOTICEABLE_FRACTION * keys.arrival_angle, 2 * law.near),
            imbalance_gate=scene.imbalance_filter.gate,
            friction_gate=scene.friction_filter.gate,
            constants=(float(constants[0, 0]), float(constants[0, 1]), float(constants[1, 1])),
            friction_torque=_FRICTION_ERROR_FRACTION * law.position_gain * keys.arrival_angle,
            least_estimate=least_estimate,
            stall_rate=scene.friction_filter.stall_share * scene.friction_filter.drive_speed,
            tuning_step=tuning.step,
            tuning_stop=tuning.stop,
            tuning_near=2 * law.near,
            margin=scene.mean_noise,
            gap=scene.masses.gap,
            by_trials=keys.correction == "trials",
        )


class _SensorSettings(NamedTuple):
    """Standard deviations that the imbalance filter assumes of its sensors."""

    position: float
    velocity: float
    angle: float
    rate: float


class _FrictionSettings(NamedTuple):
    """Constants of the friction filter and of the drives in the friction stage."""

    start: Pair
    """Standard deviations of rate, rad/s, and arm, m, before the first sample."""
    noise: FrictionNoise
    track: TrackModel
    """One mass with its drive; the inertia is reduced by b^2/M, since the rotor yields."""
    least_motion: float
    """Smoothed rate below which the filter uses no sample of a mass, rad/s."""
    euler: bool
    """True for the paper's transition in place of the exponential one."""
    every: int
    """Samples between two steps of the friction filter."""
    drive_speed: float
    speed_gain: float
    """gamma, gain of the speed control, V s/rad."""
    pair_gain: float
    """Gain of the control of the angle between the masses, V/rad; zero for the paper's law."""

    @classmethod
    def of(cls, scene: EccentricScene) -> _FrictionSettings:
        keys, track, sensor = scene.friction_filter, track_model(scene), scene.sensor
        given_way = track.moment**2 / believed_whirl(scene).mass
        inertia = track.inertia - given_way
        # The other mass's acceleration is a difference of two measured rates.
        noise = keys.rate_noise**2 * (1 + 2 * (given_way / inertia) ** 2)
        smooth = sensor.encoder_rate_noise * math.sqrt(sensor.step / (2 * SMOOTHING_TIME_S))
        return cls(
            start=(keys.initial_rate, keys.initial_friction),
            noise=FrictionNoise(noise, keys.rate_walk**2, keys.friction_walk**2),
            track=track._replace(inertia=inertia),
            least_motion=max(_CERTAIN_SIGMA * smooth, SLOWEST_RATE_RAD_S),
            euler=keys.discretisation == "euler",
            every=max(round(keys.step / sensor.step), 1),
            drive_speed=keys.drive_speed,
            speed_gain=keys.speed_gain,
            pair_gain=keys.pair_gain,
        )


class StrategySettings(NamedTuple):
    """Constants of the whole strategy."""

    step: float
    """Time between two samples, s."""
    laboratory: bool
    """True if the vibration is measured in the fixed frame."""
    smoothing: float
    """Weight of a new sample in the smoothed angles, rates and vibration."""
    voltage_every: int
    """Samples for which a voltage is held."""
    law: DriveLaw
    gates: Gates
    filter: FilterConstants
    sensor: _SensorSettings
    filter_every: int
    """Samples between two steps of the imbalance filter."""
    friction: _FrictionSettings

    @classmethod
    def of(cls, scene: EccentricScene) -> StrategySettings:
        """Derive the constants of the strategy from a scene."""
        sensor, keys, law = scene.sensor, scene.imbalance_filter, DriveLaw.of(scene)
        every = max(round(keys.step / sensor.step), 1)
        return cls(
            step=sensor.step,
            laboratory=sensor.frame == "laboratory",
            smoothing=-math.expm1(-sensor.step / SMOOTHING_TIME_S),
            voltage_every=max(round(scene.lqr.step / sensor.step), 1),
            law=law,
            gates=Gates.of(scene, law),
            filter=imbalance_filter(
                filter_settings(scene)._replace(step=sensor.step * every), speeds=scene.rotor.plateaus
            ),
            sensor=_SensorSettings(
                keys.position_noise, keys.velocity_noise, sensor.encoder_noise, sensor.encoder_rate_noise
            ),
            filter_every=every,
            friction=_FrictionSettings.of(scene),
        )


def filter_settings(scene: EccentricScene) -> FilterSettings:
    """Derive the constants of the imbalance filter."""
    keys = scene.imbalance_filter
    return FilterSettings(
        model=believed_whirl(scene),
        acceleration_noise=keys.velocity_walk**2,
        imbalance_noise=keys.unbalance_walk**2,
        start=(keys.initial_position, keys.initial_velocity, keys.initial_unbalance),
        step=keys.step,
        laboratory=scene.sensor.frame == "laboratory",
        euler=keys.discretisation == "euler",
    )


def off_by_one(scene: EccentricScene, inputs: Collection[str]) -> Iterator[EccentricScene]:
    """Yield the scene with each of these inputs, if stated uncertain, one standard deviation off."""
    for each in scene.uncertainty:
        if each.quantity in inputs:
            value = value_at(scene, each.quantity)
            yield with_values_at(scene, {each.quantity: value + each.absolute(value) / NORMAL_95})


def _drive_ratios(plant: EccentricScene) -> FloatArray:
    """Ratios B_add/b and C_add/b of the drives, shape (2,)."""
    constants = PlantParameters.of(plant)
    return np.array([constants.drive_gain, constants.drive_damping]) / constants.moment
