"""A law survives its file to the last bit; what is no law is refused with every fault named."""

from __future__ import annotations

import json
import lzma
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.files import load_law
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.reduced_model.law.paper_law import paper_law, paper_model
from ringbalance.scene import SceneError
from ringbalance.scene.models import Scene

VERSION_4 = "law_version_4.json.xz"


def test_calibrated_law_comes_back_bit_for_bit(table_1_calibration: Calibration, tmp_path: Path) -> None:
    law = table_1_calibration.flow_law
    first = law.save(tmp_path / "law.json")
    back = load_law(first)
    second = back.save(tmp_path / "again.json")
    assert first.read_bytes() == second.read_bytes()
    assert first.stat().st_size < 150_000
    assert law_equal(law, back)
    fills = np.linspace(0, 0.5, 23)
    saved, loaded = (
        m.pair_moment(fill_ratio=fills, opposite_fill_ratio=0.5 - fills) for m in (law.moment, back.moment)
    )
    np.testing.assert_array_equal(saved, loaded)


def test_a_law_of_version_4_is_read(tmp_path: Path) -> None:
    """Of the release before, with what that release answered; half-widths are by the batch of its sides.

    Half-widths by linear propagation and by whole steps of one input after the other differ where a velocity
    bends within an interval; a fifth is what such a half-width is known to.
    """
    path = tmp_path / "law.json"
    path.write_bytes(lzma.decompress((Path(__file__).parent / "golden" / VERSION_4).read_bytes()))
    law = load_law(path)
    flow = law.evaluate(
        fill_ratio=[0.05, 0.15, 0.25, 0.4, 0.25, 0.1],
        opposite_fill_ratio=[0.45, 0.35, 0.25, 0.1, 0.2, 0.4],
        gas_pressure=[7e5, 9e5, 7e5, 4e5, 14e5, 2e5],
        primed=[False, False, False, True, False, True],
    )
    velocity = [11.294967299941272, 16.997999836441455, 14.897258629070903, 11.105362396919539]
    assert flow.velocity.tolist() == pytest.approx([*velocity, 25.095526881710065, 0.0], rel=1e-14)
    whether = flow.regime == Regime.UNDECIDED
    assert np.where(whether, Regime.SEPARATED, flow.regime).tolist() == [2, 2, 2, 2, 2, Regime.BLOCKED]
    assert flow.primed.tolist() == [True, True, True, True, True, False]
    widths = [1.5629454291017868, 1.4077681721715398, 1.4069548889623524, 1.5616915326760643]
    assert flow.uncertainty.tolist() == pytest.approx([*widths, 1.636279757656296, 0.0], rel=0.2)
    again = load_law(law.save(tmp_path / "again.json"))
    assert json.loads((tmp_path / "again.json").read_text())["version"] == 5
    assert law_equal(law, again)


def law_equal(*laws: Any) -> bool:
    """True if two laws answer alike, half-widths included."""
    fills, pressures = np.linspace(0, 0.5, 41)[:, None], np.linspace(-1e5, 3e6, 37)
    flows = [law.evaluate(fill_ratio=fills, gas_pressure=pressures, primed=True) for law in laws]
    return all(map(np.array_equal, *(vars(flow).values() for flow in flows)))


def test_paper_law_comes_back_whole(table_1_scene: Scene, tmp_path: Path) -> None:
    law = paper_law(table_1_scene)
    path = law.save(tmp_path / "paper.json")
    assert load_law(path) == law
    assert BalancerModel.of(load_law(path)) == paper_model(table_1_scene)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot be read"),
        ("", "not JSON"),
        ("{", "not JSON"),
        ("[1, 2]", "not a saved law"),
        ('{"format": "another"}', "not a saved law"),
        ('{"format": "ringbalance law", "version": 2}', "calibrate again"),
        ('{"format": "ringbalance law", "version": 99}', "another release"),
        ('{"format": "ringbalance law", "version": 5}', "law"),
        ('{"format": "ringbalance law", "version": 5, "law": {"type": "TubePath"}}', "PaperLaw"),
        ('{"format": "ringbalance law", "version": 4, "law": {"type": "CalibratedLaw"}}', "no whole law"),
        ('{"format": "ringbalance law", "version": 4, "law": {"type": "TubePath"}}', "PaperLaw"),
        ("[" * 100000, "not JSON"),
    ],
)
def test_files_that_are_no_law_are_refused(tmp_path: Path, text: str | None, message: str) -> None:
    path = tmp_path / "broken.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load_law(path)
    assert message in str(caught.value)
    assert all(fault.file == str(path) for fault in caught.value.faults)


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
    *tables, last = key.split(".")
    reduce(getitem, tables, content["law"])[last] = value
    path.write_text(json.dumps(content))
    with pytest.raises(SceneError) as caught:
        load_law(path)
    (fault,) = caught.value.faults
    assert fault.table.startswith("law")
    assert fault.key in {*tables, last, "type"}
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
