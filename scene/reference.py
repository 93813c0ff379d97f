"""The reference of the scene file's keys as Markdown, straight from the schema."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from ringbalance.scene.dimensions import DIMENSIONS
from ringbalance.scene.eccentric_schema import EccentricTables, SpeedPointTable
from ringbalance.scene.faults import toml_text
from ringbalance.scene.fields import Reader
from ringbalance.scene.liquids import known_liquids
from ringbalance.scene.presence import note_of, presence_of
from ringbalance.scene.reading import Schema, table_names
from ringbalance.scene.schema import BendTable, SceneTables, VibrationTable
from ringbalance.scene.units import unit_names

_HEAD = "| key | takes | when left out | meaning |\n|---|---|---|---|"


def key_reference() -> str:
    """Write one Markdown table of keys for each table of a liquid-ring scene.

    Returns:
        Headings and tables, in the order of the schema.
    """
    inner: dict[str, Schema] = {
        "[tube] bends, each entry": BendTable,
        "[rotor] initial_vibration": VibrationTable,
    }
    return _reference(SceneTables, "At the top of the file", inner)


def eccentric_key_reference() -> str:
    """Write one Markdown table of keys for each table of a scene with driven eccentric masses.

    Returns:
        Headings and tables, in the order of the schema.
    """
    title = "At the top of a file with driven masses"
    return _reference(EccentricTables, title, {"[rotor] speed_profile, each entry": SpeedPointTable})


def _reference(schema: Schema, title: str, nested: Mapping[str, Schema]) -> str:
    tables = table_names(schema)
    top = [name for name in schema.model_fields if name not in tables]
    parts = [f"### {title}", _HEAD, *(_row(schema, key) for key in top)]
    for table in tables:
        field = schema.model_fields[table]
        model: Any = field.annotation
        parts += [f"\n### [{table}]", f"{_sentence(field.description)}\n", _HEAD]
        parts += [_row(model, key) for key in model.model_fields]
    for name, inner in nested.items():
        parts += [f"\n### {name}", _HEAD, *(_row(inner, key) for key in inner.model_fields)]
    return "\n".join(parts)


def liquid_reference() -> str:
    """Write a Markdown table of the known liquids.

    Returns:
        The table.
    """
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


def unit_reference() -> str:
    """Write a Markdown table of the units.

    Returns:
        The table.
    """
    rows = (
        f"| {kind.noun} | `{kind.example}` | `{unit_names(name).replace(', ', '`, `')}` |"
        for name, kind in DIMENSIONS.items()
    )
    return "\n".join(["| quantity | example | units |\n|---|---|---|", *rows])


def _row(model: type[BaseModel], key: str) -> str:
    field = model.model_fields[key]
    return f"| `{key}` | {_takes(field)} | {_absence(field)} | {field.description} |"


def _takes(field: FieldInfo) -> str:
    reader = next((each for each in field.metadata if isinstance(each, Reader)), None)
    if reader is not None:
        return reader.summary
    return "a list of tables" if note_of(field, "list") else "a table"


def _absence(field: FieldInfo) -> str:
    presence, rule = presence_of(field), note_of(field, "rule")
    if presence in ("needed", ""):
        return "**needed**"
    if presence == "standard" and not rule:
        return f"`{toml_text(field.default)}`"
    return f"`{rule}`" if presence == "standard" else rule


def _sentence(text: str | None) -> str:
    words = text or ""
    return f"{words[:1].upper()}{words[1:]}."
