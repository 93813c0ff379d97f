"""The whole strategy as one pure step: estimate, decide, drive.

`strategy_step` takes the state and a measurement and gives the next state and the motors' voltages; it looks
at nothing else, so that a run can be repeated, cut and compared.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.estimation.friction_filter import (
    FrictionEstimate,
    friction_restart,
    friction_step,
)
from ringbalance.controller.eccentric_mass.estimation.imbalance_filter import (
    ImbalanceEstimate,
    MassInput,
    correct,
    encoder_covariance,
    imbalance_deviation,
    mass_vector,
    predict,
    start_estimate,
    turned_back,
)
from ringbalance.controller.eccentric_mass.estimation.imbalance_model import (
    FilterMatrices,
    filter_matrices,
)
from ringbalance.controller.eccentric_mass.strategy.lqr_law import (
    known_torques,
    motor_torques,
    share_of_friction,
)
from ringbalance.controller.eccentric_mass.strategy.plan import (
    Beliefs,
    EccentricMeasurement,
    Facts,
    Motion,
    Pair,
    Plan,
    Smoothed,
    StrategyState,
    Whirl,
)
from ringbalance.controller.eccentric_mass.strategy.settings import DriveLaw, StrategySettings
from ringbalance.controller.eccentric_mass.strategy.supervisor import (
    CHECK,
    FAILED,
    FRICTION,
    IMBALANCE,
    REST,
    first_plan,
    supervise,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import compiled

_LARGEST_TURN: Final = 0.05
"""Of a mass within one step of the imbalance filter, rad, which takes its path as straight."""
_STEADY: Final = 1e-6
"""Speed rate that counts as none, rad/s^2."""


@compiled
def strategy_start(settings: StrategySettings, measurement: EccentricMeasurement) -> StrategyState:
    """The state before the first sample. Returns: The state; the strategy waits for its start."""
    told, friction = settings.imbalance, settings.friction.start
    estimate = start_estimate(told.start_position, told.start_velocity, told.start_imbalance)
    whirl = Whirl(estimate, _matrices(settings, measurement.speed), False, 0.0j, 0.0j, 0.0, 0)
    beliefs = Beliefs(0.0j, told.start_imbalance, (friction, friction))
    smoothed = Smoothed(0.0j, 0.0j, measurement.angle, (0.0, 0.0))
    plan = first_plan(measurement.angle, measurement.time)
    return StrategyState(0, plan, smoothed, whirl, beliefs, (0.0, 0.0), measurement.rate, (0.0, 0.0))


@compiled
def strategy_step(
    settings: StrategySettings, state: StrategyState, measurement: EccentricMeasurement
) -> tuple[StrategyState, Pair]:
    """The next state and both motors' voltages, V; the same arguments always give the same answer."""
    count, old, smoothed, whirl, beliefs, torque, rate, voltage = state
    if not _usable(measurement):
        return StrategyState(count + 1, old, smoothed, whirl, beliefs, torque, rate, voltage), voltage
    sample = measurement.vibration
    if settings.laboratory:
        sample = turned_back(sample, measurement.rotor_angle)
    motion = _motion(settings, measurement, sample)
    smoothed = _smoothed(settings.smoothing if count else 1.0, smoothed, motion)
    visible = _visible(settings, motion, smoothed)
    if old.stage == IMBALANCE and count % settings.imbalance.every == 0:
        whirl = _with_sample(settings, whirl, motion, sample, visible)
        beliefs = _with_imbalance(whirl, beliefs)
    if old.stage == FRICTION and count % settings.friction.every == 0:
        beliefs = _with_friction(settings, beliefs, torque, rate, motion, smoothed.rate)
        torque, rate = (0.0, 0.0), motion.rate
    facts = _facts(settings.law, old, beliefs, motion, smoothed, visible and whirl.running, measurement.time)
    plan = supervise(settings.gates, old, facts)
    asked = motor_torques(settings, plan, beliefs, motion, smoothed)
    if count % settings.voltage_every == 0:
        voltage = (_voltage_for(settings.law, asked[0]), _voltage_for(settings.law, asked[1]))
    if plan.stage == FRICTION:
        torque = known_torques(settings.law, torque, motion, beliefs.imbalance, voltage)
    return StrategyState(count + 1, plan, smoothed, whirl, beliefs, torque, rate, voltage), voltage


