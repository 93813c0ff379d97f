"""What the strategy is given, and how it follows from a scene."""

from __future__ import annotations

import math
from typing import NamedTuple

from ringbalance.controller.eccentric_mass.control_records import Supervisor
from ringbalance.controller.eccentric_mass.friction_filter import FrictionEstimate, FrictionNoise, TrackModel
from ringbalance.controller.eccentric_mass.imbalance_filter import ProcessNoise, WhirlModel
from ringbalance.controller.eccentric_mass.plan import Gates
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene

_SMOOTHING_TIME = 0.05
"""Of the angles and rates that arrival is judged by, s."""
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
_SLOWEST_RATE = 1e-3
"""Below which a mass rests, however good the encoder, rad/s."""
_CERTAIN = 5.0
"""Standard deviations of a smoothed rate beyond which a mass moves."""
_SUPERVISOR_KEYS = [name for name in Gates._fields if name in Supervisor.__dataclass_fields__]
FRICTION_ERROR = 0.1
"""Share of the arrival angle that unknown friction may hold a mass off."""


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

    @classmethod
    def of(cls, scene: EccentricScene) -> DriveLaw:
        """What the law of the voltages knows."""
        plant, track = PlantParameters.of(scene), track_model(scene)
        position_gain, rate_gain = lqr_gain(
            track, state_weight=scene.lqr.state_weight, input_weight=scene.lqr.input_weight
        )
        return cls(
            whirl=believed_whirl(scene),
            track=track,
            mass_inertia=plant.inertia,
            torque_per_volt=plant.drive_gain,
            maximum_voltage=plant.maximum_voltage,
            position_gain=position_gain,
            rate_gain=rate_gain,
            breaks_away=scene.lqr.friction_compensation == "break_away",
            slow=max(3 * scene.sensor.encoder_rate_noise, _SLOWEST_RATE),
            near=_near(scene),
        )


class _ImbalanceSettings(NamedTuple):
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


class _FrictionSettings(NamedTuple):
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
    imbalance: _ImbalanceSettings
    friction: _FrictionSettings

    @classmethod
    def of(cls, scene: EccentricScene) -> StrategySettings:
        """Gather what the strategy needs."""
        step = scene.sensor.step
        return cls(
            step=step,
            laboratory=scene.sensor.frame == "laboratory",
            smoothing=-math.expm1(-step / _SMOOTHING_TIME),
            voltage_every=max(round(scene.lqr.step / step), 1),
            law=DriveLaw.of(scene),
            gates=_gates(scene),
            imbalance=_imbalance(scene),
            friction=_friction(scene),
        )


def believed_whirl(scene: EccentricScene) -> WhirlModel:
    """The rotor as configured in filter and controller; its mass includes the eccentric masses."""
    told = scene.imbalance_filter
    return WhirlModel(told.assumed_mass + 2 * scene.masses.mass, told.assumed_damping, told.assumed_stiffness)


def track_model(scene: EccentricScene) -> TrackModel:
    """One eccentric mass with its drive."""
    plant = PlantParameters.of(scene)
    return TrackModel(plant.inertia + plant.drive_inertia, plant.drive_damping, plant.moment)


def _imbalance(scene: EccentricScene) -> _ImbalanceSettings:
    told, sensor = scene.imbalance_filter, scene.sensor
    return _ImbalanceSettings(
        noise=ProcessNoise(told.velocity_walk**2, told.unbalance_walk**2),
        position_deviation=told.position_noise,
        velocity_deviation=told.velocity_noise,
        start_position=told.initial_position,
        start_velocity=told.initial_velocity,
        start_imbalance=told.initial_unbalance,
        encoder_deviation=sensor.encoder_noise,
        encoder_rate_deviation=sensor.encoder_rate_noise,
        euler=told.discretisation == "euler",
        every=max(round(told.step / sensor.step), 1),
    )


def _friction(scene: EccentricScene) -> _FrictionSettings:
    told, track, sensor = scene.friction_filter, track_model(scene), scene.sensor
    given_way = track.moment**2 / believed_whirl(scene).mass
    inertia = track.inertia - given_way
    # The other mass's acceleration is a difference of two measured rates.
    noise = told.rate_noise**2 * (1 + 2 * (given_way / inertia) ** 2)
    smooth = sensor.encoder_rate_noise * math.sqrt(sensor.step / (2 * _SMOOTHING_TIME))
    return _FrictionSettings(
        start=FrictionEstimate(0.0, 0.0, told.initial_rate**2, 0.0, told.initial_friction**2),
        noise=FrictionNoise(noise, told.rate_walk**2, told.friction_walk**2),
        track=track._replace(inertia=inertia),
        least_motion=max(_CERTAIN * smooth, _SLOWEST_RATE),
        euler=told.discretisation == "euler",
        every=max(round(told.step / sensor.step), 1),
        drive_speed=told.drive_speed,
        speed_gain=told.speed_gain,
        pair_gain=told.pair_gain,
    )


def lqr_gain(track: TrackModel, *, state_weight: float, input_weight: float) -> tuple[float, float]:
    """Gains k_p, N m/rad, and k_d, N m s/rad, of u = -k_p (phi - phi_d) - k_d phi', of one mass by itself.

    They minimise the integral of 0.1 q (phi - phi_d)^2 + 0.01 q phi'^2 + 0.1 r u^2, with q the state weight
    and r the input weight, both above zero.  The spectrum of the cost factors: k_p^2 = q/r and
    (C_add + k_d)^2 = C_add^2 + 2 (J + J_add) k_p + 0.1 q/r.
    Source: Eqs. 42 to 49 of the paper on eccentric masses, whose back-EMF in Eq. 42 lost the minus sign.
    """
    ratio = state_weight / input_weight
    position = math.sqrt(ratio)
    more = 2 * track.inertia * position + 0.1 * ratio
    return position, more / (math.sqrt(track.damping**2 + more) + track.damping)


def _near(scene: EccentricScene) -> float:
    """A quarter of the finest move asked for, but not finer than the smoothed encoder can tell."""
    finest = min(scene.fine_tuning.stop, scene.supervisor.arrival_angle)
    smooth = scene.sensor.encoder_noise * math.sqrt(scene.sensor.step / (2 * _SMOOTHING_TIME))
    return max(0.25 * finest, 3 * smooth)


def _least_estimate(scene: EccentricScene) -> float:
    """Until the rotor's own transient, which hangs most on the assumed bearing, has died down."""
    whirl = believed_whirl(scene)
    longest = _LONGEST_ESTIMATE * scene.supervisor.imbalance_time
    return min(_DECAYS * 2 * whirl.mass / whirl.damping, longest) if whirl.damping > 0 else longest


def _gates(scene: EccentricScene) -> Gates:
    told, tuning = scene.supervisor, scene.fine_tuning
    plant, law = PlantParameters.of(scene), DriveLaw.of(scene)
    averaged = max(tuning.average / scene.sensor.step, 1.0)
    return Gates(
        **{name: getattr(told, name) for name in _SUPERVISOR_KEYS},
        noticeable=max(_NOTICEABLE * told.arrival_angle, 2 * law.near),
        dwell=_DWELL_TIME,
        imbalance_gate=scene.imbalance_filter.gate,
        friction_gate=scene.friction_filter.gate,
        friction_torque=FRICTION_ERROR * law.position_gain * told.arrival_angle,
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
        moment=plant.moment,
        gap=scene.masses.arc_length / scene.masses.guide_radius,
        by_trials=told.correction == "trials",
    )
