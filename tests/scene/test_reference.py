"""Schema, records and the written reference say the same."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import pytest
import scene_reference
from doc_tables import fresh, text_of

from ringbalance.controller.eccentric_mass.scene_records import CHECKS, ECCENTRIC_MASS
from ringbalance.scene import Scene, loop_models, models
from ringbalance.scene.chamber_file.record import MeshKeys
from ringbalance.scene.keys.declaration import keys_of
from ringbalance.scene.keys.schema import LIQUID_RING, ORIGIN, Schema
from ringbalance.scene.kinds import Check
from ringbalance.scene.origins import Measured
from ringbalance.scene.rules import shape, working
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES


def _keys(table: str) -> set[str]:
    return set(LIQUID_RING.tables[table].keys) - {ORIGIN}


def test_document_holds_the_reference() -> None:
    page = text_of("docs/scene-file.md")
    assert fresh(page, scene_reference.tables()) == page, "run tools/generate.py --write docs"


@pytest.mark.parametrize(("schema", "inside_lists"), [(LIQUID_RING, 42), (ECCENTRIC_MASS, 30)])
def test_every_key_has_a_meaning(schema: Schema, inside_lists: int) -> None:
    reference = scene_reference.key_reference(schema, "title")
    rows = [line for line in reference.splitlines() if line.startswith("| `")]
    tables = {name: table for name, table in schema.tables.items() if name != scene_reference.WIDTHS}
    keys = len(schema.top) + sum(len(table.keys) - 1 for table in tables.values())
    assert len(rows) == keys + inside_lists
    assert all(cell.strip() for row in rows for cell in row.strip("|").split("|"))


@pytest.mark.parametrize("schema", [LIQUID_RING, ECCENTRIC_MASS])
def test_every_uncertain_quantity_is_listed(schema: Schema) -> None:
    told = scene_reference.widths(schema)
    for name, table in schema.tables.items():
        keys = [f"`{key}`" for key, declared in table.keys.items() if declared.uncertain]
        assert not keys or f"| [{name}] | {', '.join(keys)} |" in told


def test_example_in_the_document_loads(load: Callable[[Mapping[str, Any]], Scene]) -> None:
    blocks = re.findall(r"```toml\n(.*?)```", text_of("docs/scene-file.md"), re.DOTALL)
    assert len(blocks) == 1
    assert load(tomllib.loads(blocks[0])).disc.chambers == 4


@pytest.mark.parametrize(
    ("table", "record", "differences"),
    [
        ("disc", models.Disc, {"geometry", *keys_of(MeshKeys)}),
        ("liquid", models.Liquid, {"density_uncertainty", "viscosity_uncertainty", "source"}),
        ("tube", models.Tube, set()),
        ("gas", models.Gas, {"valve_source"}),
        ("environment", loop_models.Environment, set()),
        ("rotor", loop_models.Rotor, {"initial_vibration", "initial_amplitude", "initial_phase"}),
        ("sensor", loop_models.Sensor, {"runout", "runout_amplitude", "runout_phase"}),
        ("controller", loop_models.ControllerSettings, set()),
        ("requirement", loop_models.RequirementSettings, set()),
        ("run", loop_models.RunSettings, set()),
        ("measured", Measured, set()),
    ],
)
def test_keys_are_fields(table: str, record: Any, differences: set[str]) -> None:
    """A key reaches the record's field of its name; nothing is written in a file and then ignored."""
    assert _keys(table) ^ {field.name for field in fields(record)} == differences


def test_uncertain_quantities() -> None:
    """A key of [uncertainty] names no table, so only one table can have a quantity of its name."""
    declared = [
        name for table in LIQUID_RING.tables.values() for name, key in table.keys.items() if key.uncertain
    ]
    assert len(declared) == len(set(declared))
    assert _keys("uncertainty") == set(declared) == set(UNCERTAIN_QUANTITIES)
    assert all(key in _keys(table) for key, table in UNCERTAIN_QUANTITIES.items())


@pytest.mark.parametrize(
    ("schema", "checks"),
    [(LIQUID_RING, (*shape.CHECKS, *working.CHECKS)), (ECCENTRIC_MASS, CHECKS)],
)
def test_checks_need_keys_that_exist(schema: Schema, checks: tuple[Check, ...]) -> None:
    for check in checks:
        for path in check.needs:
            table, key = path.split(".")
            assert key in schema.tables[table].keys


@pytest.mark.parametrize("schema", [LIQUID_RING, ECCENTRIC_MASS])
def test_derived_defaults_follow_from_what_is_known_before_them(schema: Schema) -> None:
    """Defaults are filled in table by table, so a rule needs only keys that come before, or are no rule's.

    A needed key follows from what the file itself gives, and from no default.
    """
    pending = {
        f"{name}.{key}"
        for name, table in schema.tables.items()
        for key, declared in table.keys.items()
        if declared.presence.needs and declared.presence.kind != "needed"
    }
    for name, table in schema.tables.items():
        for key, declared in table.keys.items():
            assert declared.presence.kind == "needed" or not pending & set(declared.presence.needs)
            for path in declared.presence.needs:
                needed_table, needed_key = path.split(".")
                assert needed_key in schema.tables[needed_table].keys
            pending.discard(f"{name}.{key}")
