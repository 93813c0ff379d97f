"""One step of the whole strategy: estimate, decide, drive.

`strategy_step` changes its memory by a measurement and looks at nothing else, so that a run can be repeated,
cut and compared.  Friction and wanted accelerations come from the last sample, so that no voltage depends on
itself.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.eccentric_mass.drive_law import (
    Motion,
    Pair,
    friction_torque,
    regulator_torque,
    rotor_load,
    steady_load,
    voltage_for,
)
from ringbalance.controller.eccentric_mass.friction_filter import friction_restart, friction_step
from ringbalance.controller.eccentric_mass.imbalance_filter import (
    MassInput,
    begin_filter,
    begin_whirl,
    correct,
    encoder_covariance,
    imbalance_deviation,
    mass_vector,
    predict,
    set_speed,
)
from ringbalance.controller.eccentric_mass.memory import (
    FRICTION,
    IMBALANCE,
    NONE,
    RELEASED,
    WAITING,
    EccentricMeasurement,
)
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.supervisor import arm_noise, enter, is_constant, supervise
from ringbalance.controller.eccentric_mass.targets import set_pair, wrapped
from ringbalance.scene.arrays import Record
from ringbalance.scene.platform.compiled import compiled, in_place

_LARGEST_TURN: Final = 0.05
"""Of a mass within one step of the imbalance filter, rad, which takes its path as straight."""


@compiled
def begin_strategy(settings: StrategySettings, memory: Record, measurement: EccentricMeasurement) -> None:
    """The memory before the first sample: the strategy waits for its start.

    Args: `memory`: an element of type `MEMORY`, of zeros.
    """
    begin_filter(memory.filter, settings.filter, measurement.speed)
    memory.deviation = settings.filter.start[2]
    rate, arm = settings.friction.start
    for i in range(2):
        memory.friction[i].rate_variance, memory.friction[i].arm_variance = rate**2, arm**2
        memory.angle[i] = memory.goal[i] = measurement.angle[i]
        memory.last_rate[i] = measurement.rate[i]
    memory.objective = math.inf
    enter(memory, WAITING, measurement.time, NONE)


@compiled
def strategy_step(settings: StrategySettings, memory: Record, measurement: EccentricMeasurement) -> None:
    """Take in a measurement; both motors' voltages, V, are in the memory.

    The same memory and measurement always give the same answer.
    """
    count = memory.sample
    memory.sample = count + 1
    if not _usable(measurement):
        return
    position, velocity = measurement.position, measurement.velocity
    if settings.laboratory:
        # Along the rotor's axes; the velocity is still seen from outside.
        turn = complex(math.cos(measurement.rotor_angle), -math.sin(measurement.rotor_angle))
        position, velocity = turn * position, turn * velocity
    motion = _motion(settings, measurement, position, velocity)
    _smooth(settings.smoothing if count else 1.0, memory, motion)
    visible = _visible(settings, memory, motion)
    if memory.stage == IMBALANCE and count % settings.filter_every == 0:
        _estimate_imbalance(settings, memory, motion, (position, velocity), visible)
    if memory.stage == FRICTION and count % settings.friction.every == 0:
        _estimate_friction(settings, memory, motion)
    seen = visible and memory.running > 0
    supervise(settings.gates, settings.law, memory, motion, measurement.time, seen)
    first, second = _motor_torques(settings, memory, motion)
    if count % settings.voltage_every == 0:
        set_pair(memory.voltage, voltage_for(settings.law, first), voltage_for(settings.law, second))
    if memory.stage == FRICTION:
        # What the friction filter knows of; accelerations are its own matter.
        load = rotor_load(settings.law, motion, memory.imbalance, (0.0, 0.0))
        for i in range(2):
            motor = settings.law.torque_per_volt * memory.voltage[i]
            memory.torque[i] = memory.torque[i] + motor - load[i]
            memory.motor[i] += settings.step * motor
            memory.back_emf[i] += settings.step * settings.law.track.damping * motion.rate[i]


@in_place
def _usable(measurement: EccentricMeasurement) -> bool:
    total = measurement.time + measurement.speed + measurement.speed_rate + measurement.rotor_angle
    total += measurement.position.real + measurement.position.imag
    total += measurement.velocity.real + measurement.velocity.imag
    for i in range(2):
        total += measurement.angle[i] + measurement.rate[i]
    return math.isfinite(total)


@in_place
def _motion(
    settings: StrategySettings, measurement: EccentricMeasurement, position: complex, velocity: complex
) -> Motion:
    """Along the rotor's axes; a laboratory sensor's velocity holds the rotor's turning."""
    if settings.laboratory:
        velocity = velocity - complex(0.0, measurement.speed) * position
    angle, rate = measurement.angle, measurement.rate
    return Motion(measurement.speed, measurement.speed_rate, position, velocity, angle, rate)


