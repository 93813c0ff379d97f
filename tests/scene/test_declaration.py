"""One declaration in a record's field is enough: reading, defaults, errors and reference follow from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal

import pytest
import scene_reference

from ringbalance.scene import Fault, bundled_scene, liquid_ring_scene, load_scene, scene_table
from ringbalance.scene.design_settings import DesignSettings
from ringbalance.scene.keys.declaration import (
    UNCERTAIN,
    Listed,
    Shown,
    derived,
    descriptions_of,
    keys_of,
    needed,
    standard,
    unused,
)
from ringbalance.scene.keys.fields import Length, PositiveLength
from ringbalance.scene.keys.reading import SceneReading, read_document
from ringbalance.scene.keys.schema import LIQUID_RING, Schema, TableSchema
from ringbalance.scene.loop_models import RequirementSettings
from scenes import with_tables


@dataclass(frozen=True, kw_only=True)
class Hole:
    """A hole in a plate."""

    radius: Annotated[PositiveLength, needed("of the hole")]


@dataclass(frozen=True, kw_only=True)
class Plate:
    """A plate."""

    width: Annotated[PositiveLength, needed("along the shaft"), UNCERTAIN, Shown("width w", "mm")]
    kind: Annotated[Literal["flat", "bent"], standard("flat", "shape")]
    rim: Annotated[Length | None, unused("no rim", "height of the rim"), Shown("rim", "mm", absent="none")]
    depth: Annotated[Length, derived("twice the width", "depth", "plate.width", rule=lambda width: 2 * width)]
    holes: Annotated[tuple[Hole, ...], standard([], "list of { radius }"), Listed('[{ radius = "1 mm" }]')]
    mass: float
    """No key, kg."""


SCHEMA = Schema(
    top={}, tables={"plate": TableSchema(text="a plate", keys=keys_of(Plate), record=Plate)}, scene=dict
)


def _read(**plate: Any) -> tuple[SceneReading, tuple[Fault, ...]]:
    reading, faults = read_document({"plate": plate}, file="plate.toml", schema=SCHEMA)
    reading = reading.completed()
    return reading, (*faults, *reading.missing_faults())


def _plate(reading: SceneReading) -> Mapping[str, Any]:
    return {field.name: reading.values.get(f"plate.{field.name}") for field in fields(Plate)}


def test_values_and_defaults() -> None:
    reading, faults = _read(width="2 mm", holes=[{"radius": "1 mm"}])
    assert faults == ()
    assert _plate(reading) == {
        "width": 2e-3,
        "kind": "flat",
        "rim": None,
        "depth": 4e-3,
        "holes": (Hole(radius=1e-3),),
        "mass": None,
    }


def test_reference() -> None:
    assert scene_reference.keys_table(keys_of(Plate)).splitlines()[2:] == [
        "| `width` | a length above 0 | **needed** | along the shaft |",
        '| `kind` | "flat" or "bent" | `"flat"` | shape |',
        "| `rim` | a length of at least 0 | no rim | height of the rim |",
        "| `depth` | a length of at least 0 | twice the width | depth |",
        "| `holes` | a list of tables | `[]` | list of { radius } |",
    ]


def test_a_field_that_declares_no_values_is_refused() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Unread:
        size: Annotated[complex, needed("of no reader")]

    with pytest.raises(TypeError, match="does not declare what its key takes"):
        keys_of(Unread)


def test_every_description_of_a_scene_reaches_its_table() -> None:
    """Each described field gives one row, unless it is absent or belongs to another algorithm."""
    scene = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
    kinds = [with_tables(scene, controller={"kind": kind}) for kind in ("trial", "target_vector")]
    names = {
        entry.name
        for table in LIQUID_RING.tables.values()
        if table.record is not None
        for entry in descriptions_of(table.record).values()
    }
    described = {row["quantity"] for each in kinds for row in scene_table(each)}
    optional = {"critical pressure ratio b", "dead volume", "valve lag", "gas inlet radius", "mass"}
    optional |= {"measured factor on lambda", "geometry of a chamber", "runout", "phase of the runout"}
    optional |= {"leak to ambient", "leak from the supply", "relative humidity of the supply"}
    optional |= {f"{each} of the gas hole" for each in ("diameter", "radius", "direction")}
    optional |= {"valve", "nominal flow of the valve", "flow coefficient Kv", "flow coefficient Cv"}
    optional |= {entry.name for entry in descriptions_of(RequirementSettings).values()}
    optional |= {entry.name for entry in descriptions_of(DesignSettings).values()}
    assert names - described <= optional
    assert described - names == {"tolerance"}
