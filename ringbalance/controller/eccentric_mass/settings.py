"""What the strategy is given, and how it follows from a scene."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.control_records import Supervisor
from ringbalance.controller.eccentric_mass.drive_law import (
    SLOWEST_RATE,
    SMOOTHING_TIME,
    DriveLaw,
    Pair,
    believed_whirl,
    track_model,
)
from ringbalance.controller.eccentric_mass.friction_filter import FrictionNoise, TrackModel
from ringbalance.controller.eccentric_mass.imbalance_filter import FilterSettings
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.origins import value_at, with_values_at
from ringbalance.scene.uncertain import NORMAL_95

_DWELL_TIME = 0.2
"""For which a mass must have arrived, s."""
_DECAYS = 2.0
"""Decay times of the rotor that the imbalance is estimated for at least."""
_LONGEST_ESTIMATE = 0.5
"""Share of the estimation's time limit that this may take at most."""
_NOTICEABLE = 0.25
"""Share of the arrival angle."""
_LEAST_DRIVE_TIME = 1.0
"""Of the friction stage, s: long against the drive's own time constants."""
_LONGEST_TRIAL_MOVE = 10.0
"""s."""
_CERTAIN = 5.0
"""Standard deviations of a smoothed rate beyond which a mass moves."""
_CONSTANTS = (
    *("motor.torque_constant", "motor.back_emf_constant", "motor.resistance"),
    *("masses.mass", "masses.guide_radius"),
)
"""Inputs that a friction arm is as well known as."""
_FRICTION_ERROR = 0.1
"""Share of the arrival angle that unknown friction may hold a mass off."""


class Gates(NamedTuple):
    """Limits between the stages; names of [supervisor] are its keys."""

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
    """Least angle by which masses that are not held come nearer within a second, rad."""
    dwell: float
    """For which a mass must have arrived, s."""
    imbalance_gate: float
    """Relative standard deviation."""
    friction_gate: float
    """Relative standard deviation."""
    constants: tuple[float, float, float]
    """Relative variances and covariance of B_add/b and C_add/b, see `_constants_covariance`."""
    friction_torque: float
    """Standard deviation of the friction torque that makes no difference to arrival, N m."""
    least_estimate: float
    """Shortest time of imbalance estimation, s."""
    least_drive: float
    """Shortest time of friction estimation, s."""
    stall_rate: float
    """Rate below which the drive nearly stalls, rad/s."""
    tuning_step: float
    tuning_stop: float
    tuning_near: float
    """Closest that a mass is brought to a place, rad."""
    wait: float
    average: float
    margin: float
    """By which a trial or a correction must be better, m."""
    move_time: float
    """Longest move of one trial, s."""
    moment: float
    """b, kg m."""
    gap: float
    """Angle that one mass takes up, rad."""
    by_trials: bool
    """Whether the masses are tuned by trials alone, as in the paper."""

    @classmethod
    def of(cls, scene: EccentricScene, law: DriveLaw) -> Gates:
        """Limits of a scene."""
        keys, tuning = scene.supervisor, scene.fine_tuning
        averaged = max(tuning.average / scene.sensor.step, 1.0)
        shared = [name for name in cls._fields if name in Supervisor.__dataclass_fields__]
        return cls(
            **{name: getattr(keys, name) for name in shared},
            noticeable=max(_NOTICEABLE * keys.arrival_angle, 2 * law.near),
            dwell=_DWELL_TIME,
            imbalance_gate=scene.imbalance_filter.gate,
            friction_gate=scene.friction_filter.gate,
            constants=_constants_covariance(scene),
            friction_torque=_FRICTION_ERROR * law.position_gain * keys.arrival_angle,
            least_estimate=_least_estimate(scene),
            least_drive=_LEAST_DRIVE_TIME,
            stall_rate=scene.friction_filter.stall_share * scene.friction_filter.drive_speed,
            tuning_step=tuning.step,
            tuning_stop=tuning.stop,
            tuning_near=2 * law.near,
            wait=tuning.wait,
            average=tuning.average,
            margin=2 * scene.sensor.position_noise / math.sqrt(averaged),
            move_time=_LONGEST_TRIAL_MOVE,
            moment=law.track.moment,
            gap=scene.masses.arc_length / scene.masses.guide_radius,
            by_trials=keys.correction == "trials",
        )


