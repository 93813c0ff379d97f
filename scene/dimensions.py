"""The units a scene file may use: a fixed table with exact factors.

A factor is a rational number, times pi where the unit is an angle's or a speed's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from types import MappingProxyType


@dataclass(frozen=True, kw_only=True)
class Unit:
    """One unit: SI value = (number + offset) * factor, times pi for angles."""

    factor: Fraction
    offset: Fraction = Fraction(0)
    pi: bool = False


@dataclass(frozen=True, kw_only=True)
class Dimension:
    """A kind of quantity with its units."""

    name: str
    """With its article, such as "a length"."""
    example: str
    """A quantity as one would write it."""
    units: Mapping[str, Unit] = field(repr=False)
    """By name; the SI unit first."""
    smallest: float
    """SI; a quantity that must not be zero is not smaller than this."""
    largest: float
    """SI; no magnitude above this is meant seriously, and none below it overflows when squared or cubed."""

    @property
    def noun(self) -> str:
        """The name without its article."""
        return self.name.split(" ", 1)[1]


def _units(factors: Mapping[str, str | int | Fraction]) -> dict[str, Unit]:
    return {name: Unit(factor=Fraction(factor)) for name, factor in factors.items()}


def _angles(factors: Mapping[str, str]) -> dict[str, Unit]:
    return {name: Unit(factor=Fraction(factor), pi=True) for name, factor in factors.items()}


def _ratios(above: Mapping[str, Unit], below: Mapping[str, Unit]) -> dict[str, Unit]:
    return {
        f"{top}/{bottom}": Unit(factor=above[top].factor / below[bottom].factor)
        for top in above
        for bottom in below
    }


_VIBRATION = _units({"m": 1, "mm": "1e-3", "um": "1e-6"})
_UNBALANCE = _units({"(kg*m)": 1, "(kg*mm)": "1e-3", "(g*m)": "1e-3", "(g*cm)": "1e-5", "(g*mm)": "1e-6"})

DIMENSIONS: Mapping[str, Dimension] = MappingProxyType(
    {
        "length": Dimension(
            name="a length",
            example="44.5 mm",
            units=_units({"m": 1, "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "nm": "1e-9", "in": "0.0254"}),
            smallest=1e-9,
            largest=1e3,
        ),
        "angle": Dimension(
            name="an angle",
            example="90 deg",
            units=_units({"rad": 1, "mrad": "1e-3"}) | _angles({"deg": "1/180"}),
            smallest=1e-9,
            largest=1e5,
        ),
        "density": Dimension(
            name="a mass density",
            example="1000 kg/m^3",
            units=_units({"kg/m^3": 1, "g/cm^3": 1000, "g/ml": 1000, "kg/l": 1000}),
            smallest=1e-3,
            largest=1e5,
        ),
        "kinematic_viscosity": Dimension(
            name="a kinematic viscosity",
            example="1 mm^2/s",
            units=_units({"m^2/s": 1, "cm^2/s": "1e-4", "mm^2/s": "1e-6", "cSt": "1e-6", "St": "1e-4"}),
            smallest=1e-10,
            largest=1e2,
        ),
        "pressure": Dimension(
            name="a pressure",
            example="0.7 MPa",
            units=_units(
                {
                    "Pa": 1,
                    "hPa": 100,
                    "kPa": 1000,
                    "MPa": 10**6,
                    "mbar": 100,
                    "bar": 10**5,
                    "psi": "6894.757293168361",
                }
            ),
            smallest=1e-3,
            largest=1e11,
        ),
        "temperature": Dimension(
            name="a temperature",
            example="20 degC",
            units={
                "K": Unit(factor=Fraction(1)),
                "degC": Unit(factor=Fraction(1), offset=Fraction("273.15")),
                "degF": Unit(factor=Fraction(5, 9), offset=Fraction("459.67")),
            },
            smallest=1e-3,
            largest=1e4,
        ),
        "time": Dimension(
            name="a time",
            example="0.5 s",
            units=_units({"s": 1, "ms": "1e-3", "us": "1e-6", "min": 60, "h": 3600}),
            smallest=1e-9,
            largest=1e9,
        ),
        "speed": Dimension(
            name="a speed of rotation",
            example="10000 rpm",
            units=_units({"rad/s": 1})
            | _angles({"rpm": "1/30", "r/min": "1/30", "Hz": "2", "deg/s": "1/180"}),
            smallest=1e-3,
            largest=1e7,
        ),
        "influence_coefficient": Dimension(
            name="an influence coefficient (vibration per unbalance)",
            example="0.0108 um/(g*mm)",
            units=_ratios(_VIBRATION, _UNBALANCE),
            smallest=1e-12,
            largest=1e9,
        ),
        "gain": Dimension(
            name="a gain (valve-open time per vibration)",
            example="0.08 s/um",
            units=_ratios(_units({"s": 1, "ms": "1e-3", "min": 60}), _VIBRATION),
            smallest=1e-9,
            largest=1e15,
        ),
        "conductance": Dimension(
            name="a sonic conductance (ISO 6358)",
            example="0.5 l/(s*bar)",
            units=_units(
                {
                    "m^3/(s*Pa)": 1,
                    "dm^3/(s*bar)": "1e-8",
                    "l/(s*bar)": "1e-8",
                    "l/(min*bar)": Fraction("1e-8") / 60,
                }
            ),
            smallest=1e-15,
            largest=1.0,
        ),
        "volume": Dimension(
            name="a volume",
            example="5 ml",
            units=_units(
                {"m^3": 1, "dm^3": "1e-3", "l": "1e-3", "cm^3": "1e-6", "ml": "1e-6", "mm^3": "1e-9"}
            ),
            smallest=1e-12,
            largest=1e3,
        ),
        "acceleration": Dimension(
            name="an acceleration",
            example="9.80665 m/s^2",
            units=_units({"m/s^2": 1, "cm/s^2": "1e-2", "mm/s^2": "1e-3"}),
            smallest=1e-9,
            largest=1e6,
        ),
        "mass": Dimension(
            name="a mass",
            example="5 kg",
            units=_units({"kg": 1, "g": "1e-3", "mg": "1e-6"}),
            smallest=1e-9,
            largest=1e9,
        ),
        "unbalance": Dimension(
            name="an unbalance",
            example="100 g*mm",
            units={name.strip("()"): unit for name, unit in _UNBALANCE.items()},
            smallest=1e-15,
            largest=1e9,
        ),
        "stiffness": Dimension(
            name="a stiffness",
            example="1000 N/m",
            units=_units({"N/m": 1, "kN/m": 1000, "N/mm": 1000, "N/um": 10**6, "MN/m": 10**6}),
            smallest=1e-6,
            largest=1e15,
        ),
        "damping": Dimension(
            name="a damping coefficient",
            example="10 N*s/m",
            units=_units({"N*s/m": 1, "kN*s/m": 1000, "N*s/mm": 1000, "kg/s": 1}),
            smallest=1e-9,
            largest=1e12,
        ),
        "inertia": Dimension(
            name="a moment of inertia",
            example="1e-6 kg*m^2",
            units=_units(
                {"kg*m^2": 1, "kg*cm^2": "1e-4", "kg*mm^2": "1e-6", "g*cm^2": "1e-7", "g*mm^2": "1e-9"}
            ),
            smallest=1e-15,
            largest=1e9,
        ),
        "velocity": Dimension(
            name="a velocity",
            example="10 mm/s",
            units=_units({"m/s": 1, "mm/s": "1e-3", "um/s": "1e-6"}),
            smallest=1e-12,
            largest=1e6,
        ),
        "torque_constant": Dimension(
            name="a torque constant",
            example="0.01 N*m/A",
            units=_units({"N*m/A": 1, "mN*m/A": "1e-3"}),
            smallest=1e-9,
            largest=1e6,
        ),
        "voltage_per_speed": Dimension(
            name="a voltage per speed of rotation",
            example="0.01 V*s/rad",
            units=_units({"V*s/rad": 1, "mV*s/rad": "1e-3"}),
            smallest=1e-9,
            largest=1e6,
        ),
        "voltage_per_angle": Dimension(
            name="a voltage per angle",
            example="1 V/rad",
            units=_units({"V/rad": 1, "mV/rad": "1e-3"}),
            smallest=1e-9,
            largest=1e6,
        ),
        "voltage": Dimension(
            name="a voltage",
            example="12 V",
            units=_units({"V": 1, "mV": "1e-3"}),
            smallest=1e-6,
            largest=1e6,
        ),
        "resistance": Dimension(
            name="an electrical resistance",
            example="1 ohm",
            units=_units({"ohm": 1, "mohm": "1e-3", "kohm": 1000}),
            smallest=1e-6,
            largest=1e9,
        ),
        "share": Dimension(
            name="a share",
            example="1 %",
            units=_units({"%": "1/100"}),
            smallest=1e-15,
            largest=1e6,
        ),
    }
)
