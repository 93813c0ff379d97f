"""The keys of a scene file: what each means, what it takes, and what holds when it is left out.

Every key may be absent as far as this schema goes, so that what is right in a faulty file can still be
cross-checked; `requirements` says what must be there.  Defaults are written as a user would write them.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from ringbalance.scene.fields import (
    Bounds,
    angle_of_turn,
    chamber_count,
    chamber_letters,
    choice,
    half_width,
    number,
    quantity,
    seed_number,
    share,
    text,
)
from ringbalance.scene.presence import Table, derived, list_of_tables, needed, standard, unused

BALANCERS = ("liquid_ring", "eccentric_mass")
_POSITIVE = Bounds(above=0)
_NOT_NEGATIVE = Bounds(at_least=0)

Name = Annotated[str | None, text()]
PositiveLength = Annotated[float | None, quantity("length", _POSITIVE)]
Length = Annotated[float | None, quantity("length", _NOT_NEGATIVE)]
PositiveAngle = Annotated[float | None, quantity("angle", _POSITIVE)]
Turn = Annotated[float | None, angle_of_turn()]
AngleNoise = Annotated[float | None, quantity("angle", _NOT_NEGATIVE)]
PositiveTime = Annotated[float | None, quantity("time", _POSITIVE)]
Time = Annotated[float | None, quantity("time", _NOT_NEGATIVE)]
Pressure = Annotated[float | None, quantity("pressure", _NOT_NEGATIVE)]
PositivePressure = Annotated[float | None, quantity("pressure", _POSITIVE)]
Temperature = Annotated[float | None, quantity("temperature")]
Influence = Annotated[float | None, quantity("influence_coefficient", _POSITIVE)]

LengthSpread = Annotated[tuple[float, bool] | None, half_width("length")]
AngleSpread = Annotated[tuple[float, bool] | None, half_width("angle")]
DensitySpread = Annotated[tuple[float, bool] | None, half_width("density")]
ViscositySpread = Annotated[tuple[float, bool] | None, half_width("kinematic_viscosity")]
PressureSpread = Annotated[tuple[float, bool] | None, half_width("pressure")]
ConductanceSpread = Annotated[tuple[float, bool] | None, half_width("conductance")]
NumberSpread = Annotated[tuple[float, bool] | None, half_width(None)]
VolumeSpread = Annotated[tuple[float, bool] | None, half_width("volume")]
TimeSpread = Annotated[tuple[float, bool] | None, half_width("time")]
SpeedSpread = Annotated[tuple[float, bool] | None, half_width("speed")]
InfluenceSpread = Annotated[tuple[float, bool] | None, half_width("influence_coefficient")]


def _spread(table: str) -> Any:
    rule = "that of the known liquid" if table == "liquid" else "exact"
    return unused(rule, f"half-width of the quantity in [{table}]")


class DiscTable(Table):
    """[disc]."""

    outer_radius: PositiveLength = needed("R2 of the chambers")
    inner_radius: PositiveLength = needed("R1 of the chambers")
    axial_width: PositiveLength = needed("B, inner width of the chambers along the shaft")
    central_angle: PositiveAngle = needed(
        "theta of one chamber between its bounding radii; at most 360 deg / chambers"
    )
    chambers: Annotated[int | None, chamber_count()] = derived(
        "360 deg / central_angle, when that is an even number", "number of chambers"
    )
    plate_thickness: Length = standard(
        "0 mm",
        "strip that a plate takes on each side of a chamber, so half of the plate between two chambers",
    )
    max_fill_ratio: Annotated[float | None, share(Bounds(above=0, at_most=1), example=0.5)] = standard(
        0.5, "liquid of a pair of opposite chambers, as a share of the volume of one chamber"
    )
    initial_fill: Annotated[float | None, share(Bounds(above=0, at_most=1), example=0.5)] = derived(
        "half of max_fill_ratio, the only value allowed", "fill ratio of every chamber at the start"
    )


class LiquidTable(Table):
    """[liquid]."""

    name: Name = unused(
        "density and kinematic_viscosity are needed",
        "a known liquid (see below), or a label for a custom one",
    )
    temperature: Temperature = derived(
        "needed for a known liquid, unless its data are for one temperature only", "of the liquid at work"
    )
    density: Annotated[float | None, quantity("density", _POSITIVE)] = derived(
        "that of the known liquid",
        "given outright, which wins; its uncertainty is then 0 unless [uncertainty] has one",
    )
    kinematic_viscosity: Annotated[float | None, quantity("kinematic_viscosity", _POSITIVE)] = derived(
        "that of the known liquid",
        "given outright, which wins; its uncertainty is then 0 unless [uncertainty] has one",
    )
    vapour_pressure: Pressure = derived("that of the known liquid; 0 Pa for a custom one", "absolute")


class BendTable(Table):
    """One entry of [tube] bends."""

    angle: Annotated[float, quantity("angle", _POSITIVE)] = Field(description="angle the bend turns through")
    radius: Annotated[float, quantity("length", _POSITIVE)] = Field(description="radius of its centre line")


class TubeTable(Table):
    """[tube]."""

    bore: PositiveLength = needed("inner diameter d")
    port_radius: PositiveLength = derived(
        "outer_radius", "radius at which both ends of the tube open into their chambers"
    )
    hump_radius: PositiveLength = unused(
        "the straight tube of the paper's Eq. 18: always a full siphon",
        "smallest radius on the path from port to port",
    )
    hump_position: Annotated[float | None, share(Bounds(above=0, below=1), example=0.5)] = standard(
        0.5, "share of the path, from the driven chamber, at which the hump lies"
    )
    hump_gas: Annotated[str | None, choice("vented", "trapped")] = standard(
        "vented", "bound used for the priming pressure: gas beyond the hump is vented, or must be pushed out"
    )
    length: PositiveLength = derived(
        "needed; with drag_coefficient the shortest path from port over hump to port",
        "length of the centre line, bends included",
    )
    roughness: Length = standard(
        "1.5 um", "absolute roughness of the wall; that of drawn tubing when left out"
    )
    entrance: Annotated[str | None, choice("sharp", "rounded", "projecting")] = standard(
        "sharp", "shape of the edge at which the liquid enters"
    )
    entrance_radius: PositiveLength = derived(
        "needed with a rounded entrance, not allowed otherwise", "radius of the rounded edge"
    )
    bends: tuple[BendTable, ...] = list_of_tables(
        '[{ angle = "90 deg", radius = "3 mm" }, ...]',
        "list of { angle, radius } in order from the driven chamber",
    )
    extra_loss: Annotated[float | None, number(_NOT_NEGATIVE)] = standard(
        0.0, "any further loss coefficient, on the velocity head in the tube"
    )
    drag_coefficient: Annotated[float | None, number(_POSITIVE)] = unused(
        "k is calculated from the tube and the liquid", "fixes k by decree, as the paper does"
    )


class GasTable(Table):
    """[gas]."""

    pressure: Pressure = needed("gauge pressure in the driven chamber while its valve is open")
    ambient_pressure: PositivePressure = standard("101.325 kPa", "absolute pressure of the surroundings")
    temperature: Temperature = standard("20 degC", "of the gas before the valve")
    conductance: Annotated[float | None, quantity("conductance", _POSITIVE)] = unused(
        "the chamber fills at once", "sonic conductance C (ISO 6358) of valve and line; needs critical_ratio"
    )
    critical_ratio: Annotated[float | None, share(Bounds(above=0, below=1), example=0.3)] = unused(
        "the chamber fills at once",
        "critical pressure ratio b (ISO 6358) of valve and line; needs conductance",
    )
    dead_volume: Annotated[float | None, quantity("volume", _NOT_NEGATIVE)] = unused(
        "no volume besides the chamber's", "gas volume between valve and chamber"
    )
    valve_lag: Time = unused(
        "the valves open and close at once", "time from the command to the valve's motion"
    )
    process: Annotated[str | None, choice("isothermal", "adiabatic")] = standard(
        "isothermal",
        "whether a chamber's gas keeps its temperature while it fills and vents, or takes no heat; "
        "matters with conductance only",
    )


class EnvironmentTable(Table):
    """[environment]."""

    shaft: Annotated[str | None, choice("horizontal", "vertical")] = standard(
        "horizontal", "how the shaft lies in the field of gravity"
    )
    gravity: Annotated[float | None, quantity("acceleration", _NOT_NEGATIVE)] = standard(
        "9.80665 m/s^2", "acceleration of gravity; zero for none"
    )


class VibrationTable(Table):
    """[rotor] initial_vibration."""

    amplitude: Annotated[float, quantity("length", _NOT_NEGATIVE)] = Field(description="zero-to-peak")
    phase: Annotated[float, angle_of_turn()] = Field(description="of the vibration, with the rotation")


class RotorTable(Table):
    """[rotor]."""

    speed: Annotated[float | None, quantity("speed", _POSITIVE)] = needed("speed of the rotor")
    influence_coefficient: Influence = standard(
        "0.0108 um/(g*mm)",
        "zero-to-peak vibration per unbalance; the default is inferred for the paper's rotor",
    )
    lag_angle: Turn = standard(
        "17 deg",
        "by which the vibration lags behind the unbalance; the default is assumed for the paper's rotor",
    )
    initial_vibration: VibrationTable | None = standard(
        {"amplitude": "10 um", "phase": "90 deg"}, "{ amplitude, phase } before balancing, zero-to-peak"
    )


class SensorTable(Table):
    """[sensor]."""

    amplitude_noise: Length = standard("0 um", "standard deviation of the measured amplitude")
    phase_noise: AngleNoise = standard("0 deg", "standard deviation of the measured phase")


class ControllerTable(Table):
    """[controller]."""

    kind: Annotated[str | None, choice("target_vector", "trial", "law_based")] = standard(
        "target_vector", "algorithm; law_based takes the gas time straight from the flow law"
    )
    limit: PositiveLength = standard("0.05 um", "amplitude below which the controller rests")
    period: PositiveTime = standard("0.5 s", "wait after the gas closes, before the next sample")
    proportional: Annotated[float | None, quantity("gain", _POSITIVE)] = standard(
        "0.08 s/um", "Kc, gas time per vibration amplitude"
    )
    integral_time: PositiveTime = unused("no integral part", "Ti")
    derivative_time: Time = standard("0 s", "Td; zero for no derivative part")
    minimum_gas_time: Time = standard("1 ms", "a shorter command is not executed")
    maximum_gas_time: PositiveTime = standard("5 s", "a longer command is cut to this")
    assumed_influence_coefficient: Influence = derived(
        "influence_coefficient of [rotor]", "what the controller believes"
    )
    assumed_lag_angle: Turn = derived("lag_angle of [rotor]", "what the controller believes")
    sequence: Annotated[tuple[str, ...] | None, chamber_letters()] = derived(
        "each chamber followed by its opposite: A, C, B, D for four", "trial algorithm: order of the chambers"
    )
    first_trial: PositiveTime = standard("50 ms", "trial algorithm: gas time of a chamber's first trial")
    long_step: PositiveTime = standard("100 ms", "trial algorithm: gas time while the amplitude is large")
    short_step: PositiveTime = standard("5 ms", "trial algorithm: gas time below fine_below")
    fine_below: PositiveLength = standard(
        "0.8 um", "trial algorithm: amplitude below which short steps are used"
    )


class RunTable(Table):
    """[run]."""

    seed: Annotated[int | None, seed_number()] = standard(0, "of all random numbers")
    time_limit: PositiveTime = standard("120 s", "end of a simulation")


class AccuracyTable(Table):
    """[accuracy]."""

    tolerance: Annotated[float | None, share(Bounds(above=0, below=1), example=0.01)] = standard(
        "1 %", "relative bound on discretisation and left-out terms, against the top model"
    )


class UncertaintyTable(Table):
    """[uncertainty]: 95 % half-widths of scene quantities, each under its own key."""

    outer_radius: LengthSpread = _spread("disc")
    inner_radius: LengthSpread = _spread("disc")
    axial_width: LengthSpread = _spread("disc")
    central_angle: AngleSpread = _spread("disc")
    plate_thickness: LengthSpread = _spread("disc")
    density: DensitySpread = _spread("liquid")
    kinematic_viscosity: ViscositySpread = _spread("liquid")
    vapour_pressure: PressureSpread = _spread("liquid")
    bore: LengthSpread = _spread("tube")
    port_radius: LengthSpread = _spread("tube")
    hump_radius: LengthSpread = _spread("tube")
    length: LengthSpread = _spread("tube")
    roughness: LengthSpread = _spread("tube")
    extra_loss: NumberSpread = _spread("tube")
    drag_coefficient: NumberSpread = _spread("tube")
    pressure: PressureSpread = _spread("gas")
    ambient_pressure: PressureSpread = _spread("gas")
    conductance: ConductanceSpread = _spread("gas")
    critical_ratio: NumberSpread = _spread("gas")
    dead_volume: VolumeSpread = _spread("gas")
    valve_lag: TimeSpread = _spread("gas")
    speed: SpeedSpread = _spread("rotor")
    influence_coefficient: InfluenceSpread = _spread("rotor")
    lag_angle: AngleSpread = _spread("rotor")


class SceneTables(Table):
    """A whole scene file."""

    name: Name = derived("the file's name", "title of the scene")
    balancer: Annotated[str | None, choice(*BALANCERS)] = standard("liquid_ring", "kind of balancer")
    disc: DiscTable = Field(default_factory=DiscTable, description="the balancing disc")
    liquid: LiquidTable = Field(default_factory=LiquidTable, description="the balancing liquid")
    tube: TubeTable = Field(
        default_factory=TubeTable, description="the tube that connects two opposite chambers"
    )
    gas: GasTable = Field(default_factory=GasTable, description="the gas that drives the liquid")
    environment: EnvironmentTable = Field(
        default_factory=EnvironmentTable, description="gravity and how the shaft lies in it"
    )
    rotor: RotorTable = Field(default_factory=RotorTable, description="the rotor as the balancer sees it")
    sensor: SensorTable = Field(
        default_factory=SensorTable, description="the vibration sensor; exact when left out"
    )
    controller: ControllerTable = Field(default_factory=ControllerTable, description="the control algorithm")
    uncertainty: UncertaintyTable = Field(
        default_factory=UncertaintyTable, description="95 % half-widths of the inputs"
    )
    run: RunTable = Field(default_factory=RunTable, description="a simulation's seed and end")
    accuracy: AccuracyTable = Field(default_factory=AccuracyTable, description="what is asked of the result")