@in_place
def _smooth(new: float, memory: Record, motion: Motion) -> None:
    """Args: `new`: share of this sample."""
    memory.position += new * (motion.position - memory.position)
    memory.velocity += new * (motion.velocity - memory.velocity)
    for i in range(2):
        memory.angle[i] += new * (motion.angle[i] - memory.angle[i])
        memory.rate[i] += new * (motion.rate[i] - memory.rate[i])


@in_place
def _visible(settings: StrategySettings, memory: Record, motion: Motion) -> bool:
    """Whether the imbalance filter's model holds: turning, at constant speed, with masses it can follow."""
    turning = abs(motion.speed) >= settings.gates.lowest_speed and is_constant(motion)
    fastest = max(abs(memory.rate[0]), abs(memory.rate[1]))
    return bool(turning and fastest * settings.step * settings.filter_every <= _LARGEST_TURN)


@compiled
def _estimate_imbalance(
    settings: StrategySettings,
    memory: Record,
    motion: Motion,
    sample: tuple[complex, complex],
    visible: bool,
) -> None:
    """One step of the filter; after a gap in which its model did not hold the whirl starts again.

    Args: `sample`: displacement and velocity as the sensor shows them, along the rotor's axes.
    """
    if not visible:
        memory.running = 0
        return
    law, estimate = settings.law, memory.filter
    if estimate.speed != motion.speed:
        set_speed(estimate, settings.filter, motion.speed)
    place, pace = mass_vector(law.track.moment, motion.angle, motion.rate)
    before, drift = memory.mass_vector, memory.mass_pace
    if memory.running == 0:
        begin_whirl(estimate, settings.filter)
        before, drift = place, pace
    predict(estimate, _mass_input(settings, motion, 0.5 * (before + place), 0.5 * (drift + pace)))
    position, velocity = sample[0], sample[1] + pace / law.whirl.mass
    shown = (position.real, position.imag, velocity.real, velocity.imag)
    memory.surprise += correct(estimate, shown, _sample_variance(settings, motion))
    memory.judged, memory.running = memory.judged + 1, 1
    memory.mass_vector, memory.mass_pace = place, pace
    memory.imbalance = complex(estimate.state[4], estimate.state[5])
    memory.deviation = imbalance_deviation(estimate.covariance)


@in_place
def _mass_input(settings: StrategySettings, motion: Motion, place: complex, pace: complex) -> MassInput:
    """Of one step of the imbalance filter, from the means of p and p' over it."""
    law, step = settings.law, settings.filter.step
    damped = law.whirl.damping / (law.whirl.mass * motion.speed**2)
    noise = law.track.moment * settings.sensor.rate * step / law.whirl.mass
    covariance = encoder_covariance(law.track.moment, motion.angle, settings.sensor.angle)
    return MassInput(place + damped * pace, pace * step / law.whirl.mass, covariance, noise * noise)


@in_place
def _sample_variance(settings: StrategySettings, motion: Motion) -> tuple[float, float, float, float]:
    """Of each sensor; the encoders' rates are in the velocities."""
    law, sensor = settings.law, settings.sensor
    place, pace = sensor.position**2, sensor.velocity**2
    xx, _, yy = encoder_covariance(law.track.moment, motion.angle, sensor.rate / law.whirl.mass)
    return place, place, pace + xx, pace + yy


