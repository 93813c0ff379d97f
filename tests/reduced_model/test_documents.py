"""The JSON of `calibrate --json`: every promised key, shapes that fit, nothing that JSON cannot hold."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from quantities import by_key, half_width

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.models import Scene
from scenes import with_tables

CHAMBER = (
    "free_surface_radius_m",
    "row_status",
    "wall_pressure_Pa",
    "wall_pressure_uncertainty",
    "wall_pressure_paper_Pa",
    "moment_kg_m",
    "moment_uncertainty",
    "moment_paper_kg_m",
    "lambda_per_transferred_mass_m",
)
LAW = ("velocity_m_s", "velocity_uncertainty", "regime", "velocity_paper_m_s")


@pytest.fixture(scope="module")
def document(table_1_calibration: Calibration) -> dict[str, Any]:
    text = json.dumps(calibration_document(table_1_calibration), allow_nan=False)
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def test_promised_keys_are_there_and_shapes_fit(document: dict[str, Any]) -> None:
    chamber, tube, law = document["chamber"], document["tube"], document["law"]
    n = len(chamber["fill_ratio"])
    assert chamber["fill_ratio"] == [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5]
    assert all(len(chamber[key]) == n for key in CHAMBER)
    m = len(tube["velocity_m_s"])
    assert tube["velocity_m_s"][0] == pytest.approx(0.1)
    assert tube["velocity_m_s"][-1] == pytest.approx(20)
    assert all(len(tube[key]) == m for key in ("reynolds", "k", "k_uncertainty", "flow_state", "in_range"))
    assert all(len(term) == m for term in tube["terms"].values())
    shape = (len(law["gas_pressure_Pa"]), len(law["fill_ratio"]))
    assert all(np.array(law[key]).shape == shape for key in LAW)
    assert document["statistics"]["finite_element_solves"] > 0


def test_numbers_agree_with_each_other(document: dict[str, Any]) -> None:
    chamber, known = document["chamber"], by_key(document)
    assert chamber["lambda_per_transferred_mass_m"][5] == known["lambda"]["value"]
    parts = chamber["moment_uncertainty_parts"]
    np.testing.assert_allclose(
        chamber["moment_uncertainty"], np.sqrt(sum(np.square(part) for part in parts.values()))
    )
    velocity, regime = np.array(document["law"]["velocity_m_s"]), np.array(document["law"]["regime"])
    assert np.all((velocity == 0) == (regime == "blocked"))


def test_budgets_are_the_uncertainties_of_the_rest(document: dict[str, Any]) -> None:
    told, chamber = by_key(document), document["chamber"]
    for each in (each for each in told.values() if each["parts"]):
        models = {name: size for name, size in each["causes"].items() if name.startswith("model: ")}
        inputs = {name: size for name, size in each["causes"].items() if name not in models}
        assert each["parts"]["input"] == pytest.approx(math.hypot(*inputs.values()))
        assert each["parts"]["model"] == pytest.approx(math.hypot(*models.values()))
    assert told["moment"]["value"] == pytest.approx(chamber["moment_kg_m"][-1], rel=1e-12)
    assert half_width(told["moment"]) == pytest.approx(
        math.hypot(chamber["moment_uncertainty"][-1], chamber["moment_input_uncertainty"][-1])
    )
    # The law's own, by sensitivities, in the row and column of the same state.
    law = document["law"]
    same = law["velocity_uncertainty"][2][5]
    velocity = told["velocity"]
    assert (law["velocity_m_s"][2][5], same) == pytest.approx(
        (velocity["value"], half_width(velocity)), rel=0.02
    )


def _numbers(value: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Numbers that are neither in a curve nor round."""
    if isinstance(value, dict):
        for key, inside in value.items():
            yield from _numbers(inside, f"{place}.{key}")
    elif isinstance(value, list):
        for inside in value:
            if isinstance(inside, dict):
                yield from _numbers(inside, f"{place}.{inside.get('key', '')}")
    elif isinstance(value, float) and len(repr(value)) > 12:
        yield place, value


