"""Keys of the table [design] of a liquid ring: limits of a design."""

from dataclasses import dataclass
from typing import Annotated

from ringbalance.scene.keys.declaration import Listed, Shown, needed, standard, unused
from ringbalance.scene.keys.fields import (
    POSITIVE,
    AbsolutePressure,
    OneLine,
    PositiveGaugePressure,
    PositiveLength,
    Temperature,
    each_of,
    quantity,
    text,
)
from ringbalance.scene.valves import Valve


@dataclass(frozen=True, kw_only=True)
class LiquidAtHand:
    """A liquid from which a design chooses; keys as in [liquid]."""

    name: Annotated[OneLine, needed("a known liquid, or a label for one whose data follow")]
    temperature: Annotated[Temperature | None, unused("that of [liquid]", "of the liquid at work")] = None
    density: Annotated[
        float | None, quantity("density", POSITIVE), unused("that of the known liquid", "density")
    ] = None
    kinematic_viscosity: Annotated[
        float | None,
        quantity("kinematic_viscosity", POSITIVE),
        unused("that of the known liquid", "kinematic viscosity"),
    ] = None
    vapour_pressure: Annotated[
        AbsolutePressure | None, unused("that of the known liquid; 0 Pa for a custom one", "absolute")
    ] = None


@dataclass(frozen=True, kw_only=True)
class DesignSettings:
    """Ranges from which `ringbalance design` chooses; `tune` reads only the pressure."""

    outer_radius: Annotated[
        PositiveLength | None,
        unused("the disc keeps its outer radius", "largest outer radius of the chambers that space leaves"),
        Shown("largest outer radius", "mm"),
    ] = None
    axial_width: Annotated[
        PositiveLength | None,
        unused("the disc keeps its width", "largest width of the chambers that space leaves"),
        Shown("largest axial width", "mm"),
    ] = None
    pressure: Annotated[
        PositiveGaugePressure | None,
        unused(
            "the gas keeps its pressure", "highest gauge pressure that is available, for `design` and `tune`"
        ),
        Shown("gas pressure available", "MPa", note="gauge"),
    ] = None
    valves: Annotated[
        tuple[Valve, ...],
        standard([], "valves at hand; without any, and without `valve_file`, the scene's own stays"),
        Listed(
            '[{ name = "V1", conductance = "0.4 l/(s*bar)", critical_ratio = 0.3, valve_lag = "2 ms" }, ...]'
            ', or valve_file = "valves.csv" in place of the list'
        ),
        Shown("valves at hand"),
    ] = ()
    valve_file: Annotated[
        OneLine | None,
        unused(
            "those of `valves`",
            "a CSV file beside the scene with the keys of `valves` in its columns",
        ),
        Shown("file of valves"),
    ] = None
    liquids: Annotated[
        tuple[LiquidAtHand, ...],
        standard([], "liquids at hand; without any, that of [liquid] stays"),
        Listed('[{ name = "water" }, { name = "silicone oil 5 cSt", temperature = "25 degC" }, ...]'),
        Shown("liquids at hand"),
    ] = ()
    vary: Annotated[
        tuple[str, ...],
        each_of(text(), example='["tube.bore=0.5mm:2mm", "disc.chambers=4,6"]'),
        standard([], "further keys with their ranges or lists, as `ringbalance sweep --vary` takes them"),
        Shown("further keys that vary"),
    ] = ()
