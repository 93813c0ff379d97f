"""Frozen, validated, SI-only records of a liquid-ring scene, which all other packages read.

`ringbalance.scene.load_scene` makes them; it converts units to SI and refuses impossible values.  Angles are
radians, positive with the rotation; amplitudes are zero-to-peak; gas pressures are gauge, vapour pressures
absolute.  A field's annotation declares its key: accepted values, meaning and default, see `scene.keys`.
"""

import cmath
import math
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Literal

from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.design_settings import DesignSettings
from ringbalance.scene.fitted import DrawDownFactor, ExtraLoss, GaugeCorrection, ModelErrors
from ringbalance.scene.keys.declaration import (
    UNCERTAIN,
    UNKNOWN,
    Listed,
    Shown,
    derived,
    needed,
    standard,
    unused,
)
from ringbalance.scene.keys.derivations import (
    even_number_of_chambers,
)
from ringbalance.scene.keys.fields import (
    NOT_NEGATIVE,
    POSITIVE,
    AbsolutePressure,
    Bounds,
    FillRatio,
    GaugePressure,
    Length,
    OneLine,
    PositiveAbsolutePressure,
    PositiveAngle,
    PositiveLength,
    ProperFraction,
    Temperature,
    Time,
    chamber_count,
    number,
    quantity,
    share,
)
from ringbalance.scene.loop_models import (
    ControllerSettings,
    Environment,
    RequirementSettings,
    Rotor,
    Sensor,
    required_amplitude,
)
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.valves import assumed_lag, taken_ratio

HumpGas = Literal["vented", "trapped"]
HumpShape = Literal["arc", "point"]
DissolvedGas = Literal["none", "saturated"]
PressurePlace = Literal["chamber", "shaft"]
Entrance = Literal["sharp", "rounded", "projecting"]
GasProcess = Literal["isothermal", "adiabatic"]
GasHoleDirection = Literal["outward", "axial", "inward"]
_OUTRIGHT = derived(
    "that of the known liquid", "wins when given; its uncertainty is then 0 unless [uncertainty] has one"
)


@dataclass(frozen=True, kw_only=True)
class Disc:
    """The balancing disc: equal annular chambers between radial plates."""

    outer_radius: Annotated[
        PositiveLength, needed("R2 of the chambers"), UNCERTAIN, Shown("outer radius R2", "mm")
    ]
    inner_radius: Annotated[
        PositiveLength, needed("R1 of the chambers"), UNCERTAIN, Shown("inner radius R1", "mm")
    ]
    axial_width: Annotated[
        PositiveLength,
        needed("B, inner width of the chambers along the shaft"),
        UNCERTAIN,
        Shown("axial width B", "mm"),
    ]
    central_angle: Annotated[
        PositiveAngle,
        needed(
            "theta of one chamber, from the middle of one plate to the middle of the next; at most 360 deg / "
            "chambers, and wide enough that the plates leave an opening at inner_radius of 1/2000 of "
            "outer_radius - inner_radius",
            "disc.chambers",
            otherwise="360 deg / chambers; one of both is **needed**",
            rule=lambda chambers: 2 * math.pi / chambers,
        ),
        UNCERTAIN,
        Shown("central angle of a chamber", "deg"),
    ]
    chambers: Annotated[
        int,
        chamber_count(),
        derived(
            "360 deg / central_angle, where that is an even number",
            "number of chambers",
            "disc.central_angle",
            rule=even_number_of_chambers,
        ),
        Shown("chambers"),
    ]
    plate_thickness: Annotated[
        Length,
        standard(
            "0 mm",
            "strip that a plate takes on each side of a chamber: half of the plate between two chambers",
        ),
        UNCERTAIN,
        Shown("plate thickness t", "mm", note="on each side of a chamber"),
    ]
    max_fill_ratio: Annotated[
        FillRatio,
        standard(
            0.5, "liquid of a pair, as a share of the volume of one chamber; depth at least 1e-8 outer_radius"
        ),
        Shown("greatest fill ratio", note="liquid of a pair, per chamber volume"),
    ]
    initial_fill: Annotated[
        FillRatio,
        derived(
            "half of max_fill_ratio, the only value allowed",
            "fill ratio of every chamber at the start",
            "disc.max_fill_ratio",
            rule=lambda fill_ratio: fill_ratio / 2,
        ),
        Shown("fill ratio at the start"),
    ]
    lambda_factor: Annotated[
        float | None,
        number(POSITIVE),
        unused(
            "lambda and the moments are those of the geometry",
            "measured lambda over that of the geometry, which every chamber's moment is multiplied by; "
            "`ringbalance fit` writes it",
        ),
        UNKNOWN,
        Shown("measured factor on lambda"),
    ] = None
    gas_hole_diameter: Annotated[
        PositiveLength | None,
        unused(
            "nothing is said of the gas jet on the ring but its range",
            "diameter of the hole through which gas enters a chamber",
        ),
        UNCERTAIN,
        Shown("diameter of the gas hole", "mm"),
    ] = None
    gas_hole_radius: Annotated[
        PositiveLength | None,
        derived(
            "gas.inlet_radius; one of both is needed with gas_hole_diameter",
            "distance of that hole from the axis; never under liquid",
            "disc.gas_hole_diameter",
            also=("gas.inlet_radius",),
            rule=lambda _diameter, inlet_radius: inlet_radius,
        ),
        UNCERTAIN,
        Shown("radius of the gas hole", "mm"),
    ] = None
    gas_hole_direction: Annotated[
        GasHoleDirection | None,
        derived(
            '"outward" with gas_hole_diameter',
            "where the hole blows: at the ring, along the shaft, or at the inner wall",
            "disc.gas_hole_diameter",
            # At the ring the jet digs deepest.
            rule=lambda _diameter: "outward",
        ),
        Shown("direction of the gas hole"),
    ] = None
    geometry: Annotated[ChamberGeometry | None, Shown("geometry of a chamber")] = None
    """Chamber read from a mesh file, no key; None for the sector between plates that the keys describe."""

    @property
    def moment_factor(self) -> float:
        """Moment of a chamber over that of its geometry: `lambda_factor`, or 1 where nothing is measured."""
        return 1.0 if self.lambda_factor is None else self.lambda_factor


