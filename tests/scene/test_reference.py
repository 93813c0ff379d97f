"""Schema, records and the written reference say the same."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from ringbalance.scene import Scene, models
from ringbalance.scene.checks import CHECKS
from ringbalance.scene.reading import TABLES
from ringbalance.scene.reference import key_reference, liquid_reference, unit_reference
from ringbalance.scene.schema import SceneTables
from ringbalance.scene.uncertain import UNCERTAIN

DOCUMENT = Path(__file__).parents[2] / "docs" / "scene-file.md"
REWRITE = "paste the output of ringbalance.scene.reference into docs/scene-file.md"


def _keys(table: str) -> set[str]:
    model: Any = SceneTables.model_fields[table].annotation
    return set(model.model_fields)


@pytest.mark.parametrize("part", [key_reference, liquid_reference, unit_reference])
def test_document_holds_the_reference(part: Callable[[], str]) -> None:
    assert part() in DOCUMENT.read_text(encoding="utf-8"), REWRITE


def test_every_key_has_a_meaning() -> None:
    rows = [line for line in key_reference().splitlines() if line.startswith("| `")]
    top = len(SceneTables.model_fields) - len(TABLES)
    inside_lists = len(("angle", "radius", "amplitude", "phase"))
    assert len(rows) == top + sum(len(_keys(table)) for table in TABLES) + inside_lists
    assert all(cell.strip() for row in rows for cell in row.strip("|").split("|"))


def test_example_in_the_document_loads(load: Callable[[Mapping[str, Any]], Scene]) -> None:
    blocks = re.findall(r"```toml\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 1
    assert load(tomllib.loads(blocks[0])).disc.chambers == 4


@pytest.mark.parametrize(
    ("table", "record", "differences"),
    [
        ("disc", models.Disc, set()),
        ("liquid", models.Liquid, {"density_uncertainty", "viscosity_uncertainty", "source"}),
        ("tube", models.Tube, set()),
        ("gas", models.Gas, set()),
        ("environment", models.Environment, set()),
        ("rotor", models.Rotor, {"initial_vibration", "initial_amplitude", "initial_phase"}),
        ("sensor", models.Sensor, set()),
        ("controller", models.ControllerSettings, set()),
        ("run", models.RunSettings, set()),
    ],
)
def test_keys_are_fields(table: str, record: Any, differences: set[str]) -> None:
    """A key reaches the record's field of its name; nothing is written in a file and then ignored."""
    assert _keys(table) ^ {field.name for field in fields(record)} == differences


@pytest.mark.parametrize(
    ("table", "key", "record"),
    [
        ("tube", "hump_gas", models.Tube),
        ("tube", "entrance", models.Tube),
        ("environment", "shaft", models.Environment),
        ("controller", "kind", models.ControllerSettings),
    ],
)
def test_words_are_those_of_the_records(table: str, key: str, record: Any) -> None:
    model: Any = SceneTables.model_fields[table].annotation
    (reader,) = model.model_fields[key].metadata
    words = get_args(get_type_hints(record)[key])
    assert [reader.read(word) for word in words] == list(words)
    assert reader.allowed == " or ".join(f'"{word}"' for word in words)


def test_uncertain_quantities() -> None:
    assert _keys("uncertainty") == set(UNCERTAIN)
    assert all(key in _keys(entry.table) for key, entry in UNCERTAIN.items())


def test_checks_need_keys_that_exist() -> None:
    for check in CHECKS:
        for path in check.needs:
            table, key = path.split(".")
            assert table in TABLES
            assert key in _keys(table)
