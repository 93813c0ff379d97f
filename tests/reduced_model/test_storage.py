"""A law survives its file to the last bit; what is no law is refused with every fault named."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.files import load_law
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_law, paper_model
from ringbalance.scene import SceneError
from ringbalance.scene.models import Scene


def test_calibrated_law_comes_back_bit_for_bit(table_1_calibration: Calibration, tmp_path: Path) -> None:
    law = table_1_calibration.flow_law
    first = law.save(tmp_path / "law.json")
    back = load_law(first)
    second = back.save(tmp_path / "again.json")
    assert first.read_bytes() == second.read_bytes()
    conditions: dict[str, Any] = {
        "fill_ratio": np.linspace(0, 0.5, 41)[:, None],
        "gas_pressure": np.linspace(-1e5, 3e6, 37),
        "primed": True,
    }
    here, there = law.evaluate(**conditions), back.evaluate(**conditions)
    for name in ("velocity", "regime", "uncertainty", "primed"):
        np.testing.assert_array_equal(getattr(here, name), getattr(there, name))
    fills = np.linspace(0, 0.5, 23)
    saved, loaded = (
        m.pair_moment(fill_ratio=fills, opposite_fill_ratio=0.5 - fills) for m in (law.moment, back.moment)
    )
    np.testing.assert_array_equal(saved, loaded)


def test_paper_law_comes_back_whole(table_1_scene: Scene, tmp_path: Path) -> None:
    law = paper_law(table_1_scene)
    path = law.save(tmp_path / "paper.json")
    assert load_law(path) == law
    assert BalancerModel.of(load_law(path)) == paper_model(table_1_scene)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (None, "cannot be read"),
        ("", "not JSON"),
        ("{", "not JSON"),
        ("[1, 2]", "not a saved law"),
        ('{"format": "another"}', "not a saved law"),
        ('{"format": "ringbalance law", "version": 2}', "calibrate again"),
        ('{"format": "ringbalance law", "version": 99}', "another release"),
        ('{"format": "ringbalance law", "version": 4}', "law"),
        ('{"format": "ringbalance law", "version": 4, "law": {"type": "TubePath"}}', "PaperLaw"),
        ("[" * 100000, "not JSON"),
    ],
)
def test_files_that_are_no_law_are_refused(tmp_path: Path, text: str | None, told: str) -> None:
    path = tmp_path / "broken.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load_law(path)
    assert told in str(caught.value)
    assert all(fault.file == str(path) for fault in caught.value.faults)


def _set(key: str, value: object) -> Callable[[dict[str, Any]], None]:
    def change(law: dict[str, Any]) -> None:
        *way, last = key.split(".")
        for part in way:
            law = law[part]
        law[last] = value

    return change


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("chamber_volume", -1.0),
        ("tube_area", "thick"),
        ("max_fill_ratio", True),
        ("ambient_pressure", float("nan")),
        ("path.density", 10**400),
        ("path.trapped", 1),
        ("levels.columns", [0.0, "a"]),
        ("levels.columns", [1.0]),
        ("heads.siphon", None),
        ("moment.type", "PaperMoment"),
        ("surprise", 3),
    ],
)
def test_each_fault_names_its_key(
    table_1_calibration: Calibration, tmp_path: Path, key: str, value: object
) -> None:
    path = table_1_calibration.flow_law.save(tmp_path / "law.json")
    content = json.loads(path.read_text())
    _set(key, value)(content["law"])
    path.write_text(json.dumps(content))
    with pytest.raises(SceneError) as caught:
        load_law(path)
    (fault,) = caught.value.faults
    assert fault.table.startswith("law")
    assert fault.key in {key.split(".")[-1], "type"}
    assert fault.allowed


def test_all_faults_come_in_one_go(table_1_scene: Scene, tmp_path: Path) -> None:
    path = paper_law(table_1_scene).save(tmp_path / "law.json")
    content = json.loads(path.read_text())
    del content["law"]["density"]
    content["law"]["tube_area"] = 0
    content["law"]["moment"]["density"] = "heavy"
    path.write_text(json.dumps(content))
    with pytest.raises(SceneError) as caught:
        load_law(path)
    assert {(f.table, f.key) for f in caught.value.faults} == {
        ("law", "density"),
        ("law", "tube_area"),
        ("law.moment", "density"),
    }
