"""Finite elements check the closed forms of a chamber, and a wrong closed form does not pass."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from ringbalance.physics.results import StatusCode
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.chamber.element_check import ElementCheck
from ringbalance.reduced_model.chamber.values import RingValues
from ringbalance.scene.loop_models import Shaft
from ringbalance.scene.models import Scene
from scenes import with_tables


def test_the_closed_forms_are_checked_at_both_ends_of_the_range(table_1_calibration: Calibration) -> None:
    chamber = table_1_calibration.chamber
    check = chamber.check
    np.testing.assert_allclose(check.elements.fill_ratio, [0.025, 0.5])
    assert check.status.ok
    assert check.excess == 0.0
    for name, difference in check.difference.items():
        assert np.all(np.abs(difference) <= check.allowed[name])
        assert np.all(np.abs(difference) > 0)  # solved, not copied


@pytest.mark.parametrize("quantity", ["wall_pressure", "moment", "moment_per_volume"])
def test_a_wrong_closed_form_is_noticed(table_1_scene: Scene, quantity: str) -> None:
    fills = np.linspace(0.0, table_1_scene.disc.max_fill_ratio, 11)
    values = RingValues.of(table_1_scene, fill_ratio=fills, gravity=False)
    right = getattr(values, quantity)
    wrong = dataclasses.replace(right, value=right.value * (1 + 1e-4))
    check = ElementCheck.of(
        table_1_scene, values=dataclasses.replace(values, **{quantity: wrong}), gravity=False
    )
    assert check.status.code is StatusCode.NOT_CONVERGED
    assert "accuracy.tolerance" in check.status.text
    assert check.excess == pytest.approx(1e-4, rel=0.2)


def test_a_tighter_tolerance_takes_a_finer_mesh(table_1_scene: Scene) -> None:
    fills = np.linspace(0.0, table_1_scene.disc.max_fill_ratio, 11)
    values = RingValues.of(table_1_scene, fill_ratio=fills, gravity=False)
    tight = ElementCheck.of(dataclasses.replace(table_1_scene, tolerance=1e-5), values=values, gravity=False)
    loose = ElementCheck.of(table_1_scene, values=values, gravity=False)
    assert tight.elements.cells[0] > loose.elements.cells[0]
    assert np.all(tight.allowed["wall_pressure"] < loose.allowed["wall_pressure"] / 20)


@pytest.mark.parametrize("shaft", ["horizontal", "vertical"])
def test_gravity_is_in_the_check_above_the_tolerance(table_1_scene: Scene, shaft: Shaft) -> None:
    slow = with_tables(table_1_scene, tolerance=1e-3, rotor={"speed": 60.0}, environment={"shaft": shaft})
    chamber = calibrate(slow).chamber
    assert chamber.check.gravity
    assert chamber.check.status.ok
    assert chamber.statistics.unknowns > 0
