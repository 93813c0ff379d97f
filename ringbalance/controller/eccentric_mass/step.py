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
    plateau_at,
    predict,
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

_LARGEST_STEP_ANGLE_RAD: Final = 0.05
"""Largest travel of a mass within a step of the imbalance filter, which assumes a straight path."""


@compiled
def begin_strategy(settings: StrategySettings, memory: Record, measurement: EccentricMeasurement) -> None:
    """Write the memory before the first sample: the strategy waits for its start.

    Args: `memory`: an element of type `MEMORY`, of zeros.
    """
    begin_filter(memory.filter, settings.filter)
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
    memory.filter.plateau = plateau_at(settings.filter, motion.speed) if is_constant(motion) else -1
    turning = abs(motion.speed) >= settings.gates.lowest_speed and memory.filter.plateau >= 0
    fastest = max(abs(memory.rate[0]), abs(memory.rate[1]))
    visible = bool(turning and fastest * settings.step * settings.filter_every <= _LARGEST_STEP_ANGLE_RAD)
    if memory.stage == IMBALANCE and count % settings.filter_every == 0:
        _estimate_imbalance(settings, memory, motion, (position, velocity), visible)
    if memory.stage == FRICTION and count % settings.friction.every == 0:
        _estimate_friction(settings, memory, motion)
    supervise(settings.gates, law, memory, motion, measurement.time, visible and memory.running > 0)
    first, second = _motor_torques(settings, memory, motion)
    if count % settings.voltage_every == 0:
        set_pair(memory.voltage, voltage_for(law, first), voltage_for(law, second))
    if memory.stage == FRICTION:
        # Known torques for the friction filter, without those of the masses' acceleration.
        load = rotor_load(law, motion, memory.imbalance, (0.0, 0.0))
        for i in range(2):
            motor = law.torque_per_volt * memory.voltage[i]
            memory.torque[i] = memory.torque[i] + motor - load[i]
            memory.motor[i] += settings.step * motor
            memory.back_emf[i] += settings.step * law.track.damping * motion.rate[i]


@compiled
def _estimate_imbalance(
    settings: StrategySettings,
    memory: Record,
    motion: Motion,
    sample: tuple[complex, complex],
    visible: bool,
) -> None:
    """Carry out one filter step; after a gap in which the model did not hold, the whirl restarts.

    Args: `sample`: displacement and velocity measured by the sensor, along the rotor's axes.
    """
    if not visible:
        memory.running = 0
        return
    estimate, sensor, step = memory.filter, settings.sensor, settings.filter.step
    whirl, moment = settings.law.whirl, settings.law.track.moment
    vector, vector_rate = mass_vector(moment, motion.angle, motion.rate)
    before, rate_before = memory.mass_vector, memory.mass_pace
    if memory.running == 0:
        begin_whirl(estimate, settings.filter)
        before, rate_before = vector, vector_rate
    # Means of p and p' over the step.
    mean, mean_rate = 0.5 * (before + vector), 0.5 * (rate_before + vector_rate)
    damped = whirl.damping / (whirl.mass * motion.speed**2)
    noise = moment * sensor.rate * step / whirl.mass
    covariance = encoder_covariance(moment, motion.angle, sensor.angle)
    masses = MassInput(mean + damped * mean_rate, mean_rate * step / whirl.mass, covariance, noise * noise)
    predict(settings.filter, estimate, masses)
    position, velocity = sample[0], sample[1] + vector_rate / whirl.mass
    shown = (position.real, position.imag, velocity.real, velocity.imag)
    # The encoders' rates are in the velocities.
    xx, _, yy = encoder_covariance(moment, motion.angle, sensor.rate / whirl.mass)
    of_position, of_velocity = sensor.position**2, sensor.velocity**2
    variance = (of_position, of_position, of_velocity + xx, of_velocity + yy)
    memory.surprise += correct(settings.filter, estimate, shown, variance)
    memory.judged, memory.running = memory.judged + 1, 1
    memory.mass_vector, memory.mass_pace = vector, vector_rate
    memory.imbalance = complex(estimate.state[4], estimate.state[5])
    memory.deviation = imbalance_deviation(estimate.covariance)


@in_place
def _estimate_friction(settings: StrategySettings, memory: Record, motion: Motion) -> None:
    """Carry out one step of both masses' filters; each load includes the other mass's acceleration."""
    friction, (first, second) = settings.friction, motion.angle
    step = settings.step * friction.every
    lever = friction.track.moment**2 / settings.law.whirl.mass * math.cos(first - second)
    lever /= step
    for i in range(2):
        rate, smooth, estimate = motion.rate[i], memory.rate[i], memory.friction[i]
        torque = memory.torque[i] / friction.every + lever * (motion.rate[1 - i] - memory.last_rate[1 - i])
        # One noisy sample of the rate proves no motion; the smoothed rate does.
        moves = abs(smooth) > friction.least_motion and smooth * rate > 0 and abs(rate) > settings.law.slow
        if not moves or estimate.rate * rate <= 0:
            friction_restart(estimate, friction.noise, rate)
        else:
            friction_step(
                estimate, friction.track, friction.noise, rate, motion.speed, torque, step, friction.euler
            )
    for i in range(2):
        memory.torque[i], memory.last_rate[i] = 0.0, motion.rate[i]


@in_place
def _motor_torques(settings: StrategySettings, memory: Record, motion: Motion) -> Pair:
    """Required torques of the motors, as B_add V at standstill, N m."""
    law, friction, goal = settings.law, settings.friction, memory.goal
    (first, second), (first_rate, second_rate) = motion.angle, motion.rate
    if memory.stage == FRICTION:
        # The paper's speed control of each mass, and a control that keeps them 180 degrees apart.
        error = wrapped(second - first - math.pi)
        first_volts = friction.speed_gain * (friction.drive_speed - first_rate) + friction.pair_gain * error
        second_volts = friction.speed_gain * (friction.drive_speed - second_rate) - friction.pair_gain * error
        control = (law.torque_per_volt * first_volts, law.torque_per_volt * second_volts)
    else:
        control = (
            regulator_torque(law, first, first_rate, goal[0]),
            regulator_torque(law, second, second_rate, goal[1]),
        )
    if memory.stage <= IMBALANCE:
        load = steady_load(law, motion)
        return control[0] + load[0], control[1] + load[1]
    if memory.hold == RELEASED:
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
    distance, deviation = memory.goal[mass] - memory.angle[mass], arm_noise(memory, mass)
    if memory.stage == FRICTION:
        # The paper's law of the pair compensates nothing.
        if settings.friction.pair_gain == 0:
            return 0.0
        # The arm is not yet known; its estimate alone is compensated.
        distance, deviation = math.copysign(math.inf, settings.friction.drive_speed), 0.0
    return friction_torque(settings.law, memory.friction[mass].arm, deviation, speed, rate, distance)