@compiled
def _usable(measurement: EccentricMeasurement) -> bool:
    total = measurement.time + measurement.speed + measurement.speed_rate + measurement.rotor_angle
    for i in range(4):
        total += measurement.vibration[i]
    for i in range(2):
        total += measurement.angle[i] + measurement.rate[i]
    return math.isfinite(total)


@compiled
def _voltage_for(law: DriveLaw, torque: float) -> float:
    """Voltage that gives a torque, as far as the supply allows. Returns: V."""
    return min(max(torque / law.torque_per_volt, -law.maximum_voltage), law.maximum_voltage)


@compiled
def _matrices(settings: StrategySettings, speed: float) -> FilterMatrices:
    told = settings.imbalance
    step, noise = settings.step * told.every, told.noise
    return filter_matrices(settings.law.whirl, noise, speed, step, settings.laboratory, told.euler)


@compiled
def _motion(settings: StrategySettings, measurement: EccentricMeasurement, sample: FloatArray) -> Motion:
    """Along the rotor's axes; a laboratory sensor's velocity holds the rotor's turning."""
    position, velocity = complex(sample[0], sample[1]), complex(sample[2], sample[3])
    if settings.laboratory:
        velocity -= complex(0.0, measurement.speed) * position
    angle, rate = measurement.angle, measurement.rate
    return Motion(measurement.speed, measurement.speed_rate, position, velocity, angle, rate)


@compiled
def _smoothed(new: float, old: Smoothed, motion: Motion) -> Smoothed:
    return Smoothed(
        old.position + new * (motion.position - old.position),
        old.velocity + new * (motion.velocity - old.velocity),
        (
            old.angle[0] + new * (motion.angle[0] - old.angle[0]),
            old.angle[1] + new * (motion.angle[1] - old.angle[1]),
        ),
        (
            old.rate[0] + new * (motion.rate[0] - old.rate[0]),
            old.rate[1] + new * (motion.rate[1] - old.rate[1]),
        ),
    )


@compiled
def _visible(settings: StrategySettings, motion: Motion, smoothed: Smoothed) -> bool:
    """Whether the imbalance filter's model holds: turning, at constant speed, with masses it can follow."""
    turning = abs(motion.speed) >= settings.gates.lowest_speed and abs(motion.speed_rate) < _STEADY
    fastest = max(abs(smoothed.rate[0]), abs(smoothed.rate[1]))
    return turning and fastest * settings.step * settings.imbalance.every <= _LARGEST_TURN


@compiled
def _with_sample(
    settings: StrategySettings, old: Whirl, motion: Motion, sample: FloatArray, visible: bool
) -> Whirl:
    """One step of the imbalance filter; after a gap in which its model did not hold the whirl starts
    again."""
    if not visible:
        return Whirl(old.estimate, old.matrices, False, 0.0j, 0.0j, old.surprise, old.judged)
    told, matrices, estimate = settings.imbalance, old.matrices, old.estimate
    if matrices.speed != motion.speed:
        matrices = _matrices(settings, motion.speed)
    place, pace = mass_vector(settings.law.track.moment, motion.angle, motion.rate)
    before, drift = old.place, old.pace
    if not old.running:
        start = start_estimate(told.start_position, told.start_velocity, told.start_imbalance)
        estimate, before, drift = _with_fresh_whirl(estimate, start), place, pace
    masses = _mass_input(settings, motion, 0.5 * (before + place), 0.5 * (drift + pace))
    mass, shifted = settings.law.whirl.mass, sample.copy()
    shifted[2] += pace.real / mass
    shifted[3] += pace.imag / mass
    ahead = predict(estimate, matrices, masses)
    variance = _sample_variance(settings, motion)
    estimate, surprise = correct(ahead, matrices, shifted, variance)
    return Whirl(estimate, matrices, True, place, pace, old.surprise + surprise, old.judged + 1)


@compiled
def _mass_input(settings: StrategySettings, motion: Motion, place: complex, pace: complex) -> MassInput:
    """Of one step of the imbalance filter, from the means of p and p' over it."""
    law, told = settings.law, settings.imbalance
    step, damped = settings.step * told.every, law.whirl.damping / (law.whirl.mass * motion.speed**2)
    noise = law.track.moment * told.encoder_rate_deviation * step / law.whirl.mass
    covariance = encoder_covariance(law.track.moment, motion.angle, told.encoder_deviation)
    return MassInput(place + damped * pace, pace * step / law.whirl.mass, covariance, noise * noise)