@dataclass(frozen=True, kw_only=True)
class Liquid:
    """The balancing liquid at its working temperature."""

    name: Annotated[
        OneLine,
        unused(
            "density and kinematic_viscosity are needed",
            "a known liquid (see below), or a label for a custom one",
        ),
        Shown("liquid"),
    ]
    temperature: Annotated[
        Temperature | None,
        derived(
            "needed for a known liquid, unless its data are for one temperature only", "of the liquid at work"
        ),
        Shown("temperature", "degC", absent="not given"),
    ]
    density: Annotated[float, quantity("density", POSITIVE), _OUTRIGHT, UNKNOWN, Shown("density", "kg/m^3")]
    kinematic_viscosity: Annotated[
        float,
        quantity("kinematic_viscosity", POSITIVE),
        _OUTRIGHT,
        UNKNOWN,
        Shown("kinematic viscosity", "mm^2/s"),
    ]
    vapour_pressure: Annotated[
        AbsolutePressure,
        derived("that of the known liquid; 0 Pa for a custom one", "absolute"),
        UNKNOWN,
        Shown("vapour pressure", "kPa", note="absolute"),
    ]
    dissolved_gas: Annotated[
        DissolvedGas,
        standard("saturated", "gas that low pressure at the siphon crest can release from the liquid"),
        Shown("dissolved gas"),
    ]
    density_uncertainty: float
    """Expanded uncertainty (95 %), relative to the density."""
    viscosity_uncertainty: float
    """Expanded uncertainty (95 %), relative to the kinematic viscosity."""
    source: str
    """Source of the properties, for the report."""


@dataclass(frozen=True, kw_only=True)
class Bend:
    """One smooth bend of the connecting tube."""

    angle: Annotated[float, quantity("angle", POSITIVE), needed("angle the bend turns through")]
    radius: Annotated[float, quantity("length", POSITIVE), needed("radius of its centre line")]


