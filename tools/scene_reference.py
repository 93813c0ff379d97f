"""Tables of docs/scene-file.md from the declarations of keys, liquids and units, for `doc_tables`."""

from __future__ import annotations

from collections.abc import Mapping

from benchmark_tables import markdown

from ringbalance.controller.eccentric_mass.scene_records import ECCENTRIC_MASS
from ringbalance.scene import known_liquids
from ringbalance.scene.keys.declaration import Entries, Key
from ringbalance.scene.keys.schema import LIQUID_RING, ORIGIN, Schema
from ringbalance.scene.platform.files import packaged_rows
from ringbalance.scene.toml import toml_text
from ringbalance.scene.units import DIMENSIONS

WIDTHS = "uncertainty"
MANY = 8
"""Largest number of units of a quantity that are listed one by one."""


def key_reference(schema: Schema, title: str, above: Schema | None = None) -> str:
    """One Markdown table of keys for each table of a kind of scene.

    Args: `title`: of the first table. `above`: kind of scene whose tables precede; identical tables are
    only named.
    """
    tables = {} if above is None else above.tables
    same = [name for name in schema.tables if name in tables and _told(schema, name) == _told(above, name)]
    parts = [f"### {title}", keys_table(schema.top)]
    for name, table in schema.tables.items():
        if name in same:
            continue
        inside = widths(schema) if name == WIDTHS else keys_table(table.keys)
        parts += [f"\n### [{name}]", f"{table.text[0].upper()}{table.text[1:]}.\n", inside]
    for name, table in schema.tables.items():
        if name == WIDTHS or name in same:
            continue
        for key, declared in table.keys.items():
            if isinstance(declared.takes, Entries) and key != ORIGIN:
                each = ", each entry" if declared.takes.example else ""
                parts += [f"\n### [{name}] {key}{each}", keys_table(declared.takes.keys)]
    if same:
        parts += [f"\n### [{'], ['.join(same)}]", "As of a liquid-ring scene, above."]
    return "\n".join(parts)


def _told(schema: Schema | None, name: str) -> object:
    """Contents of the page on a table, for comparison."""
    if schema is None or name == WIDTHS:
        return schema
    table = schema.tables[name]
    inside = [keys_table(key.takes.keys) for key in table.keys.values() if isinstance(key.takes, Entries)]
    return table.text[0], keys_table(table.keys), inside


def widths(schema: Schema) -> str:
    """Text on the table [uncertainty], whose keys all take the same values."""
    variants = {
        name: [key for key, declared in table.keys.items() if declared.uncertain]
        for name, table in schema.tables.items()
    }
    first, *_ = schema.tables[WIDTHS].keys.values()
    how, liquid = (
        ('a table for each of these, such as `rotor = { mass = "1 %" }`', "")
        if isinstance(first.takes, Entries)
        else ("a key for each of these quantities", ", or that of the liquid")
    )
    rows = [(f"[{name}]", f"`{'`, `'.join(keys)}`") for name, keys in variants.items() if keys]
    text = f"It has {how}: a percentage, or a value with its unit. Left out: exact{liquid}."
    return f"{text}\n\n{markdown(('of table', 'quantities'), rows)}"


def liquid_reference() -> str:
    """Write a Markdown table of the known liquids."""
    heads = ("name", "also understood", "temperatures", "density, 95 %", "viscosity, 95 %", "source")
    rows = []
    for each in known_liquids():
        spreads = (each.density_uncertainty, each.viscosity_uncertainty)
        cells = (each.name, ", ".join(each.aliases), each.held, *(f"{100 * share:g} %" for share in spreads))
        rows.append((*cells, each.source))
    return markdown(heads, rows)


def valve_reference() -> str:
    """Write a Markdown table of the known valves, as their sources print them."""
    heads = ("C, l/(s bar)", "b", "6 to 5 bar, l/min", "Cv", "lag, ms", "bar gauge", "source")
    columns = ("conductance", "critical_ratio", "nominal_flow", "Cv", "valve_lag")
    rows = []
    for row in packaged_rows("ringbalance.scene", "data", "valves.csv"):
        pressures = " to ".join(filter(None, (row["lowest_pressure"], row["highest_pressure"])))
        source = ", ".join(filter(None, (row["source"], row["date"])))
        rows.append((row["name"], row["type"], *(row[each] for each in columns), pressures, source))
    return markdown(("name", "type", *heads), rows)


def unit_reference() -> str:
    """Write a Markdown table of the units."""
    rows = [(kind.noun, f"`{kind.example}`", _units([*kind.units])) for kind in DIMENSIONS.values()]
    return markdown(("quantity", "example", "units"), rows)


def _units(names: list[str]) -> str:
    """Units in code type; numerators and denominators once each where all their quotients are units."""
    over = [
        dict.fromkeys(part)
        for part in zip(*(name.split("/", 1) for name in names if "/" in name), strict=True)
    ]
    if len(names) > MANY and len(over) == 2 and len(names) == len(over[0]) * len(over[1]):
        return " over ".join(", ".join(f"`{unit}`" for unit in units) for units in over)
    return ", ".join(f"`{name}`" for name in names)


def keys_table(keys: Mapping[str, Key]) -> str:
    """Table of some keys, without `origin`, which the text of the page describes."""
    rows = []
    for name, key in keys.items():
        how = key.presence
        absent = f"`{toml_text(how.default)}`" if how.kind == "standard" else how.otherwise
        if name != ORIGIN:
            rows.append((f"`{name}`", key.takes.summary, absent, how.meaning))
    return markdown(("key", "takes", "when left out", "meaning"), rows)


def tables() -> dict[str, str]:
    """Tables of the page, by name."""
    return {
        "units": unit_reference(),
        "liquid_ring_keys": key_reference(LIQUID_RING, "At the top of the file"),
        "eccentric_mass_keys": key_reference(
            ECCENTRIC_MASS, "At the top of a file with eccentric masses", above=LIQUID_RING
        ),
        "liquids": liquid_reference(),
        "valves": valve_reference(),
    }
