"""Records of filters, regulator and stages of two eccentric masses; `scene_records` has the machine."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal

from ringbalance.scene.keys.declaration import derived, standard
from ringbalance.scene.keys.fields import (
    NOT_NEGATIVE,
    POSITIVE,
    Damping,
    Gate,
    Length,
    PositiveAngle,
    PositiveLength,
    PositiveMass,
    PositiveRate,
    PositiveTime,
    PositiveUnbalance,
    PositiveVelocity,
    Rate,
    Stiffness,
    Time,
    Unbalance,
    Velocity,
    Weight,
    angle_of_turn,
    each_of,
    quantity,
)

Discretisation = Literal["exact", "euler"]
FrictionCompensation = Literal["break_away", "none"]
Strategy = Literal["whole", "locked"]
CorrectionRule = Literal["measured", "trials"]

_FINEST_FRACTION = 1e-5
"""Noise that a filter assumes of exact sensors, as a fraction of its initial standard deviation."""
_FINEST_RATE_RAD_S = 1e-3
_UNBALANCE_WALK_FRACTION = 0.01
"""Random walk of the unbalance within 1 s, as a fraction of its standard deviation after 1 s of samples far
above the critical speed: the filter averages over 100 s, longer than an estimation takes."""
_VELOCITY_WALK_FRACTION = 0.03
"""Random walk of the velocity within 1 s, as a fraction of W_c^2 times the displacement noise of 1 s.