@compiled
def _sample_variance(settings: StrategySettings, motion: Motion) -> FloatArray:
    """Of each sensor; the encoders' rates are in the velocities."""
    law, told = settings.law, settings.imbalance
    place, pace = told.position_deviation**2, told.velocity_deviation**2
    rates = encoder_covariance(law.track.moment, motion.angle, told.encoder_rate_deviation / law.whirl.mass)
    return np.array([place, place, pace + rates[0, 0], pace + rates[1, 1]])


@compiled
def _with_imbalance(whirl: Whirl, old: Beliefs) -> Beliefs:
    state = whirl.estimate.state
    deviation = imbalance_deviation(whirl.estimate.covariance)
    return Beliefs(complex(state[4], state[5]), deviation, old.friction)


@compiled
def _with_friction(
    settings: StrategySettings, old: Beliefs, torque: Pair, last: Pair, motion: Motion, smooth: Pair
) -> Beliefs:
    """One step of both masses' filters; each one's load holds the acceleration that the other one had."""
    told, whirl, (one, two) = settings.friction, settings.law.whirl, old.friction
    first, second = motion.angle
    lever = told.track.moment**2 / whirl.mass * math.cos(first - second) / (settings.step * told.every)
    push_1 = torque[0] / told.every + lever * (motion.rate[1] - last[1])
    push_2 = torque[1] / told.every + lever * (motion.rate[0] - last[0])
    new_1 = _one_friction(settings, one, push_1, motion.rate[0], smooth[0], motion.speed)
    new_2 = _one_friction(settings, two, push_2, motion.rate[1], smooth[1], motion.speed)
    return Beliefs(old.imbalance, old.deviation, (new_1, new_2))


@compiled
def _one_friction(
    settings: StrategySettings,
    estimate: FrictionEstimate,
    torque: float,
    rate: float,
    smooth: float,
    speed: float,
) -> FrictionEstimate:
    """One step of a mass's filter, if the mass certainly moves and has not turned round.

    One noisy sample of the rate shows no motion; its mean over a while does.
    """
    told = settings.friction
    moves = abs(smooth) > told.least_motion and smooth * rate > 0 and abs(rate) > settings.law.slow
    if not moves or estimate.rate * rate <= 0:
        return friction_restart(estimate, told.noise, rate)
    step = settings.step * told.every
    return friction_step(estimate, told.track, told.noise, rate, speed, torque, step, told.euler)


@compiled
def _facts(
    law: DriveLaw,
    plan: Plan,
    beliefs: Beliefs,
    motion: Motion,
    smoothed: Smoothed,
    visible: bool,
    time: float,
) -> Facts:
    w = motion.speed
    stiffness = complex(law.whirl.stiffness - law.whirl.mass * w * w, law.whirl.damping * w)
    one, two = beliefs.friction
    deviation = (math.sqrt(max(one.arm_variance, 0.0)), math.sqrt(max(two.arm_variance, 0.0)))
    load = 0.0
    if plan.stage == CHECK or plan.stage == REST or plan.stage == FAILED:
        sure = (max(one.arm - 2 * deviation[0], 0.0), max(two.arm - 2 * deviation[1], 0.0))
        load = share_of_friction(law, motion, smoothed, beliefs.imbalance, sure)
    return Facts(
        time,
        w,
        abs(motion.speed_rate) < _STEADY,
        visible,
        motion.position,
        smoothed.angle,
        smoothed.rate,
        beliefs.imbalance,
        beliefs.deviation,
        w * w / stiffness,
        (one.arm, two.arm),
        deviation,
        load,
    )


@compiled
def _with_fresh_whirl(estimate: ImbalanceEstimate, start: ImbalanceEstimate) -> ImbalanceEstimate:
    """Forget the whirl and keep the imbalance, after a time in which the filter's model did not hold."""
    state, covariance = start.state.copy(), start.covariance.copy()
    for i in range(4, 6):
        state[i] = estimate.state[i]
        for k in range(4, 6):
            covariance[i, k] = estimate.covariance[i, k]
    return ImbalanceEstimate(state, covariance)