@pytest.mark.parametrize("name", ["liquid_ring_paper", "six_chamber", "imported_chamber"])
def test_each_number_stands_once(name: str) -> None:
    """But for values that findings quote, and parts that have one cause."""
    document = calibrate(liquid_ring_scene(load_scene(bundled_scene(name)))).to_dict()
    places: dict[float, list[str]] = {}
    for part in document.keys() - {"findings", "models_used", "gas_line", "check"}:
        for place, value in _numbers(document[part], part):
            if not re.search(r"\.(lower|upper)$|\.(parts|causes)\.", place):
                places.setdefault(value, []).append(place)
    twice = [sorted(each) for each in places.values() if len(each) > 1]
    # On the sector Eq. 12's pressure stalls a full siphon, and four chambers reach what a pair of them does.
    allowed = [{"wall_pressure", "stall_pressure"}, {"usable_moment", "reach"}]
    allowed.append({"priming_pressure_vented", "priming_pressure_trapped"})
    assert [each for each in twice if {place.split(".")[1] for place in each} not in allowed] == []


def test_wall_pressure_of_the_paper_is_eq_12(document: dict[str, Any], table_1_scene: Scene) -> None:
    # By hand: rho omega^2/(B theta) = 1.1260e10 Pa/m^3, V' = 33.844 ml.
    last = document["chamber"]["wall_pressure_paper_Pa"][-1]
    assert last == pytest.approx(381.09e3, rel=5e-5)
    assert document["chamber"]["moment_paper_kg_m"][-1] * 1e6 == pytest.approx(1334.46, abs=0.02)
    # Without plates Eq. 12 is low by what the plates take from the volume.
    assert document["chamber"]["wall_pressure_Pa"][-1] / last == pytest.approx(1.098, abs=2e-3)
    assert table_1_scene.disc.plate_thickness > 0


def test_fill_range_that_is_no_multiple_of_the_step(table_1_scene: Scene) -> None:
    disc = dataclasses.replace(table_1_scene.disc, max_fill_ratio=0.33, initial_fill=0.165)
    chamber = calibration_document(calibrate(dataclasses.replace(table_1_scene, disc=disc)))["chamber"]
    assert chamber["fill_ratio"] == [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.33]
    assert np.all(np.diff(chamber["wall_pressure_Pa"]) > 0)
    assert np.ptp(chamber["lambda_per_transferred_mass_m"]) < 1e-3


def test_blocked_scene_still_makes_a_clean_document(table_1_scene: Scene) -> None:
    weak = with_tables(table_1_scene, gas={"pressure": 0.0})
    document = calibration_document(calibrate(weak))
    json.dumps(document, allow_nan=False)
    assert document["regime"] == "blocked"
    assert "drag_coefficient" not in by_key(document)
    assert by_key(document)["priming_pressure_vented"]["value"] == pytest.approx(0.5417e6, rel=1e-3)
    # 0.3 MPa drives a primed tube, and lifts nothing over the crest of an empty one.
    lower = with_tables(table_1_scene, gas={"pressure": 0.3e6})
    found = calibrate(lower)
    assert "drag_coefficient" not in {each.key for each in found.rows().quantities}
    # Advice is the safe end of an interval, and what is only told has its interval.
    texts = {each.code: each for each in found.rows().findings}
    starts = next(each for each in found.rows().quantities if each.key == "priming_pressure_vented")
    # By the inputs alone: an empty chamber has no waves.
    assert (starts.upper or 0.0) > 1.0005 * (starts.value or math.inf)
    assert starts.parts is not None
    assert starts.parts.model == 0
    assert texts["blocked"].values["pressure"] == pytest.approx(starts.upper)
    plain = {each.code: each.text for each in calibrate(table_1_scene).rows().findings}
    assert plain["draw_down"].count("+-") + plain["draw_down"].count("±") == 2
