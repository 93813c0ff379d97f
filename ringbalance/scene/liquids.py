"""Known liquids by name and temperature, with their uncertainties; a temperature without data is refused.

`with_liquid` completes a scene's liquid from them; values that the scene gives take precedence.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebval

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import Fault, did_you_mean, plain_name
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.models import Liquid
from ringbalance.scene.platform.files import packaged_rows
from ringbalance.scene.units import FieldError

_ZERO_CELSIUS_K = 273.15
_ROOM_TEMPERATURE_K = 293.15
_SAME_TEMPERATURE_K = 0.01
_WATER = "water"
_COLUMNS = ("T_C", "rho_kg_m3", "nu_m2_s", "vapour_pressure_Pa")
_ALIASES: Mapping[str, tuple[str, tuple[str, ...]]] = MappingProxyType(
    {
        "water": ("water", ()),
        "gallium": ("gallium", ("liquid gallium", "Ga")),
        "silicone KF-96L-5cs": ("silicone oil 5 cSt", ("silicone 5 cSt", "KF-96L-5cs")),
        "silicone 10 cSt": ("silicone oil 10 cSt", ()),
        "silicone 50 cSt": ("silicone oil 50 cSt", ()),
        "silicone 100 cSt": ("silicone oil 100 cSt", ()),
        "silicone 350 cSt": ("silicone oil 350 cSt", ()),
        "Krytox GPL 101": ("perfluorinated oil GPL 101", ("GPL 101",)),
        "Krytox GPL 102": ("perfluorinated oil GPL 102", ("GPL 102",)),
    }
)
"""Name in scenes and aliases, by the name in the data file, which is understood too."""
COLDEST_WATER_K = 273.15
"""Lowest temperature of liquid water; it freezes below."""
HOTTEST_WATER_K = 373.05
"""Highest temperature of liquid water (99.9 degC); it boils at atmospheric pressure just above."""
_DENSITY, _VISCOSITY, _VAPOUR = "liquid.density", "liquid.kinematic_viscosity", "liquid.vapour_pressure"
_OUTRIGHT = "density and kinematic_viscosity given outright"


@dataclass(frozen=True, kw_only=True)
class KnownLiquid:
    """A liquid with tabulated properties, or water."""

    name: str
    aliases: tuple[str, ...]
    """Other names that are understood; case, spaces and dashes do not matter."""
    temperatures: tuple[float, ...]
    """Temperatures with data, K, rising; properties are interpolated between them."""
    density_uncertainty: float
    """Expanded uncertainty (95 %), relative."""
    viscosity_uncertainty: float
    """Expanded uncertainty (95 %), relative."""
    source: str

    @property
    def held(self) -> str:
        """Temperatures with data, in words."""
        first, last = (
            f"{t - _ZERO_CELSIUS_K:.4g} degC" for t in (self.temperatures[0], self.temperatures[-1])
        )
        return first if len(self.temperatures) == 1 else f"{first} to {last}"

    def holds(self, temperature: float) -> bool:
        """True when there are data for a temperature (K), plus or minus 0.01 K."""
        low, high = self.temperatures[0], self.temperatures[-1]
        return low - _SAME_TEMPERATURE_K <= temperature <= high + _SAME_TEMPERATURE_K


def known_liquids() -> tuple[KnownLiquid, ...]:
    """The liquids that a scene can name, in the order of the data file."""
    return tuple(liquid for liquid, _ in _library().values())


def _find_liquid(*, name: str) -> KnownLiquid | None:
    """The liquid of any of its names, such as "Silicone oil 100 cSt"; None when no liquid has it."""
    plain = plain_name(name)
    return next((liquid for liquid in known_liquids() if plain in map(plain_name, _names(liquid))), None)


def _unknown_liquid(*, name: str) -> FieldError:
    """Error for an unknown liquid, with the names of the known ones."""
    names = [each for liquid in known_liquids() for each in _names(liquid)]
    held = ", ".join(f'"{liquid.name}"' for liquid in known_liquids())
    return FieldError(
        f"no liquid of that name is known{did_you_mean(name, names)}",
        f"{held}; or any name with density and kinematic_viscosity given outright",
    )


def liquid_at(*, name: str, temperature: float) -> Liquid:
    """Properties of a known liquid at a temperature.

    Between two temperatures of the data the density is linear in T and the logarithm of the kinematic
    viscosity is linear in 1/T; the vapour pressure is linear in T.  Water is calculated.
    Args: `name`: any of the liquid's names. `temperature`: K.
    Returns: The liquid with its uncertainties.
    Raises: FieldError: an unknown name, or a temperature outside the data.
    Source: the rows of `data/fluid_properties.csv`, each with its own; water, `_water_properties`.
    """
    liquid = _find_liquid(name=name)
    if liquid is None:
        raise _unknown_liquid(name=name)
    if not liquid.holds(temperature):
        shown = f"{temperature - _ZERO_CELSIUS_K:.6g} degC"
        raise FieldError(f"there are no data for {liquid.name} at {shown}", f"{liquid.name} at {liquid.held}")
    low, high = liquid.temperatures[0], liquid.temperatures[-1]
    inside = min(max(temperature, low), high)
    if liquid.name == _WATER:
        density, viscosity, vapour_pressure = _water_properties(temperature=inside)
    else:
        rows = _library()[liquid.name][1]
        upper = int(np.searchsorted(rows[:, 0], inside))
        last, density, viscosity, vapour_pressure = rows[upper].tolist()
        if last != inside:
            first, lower_density, lower_viscosity, lower_vapour = rows[upper - 1].tolist()
            share = (inside - first) / (last - first)
            # Fraction for interpolation in 1/T: that in T, times the upper temperature over T.
            inverse_share = share * last / inside
            density = lower_density + share * (density - lower_density)
            viscosity = lower_viscosity * math.exp(inverse_share * math.log(viscosity / lower_viscosity))
            vapour_pressure = lower_vapour + share * (vapour_pressure - lower_vapour)
    return Liquid(
        name=liquid.name,
        temperature=temperature,
        density=density,
        kinematic_viscosity=viscosity,
        vapour_pressure=vapour_pressure,
        dissolved_gas="saturated",
        density_uncertainty=liquid.density_uncertainty,
        viscosity_uncertainty=liquid.viscosity_uncertainty,
        source=liquid.source,
    )


def liquids_at_room_temperature() -> tuple[Liquid, ...]:
    """Every known liquid at 20 degC, or at the nearest temperature for which there are data."""
    return tuple(
        liquid_at(
            name=each.name,
            temperature=min(max(_ROOM_TEMPERATURE_K, each.temperatures[0]), each.temperatures[-1]),
        )
        for each in known_liquids()
    )


def _names(liquid: KnownLiquid) -> tuple[str, ...]:
    return (liquid.name, *liquid.aliases)


@cache
def _library() -> Mapping[str, tuple[KnownLiquid, FloatArray]]:
    """Liquids by name, with rows of temperature, density, kinematic viscosity and vapour pressure, SI."""
    table = packaged_rows("ringbalance.scene", "data", "fluid_properties.csv")
    library = {}
    for key in dict.fromkeys(line["fluid"] for line in table):
        ordered = sorted(
            (line for line in table if line["fluid"] == key), key=lambda line: float(line["T_C"])
        )
        rows = np.array([[float(line[column]) for column in _COLUMNS] for line in ordered])
        rows[:, 0] += _ZERO_CELSIUS_K
        name, aliases = _ALIASES[key]
        liquid = KnownLiquid(
            name=name,
            aliases=aliases if key == name else (*aliases, key),
            temperatures=(COLDEST_WATER_K, HOTTEST_WATER_K) if name == _WATER else tuple(rows[:, 0].tolist()),
            density_uncertainty=max(float(line["u95_rho_percent"]) for line in ordered) / 100,
            viscosity_uncertainty=max(float(line["u95_nu_percent"]) for line in ordered) / 100,
            source=f"{ordered[0]['source']}; {ordered[0]['status']}",
        )
        library[name] = liquid, rows
    return MappingProxyType(library)


@lru_cache(maxsize=256)
def _water_properties(*, temperature: float) -> tuple[float, float, float]:
    """Properties of water at atmospheric pressure.

    Args: `temperature`: K.
    Returns: Density, kg/m^3; kinematic viscosity, m^2/s; vapour pressure, Pa absolute.
    Range: `COLDEST_WATER_K` to `HOTTEST_WATER_K`, 101 325 Pa; 0.5 % more density at 10 MPa is left out.
    Source: density and vapour pressure, Wagner and Pruss, J. Phys. Chem. Ref. Data 31 (2002) 387 (IAPWS-95);
        viscosity, Huber et al., ibid. 38 (2009) 101 (IAPWS 2008); as series in `data/water.csv`.
    """
    x = 2.0 * (temperature - COLDEST_WATER_K) / (HOTTEST_WATER_K - COLDEST_WATER_K) - 1.0
    density, log_viscosity, log_vapour_pressure = np.asarray(chebval(x, _water_series())).tolist()
    return density, math.exp(log_viscosity), math.exp(log_vapour_pressure)


@cache
def _water_series() -> FloatArray:
    rows = packaged_rows("ringbalance.scene", "data", "water.csv")
    return np.array([[float(value) for value in row.values()] for row in rows])


def with_liquid(reading: SceneReading) -> tuple[SceneReading, tuple[Fault, ...]]:
    """The reading with the liquid's values, those in the file before tabulated ones; and the errors."""
    if "liquid" in reading.broken or not reading.given("liquid"):
        return reading, ()
    liquid = _find_liquid(name=reading.values["liquid.name"]) if reading.known("liquid.name") else None
    faults = _faults(reading, liquid)
    looked_up = None
    if liquid is not None and not faults:
        temperature = reading.values.get("liquid.temperature")
        if temperature is None and len(liquid.temperatures) == 1 and reading.lacks("liquid.temperature"):
            temperature = liquid.temperatures[0]
        if temperature is not None and liquid.holds(temperature):
            looked_up = liquid_at(name=liquid.name, temperature=temperature)
    return reading.adding(_liquid_values(reading, looked_up)), faults


