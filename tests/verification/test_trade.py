"""The trade: errors against references of their own, and the command."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from ringbalance.cli import main
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.trade import Record, TradeStudy, trade_study


@pytest.fixture(scope="module")
def scene() -> Scene:
    return liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))


@pytest.fixture(scope="module")
def study(scene: Scene) -> TradeStudy:
    return trade_study(scene, level="light")


def quantity(study: TradeStudy, name: str) -> Record:
    (result,) = (each for each in study.quantities if each["quantity"] == name)
    return result


def test_the_papers_formula_lacks_the_plates(study: TradeStudy) -> None:
    """They are some 11 % of the volume; the closed form lacks gravity, 1e-7, the mesh an arc's facets."""
    pressure = quantity(study, "wall_pressure")
    errors = {model["model"]: model["error"] for model in pressure["models"]}
    assert 0.05 < errors["the paper's formulas"] < 0.12
    assert 0 < errors["closed form"] < 1e-6
    assert [*errors][-1] == "closed form, gravity to all orders"
    assert errors[[*errors][-1]] == 0.0
    meshes = [error for name, error in errors.items() if name.startswith("2-D")]
    assert len(meshes) == 2
    assert meshes[1] < meshes[0] / 8
    assert pressure["uncertainty"] > errors["closed form"]
    assert all(model["designs_per_second"] > 0 for model in study.times["wall_pressure"])


def test_velocities_are_those_of_calibrate(scene: Scene, study: TradeStudy) -> None:
    velocity = quantity(study, "velocity")
    law = calibrate(scene).flow_law
    fills = [float(point.removeprefix("fill ratio ")) for point in velocity["points"]]
    result = law.evaluate(fill_ratio=np.array(fills), gas_pressure=scene.gas.pressure)
    assert velocity["models"][-1]["values"] == pytest.approx(result.velocity, rel=1e-9)
    errors = {model["model"]: model["error"] for model in velocity["models"]}
    assert errors["k = 50, regimes over the crest"] > 0.4
    assert errors["correlations and finite-element tables, few nodes"] < 1e-4


def test_where_no_ring_is_closed_the_chamber_has_no_models(scene: Scene) -> None:
    rotor = dataclasses.replace(scene.rotor, speed=200 * math.pi / 30)
    slow = trade_study(dataclasses.replace(scene, rotor=rotor), level="light")
    pressure = quantity(slow, "wall_pressure")
    assert pressure["models"] == []
    assert pressure["status"]["code"] != "ok"


def test_the_command(study: TradeStudy, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(bundled_scene("liquid_ring_paper"))
    assert main(["trade", path, "--level", "light", "--json", "--out", str(tmp_path)]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "trade.json").read_text()) == printed
    assert {each.unit for each in study.rows().quantities} == {"designs a second"}


def test_a_scene_that_cannot_be_used_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = bundled_scene("liquid_ring_paper").read_text()
    slow = tmp_path / "slow.toml"
    slow.write_text(text.replace('speed = "10000 rpm"', 'speed = "60 rpm"'))
    assert main(["trade", str(slow)]) == 2
    assert "rotor" in capsys.readouterr().err