@in_place
def _estimate_friction(settings: StrategySettings, memory: Record, motion: Motion) -> None:
    """One step of both masses' filters; each one's load holds the acceleration that the other one had."""
    own, (first, second) = settings.friction, motion.angle
    lever = own.track.moment**2 / settings.law.whirl.mass * math.cos(first - second)
    lever /= settings.step * own.every
    for i in range(2):
        other = 1 - i
        push = memory.torque[i] / own.every + lever * (motion.rate[other] - memory.last_rate[other])
        _follow(settings, memory.friction[i], push, motion.rate[i], memory.rate[i], motion.speed)
    for i in range(2):
        memory.torque[i], memory.last_rate[i] = 0.0, motion.rate[i]


@in_place
def _follow(
    settings: StrategySettings, estimate: Record, torque: float, rate: float, smooth: float, speed: float
) -> None:
    """One step of a mass's filter, if the mass certainly moves and has not turned round.

    One noisy sample of the rate shows no motion; its mean over a while does.
    """
    own = settings.friction
    moves = abs(smooth) > own.least_motion and smooth * rate > 0 and abs(rate) > settings.law.slow
    if not moves or estimate.rate * rate <= 0:
        friction_restart(estimate, own.noise, rate)
    else:
        step = settings.step * own.every
        friction_step(estimate, own.track, own.noise, rate, speed, torque, step, own.euler)


@in_place
def _motor_torques(settings: StrategySettings, memory: Record, motion: Motion) -> Pair:
    """What the motors should give at standstill, N m."""
    law, goal, (first, second), (one, two) = settings.law, memory.goal, motion.angle, motion.rate
    asked = (regulator_torque(law, first, one, goal[0]), regulator_torque(law, second, two, goal[1]))
    if memory.stage == FRICTION:
        asked = _pair_torques(settings, motion)
    if memory.stage <= IMBALANCE:
        load = steady_load(law, motion)
        return asked[0] + load[0], asked[1] + load[1]
    if memory.hold == RELEASED:
        return 0.0, 0.0
    wanted = (
        (asked[0] - law.track.damping * one) / law.track.inertia,
        (asked[1] - law.track.damping * two) / law.track.inertia,
    )
    load = rotor_load(law, motion, memory.imbalance, wanted)
    return (
        asked[0] + load[0] + _friction_of(settings, memory, motion, 0),
        asked[1] + load[1] + _friction_of(settings, memory, motion, 1),
    )


@in_place
def _pair_torques(settings: StrategySettings, motion: Motion) -> Pair:
    """The paper's speed control of each mass, and one of the 180 degrees between them."""
    error = wrapped(motion.angle[1] - motion.angle[0] - math.pi)
    own, per_volt = settings.friction, settings.law.torque_per_volt
    first = own.speed_gain * (own.drive_speed - motion.rate[0]) + own.pair_gain * error
    second = own.speed_gain * (own.drive_speed - motion.rate[1]) - own.pair_gain * error
    return per_volt * first, per_volt * second


@in_place
def _friction_of(settings: StrategySettings, memory: Record, motion: Motion, mass: int) -> float:
    """Torque that makes up for a mass's friction as estimated, N m."""
    # A motor that is stronger than assumed made the arm smaller, and now gives as much more than asked.
    distance, deviation = memory.goal[mass] - memory.angle[mass], arm_noise(memory, mass)
    if memory.stage == FRICTION:
        # The paper's law of the pair compensates nothing.
        if settings.friction.pair_gain == 0:
            return 0.0
        # The arm is not yet known, and the masses are driven all the same.
        distance, deviation = math.copysign(math.inf, settings.friction.drive_speed), 0.0
    arm, rate = memory.friction[mass].arm, motion.rate[mass]
    return friction_torque(settings.law, arm, deviation, motion.speed, rate, distance)