def _faults(reading: SceneReading, liquid: KnownLiquid | None) -> tuple[Fault, ...]:
    """At most one error: temperature of a known liquid, or values missing for an unknown one."""
    incomplete = reading.lacks(_DENSITY) or reading.lacks(_VISCOSITY)
    if liquid is not None:
        path, held = "liquid.temperature", f"{liquid.name} at {liquid.held}"
        if reading.known(path):
            if liquid.holds(reading.values[path]) or not (incomplete or reading.lacks(_VAPOUR)):
                return ()
            problem = f"there are no data for {liquid.name} at this temperature"
            allowed = f"{held}; or density, kinematic_viscosity and vapour_pressure given outright"
        elif len(liquid.temperatures) == 1 or not reading.lacks(path) or not incomplete:
            return ()
        else:
            problem, allowed = "the properties of a known liquid depend on it", f"{held}; or {_OUTRIGHT}"
    elif not incomplete or "liquid.name" in reading.broken:
        return ()
    elif reading.known("liquid.name"):
        path, error = "liquid.name", _unknown_liquid(name=reading.values["liquid.name"])
        problem, allowed = error.problem, error.allowed
    elif reading.lacks(_DENSITY) and reading.lacks(_VISCOSITY):
        path, problem = "liquid.name", "the liquid is not named"
        allowed = f"a known liquid's name with its temperature, or {_OUTRIGHT}"
    else:
        path = _DENSITY if reading.lacks(_DENSITY) else _VISCOSITY
        problem = "it is needed for a liquid without a known name"
        allowed = f"{reading.allowed(path)}; or the name of a known liquid"
    return (reading.fault(path, problem=problem, allowed=allowed),)


