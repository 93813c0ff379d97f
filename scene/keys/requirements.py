"""What a scene file must contain: the keys always needed, and those that another key makes necessary."""

from __future__ import annotations

from collections.abc import Iterator

from ringbalance.scene.faults import MISSING, Fault
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.keys.schema import LIQUID_RING, Schema


def missing_faults(reading: Reading) -> tuple[Fault, ...]:
    """Report what the scene needs and the file does not have.

    Args: `reading`: what is known of the file, defaults included.
    Returns: One fault for each missing key; one for a whole table that is missing.
    """
    liquid_ring = _needed_by_others(reading) if reading.schema is LIQUID_RING else ()
    return (*_always_needed(reading), *liquid_ring)


def needed_keys(table: str, schema: Schema) -> tuple[str, ...]:
    """Keys that a table must have in every scene, in order."""
    keys = schema.tables[table].keys
    return tuple(name for name, key in keys.items() if key.presence.kind == "needed")


def _always_needed(reading: Reading) -> Iterator[Fault]:
    for table in reading.schema.tables:
        keys = needed_keys(table, reading.schema)
        if not keys and table != "liquid":
            continue
        if reading.given(table):
            yield from (
                _missing(reading, f"{table}.{key}") for key in keys if reading.lacks(f"{table}.{key}")
            )
        elif table not in reading.broken:
            yield _missing_table(reading, table, keys)


def _missing_table(reading: Reading, table: str, keys: tuple[str, ...]) -> Fault:
    inside = ", ".join(keys) or "name and temperature, or density and kinematic_viscosity"
    return Fault(
        file=reading.file,
        table=table,
        key="",
        value=MISSING,
        problem="every scene needs this table",
        allowed=f"a table with {inside}",
    )


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
