"""What a file leaves out: defaults that follow from its other values, and errors for what it must have."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import PurePath

from ringbalance.scene.faults import MISSING, Fault
from ringbalance.scene.keys.derivations import shortest_path
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.keys.schema import LIQUID_RING


def completed(reading: Reading) -> Reading:
    """Fill in the defaults that follow from other values, as far as those are known.

    What a default follows from is there already, because a key is declared after it.
    """
    if reading.lacks("name"):
        reading = reading.adding({"name": PurePath(reading.file).stem or "scene"})
    for name, table in reading.schema.tables.items():
        for key, declared in table.keys.items():
            path, needs = f"{name}.{key}", declared.presence.needs
            if needs and reading.lacks(path) and reading.known(*needs):
                result = declared.presence.value(*(reading.values[need] for need in needs))
                reading = reading.adding({} if result is None else {path: result})
    return reading.adding(_shortest_length(reading)) if reading.schema is LIQUID_RING else reading


def _shortest_length(reading: Reading) -> Mapping[str, float]:
    """With a given k the length matters for the liquid's inertia only: that of the shortest tube is used."""
    hump_settled = reading.known("tube.hump_radius") or reading.lacks("tube.hump_radius")
    settled = reading.known("tube.drag_coefficient", "tube.port_radius") and hump_settled
    if not settled or not reading.lacks("tube.length"):
        return {}
    port_radius, hump_radius = reading.values["tube.port_radius"], reading.values.get("tube.hump_radius")
    if hump_radius is not None and hump_radius >= port_radius:
        return {}
    length = shortest_path(port_radius=port_radius, hump_radius=hump_radius, separation=math.pi)
    return {"tube.length": length}


def missing_faults(reading: Reading) -> Iterator[Fault]:
    """One error for each missing key, defaults included; one for a whole table that is missing."""
    for name, table in reading.schema.tables.items():
        keys = [key for key, declared in table.keys.items() if declared.presence.kind == "needed"]
        if not keys and name != "liquid":
            continue
        if reading.given(name):
            paths = (f"{name}.{key}" for key in keys)
            yield from (_missing(reading, path) for path in paths if reading.lacks(path))
        elif name not in reading.broken:
            inside = ", ".join(keys) or "name and temperature, or density and kinematic_viscosity"
            yield Fault(
                file=reading.file,
                table=name,
                key="",
                value=MISSING,
                problem="every scene needs this table",
                allowed=f"a table with {inside}",
            )
    if reading.schema is LIQUID_RING:
        yield from _needed_by_others(reading)


def _missing(reading: Reading, path: str, problem: str = "every scene needs it") -> Fault:
    return reading.fault(path, problem=problem, allowed=reading.allowed(path))


def _needed_by_others(reading: Reading) -> Iterator[Fault]:
    if reading.given("tube") and reading.lacks("tube.length") and reading.lacks("tube.drag_coefficient"):
        yield _missing(reading, "tube.length", "k cannot be calculated without it")
    if reading.values.get("tube.entrance") == "rounded" and reading.lacks("tube.entrance_radius"):
        yield _missing(reading, "tube.entrance_radius", "a rounded entrance needs its radius")
    pair = ("gas.conductance", "gas.critical_ratio")
    for present, absent in (pair, pair[::-1]):
        if reading.known(present) and reading.lacks(absent):
            yield _missing(reading, absent, f"{present.split('.')[1]} has no meaning without it")
