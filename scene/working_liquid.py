"""The liquid of a scene: looked up, given outright, or partly both."""

from __future__ import annotations

from typing import Any

from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.liquids import KnownLiquid, find_liquid, liquid_at, unknown_liquid
from ringbalance.scene.models import Liquid

_DENSITY, _VISCOSITY, _VAPOUR = "liquid.density", "liquid.kinematic_viscosity", "liquid.vapour_pressure"
_OUTRIGHT = "density and kinematic_viscosity given outright"


def with_liquid(reading: Reading) -> tuple[Reading, tuple[Fault, ...]]:
    """The liquid's values, as far as they can be known, what is given outright first; and what is wrong."""
    if "liquid" in reading.broken or not reading.given("liquid"):
        return reading, ()
    liquid = find_liquid(name=reading.values["liquid.name"]) if reading.known("liquid.name") else None
    faults = _faults(reading, liquid)
    looked_up = None if faults or liquid is None else _looked_up(reading, liquid)
    return reading.adding(_values(reading, looked_up)), faults


def _incomplete(reading: Reading) -> bool:
    return reading.lacks(_DENSITY) or reading.lacks(_VISCOSITY)


def _faults(reading: Reading, liquid: KnownLiquid | None) -> tuple[Fault, ...]:
    if liquid is not None:
        return _temperature_faults(reading, liquid)
    if not _incomplete(reading) or "liquid.name" in reading.broken:
        return ()
    if reading.known("liquid.name"):
        error = unknown_liquid(name=reading.values["liquid.name"])
        return (reading.fault("liquid.name", problem=error.problem, allowed=error.allowed),)
    if reading.lacks(_DENSITY) and reading.lacks(_VISCOSITY):
        allowed = f"a known liquid's name with its temperature, or {_OUTRIGHT}"
        return (reading.fault("liquid.name", problem="the liquid is not named", allowed=allowed),)
    path = _DENSITY if reading.lacks(_DENSITY) else _VISCOSITY
    allowed = f"{reading.allowed(path)}; or the name of a known liquid"
    return (reading.fault(path, problem="it is needed for a liquid without a known name", allowed=allowed),)


def _temperature_faults(reading: Reading, liquid: KnownLiquid) -> tuple[Fault, ...]:
    held = f"{liquid.name} at {liquid.held}"
    path = "liquid.temperature"
    if reading.known(path):
        temperature = reading.values[path]
        if liquid.holds(temperature) or not (_incomplete(reading) or reading.lacks(_VAPOUR)):
            return ()
        problem = f"there are no data for {liquid.name} at this temperature"
        allowed = f"{held}; or density, kinematic_viscosity and vapour_pressure given outright"
        return (reading.fault(path, problem=problem, allowed=allowed),)
    if len(liquid.temperatures) == 1 or not reading.lacks(path) or not _incomplete(reading):
        return ()
    problem = "the properties of a known liquid depend on it"
    return (reading.fault(path, problem=problem, allowed=f"{held}; or {_OUTRIGHT}"),)


def _looked_up(reading: Reading, liquid: KnownLiquid) -> Liquid | None:
    temperature = reading.values.get("liquid.temperature")
    if temperature is None and len(liquid.temperatures) == 1 and reading.lacks("liquid.temperature"):
        temperature = liquid.temperatures[0]
    if temperature is None or not liquid.holds(temperature):
        return None
    return liquid_at(name=liquid.name, temperature=temperature)


def _values(reading: Reading, looked_up: Liquid | None) -> dict[str, Any]:
    values: dict[str, Any] = {}
    if looked_up is not None:
        found = {
            _DENSITY: looked_up.density,
            _VISCOSITY: looked_up.kinematic_viscosity,
            _VAPOUR: looked_up.vapour_pressure,
            "liquid.temperature": looked_up.temperature,
        }
        values |= {path: value for path, value in found.items() if reading.lacks(path)}
    elif reading.lacks(_VAPOUR):
        values[_VAPOUR] = 0.0
    if reading.lacks("liquid.name"):
        values["liquid.name"] = "custom"
    return (
        values | _uncertainties(reading, values, looked_up) | {"liquid.source": _source(reading, looked_up)}
    )


def _uncertainties(reading: Reading, values: dict[str, Any], looked_up: Liquid | None) -> dict[str, float]:
    known = (0.0, 0.0)
    if looked_up is not None:
        known = (looked_up.density_uncertainty, looked_up.viscosity_uncertainty)
    keys = ("density", "kinematic_viscosity")
    names = ("liquid.density_uncertainty", "liquid.viscosity_uncertainty")
    merged = {**reading.values, **values}
    return {
        name: _relative(merged, key, otherwise=0.0 if reading.known(f"liquid.{key}") else uncertainty)
        for name, key, uncertainty in zip(names, keys, known, strict=True)
    }


def _relative(values: dict[str, Any], key: str, *, otherwise: float) -> float:
    if f"uncertainty.{key}" not in values or f"liquid.{key}" not in values:
        return otherwise
    width, relative = values[f"uncertainty.{key}"]
    return float(width if relative else width / values[f"liquid.{key}"])


def _source(reading: Reading, looked_up: Liquid | None) -> str:
    named = {"density": _DENSITY, "kinematic viscosity": _VISCOSITY, "vapour pressure": _VAPOUR}
    outright = [name for name, path in named.items() if reading.known(path)]
    given = f"{', '.join(outright)} given outright" if outright else ""
    if looked_up is None:
        return given if _VAPOUR in reading.values else f"{given}; vapour pressure not given, taken as 0 Pa"
    return looked_up.source if not given else f"{given}; otherwise {looked_up.source}"
