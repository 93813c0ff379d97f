"""One step of the whole strategy: estimate, decide, drive.

`strategy_step` depends on its memory and the measurement only, so that a run can be repeated, cut and
compared.  Friction and wanted accelerations come from the last sample, so that no voltage depends on
itself.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.eccentric_mass.drive_law import (
    Motion,
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
    plateau_at,
    predict,
)
from ringbalance.controller.eccentric_mass.memory import Cause, EccentricMeasurement, Hold, Pair, Stage
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.supervisor import arm_noise, enter, is_constant, supervise
from ringbalance.controller.eccentric_mass.targets import set_pair, wrapped
from ringbalance.scene.arrays import FloatArray, Record
from ringbalance.scene.platform.compiled import compiled, in_place

_LARGEST_STEP_ANGLE_RAD: Final = 0.05
"""Largest travel of a mass within a step of the imbalance filter, which assumes a straight path."""


@compiled
def begin_strategy(settings: StrategySettings, memory: Record, measurement: EccentricMeasurement) -> None:
    """Write the memory before the first sample: the strategy waits for its start.

    Args: `memory`: an element of type `MEMORY`, of zeros.
    """
    begin_filter(memory.estimation.filter, settings.filter)
    memory.estimation.deviation = settings.filter.start[2]
    rate, arm = settings.friction.start
    for i in range(2):
        estimate = memory.friction.filter[i]
        estimate.rate_variance, estimate.arm_variance = rate**2, arm**2
        memory.angle[i], memory.friction.last_rate[i] = measurement.angle[i], measurement.rate[i]
    memory.time = measurement.time
    enter(memory, Stage.WAITING, memory.angle, Cause.NONE)


@compiled
def strategy_step(settings: StrategySettings, memory: Record, measurement: EccentricMeasurement) -> None:
    """Process a measurement and write both motors' voltages, V, into the memory.

    Equal memory and measurement give equal voltages.
    """
    law, count = settings.law, memory.sample
    memory.sample = count + 1
    total = measurement.time + measurement.speed + measurement.speed_rate + measurement.rotor_angle
    total += measurement.position.real + measurement.position.imag
    total += measurement.velocity.real + measurement.velocity.imag
    for i in range(2):
        total += measurement.angle[i] + measurement.rate[i]
    if not math.isfinite(total):
        return
    memory.time = measurement.time
    position, velocity = measurement.position, measurement.velocity
    relative = velocity
    if settings.laboratory:
        # Along the rotor's axes; `velocity` is still relative to the fixed frame.
        turn = complex(math.cos(measurement.rotor_angle), -math.sin(measurement.rotor_angle))
        position, velocity = turn * position, turn * velocity
        relative = velocity - complex(0.0, measurement.speed) * position
    motion = Motion(
        measurement.speed, measurement.speed_rate, position, relative, measurement.angle, measurement.rate
    )
    weight = settings.smoothing if count else 1.0
    memory.position += weight * (motion.position - memory.position)
    memory.velocity += weight * (motion.velocity - memory.velocity)
    for i in range(2):
        memory.angle[i] += weight * (motion.angle[i] - memory.angle[i])
        memory.rate[i] += weight * (motion.rate[i] - memory.rate[i])
    # The imbalance filter's model holds for a rotor at the constant speed of a plateau with slow masses.
    estimation, friction = memory.estimation, memory.friction
    estimation.filter.plateau = plateau_at(settings.filter, motion.speed) if is_constant(motion) else -1
    turning = abs(motion.speed) >= settings.gates.lowest_speed and estimation.filter.plateau >= 0
    fastest = max(abs(memory.rate[0]), abs(memory.rate[1]))
    visible = bool(turning and fastest * settings.step * settings.filter_every <= _LARGEST_STEP_ANGLE_RAD)
    if memory.stage == Stage.IMBALANCE_ESTIMATION and count % settings.filter_every == 0:
        if visible:
            _estimate_imbalance(settings, estimation, motion, position, velocity)
            memory.imbalance = complex(estimation.filter.state[4], estimation.filter.state[5])
        estimation.running = 1 if visible else 0
    if memory.stage == Stage.FRICTION_ESTIMATION and count % settings.friction.every == 0:
        _estimate_friction(settings, friction, motion, memory.rate)
    supervise(settings.gates, law, memory, motion, visible and estimation.running > 0)
    first, second = _motor_torques(settings, memory, motion)
    if count % settings.voltage_every == 0:
        set_pair(memory.voltage, voltage_for(law, first), voltage_for(law, second))
    if memory.stage == Stage.FRICTION_ESTIMATION:
        # Known torques for the friction filter, without those of the masses' acceleration.
        load = rotor_load(law, motion, memory.imbalance, (0.0, 0.0))
        for i in range(2):
            motor = law.torque_per_volt * memory.voltage[i]
            friction.torque[i] = friction.torque[i] + motor - load[i]
            friction.motor[i] += settings.step * motor
            friction.back_emf[i] += settings.step * law.track.damping * motion.rate[i]


@compiled
def _estimate_imbalance(
    settings: StrategySettings, estimation: Record, motion: Motion, position: complex, velocity: complex
) -> None:
    """Carry out one filter step; after a gap in which the model did not hold, the whirl restarts.

    Args: `position`, `velocity`: measured by the sensor, along the rotor's axes.
    """
    estimate, sensor, step = estimation.filter, settings.sensor, settings.filter.step
    whirl, moment = settings.law.whirl, settings.law.track.moment
    vector, vector_rate = mass_vector(moment, motion.angle, motion.rate)
    before, rate_before = estimation.mass_vector, estimation.mass_pace
    if estimation.running == 0:
        begin_whirl(estimate, settings.filter)
        before, rate_before = vector, vector_rate
    # Means of p and p' over the step.
    mean, mean_rate = 0.5 * (before + vector), 0.5 * (rate_before + vector_rate)
    damped = whirl.damping / (whirl.mass * motion.speed**2)
    noise = moment * sensor.rate * step / whirl.mass
    covariance = encoder_covariance(moment, motion.angle, sensor.angle)
    masses = MassInput(mean + damped * mean_rate, mean_rate * step / whirl.mass, covariance, noise * noise)
    predict(settings.filter, estimate, masses)
    velocity += vector_rate / whirl.mass
    shown = (position.real, position.imag, velocity.real, velocity.imag)
    # The encoders' rates are in the velocities.
    xx, _, yy = encoder_covariance(moment, motion.angle, sensor.rate / whirl.mass)
    of_position, of_velocity = sensor.position**2, sensor.velocity**2
    variance = (of_position, of_position, of_velocity + xx, of_velocity + yy)
    estimation.surprise += correct(settings.filter, estimate, shown, variance)
    estimation.judged += 1
    estimation.mass_vector, estimation.mass_pace = vector, vector_rate
    estimation.deviation = imbalance_deviation(estimate.covariance)


@in_place
def _estimate_friction(
    settings: StrategySettings, friction: Record, motion: Motion, smooth_rate: FloatArray
) -> None:
    """Carry out one step of both masses' filters; each load includes the other mass's acceleration."""
    law, constants, (first, second) = settings.law, settings.friction, motion.angle
    step = settings.step * constants.every
    lever = constants.track.moment**2 / law.whirl.mass * math.cos(first - second)
    lever /= step
    for i in range(2):
        rate, smooth, estimate = motion.rate[i], smooth_rate[i], friction.filter[i]
        change = motion.rate[1 - i] - friction.last_rate[1 - i]
        torque = friction.torque[i] / constants.every + lever * change
        # One noisy sample of the rate proves no motion; the smoothed rate does.
        moves = abs(smooth) > constants.least_motion and smooth * rate > 0 and abs(rate) > law.slow
        if moves and estimate.rate * rate > 0:
            track, noise, euler = constants.track, constants.noise, constants.euler
            friction_step(estimate, track, noise, rate, motion.speed, torque, step, euler)
        else:
            friction_restart(estimate, constants.noise, rate)
    for i in range(2):
        friction.torque[i], friction.last_rate[i] = 0.0, motion.rate[i]


@in_place
def _motor_torques(settings: StrategySettings, memory: Record, motion: Motion) -> Pair:
    """Required torques of the motors, as B_add V at standstill, N m."""
    law, friction, goal = settings.law, settings.friction, memory.travel.goal
    (first, second), (first_rate, second_rate) = motion.angle, motion.rate
    control = (
        regulator_torque(law, first, first_rate, goal[0]),
        regulator_torque(law, second, second_rate, goal[1]),
    )
    if memory.stage == Stage.FRICTION_ESTIMATION:
        # The paper's speed control of each mass, and a control that keeps them 180 degrees apart.
        error = wrapped(second - first - math.pi)
        first_volts = friction.speed_gain * (friction.drive_speed - first_rate) + friction.pair_gain * error
        second_volts = friction.speed_gain * (friction.drive_speed - second_rate) - friction.pair_gain * error
        control = (law.torque_per_volt * first_volts, law.torque_per_volt * second_volts)
    if memory.stage <= Stage.IMBALANCE_ESTIMATION:
        load = steady_load(law, motion)
        return control[0] + load[0], control[1] + load[1]
    if memory.hold == Hold.RELEASED:
        return 0.0, 0.0
    acceleration = (
        (control[0] - law.track.damping * first_rate) / law.track.inertia,
        (control[1] - law.track.damping * second_rate) / law.track.inertia,
    )
    load = rotor_load(law, motion, memory.imbalance, acceleration)
    return (
        control[0] + load[0] + _compensation(settings, memory, 0, motion.speed, first_rate),
        control[1] + load[1] + _compensation(settings, memory, 1, motion.speed, second_rate),
    )


@in_place
def _compensation(settings: StrategySettings, memory: Record, mass: int, speed: float, rate: float) -> float:
    """Torque that compensates a mass's estimated friction at its rate, N m."""
    # Noise only: a motor stronger than assumed makes the estimated arm smaller, but its torque larger.
    deviation = arm_noise(memory.friction, mass)
    distance = memory.travel.goal[mass] - memory.angle[mass]
    if memory.stage == Stage.FRICTION_ESTIMATION:
        # The paper's law of the pair compensates nothing.
        if settings.friction.pair_gain == 0:
            return 0.0
        # The arm is not yet known; its estimate alone is compensated.
        distance, deviation = math.copysign(math.inf, settings.friction.drive_speed), 0.0
    arm = memory.friction.filter[mass].arm
    return friction_torque(settings.law, arm, deviation, speed, rate, distance)
