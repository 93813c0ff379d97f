"""The whole strategy as one pure step: estimate, decide, drive.

`strategy_step` takes the state and a measurement and gives the next state and the motors' voltages; it looks
at nothing else, so that a run can be repeated, cut and compared.

Of the motors' torques what the rotor asks for, what friction takes, and what brings the masses to their
places: the rotor's acceleration is not measured but follows from its own equation, with the acceleration that
the masses are about to have; friction is compensated in the sense in which the mass moves or, at rest, is
meant to move.  Both come from the last sample, so that no voltage depends on itself.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.friction_filter import (
    FrictionEstimate,
    friction_restart,
    friction_step,
)
from ringbalance.controller.eccentric_mass.imbalance_filter import (
    FilterMatrices,
    ImbalanceEstimate,
    MassInput,
    correct,
    encoder_covariance,
    filter_matrices,
    imbalance_deviation,
    mass_vector,
    predict,
    start_estimate,
    turned_back,
)
from ringbalance.controller.eccentric_mass.plan import (
    RELEASED,
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
from ringbalance.controller.eccentric_mass.settings import DriveLaw, StrategySettings
from ringbalance.controller.eccentric_mass.supervisor import (
    CHECK,
    FAILED,
    FRICTION,
    IMBALANCE,
    REST,
    first_plan,
    supervise,
)
from ringbalance.controller.eccentric_mass.targets import wrapped
from ringbalance.scene.arrays import FloatArray
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
def _motor_torques(
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
def _known_torques(law: DriveLaw, old: Pair, motion: Motion, imbalance: complex, voltage: Pair) -> Pair:
    """The torques that the friction filter knows of, one sample more; accelerations are its own matter."""
    load = _rotor_load(law, motion, imbalance, (0.0, 0.0))
    return (
        old[0] + law.torque_per_volt * voltage[0] - load[0],
        old[1] + law.torque_per_volt * voltage[1] - load[1],
    )


@compiled
def _share_of_friction(
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
    asked = _motor_torques(settings, plan, beliefs, motion, smoothed)
    if count % settings.voltage_every == 0:
        voltage = (_voltage_for(settings.law, asked[0]), _voltage_for(settings.law, asked[1]))
    if plan.stage == FRICTION:
        torque = _known_torques(settings.law, torque, motion, beliefs.imbalance, voltage)
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
        load = _share_of_friction(law, motion, smoothed, beliefs.imbalance, sure)
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
