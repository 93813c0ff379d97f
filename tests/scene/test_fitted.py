"""The joint distribution of [fitted]: what is refused, and what replaces [uncertainty]."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.eccentric_mass.devices import device
from ringbalance.controller.eccentric_mass.scene_records import eccentric_scene
from ringbalance.scene import SceneError, bundled_scene
from ringbalance.scene.loader import scene_from
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.toml import toml_bytes
from ringbalance.scene.uncertain import NORMAL_95, half_widths
from ringbalance.verification.papers import changed

BORE = {"quantity": "tube.bore", "unit": "mm", "standard_deviation": 0.02, "correlations": [1.0, 0.9]}
LOSS = {
    "quantity": "model: ends, even",
    "unit": "1",
    "standard_deviation": 0.7,
    "correlations": [0.9, 1.0],
}


def content(*quantities: dict[str, Any], name: str = "liquid_ring_paper") -> bytes:
    document = tomllib.loads(bundled_scene(name).read_text(encoding="utf-8"))
    return toml_bytes(document | {"fitted": {"quantities": list(quantities)}})


def refused(*quantities: dict[str, Any]) -> list[tuple[str, str]]:
    with pytest.raises(SceneError) as error:
        scene_from(content=content(*quantities), file="a.toml")
    return [(fault.table, fault.key) for fault in error.value.faults]


def test_a_joint_distribution_is_read_in_si() -> None:
    scene = liquid_ring_scene(scene_from(content=content(BORE, LOSS), file="a.toml"))
    assert scene.fitted.covariance == pytest.approx(
        np.array([[4e-10, 0.9 * 2e-5 * 0.7], [0.9 * 2e-5 * 0.7, 0.49]])
    )
    columns = scene.fitted.directions()
    assert columns @ columns.T == pytest.approx(scene.fitted.covariance)
    assert half_widths(scene)["bore"] == pytest.approx(NORMAL_95 * 2e-5)


@pytest.mark.parametrize(
    ("changed", "key"),
    [
        ({"quantity": "tube.bor"}, "quantities[1].quantity"),
        ({"quantity": "tube.entrance"}, "quantities[1].quantity"),
        ({"quantity": "gas.conductance", "unit": "l/(s*bar)"}, "quantities[1].quantity"),
        ({"quantity": "model: luck, even", "unit": "1"}, "quantities[1].quantity"),
        ({"quantity": "model: ends, even", "unit": "1"}, "quantities[2].quantity"),
        ({"unit": "kPa"}, "quantities[1].unit"),
        ({"correlations": [1.0]}, "quantities[1].correlations"),
        ({"correlations": [0.5, 0.9]}, "quantities[1].correlations"),
        ({"correlations": [1.0, 0.8]}, "quantities"),
        ({"standard_deviation": 0.0}, "quantities[1].standard_deviation"),
    ],
)
def test_what_cannot_be_is_refused(changed: dict[str, Any], key: str) -> None:
    assert ("fitted", key) in refused(BORE | changed, LOSS)


def test_correlations_that_cannot_be_true_together_are_refused() -> None:
    names, rows = ("tube.bore", "tube.length", "tube.roughness"), np.full((3, 3), -0.9) + 1.9 * np.eye(3)
    quantities = [
        {"quantity": n, "unit": "mm", "standard_deviation": 1e-3, "correlations": row.tolist()}
        for n, row in zip(names, rows, strict=True)
    ]
    assert refused(*quantities) == [("fitted", "quantities")]


def test_eccentric_inputs_are_drawn_together() -> None:
    """Logarithms of positive values, with the stated correlation; others as [uncertainty] has them."""
    quantities = (
        {"quantity": "rotor.damping", "unit": "N*s/m", "standard_deviation": 0.4, "correlations": [1, 0.95]},
        {"quantity": "imbalance.phase", "unit": "deg", "standard_deviation": 2.0, "correlations": [0.95, 1]},
    )
    read = scene_from(content=content(*quantities, name="driven_masses_small"), file="a.toml")
    scene = changed(eccentric_scene(read), {"requirement.phase_range": 0.0})
    draws = [device(scene, number).scene for number in range(1024)]
    damping = np.log([each.rotor.damping / scene.rotor.damping for each in draws])
    phase = np.array([each.imbalance.phase - scene.imbalance.phase for each in draws])
    assert np.std(damping) == pytest.approx(0.4 / scene.rotor.damping, rel=0.1)
    assert np.std(phase) == pytest.approx(np.radians(2.0), rel=0.1)
    assert np.corrcoef(damping, phase)[0, 1] == pytest.approx(0.95, abs=0.01)
    assert np.std([each.rotor.mass for each in draws]) > 0