class _SensorSettings(NamedTuple):
    """What the imbalance filter assumes of its sensors: standard deviations."""

    position: float
    velocity: float
    angle: float
    rate: float


class _FrictionSettings(NamedTuple):
    """Of the friction filter and the drive meanwhile."""

    start: Pair
    """Standard deviations of rate, rad/s, and arm, m, before the first sample."""
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

    @classmethod
    def of(cls, scene: EccentricScene) -> _FrictionSettings:
        keys, track, sensor = scene.friction_filter, track_model(scene), scene.sensor
        given_way = track.moment**2 / believed_whirl(scene).mass
        inertia = track.inertia - given_way
        # The other mass's acceleration is a difference of two measured rates.
        noise = keys.rate_noise**2 * (1 + 2 * (given_way / inertia) ** 2)
        smooth = sensor.encoder_rate_noise * math.sqrt(sensor.step / (2 * SMOOTHING_TIME))
        return cls(
            start=(keys.initial_rate, keys.initial_friction),
            noise=FrictionNoise(noise, keys.rate_walk**2, keys.friction_walk**2),
            track=track._replace(inertia=inertia),
            least_motion=max(_CERTAIN * smooth, SLOWEST_RATE),
            euler=keys.discretisation == "euler",
            every=max(round(keys.step / sensor.step), 1),
            drive_speed=keys.drive_speed,
            speed_gain=keys.speed_gain,
            pair_gain=keys.pair_gain,
        )


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
    filter: FilterSettings
    sensor: _SensorSettings
    filter_every: int
    """Samples between two steps of the imbalance filter."""
    friction: _FrictionSettings

    @classmethod
    def of(cls, scene: EccentricScene) -> StrategySettings:
        """Gather what the strategy needs."""
        sensor, keys, law = scene.sensor, scene.imbalance_filter, DriveLaw.of(scene)
        every = max(round(keys.step / sensor.step), 1)
        return cls(
            step=sensor.step,
            laboratory=sensor.frame == "laboratory",
            smoothing=-math.expm1(-sensor.step / SMOOTHING_TIME),
            voltage_every=max(round(scene.lqr.step / sensor.step), 1),
            law=law,
            gates=Gates.of(scene, law),
            filter=filter_settings(scene)._replace(step=sensor.step * every),
            sensor=_SensorSettings(
                position=keys.position_noise,
                velocity=keys.velocity_noise,
                angle=sensor.encoder_noise,
                rate=sensor.encoder_rate_noise,
            ),
            filter_every=every,
            friction=_FrictionSettings.of(scene),
        )


def filter_settings(scene: EccentricScene) -> FilterSettings:
    """Of the imbalance filter."""
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


def _least_estimate(scene: EccentricScene) -> float:
    """Until the rotor's own transient, which hangs most on the assumed bearing, has died down."""
    whirl = believed_whirl(scene)
    longest = _LONGEST_ESTIMATE * scene.supervisor.imbalance_time
    return min(_DECAYS * 2 * whirl.mass / whirl.damping, longest) if whirl.damping > 0 else longest


def off_by_one(scene: EccentricScene, inputs: Collection[str]) -> Iterator[EccentricScene]:
    """Yield the scene with each of these inputs, if stated uncertain, one standard deviation off."""
    for each in scene.uncertainty:
        if each.quantity in inputs:
            value = value_at(scene, each.quantity)
            yield with_values_at(scene, {each.quantity: value + each.absolute(value) / NORMAL_95})


def _constants_covariance(scene: EccentricScene) -> tuple[float, float, float]:
    """Relative variance of B_add/b, covariance of it with C_add/b, and variance of that, by what is stated of
    motor and masses.

    While the masses go round, B_add V = C_add w + mu b (W + w)^2 + load, and the rotor's load has the factor
    b: a friction arm is as well known as these two, however little noise there is.
    """

    def ratios(plant: EccentricScene) -> FloatArray:
        constants = PlantParameters.of(plant)
        return np.array([constants.drive_gain, constants.drive_damping]) / constants.moment

    middle, found = ratios(scene), np.zeros((2, 2))
    for plant in off_by_one(scene, _CONSTANTS):
        change = np.divide(ratios(plant) - middle, middle, out=np.zeros(2), where=middle > 0)
        found += np.outer(change, change)
    return float(found[0, 0]), float(found[0, 1]), float(found[1, 1])