def _liquid_values(reading: SceneReading, looked_up: Liquid | None) -> dict[str, Any]:
    values: dict[str, Any] = {}
    if looked_up is not None:
        properties = {
            _DENSITY: looked_up.density,
            _VISCOSITY: looked_up.kinematic_viscosity,
            _VAPOUR: looked_up.vapour_pressure,
            "liquid.temperature": looked_up.temperature,
        }
        values |= {path: value for path, value in properties.items() if reading.lacks(path)}
    elif reading.lacks(_VAPOUR):
        values[_VAPOUR] = 0.0
    if reading.lacks("liquid.name"):
        values["liquid.name"] = "custom"
    merged = {**reading.values, **values}
    for key, name in (("density", "density"), ("kinematic_viscosity", "viscosity")):
        outright = looked_up is None or reading.known(f"liquid.{key}")
        uncertainty = 0.0 if outright else getattr(looked_up, f"{name}_uncertainty")
        if f"uncertainty.{key}" in merged and f"liquid.{key}" in merged:
            width, relative = merged[f"uncertainty.{key}"]
            uncertainty = float(width if relative else width / merged[f"liquid.{key}"])
        values[f"liquid.{name}_uncertainty"] = uncertainty
    named = {"density": _DENSITY, "kinematic viscosity": _VISCOSITY, "vapour pressure": _VAPOUR}
    stated = ", ".join(name for name, path in named.items() if reading.known(path))
    source = f"{stated} given outright" if stated else ""
    if looked_up is not None:
        source = f"{source}; otherwise {looked_up.source}" if source else looked_up.source
    elif _VAPOUR not in reading.values:
        source = f"{source}; vapour pressure not given, taken as 0 Pa"
    return values | {"liquid.source": source}
