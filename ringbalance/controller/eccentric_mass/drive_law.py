"""Drive law: motor voltages from the rotor's load, the friction and the position control of the masses.

The rotor's acceleration is not measured; it follows from the rotor's equation of motion with the commanded
acceleration of the masses.  Friction is compensated in the direction in which the mass moves or, at rest,
should move.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from ringbalance.controller.eccentric_mass.friction_filter import TrackModel
from ringbalance.controller.eccentric_mass.imbalance_filter import WhirlModel
from ringbalance.controller.eccentric_mass.memory import Pair
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.platform.compiled import in_place

SMOOTHING_TIME_S: Final = 0.05
"""Time constant of the smoothed angles and rates by which arrival is judged."""
SLOWEST_RATE_RAD_S: Final = 1e-3
"""Lower bound of the rate below which a mass counts as resting, for an exact encoder."""
_BREAK_AWAY_SIGMA: Final = 3.0
"""Standard deviations of the friction arm that are added to its estimate to break a resting mass away."""


class DriveLaw(NamedTuple):
    """Configuration of the law of the voltages: masses, drives and sensors."""

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
    """True if friction is compensated, also for a mass at rest; False for no compensation."""
    slow: float
    """Rate below which a mass counts as resting, rad/s."""
    near: float
    """Distance from its goal below which a resting mass gets no friction compensation, rad."""

    @classmethod
    def of(cls, scene: EccentricScene) -> DriveLaw:
        """Derive the law's constants from a scene."""
        plant, track, sensor = PlantParameters.of(scene), track_model(scene), scene.sensor
        position_gain, rate_gain = lqr_gain(
            track, state_weight=scene.lqr.state_weight, input_weight=scene.lqr.input_weight
        )
        finest_move = min(scene.fine_tuning.stop, scene.supervisor.arrival_angle)
        smooth_noise = sensor.encoder_noise * math.sqrt(sensor.step / (2 * SMOOTHING_TIME_S))
        return cls(
            whirl=believed_whirl(scene),
            track=track,
            mass_inertia=plant.inertia,
            torque_per_volt=plant.drive_gain,
            maximum_voltage=plant.maximum_voltage,
            position_gain=position_gain,
            rate_gain=rate_gain,
            breaks_away=scene.lqr.friction_compensation == "break_away",
            slow=max(3 * sensor.encoder_rate_noise, SLOWEST_RATE_RAD_S),
            near=max(0.25 * finest_move, 3 * smooth_noise),
        )


def believed_whirl(scene: EccentricScene) -> WhirlModel:
    """Rotor that filter and controller assume; its mass includes the eccentric masses."""
    assumed = scene.imbalance_filter
    mass = assumed.assumed_mass + 2 * scene.masses.mass
    return WhirlModel(mass, assumed.assumed_damping, assumed.assumed_stiffness)


def track_model(scene: EccentricScene) -> TrackModel:
    """One eccentric mass with its drive."""
    plant = PlantParameters.of(scene)
    return TrackModel(plant.inertia + plant.drive_inertia, plant.drive_damping, plant.moment)


def lqr_gain(track: TrackModel, *, state_weight: float, input_weight: float) -> tuple[float, float]:
    """Gains k_p, N m/rad, and k_d, N m s/rad, of u = -k_p (phi - phi_d) - k_d phi', for one mass alone.

    They minimise the integral of 0.1 q (phi - phi_d)^2 + 0.01 q phi'^2 + 0.1 r u^2, with q the state weight
    and r the input weight, both above zero.  Spectral factorisation gives k_p^2 = q/r and
    (C_add + k_d)^2 = C_add^2 + 2 (J + J_add) k_p + 0.1 q/r.
    Source: Eqs. 42 to 49 of the paper on eccentric masses, whose back-EMF in Eq. 42 lost the minus sign.
    """
    ratio = state_weight / input_weight
    position = math.sqrt(ratio)
    more = 2 * track.inertia * position + 0.1 * ratio
    return position, more / (math.sqrt(track.damping**2 + more) + track.damping)


