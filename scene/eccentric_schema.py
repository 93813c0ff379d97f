"""The keys of a scene with two driven eccentric masses, as `schema` has those of a liquid ring.

Standard deviations are those of Gaussian noise.  A walk is the standard deviation that a quantity gathers
within one second by a random walk: after t seconds it is the walk times sqrt(t / 1 s), whatever the step.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from ringbalance.scene.fields import (
    Bounds,
    angle_of_turn,
    choice,
    each_of,
    number,
    quantity,
    share,
    teeth_number,
)
from ringbalance.scene.presence import Table, derived, list_of_tables, needed, standard, unused
from ringbalance.scene.schema import (
    BALANCERS,
    AccuracyTable,
    Length,
    Name,
    PositiveAngle,
    PositiveLength,
    PositiveTime,
    RunTable,
    Time,
    Turn,
)

_POSITIVE = Bounds(above=0)
_NOT_NEGATIVE = Bounds(at_least=0)

PositiveMass = Annotated[float | None, quantity("mass", _POSITIVE)]
Mass = Annotated[float | None, quantity("mass", _NOT_NEGATIVE)]
Stiffness = Annotated[float | None, quantity("stiffness", _POSITIVE)]
Damping = Annotated[float | None, quantity("damping", _NOT_NEGATIVE)]
Velocity = Annotated[float | None, quantity("velocity", _NOT_NEGATIVE)]
PositiveVelocity = Annotated[float | None, quantity("velocity", _POSITIVE)]
PositiveUnbalance = Annotated[float | None, quantity("unbalance", _POSITIVE)]
Unbalance = Annotated[float | None, quantity("unbalance", _NOT_NEGATIVE)]
Angle = Annotated[float | None, quantity("angle", _NOT_NEGATIVE)]
Rate = Annotated[float | None, quantity("speed", _NOT_NEGATIVE)]
PositiveRate = Annotated[float | None, quantity("speed", _POSITIVE)]
Inertia = Annotated[float | None, quantity("inertia", _NOT_NEGATIVE)]
Weight = Annotated[float | None, number(_POSITIVE)]
Gate = Annotated[float | None, share(Bounds(above=0, at_most=1), example=0.01)]
Angles = Annotated[
    tuple[float, float] | None, each_of(angle_of_turn(), count=2, example='["0 deg", "180 deg"]')
]
Arms = Annotated[
    tuple[float, float] | None,
    each_of(quantity("length", _NOT_NEGATIVE), count=2, example='["10 mm", "10 mm"]'),
]
Teeth = Annotated[tuple[int, int, int] | None, each_of(teeth_number(), count=3, example="[10, 40, 400]")]
Method = Annotated[str | None, choice("exact", "euler")]


class SpeedPointTable(Table):
    """One entry of [rotor] speed_profile."""

    time: Annotated[float, quantity("time", _NOT_NEGATIVE)] = Field(description="from the start of the run")
    speed: Annotated[float, quantity("speed")] = Field(
        description="of the rotor; negative against the sense in which angles count"
    )


class EccentricRotorTable(Table):
    """[rotor]."""

    mass: PositiveMass = needed("m_r of the rotor with its imbalance, without the two driven masses")
    stiffness: Stiffness = needed("K_B of the isotropic bearing")
    damping: Damping = needed("C_B of the isotropic bearing")
    speed_profile: tuple[SpeedPointTable, ...] | None = list_of_tables(
        '[{ time = "0 s", speed = "100 rpm" }, ...]',
        "list of { time, speed }; the speed is linear in between, and constant before and after",
        is_needed=True,
    )


class ImbalanceTable(Table):
    """[imbalance]."""

    mass: Mass = needed("m_im; a part of the rotor's mass")
    radius: PositiveLength = needed("r_im, of the imbalance")
    phase: Turn = needed("phi_m, of the imbalance in the rotor's frame")


class MassesTable(Table):
    """[masses]."""

    mass: PositiveMass = needed("m_b of each")
    guide_radius: PositiveLength = needed("r_b of the circular track")
    arc_length: PositiveLength = needed("l of each along the track: the masses cannot come closer")
    initial_angle: Angles = standard(["0 deg", "180 deg"], "phi of each at the start, in the rotor's frame")
    friction_arm: Arms = standard(
        ["0 mm", "0 mm"],
        "mu_f of each, a length: friction torque = mu_f m_b r_b (rotor speed + mass's own speed)^2",
    )


class MotorTable(Table):
    """[motor]."""

    torque_constant: Annotated[float | None, quantity("torque_constant", _POSITIVE)] = needed(
        "K_i, motor torque per current"
    )
    back_emf_constant: Annotated[float | None, quantity("voltage_per_speed", _NOT_NEGATIVE)] = needed(
        "K_m, voltage per speed of the motor"
    )
    resistance: Annotated[float | None, quantity("resistance", _POSITIVE)] = needed("R_m of the winding")
    motor_inertia: Inertia = needed("J_1 of motor and gear A")
    gear_inertia: Inertia = needed("J_2 of gear B")
    teeth: Teeth = needed("N_1 of gear A on the motor, N_2 of gear B, N_3 of the fixed gear C")
    maximum_voltage: Annotated[float | None, quantity("voltage", _POSITIVE)] = unused(
        "no limit", "a larger command is cut to this"
    )


class EccentricSensorTable(Table):
    """[sensor]."""

    frame: Annotated[str | None, choice("rotor", "laboratory")] = standard(
        "rotor", "frame in which the sensors measure the rotor's position and velocity"
    )
    position_noise: Length = standard("0 mm", "standard deviation of each measured coordinate")
    velocity_noise: Velocity = standard("0 mm/s", "standard deviation of each measured velocity")
    encoder_noise: Angle = standard("0 deg", "standard deviation of the measured angle of a mass")
    encoder_rate_noise: Rate = standard("0 rad/s", "standard deviation of the measured speed of a mass")
    step: PositiveTime = standard("1 ms", "time between two samples, the step of the whole loop")


class ImbalanceFilterTable(Table):
    """[imbalance_filter]."""

    step: PositiveTime = derived("step of [sensor]", "time between two updates")
    discretisation: Method = standard(
        "exact",
        "of the rotor's equations: by the matrix exponential, or by one Euler step as the paper has it",
    )
    position_noise: PositiveLength = derived(
        "position_noise of [sensor], at least 1 um", "standard deviation that the filter believes"
    )
    velocity_noise: PositiveVelocity = derived(
        "velocity_noise of [sensor], at least 10 um/s", "standard deviation that the filter believes"
    )
    velocity_walk: Velocity = standard(
        "0.1 mm/s", "random walk of the rotor's velocity, from forces that are not in the model, within 1 s"
    )
    unbalance_walk: Unbalance = standard("1 g*mm", "random walk of the unbalance within 1 s")
    initial_position: PositiveLength = derived(
        "2 m_b r_b / M, the balancing capacity over the whole mass",
        "standard deviation of each coordinate before the first update",
    )
    initial_velocity: PositiveVelocity = derived(
        "initial_position times the critical speed",
        "standard deviation of each velocity before the first update",
    )
    initial_unbalance: PositiveUnbalance = derived(
        "2 m_b r_b, the balancing capacity",
        "standard deviation of each component of the unbalance before the first update",
    )
    gate: Gate = standard(
        "1 %", "the estimate is taken when its standard deviation is below this share of its magnitude"
    )
    assumed_mass: PositiveMass = derived("mass of [rotor]", "what the filter and the controller believe")
    assumed_stiffness: Stiffness = derived(
        "stiffness of [rotor]", "what the filter and the controller believe"
    )
    assumed_damping: Damping = derived("damping of [rotor]", "what the filter and the controller believe")


class FrictionFilterTable(Table):
    """[friction_filter]."""

    step: PositiveTime = derived("step of [sensor]", "time between two updates")
    discretisation: Method = standard("exact", "of the drive's equations, as in [imbalance_filter]")
    rate_noise: PositiveRate = derived(
        "encoder_rate_noise of [sensor], at least 0.001 rad/s", "standard deviation that the filter believes"
    )
    rate_walk: Rate = standard("0.01 rad/s", "random walk of the speed of a mass within 1 s")
    friction_walk: Length = standard("0.01 mm", "random walk of the friction arm within 1 s")
    initial_rate: PositiveRate = derived(
        "drive_speed", "standard deviation of the speed of a mass before the first update"
    )
    initial_friction: PositiveLength = derived(
        "a tenth of guide_radius", "standard deviation of the friction arm before the first update"
    )
    drive_speed: PositiveRate = standard(
        "5 rpm", "speed of both masses along the track while friction is found"
    )
    speed_gain: Annotated[float | None, quantity("voltage_per_speed", _POSITIVE)] = standard(
        "2 V*s/rad", "gamma, motor voltage per error of the speed of a mass"
    )
    pair_gain: Annotated[float | None, quantity("voltage_per_angle", _NOT_NEGATIVE)] = standard(
        "2 V/rad", "motor voltage per error of the 180 degrees between the masses; zero for the paper's law"
    )
    stall_share: Gate = standard(
        "20 %", "a warning is given when a mass is slower than this share of drive_speed"
    )
    gate: Gate = standard(
        "2 %", "the estimate is taken when its standard deviation is below this share of its magnitude"
    )


class LqrTable(Table):
    """[lqr]."""

    state_weight: Weight = standard(3.5, "q in Q = q diag(0.1, 0.1, 0.01, 0.01), of angles and speeds in SI")
    input_weight: Weight = standard(1.0, "r in R = r diag(0.1, 0.1), of torques in SI")
    step: PositiveTime = derived("step of [sensor]", "time for which the motors' voltages are held")
    friction_compensation: Annotated[str | None, choice("break_away", "printed", "none")] = standard(
        "break_away",
        "of the estimated friction: so that a mass at rest breaks away; as the paper prints it; or none",
    )


class FineTuningTable(Table):
    """[fine_tuning]."""

    step: PositiveAngle = standard("4 deg", "first trial move of the masses; it is halved when no move helps")
    stop: PositiveAngle = standard("0.1 deg", "tuning ends when the trial move is shorter than this")
    wait: Time = derived(
        "8 / decay rate C_B / (2 M) of the rotor, at most 30 s", "after a move, for the rotor to settle"
    )
    average: PositiveTime = derived(
        "two turns of the rotor at the start", "time over which the amplitude is averaged"
    )


class SupervisorTable(Table):
    """[supervisor]."""

    strategy: Annotated[str | None, choice("whole", "locked")] = standard(
        "whole", "all stages in turn; or none, with the masses locked where they are"
    )
    start: Time = standard("0 s", "beginning of the first stage")
    limit: PositiveLength = derived(
        "2 % of 2 m_b r_b / M, at least three times position_noise",
        "amplitude (zero-to-peak) below which no fine tuning is needed",
    )
    lowest_speed: PositiveRate = standard(
        "1 rpm", "the imbalance cannot be seen below this speed, and its estimation is refused"
    )
    arrival_angle: PositiveAngle = standard("0.5 deg", "a mass has arrived when it is closer to its target")
    arrival_rate: PositiveRate = standard("0.5 deg/s", "a mass has arrived when it is also slower than this")
    imbalance_time: PositiveTime = standard("60 s", "longest estimation of the imbalance")
    friction_time: PositiveTime = standard("60 s", "longest estimation of the friction")
    positioning_time: PositiveTime = standard("60 s", "longest move to the targets")
    fine_tuning_time: PositiveTime = standard("600 s", "longest fine tuning")
    target_error: Annotated[
        tuple[float, float] | None, each_of(angle_of_turn(), count=2, example='["10 deg", "-10 deg"]')
    ] = standard(["0 deg", "0 deg"], "added to each target, to show what fine tuning mends")


class EccentricTables(Table):
    """A whole scene file with two driven eccentric masses."""

    name: Name = derived("the file's name", "title of the scene")
    balancer: Annotated[str | None, choice(*BALANCERS)] = needed('"eccentric_mass" for driven masses')
    rotor: EccentricRotorTable = Field(
        default_factory=EccentricRotorTable, description="the rotor on its bearing, and its speed"
    )
    imbalance: ImbalanceTable = Field(
        default_factory=ImbalanceTable, description="the imbalance to be balanced"
    )
    masses: MassesTable = Field(
        default_factory=MassesTable, description="the two driven masses on their track"
    )
    motor: MotorTable = Field(default_factory=MotorTable, description="motor and gears of each mass")
    sensor: EccentricSensorTable = Field(
        default_factory=EccentricSensorTable, description="the sensors; exact when left out"
    )
    imbalance_filter: ImbalanceFilterTable = Field(
        default_factory=ImbalanceFilterTable, description="the Kalman filter that finds the imbalance"
    )
    friction_filter: FrictionFilterTable = Field(
        default_factory=FrictionFilterTable, description="the extended Kalman filter that finds the friction"
    )
    lqr: LqrTable = Field(default_factory=LqrTable, description="the regulator that moves the masses")
    fine_tuning: FineTuningTable = Field(
        default_factory=FineTuningTable, description="the search by trial for a smaller vibration"
    )
    supervisor: SupervisorTable = Field(
        default_factory=SupervisorTable, description="the order of the stages, and when each ends"
    )
    run: RunTable = Field(default_factory=RunTable, description="a simulation's seed and end")
    accuracy: AccuracyTable = Field(default_factory=AccuracyTable, description="what is asked of the result")
