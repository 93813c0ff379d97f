"""Tables of docs/scene-file.md from the declarations of keys, liquids and units, for `doc_tables`."""

from __future__ import annotations

from collections.abc import Mapping

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
HEAD = "| key | takes | when left out | meaning |\n|---|---|---|---|"


def key_reference(schema: Schema, title: str, above: Schema | None = None) -> str:
    """One Markdown table of keys for each table of a kind of scene.

    Args: `title`: of the first table. `above`: kind of scene whose tables precede; identical tables are
    only named.
    """
    tables = {} if above is None else above.tables
    same = [name for name in schema.tables if name in tables and _told(schema, name) == _told(above, name)]
    parts = [f"### {title}", *rows(schema.top)]
    for name, table in schema.tables.items():
        if name in same:
            continue
        inside = widths(schema) if name == WIDTHS else rows(table.keys)
        parts += [f"\n### [{name}]", f"{table.text[0].upper()}{table.text[1:]}.\n", *inside]
    for name, table in schema.tables.items():
        if name == WIDTHS or name in same:
            continue
        for key, declared in table.keys.items():
            if isinstance(declared.takes, Entries) and key != ORIGIN:
                each = ", each entry" if declared.takes.example else ""
                parts += [f"\n### [{name}] {key}{each}", *rows(declared.takes.keys)]
    if same:
        parts += [f"\n### [{'], ['.join(same)}]", "As of a liquid-ring scene, above."]
    return "\n".join(parts)


def _told(schema: Schema | None, name: str) -> object:
    """Contents of the page on a table, for comparison."""
    if schema is None or name == WIDTHS:
        return schema
    table = schema.tables[name]
    inside = [rows(key.takes.keys) for key in table.keys.values() if isinstance(key.takes, Entries)]
    return table.text[0], rows(table.keys), inside


def widths(schema: Schema) -> list[str]:
    """Lines of the table [uncertainty], whose keys all take the same values."""
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
    return [
        f"It has {how}: a percentage, or a value with its unit. Left out: exact{liquid}.\n",
        "| of table | quantities |\n|---|---|",
        *(f"| [{name}] | `{'`, `'.join(keys)}` |" for name, keys in variants.items() if keys),
    ]


def liquid_reference() -> str:
    """Write a Markdown table of the known liquids."""
    head = (
        "| name | also understood | temperatures | density, 95 % | viscosity, 95 % | source |\n"
        "|---|---|---|---|---|---|"
    )
    rows = (
        f"| {each.name} | {', '.join(each.aliases)} | {each.held} | {100 * each.density_uncertainty:g} % "
        f"| {100 * each.viscosity_uncertainty:g} % | {each.source} |"
        for each in known_liquids()
    )
    return "\n".join([head, *rows])


def valve_reference() -> str:
    """Write a Markdown table of the known valves, as their sources print them."""
    heads = ("C, l/(s bar)", "b", "6 to 5 bar, l/min", "Cv", "lag, ms", "bar gauge", "source")
    columns = ("conductance", "critical_ratio", "nominal_flow", "Cv", "valve_lag")
    rows = []
    for row in packaged_rows("ringbalance.scene", "data", "valves.csv"):
        pressures = " to ".join(filter(None, (row["lowest_pressure"], row["highest_pressure"])))
        source = ", ".join(filter(None, (row["source"], row["date"])))
        rows.append((row["name"], row["type"], *(row[each] for each in columns), pressures, source))
    lines = (f"| {' | '.join(cells)} |" for cells in (("name", "type", *heads), ("---",) * 9, *rows))
    return "\n".join(lines)


def unit_reference() -> str:
    """Write a Markdown table of the units."""
    rows = (f"| {kind.noun} | `{kind.example}` | {_units([*kind.units])} |" for kind in DIMENSIONS.values())
    return "\n".join(["| quantity | example | units |\n|---|---|---|", *rows])


def _units(names: list[str]) -> str:
    """Units in code type; numerators and denominators once each where all their quotients are units."""
    over = [
        dict.fromkeys(part)
        for part in zip(*(name.split("/", 1) for name in names if "/" in name), strict=True)
    ]
    if len(names) > MANY and len(over) == 2 and len(names) == len(over[0]) * len(over[1]):
        return " over ".join(", ".join(f"`{unit}`" for unit in units) for units in over)
    return ", ".join(f"`{name}`" for name in names)


def rows(keys: Mapping[str, Key]) -> list[str]:
    """Head and rows of the table of some keys, without `origin`, which the text of the page describes."""
    return [
        HEAD,
        *(
            f"| `{name}` | {key.takes.summary} | {when_left_out(key)} | {key.presence.meaning} |"
            for name, key in keys.items()
            if name != ORIGIN
        ),
    ]


def when_left_out(key: Key) -> str:
    """Default of a key, in words."""
    if key.presence.kind == "standard":
        return f"`{toml_text(key.presence.default)}`"
    return key.presence.otherwise


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