@dataclass(frozen=True, kw_only=True)
class Tube:
    """The connecting tube from the port of one chamber, over a crest, to the port of the opposite one."""

    bore: Annotated[PositiveLength, needed("inner diameter d"), UNCERTAIN, Shown("bore d", "mm")]
    port_radius: Annotated[
        PositiveLength,
        derived(
            "outer_radius",
            "radius at which both ends of the tube open into their chambers",
            "disc.outer_radius",
        ),
        UNCERTAIN,
        Shown("port radius", "mm"),
    ]
    hump_radius: Annotated[
        PositiveLength | None,
        unused(
            "the straight tube of the paper's Eq. 18, always full: no correction lasts",
            "smallest radius on the path from port to port",
        ),
        UNCERTAIN,
        Shown("siphon crest radius", "mm", absent="none: always full"),
    ]
    hump_position: Annotated[
        ProperFraction,
        standard(0.5, "share of the path, from the driven chamber, at which the siphon crest lies"),
        UNCERTAIN,
        Shown("siphon crest position", note="share of the path"),
    ]
    hump_shape: Annotated[
        HumpShape,
        standard(
            "arc",
            "between its straight legs the tube follows the circle of hump_radius, or touches it at a point",
        ),
        Shown("siphon crest shape"),
    ]
    hump_gas: Annotated[
        HumpGas,
        standard(
            "vented",
            "bound for the priming pressure: gas beyond the siphon crest is vented, or must be pushed out",
        ),
        Shown("gas beyond the siphon crest"),
    ]
    length: Annotated[
        PositiveLength,
        derived(
            "needed; with drag_coefficient the shortest path from port over siphon crest to port",
            "length of the centre line, bends included",
        ),
        UNCERTAIN,
        Shown("length", "mm", note="bends included"),
    ]
    roughness: Annotated[
        Length,
        standard("1.5 um", "absolute roughness of the wall; that of drawn tubing when left out"),
        UNCERTAIN,
        Shown("roughness", "um"),
    ]
    entrance: Annotated[
        Entrance, standard("sharp", "shape of the edge at which the liquid enters"), Shown("entrance")
    ]
    entrance_radius: Annotated[
        PositiveLength,
        derived(
            "needed with a rounded entrance, not allowed otherwise",
            "radius of the rounded edge",
            "tube.entrance",
            rule=lambda entrance: None if entrance == "rounded" else 0.0,
        ),
    ]
    bends: Annotated[
        tuple[Bend, ...],
        standard([], "list of { angle, radius } in order from the driven chamber"),
        Listed('[{ angle = "90 deg", radius = "3 mm" }, ...]'),
        Shown("bends"),
    ]
    extra_loss: ExtraLoss
    drag_coefficient: Annotated[
        float | None,
        number(POSITIVE),
        unused("k is calculated from the tube and the liquid", "prescribes k, as the paper does"),
        UNKNOWN,
        Shown("drag coefficient k", absent="calculated"),
    ]
    draw_down_factor: DrawDownFactor = 1.0
    model_errors: ModelErrors = ()

    @property
    def area(self) -> float:
        """Cross-section S, m^2."""
        return math.pi / 4 * self.bore**2

    def model_error(self, cause: str) -> float:
        """Sum of the even parts of a cause's errors, in standard deviations."""
        return sum(each.even for each in self.model_errors if each.cause == cause)


