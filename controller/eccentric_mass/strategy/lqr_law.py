"""Motor torques: what the rotor asks for, what friction takes, and what brings the masses to their places.

The rotor's acceleration is not measured but follows from its own equation, with the acceleration that the
masses are about to have; friction is compensated in the sense in which the mass moves or, at rest, is meant
to move.  Both come from the last sample, so that no voltage depends on itself.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.eccentric_mass.strategy.plan import (
    RELEASED,
    Beliefs,
    Motion,
    Pair,
    Plan,
    Smoothed,
)
from ringbalance.controller.eccentric_mass.strategy.settings import DriveLaw, StrategySettings
from ringbalance.controller.eccentric_mass.strategy.supervisor import FRICTION, IMBALANCE
from ringbalance.controller.eccentric_mass.strategy.targets import wrapped
from ringbalance.scene.platform.compiled import compiled

_BREAKS_AWAY: Final = 3.0
"""Standard deviations of a friction arm beyond its estimate with which a mass at rest is set going."""


@compiled
def _rotor_load(law: DriveLaw, motion: Motion, imbalance: complex, wanted: Pair) -> Pair:
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
def _steady_load(law: DriveLaw, motion: Motion) -> Pair:
    """The same, N m, of a steady whirl while the imbalance is not known: a = -W^2 z + 2 j W z' + j W' z."""
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
    largest = max(arm + _BREAKS_AWAY * deviation, 0.0) * pressure
    return math.copysign(largest, distance) if abs(distance) > law.near else 0.0


@compiled
def regulator_torque(law: DriveLaw, angle: float, rate: float, goal: float) -> float:
    """The regulator's torque, u = -k_p (phi - phi_d) - k_d phi', N m.

    Source: Eq. 49 of the paper on eccentric masses.
    """
    return -law.position_gain * (angle - goal) - law.rate_gain * rate


@compiled
def motor_torques(
    settings: StrategySettings, plan: Plan, beliefs: Beliefs, motion: Motion, smoothed: Smoothed
) -> Pair:
    """What the motors should give at standstill."""
    law = settings.law
    if plan.stage == FRICTION:
        asked = _pair_torques(settings, motion)
    else:
        asked = (
            regulator_torque(law, motion.angle[0], motion.rate[0], plan.goal[0]),
            regulator_torque(law, motion.angle[1], motion.rate[1], plan.goal[1]),
        )
    if plan.stage <= IMBALANCE:
        load = _steady_load(law, motion)
        return asked[0] + load[0], asked[1] + load[1]
    wanted = (
        (asked[0] - law.track.damping * motion.rate[0]) / law.track.inertia,
        (asked[1] - law.track.damping * motion.rate[1]) / law.track.inertia,
    )
    load = _rotor_load(law, motion, beliefs.imbalance, wanted)
    if plan.hold == RELEASED:
        return 0.0, 0.0
    one = _friction_of(settings, plan, beliefs, motion, smoothed, 0)
    two = _friction_of(settings, plan, beliefs, motion, smoothed, 1)
    return asked[0] + load[0] + one, asked[1] + load[1] + two


@compiled
def _pair_torques(settings: StrategySettings, motion: Motion) -> Pair:
    """The paper's speed control of each mass, and one of the 180 degrees between them."""
    error = wrapped(motion.angle[1] - motion.angle[0] - math.pi)
    told, per_volt = settings.friction, settings.law.torque_per_volt
    first = told.speed_gain * (told.drive_speed - motion.rate[0]) + told.pair_gain * error
    second = told.speed_gain * (told.drive_speed - motion.rate[1]) - told.pair_gain * error
    return per_volt * first, per_volt * second


@compiled
def _friction_of(
    settings: StrategySettings,
    plan: Plan,
    beliefs: Beliefs,
    motion: Motion,
    smoothed: Smoothed,
    mass: int,
) -> float:
    known, distance = beliefs.friction[mass], plan.goal[mass] - smoothed.angle[mass]
    deviation = math.sqrt(max(known.arm_variance, 0.0))
    if plan.stage == FRICTION:
        # The paper's law of the pair compensates nothing.
        if settings.friction.pair_gain == 0:
            return 0.0
        # The arm is not yet known, and the masses are driven all the same.
        distance, deviation = math.copysign(math.inf, settings.friction.drive_speed), 0.0
    return friction_torque(settings.law, known.arm, deviation, motion.speed, motion.rate[mass], distance)


@compiled
def known_torques(law: DriveLaw, old: Pair, motion: Motion, imbalance: complex, voltage: Pair) -> Pair:
    """The torques that the friction filter knows of, one sample more; accelerations are its own matter."""
    load = _rotor_load(law, motion, imbalance, (0.0, 0.0))
    return (
        old[0] + law.torque_per_volt * voltage[0] - load[0],
        old[1] + law.torque_per_volt * voltage[1] - load[1],
    )


@compiled
def share_of_friction(
    law: DriveLaw, motion: Motion, smoothed: Smoothed, imbalance: complex, arm: Pair
) -> float:
    """Largest share of what these friction arms hold at most that holding the masses takes."""
    w, place, velocity = motion.speed, smoothed.position, smoothed.velocity
    quiet = Motion(w, motion.speed_rate, place, velocity, smoothed.angle, (0.0, 0.0))
    load = _rotor_load(law, quiet, imbalance, (0.0, 0.0))
    share = 0.0
    for i in range(2):
        most = arm[i] * law.track.moment * w * w
        share = max(share, abs(load[i]) / most if most > 0 else math.inf)
    return share