class Motion(NamedTuple):
    """Measured motion of rotor and masses, in the rotor's frame."""

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


@in_place
def rotor_load(law: DriveLaw, motion: Motion, imbalance: complex, acceleration: Pair) -> Pair:
    """Torque, N m, that the rotor's motion and its speed rate require of each mass's drive.

    b (c_i a_y - s_i a_x) + J W' with the rotor's absolute acceleration a along its axes, from
    M a = -C_B (z' + j W z) - K_B z + theta (W^2 - j W') + b sum ((W + w_i)^2 - j (W' + w_i')) exp(j phi_i).
    Args: `acceleration`: commanded w_i', rad/s^2.
    Source: parts (a) of Eqs. 30 and 39 of the paper on eccentric masses, with the terms of the speed rate.
    """
    w, rate = motion.speed, motion.speed_rate
    force = imbalance * complex(w * w, -rate)
    force -= law.whirl.damping * (motion.velocity + complex(0.0, w) * motion.position)
    force -= law.whirl.stiffness * motion.position
    for i in range(2):
        pull = complex((w + motion.rate[i]) ** 2, -(rate + acceleration[i]))
        force += law.track.moment * pull * complex(math.cos(motion.angle[i]), math.sin(motion.angle[i]))
    return _tangential_load(law, motion, force / law.whirl.mass)


@in_place
def steady_load(law: DriveLaw, motion: Motion) -> Pair:
    """Torque, N m, that a steady whirl of unknown imbalance requires: a = -W^2 z + 2 j W z' + j W' z."""
    w = motion.speed
    pull = complex(-w * w, motion.speed_rate) * motion.position
    return _tangential_load(law, motion, pull + complex(0.0, 2 * w) * motion.velocity)


@in_place
def _tangential_load(law: DriveLaw, motion: Motion, acceleration: complex) -> Pair:
    """Torque on each mass that an acceleration of the track requires, N m."""
    b, spin = law.track.moment, law.mass_inertia * motion.speed_rate
    (first, second), x, y = motion.angle, acceleration.real, acceleration.imag
    return (
        b * (math.cos(first) * y - math.sin(first) * x) + spin,
        b * (math.cos(second) * y - math.sin(second) * x) + spin,
    )


@in_place
def friction_torque(
    law: DriveLaw, arm: float, deviation: float, speed: float, rate: float, distance: float
) -> float:
    """Torque that compensates friction, N m; zero for a resting mass near its goal.

    A moving mass: mu b (W + w)^2 in the direction of w.  A resting mass: towards the goal, with mu three
    standard deviations above its estimate, since with an arm estimated too small the mass would stay held.
    Args: `deviation`: standard deviation of the arm, m. `distance`: signed angle from mass to goal, rad;
    infinite for a mass that should keep moving.
    Source: part (b) of Eq. 39 of the paper on eccentric masses, which prints the angle for the rate and gives
    no torque at rest, so that a mass held by friction stays held.
    """
    if not law.breaks_away:
        return 0.0
    pressure = law.track.moment * (speed + rate) ** 2
    if abs(rate) > law.slow:
        return math.copysign(max(arm, 0.0) * pressure, rate)
    largest = max(arm + _BREAK_AWAY_SIGMA * deviation, 0.0) * pressure
    return math.copysign(largest, distance) if abs(distance) > law.near else 0.0


@in_place
def regulator_torque(law: DriveLaw, angle: float, rate: float, goal: float) -> float:
    """Torque of the regulator, u = -k_p (phi - phi_d) - k_d phi', N m.

    Source: Eq. 49 of the paper on eccentric masses.
    """
    return -law.position_gain * (angle - goal) - law.rate_gain * rate


@in_place
def voltage_for(law: DriveLaw, torque: float) -> float:
    """Voltage for a torque at standstill, within the limit of the supply, V."""
    return min(max(torque / law.torque_per_volt, -law.maximum_voltage), law.maximum_voltage)