@dataclass(frozen=True, kw_only=True)
class Gas:
    """The driving gas; None marks a term that the scene does not model."""

    pressure: Annotated[
        GaugePressure,
        needed("gauge pressure in the driven chamber while its valve is open; with a leak, of the supply"),
        UNCERTAIN,
        Shown("gas pressure", "MPa", note="gauge"),
    ]
    gauge_correction: GaugeCorrection = 0.0
    measured_at: Annotated[
        PressurePlace,
        standard(
            "chamber",
            "where `pressure` holds: on the liquid, or on the shaft's axis; spinning gas adds to it there",
        ),
        Shown("gas pressure measured at"),
    ]
    inlet_radius: Annotated[
        PositiveLength | None,
        unused("not compared with the level", "radius at which gas enters the chambers; never under liquid"),
        Shown("gas inlet radius", "mm"),
    ] = None
    ambient_pressure: Annotated[
        PositiveAbsolutePressure,
        standard("101.325 kPa", "absolute pressure of the surroundings"),
        UNCERTAIN,
        Shown("ambient pressure", "kPa", note="absolute"),
    ]
    temperature: Annotated[
        Temperature, standard("20 degC", "of the gas before the valve"), Shown("gas temperature", "degC")
    ]
    conductance: Annotated[
        float | None,
        quantity("conductance", POSITIVE),
        unused(
            "the chamber fills at once",
            "sonic conductance C (ISO 6358) of valve and line; it, or one of the next four",
        ),
        UNCERTAIN,
        Shown("sonic conductance C", "l/(s*bar)", absent="none: the chamber fills at once"),
    ]
    nominal_flow: Annotated[
        float | None,
        quantity("flow_rate", POSITIVE),
        unused("`conductance` or another", "flow of the valve from 6 to 5 bar gauge, at 20 degC and 1 bar"),
        Shown("nominal flow of the valve", "l/min"),
    ] = None
    Kv: Annotated[
        float | None,
        number(POSITIVE),
        unused("`conductance` or another", "flow coefficient of the valve, water in m^3/h at 1 bar"),
        Shown("flow coefficient Kv"),
    ] = None
    Cv: Annotated[
        float | None,
        number(POSITIVE),
        unused("`conductance` or another", "flow coefficient of the valve, water in US gal/min at 1 psi"),
        Shown("flow coefficient Cv"),
    ] = None
    valve: Annotated[
        OneLine | None,
        unused("`conductance` or another", "name of a valve of the catalogue, see below"),
        Shown("valve"),
    ] = None
    critical_ratio: Annotated[
        ProperFraction | None,
        unused(
            "that of the valve, or 0.3, which every command then says",
            "critical pressure ratio b (ISO 6358) of valve and line",
        ),
        UNCERTAIN,
        Shown("critical pressure ratio b"),
    ]
    leak_to_ambient: Annotated[
        float | None,
        quantity("conductance", NOT_NEGATIVE),
        unused(
            "no leak",
            "sonic conductance of a leak from between valve and chamber, such as a distributor's gap; with "
            "critical_ratio of the valve. Without conductance it costs air alone",
        ),
        UNCERTAIN,
        Shown("leak to ambient", "l/(s*bar)"),
    ] = None
    leak_from_supply: Annotated[
        float | None,
        quantity("conductance", NOT_NEGATIVE),
        unused(
            "no leak",
            "sonic conductance of a leak from the supply into each chamber whose valve is closed; with "
            "critical_ratio of the valve. Without conductance it costs air alone",
        ),
        UNCERTAIN,
        Shown("leak from the supply", "l/(s*bar)"),
    ] = None
    relative_humidity: Annotated[
        float | None,
        share(Bounds(at_least=0, at_most=1), example=0.3),
        unused(
            "dry gas",
            "of the supply at its own pressure and temperature, 1 for compressed air that is not dried; "
            "counts in the water that the gas carries off",
        ),
        Shown("relative humidity of the supply"),
    ] = None
    dead_volume: Annotated[
        float | None,
        quantity("volume", NOT_NEGATIVE),
        unused("no volume besides the chamber's", "gas volume between valve and chamber"),
        UNCERTAIN,
        Shown("dead volume", "ml"),
    ]
    valve_lag: Annotated[
        Time | None,
        unused(
            "that of the named valve, else 20 ms, assumed, with a stated flow; without one at once",
            "time from the command to the valve's motion",
        ),
        UNCERTAIN,
        Shown("valve lag", "ms"),
    ]
    process: Annotated[
        GasProcess,
        standard(
            "isothermal",
            "whether a chamber's gas keeps its temperature while it fills and vents, or takes no heat; "
            "matters with conductance only",
        ),
        Shown("gas in the chambers", note="matters with a conductance only"),
    ]
    valve_source: str = ""
    """Origin of conductance and critical ratio where another key states them, in words."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Scene(SceneFile):
    """All that a run needs, in SI units.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> wider = scene.with_values({"tube.bore": "1.8 mm"})
        >>> wider.tube.bore, wider.origin_of("tube.bore")
        (0.0018, 'given')
    """

    disc: Disc
    liquid: Liquid
    tube: Tube
    gas: Gas
    environment: Environment
    rotor: Rotor
    sensor: Sensor
    controller: ControllerSettings
    requirement: RequirementSettings = field(default_factory=RequirementSettings)
    design: DesignSettings = field(default_factory=DesignSettings)

    balancer: ClassVar[str] = "liquid_ring"

    @property
    def required_amplitude(self) -> float | None:
        """Amplitude that [requirement] allows, m zero-to-peak; None where it states none."""
        return required_amplitude(
            speed=self.rotor.speed,
            influence_coefficient=self.rotor.influence_coefficient,
            mass=self.rotor.mass,
            residual=self.requirement.residual,
            grade=self.requirement.grade,
        )

    @property
    def rotor_as_read(self) -> Rotor:
        """Rotor as a sensor without noise shows it: its initial vibration includes the sensor's runout."""
        if self.sensor.runout_amplitude is None:
            return self.rotor
        seen = self.rotor.initial_vibration + self.sensor.runout
        return replace(self.rotor, initial_amplitude=abs(seen), initial_phase=cmath.phase(seen))

    @property
    def remark(self) -> str:
        """Origin of C and b of valves where they do not stand in the file."""
        taken = [each.name for each in self.design.valves if each.completed.critical_ratio is None]
        texts = [f"[gas] {self.gas.valve_source}"] if self.gas.valve_source else []
        texts += [f"[design] valves: {taken_ratio(taken)}"] if taken else []
        slow = [each for each in self.design.valves if each.assumes_lag]
        texts += [f"[design] valves: {assumed_lag(slow)}"] if slow else []
        return "; ".join(texts)

    @property
    def mesh_digest(self) -> str:
        """SHA-256 of the mesh of a chamber; empty without one."""
        return "" if self.disc.geometry is None else self.disc.geometry.digest
