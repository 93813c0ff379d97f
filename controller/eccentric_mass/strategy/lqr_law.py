"""Motor voltages: what the rotor asks for, what friction takes, and what brings the masses to their places.

The rotor's acceleration is not measured but follows from its own equation, with the acceleration that the
masses are about to have; friction is compensated in the sense in which the mass moves or, at rest, is meant
to move.  Both come from the last sample, so that no voltage depends on itself.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.eccentric_mass.estimation.friction_filter import TrackModel
from ringbalance.controller.eccentric_mass.estimation.imbalance_model import WhirlModel

Pair = tuple[float, float]

BREAKS_AWAY: Final = 3.0
"""Standard deviations of a friction arm beyond its estimate with which a mass at rest is set going."""


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


@compiled
def rotor_load(law: DriveLaw, motion: Motion, imbalance: complex, wanted: Pair) -> Pair:
    """Torque that the rotor's motion and its speed rate ask of each mass's drive.

    b (c_i a_y - s_i a_x) + J W' with the rotor's absolute acceleration a along its axes, from
    M a = -C_B (z' + j W z) - K_B z + theta (W^2 - j W') + b sum ((W + w_i)^2 - j (W' + w_i')) exp(j phi_i).
    Returns: Torques, N m.
    Source: parts (a) of Eqs. 30 and 39 of the paper on eccentric masses, with the terms of the speed rate.
    """
    w, rate = motion.speed, motion.speed_rate
    force = imbalance * complex(w * w, -rate)
    force -= law.whirl.damping * (motion.velocity + complex(0.0, w) * motion.position)
    force -= law.whirl.stiffness * motion.position
    for i in range(2):
        pull = complex((w + motion.rate[i]) ** 2, -(rate + wanted[i]))
        force += law.track.moment * pull * complex(math.cos(motion.angle[i]), math.sin(motion.angle[i]))
    return _tangential_load(law, motion, force / law.whirl.mass)


@compiled
def steady_load(law: DriveLaw, motion: Motion) -> Pair:
    """The same while the imbalance is not yet known, from a whirl without rotor-fixed acceleration.

    a = -W^2 z + 2 j W z' + j W' z.
    Returns: Torques, N m.
    """
    w = motion.speed
    pull = complex(-w * w, motion.speed_rate) * motion.position
    return _tangential_load(law, motion, pull + complex(0.0, 2 * w) * motion.velocity)


@compiled
def _tangential_load(law: DriveLaw, motion: Motion, acceleration: complex) -> Pair:
    """Torque that carries each mass along with an acceleration of the track. Returns: Torques, N m."""
    spin = law.mass_inertia * motion.speed_rate
    first, second = motion.angle
    return (
        law.track.moment * (math.cos(first) * acceleration.imag - math.sin(first) * acceleration.real) + spin,
        law.track.moment * (math.cos(second) * acceleration.imag - math.sin(second) * acceleration.real)
        + spin,
    )


@compiled
def friction_torque(
    law: DriveLaw, arm: float, deviation: float, speed: float, rate: float, distance: float
) -> float:
    """Torque that makes up for friction.

    mu b (W + w)^2 in the sense of w; at rest, where friction opposes whatever is about to move the mass, in
    the sense of where the mass should go, and as large as friction may be: an arm that is estimated too small
    would hold the mass where it is.
    Args: `deviation`: standard deviation of the arm, m. `distance`: from where the mass is to where it should
    be, rad; infinite for one that should keep going.
    Returns: Torque, N m; zero for a resting mass that is near its place.
    Source: part (b) of Eq. 39 of the paper on eccentric masses, which prints the angle for the rate and gives
    no torque at rest, so that a mass which friction holds stays held.
    """
    if not law.breaks_away:
        return 0.0
    pressure = law.track.moment * (speed + rate) ** 2
    if abs(rate) > law.slow:
        return math.copysign(max(arm, 0.0) * pressure, rate)
    largest = max(arm + BREAKS_AWAY * deviation, 0.0) * pressure
    return math.copysign(largest, distance) if abs(distance) > law.near else 0.0


@compiled
def regulator_torque(law: DriveLaw, angle: float, rate: float, goal: float) -> float:
    """The regulator's torque, u = -k_p (phi - phi_d) - k_d phi'.

    Returns: Torque, N m.
    Source: Eq. 49 of the paper on eccentric masses.
    """
    return -law.position_gain * (angle - goal) - law.rate_gain * rate


@compiled
def voltage_for(law: DriveLaw, torque: float) -> float:
    """Voltage that gives a torque, as far as the supply allows. Returns: V."""
    return min(max(torque / law.torque_per_volt, -law.maximum_voltage), law.maximum_voltage)