The fraction is largest at the critical speed, where damping divides it.
"""
_LONGEST_WAIT_S = 30.0
_MEAN_NOISE_FRACTION = 0.05
"""Noise of the mean vibration (95 %), as a fraction of the limit."""
_LONGEST_AVERAGE_S = 30.0
"""Bound of the averaging time for slow sensors; two turns of a slower rotor still take longer."""


def _capacity(mass: float, radius: float) -> float:
    """Largest static moment of the eccentric masses, kg m."""
    return 2 * mass * radius


def _capacity_travel(mass: float, radius: float, rotor: float) -> float:
    """Largest static moment of the eccentric masses, divided by the total mass, m."""
    return _capacity(mass, radius) / (rotor + 2 * mass)


def _assumed_noise(noise: float, expected: float) -> float:
    """Standard deviation of a sensor that the filter assumes, with a lower bound for exact sensors."""
    return max(noise, _FINEST_FRACTION * expected)


def _settling(damping: float, rotor: float, mass: float) -> float:
    """Eight time constants of the free whirl, at most `_LONGEST_WAIT_S`, s."""
    twice_mass = 2 * (rotor + 2 * mass)
    return _LONGEST_WAIT_S if damping * _LONGEST_WAIT_S <= 8 * twice_mass else 8 * twice_mass / damping


def _averaging(profile: Sequence[Any], noise: float, limit: float, step: float) -> float:
    """Whole turns at the start of a speed profile that make the mean precise, s; without a speed 1 s.

    The noise of the mean, 2 position_noise / sqrt(samples), is then at most 5 % of the limit.
    """
    speeds = [abs(corner.speed) for corner in profile]
    fastest = speeds[0] or max(speeds) if speeds else 0.0
    precise = min(step * (2 * noise / (_MEAN_NOISE_FRACTION * limit)) ** 2, _LONGEST_AVERAGE_S)
    turn = 2 * math.pi / fastest if fastest else 0.5
    return turn * max(math.ceil(precise / turn), 2)


@dataclass(frozen=True, kw_only=True)
class ImbalanceFilter:
    """Kalman filter of rotor and unbalance."""

    step: Annotated[PositiveTime, derived("step of [sensor]", "time between two updates", "sensor.step")]
    discretisation: Annotated[
        Discretisation,
        standard(
            "exact",
            "of the rotor's equations: by the matrix exponential, or by one Euler step as the paper has it",
        ),
    ]
    initial_position: Annotated[
        PositiveLength,
        derived(
            "2 m_b r_b / M, the balancing capacity over the whole mass",
            "standard deviation of each coordinate before the first update",
            "masses.mass",
            "masses.guide_radius",
            "rotor.mass",
            rule=_capacity_travel,
        ),
    ]
    initial_velocity: Annotated[
        PositiveVelocity,
        derived(
            "initial_position times the critical speed",
            "standard deviation of each velocity before the first update",
            "imbalance_filter.initial_position",
            "rotor.stiffness",
            "rotor.mass",
            "masses.mass",
            rule=lambda travel, stiffness, rotor, mass: travel * math.sqrt(stiffness / (rotor + 2 * mass)),
        ),
    ]
    initial_unbalance: Annotated[
        PositiveUnbalance,
        derived(
            "2 m_b r_b, the balancing capacity",
            "standard deviation of each component of the unbalance before the first update",
            "masses.mass",
            "masses.guide_radius",
            rule=_capacity,
        ),
    ]
    position_noise: Annotated[
        PositiveLength,
        derived(
            "position_noise of [sensor], at least 1e-5 initial_position",
            "standard deviation that the filter assumes",
            "sensor.position_noise",
            "imbalance_filter.initial_position",
            rule=_assumed_noise,
        ),
    ]
    velocity_noise: Annotated[
        PositiveVelocity,
        derived(
            "velocity_noise of [sensor], at least 1e-5 initial_velocity",
            "standard deviation that the filter assumes",
            "sensor.velocity_noise",
            "imbalance_filter.initial_velocity",
            rule=_assumed_noise,
        ),
    ]
    velocity_walk: Annotated[
        Velocity,
        derived(
            "0.03 W_c^2 position_noise sqrt(step / 1 s), W_c the critical speed",
            "random walk of the rotor's velocity, from forces that are not in the model, within 1 s",
            "imbalance_filter.position_noise",
            "imbalance_filter.step",
            "rotor.stiffness",
            "rotor.mass",
            "masses.mass",
            rule=lambda noise, step, stiffness, rotor, mass: (
                _VELOCITY_WALK_FRACTION * stiffness / (rotor + 2 * mass) * noise * math.sqrt(step)
            ),
        ),
    ]
    unbalance_walk: Annotated[
        Unbalance,
        derived(
            "0.01 M position_noise sqrt(step / 1 s)",
            "random walk of the unbalance within 1 s",
            "imbalance_filter.position_noise",
            "imbalance_filter.step",
            "rotor.mass",
            "masses.mass",
            rule=lambda noise, step, rotor, mass: (
                _UNBALANCE_WALK_FRACTION * (rotor + 2 * mass) * noise * math.sqrt(step)
            ),
        ),
    ]
    gate: Annotated[
        Gate,
        standard(
            "1 %", "the estimate is taken when its standard deviation is below this share of its magnitude"
        ),
    ]
    assumed_mass: Annotated[
        PositiveMass,
        derived("mass of [rotor]", "value used by the filter and the controller", "rotor.mass"),
    ]
    assumed_stiffness: Annotated[
        Stiffness,
        derived("stiffness of [rotor]", "value used by the filter and the controller", "rotor.stiffness"),
    ]
    assumed_damping: Annotated[
        Damping,
        derived("damping of [rotor]", "value used by the filter and the controller", "rotor.damping"),
    ]


@dataclass(frozen=True, kw_only=True)
class FrictionFilter:
    """Extended Kalman filter of the friction arms, and the drive of the friction stage."""

    step: Annotated[PositiveTime, derived("step of [sensor]", "time between two updates", "sensor.step")]
    discretisation: Annotated[
        Discretisation, standard("exact", "of the drive's equations, as in [imbalance_filter]")
    ]
    rate_noise: Annotated[
        PositiveRate,
        derived(
            "encoder_rate_noise of [sensor], at least 0.001 rad/s",
            "standard deviation that the filter assumes",
            "sensor.encoder_rate_noise",
            rule=partial(max, _FINEST_RATE_RAD_S),
        ),
    ]
    rate_walk: Annotated[Rate, standard("0.01 rad/s", "random walk of the speed of a mass within 1 s")]
    friction_walk: Annotated[
        Length,
        derived(
            "4e-5 guide_radius",
            "random walk of the friction arm within 1 s",
            "masses.guide_radius",
            rule=lambda radius: 4e-5 * radius,
        ),
    ]
    initial_rate: Annotated[
        PositiveRate,
        derived(
            "drive_speed",
            "standard deviation of the speed of a mass before the first update",
            "friction_filter.drive_speed",
        ),
    ]
    initial_friction: Annotated[
        PositiveLength,
        derived(
            "a tenth of guide_radius",
            "standard deviation of the friction arm before the first update",
            "masses.guide_radius",
            rule=lambda radius: radius / 10,
        ),
    ]
    drive_speed: Annotated[
        PositiveRate, standard("5 rpm", "speed of both masses along the track while friction is found")
    ]
    speed_gain: Annotated[
        float,
        quantity("voltage_per_speed", POSITIVE),
        standard("2 V*s/rad", "gamma, motor voltage per error of the speed of a mass"),
    ]
    pair_gain: Annotated[
        float,
        quantity("voltage_per_angle", NOT_NEGATIVE),
        standard(
            "2 V/rad",
            "motor voltage per error of the 180 degrees between the masses; zero for the paper's law",
        ),
    ]
    stall_share: Annotated[
        Gate, standard("20 %", "a warning is given when a mass is slower than this share of drive_speed")
    ]
    gate: Annotated[
        Gate,
        standard(
            "2 %", "the estimate is taken when its standard deviation is below this share of its magnitude"
        ),
    ]


@dataclass(frozen=True, kw_only=True)
class Lqr:
    """Regulator that moves the masses to their targets."""

    state_weight: Annotated[
        Weight, standard(3.5, "q in Q = q diag(0.1, 0.1, 0.01, 0.01), of angles and speeds in SI")
    ]
    input_weight: Annotated[Weight, standard(1.0, "r in R = r diag(0.1, 0.1), of torques in SI")]
    step: Annotated[
        PositiveTime,
        derived("step of [sensor]", "time for which the motors' voltages are held", "sensor.step"),
    ]
    friction_compensation: Annotated[
        FrictionCompensation,
        standard(
            "break_away",
            "of the estimated friction: so that a mass at rest breaks away; or none",
        ),
    ]


@dataclass(frozen=True, kw_only=True)
class FineTuning:
    """Search by trial for a smaller vibration."""

    step: Annotated[
        PositiveAngle, standard("4 deg", "first trial move of the masses; it is halved when no move helps")
    ]
    stop: Annotated[
        PositiveAngle, standard("0.1 deg", "tuning ends when the trial move is shorter than this")
    ]
    wait: Annotated[
        Time,
        derived(
            "8 / decay rate C_B / (2 M) of the rotor, at most 30 s",
            "after a move, for the rotor to settle",
            "rotor.damping",
            "rotor.mass",
            "masses.mass",
            rule=_settling,
        ),
    ]
    average: Annotated[
        PositiveTime,
        derived(
            "two turns of the rotor at the start; more, up to 30 s, until the noise of the mean, "
            "2 position_noise sqrt(step / average), is at most 5 % of limit",
            "time over which the vibration is averaged; balanced is a mean at least its noise below limit",
            "rotor.speed_profile",
            "sensor.position_noise",
            "supervisor.limit",
            "sensor.step",
            rule=_averaging,
        ),
    ]


@dataclass(frozen=True, kw_only=True)
class Supervisor:
    """Gates, times and limits of the stages."""

    strategy: Annotated[
        Strategy, standard("whole", "all stages in turn; or none, with the masses locked where they are")
    ]
    start: Annotated[Time, standard("0 s", "beginning of the first stage")]
    limit: Annotated[
        PositiveLength,
        derived(
            "2 % of 2 m_b r_b / M, at least three times position_noise",
            "amplitude (zero-to-peak) below which no fine tuning is needed",
            "masses.mass",
            "masses.guide_radius",
            "rotor.mass",
            "sensor.position_noise",
            rule=lambda mass, radius, rotor, noise: max(
                0.02 * _capacity_travel(mass, radius, rotor), 3 * noise
            ),
        ),
    ]
    lowest_speed: Annotated[
        PositiveRate,
        standard("1 rpm", "the imbalance cannot be seen below this speed, and its estimation is refused"),
    ]
    arrival_angle: Annotated[
        PositiveAngle, standard("0.5 deg", "a mass has arrived when it is closer to its target")
    ]
    arrival_rate: Annotated[
        PositiveRate, standard("0.5 deg/s", "a mass has arrived when it is also slower than this")
    ]
    imbalance_time: Annotated[PositiveTime, standard("60 s", "longest estimation of the imbalance")]
    friction_time: Annotated[PositiveTime, standard("60 s", "longest estimation of the friction")]
    positioning_time: Annotated[PositiveTime, standard("60 s", "longest move to the targets")]
    correction: Annotated[
        CorrectionRule,
        standard(
            "measured",
            "of the targets after the check: by the measured vibration over the assumed influence of an "
            "unbalance, with trials only where that does not help; or by trials alone, as the paper has it",
        ),
    ]
    fine_tuning_time: Annotated[PositiveTime, standard("600 s", "longest fine tuning")]
    target_error: Annotated[
        tuple[float, float],
        each_of(angle_of_turn(), count=2, example='["10 deg", "-10 deg"]'),
        standard(["0 deg", "0 deg"], "added to each target, to show what fine tuning mends"),
    ]
