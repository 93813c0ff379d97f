"""Eq. 19 behind the common interface."""

from __future__ import annotations

import numpy as np
import pytest

from ringbalance.reduced_model import paper
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.paper_law import paper_law, paper_model
from ringbalance.scene.models import Scene
from scenes import with_tables


def test_law_is_eq_19(table_1_scene: Scene) -> None:
    x = np.linspace(0, 0.5, 11)
    flow = paper_law(table_1_scene).evaluate(fill_ratio=x, gas_pressure=0.7e6)
    disc, square = table_1_scene.disc, table_1_scene.rotor.speed**2
    moved = paper.chamber_volume_paper(disc=disc) * (2 * x - 0.5)
    level = 1000.0 * square * moved / (disc.axial_width * disc.central_angle)
    expected = np.sqrt(2 / (1000.0 * 51) * (0.7e6 + level))
    np.testing.assert_allclose(flow.velocity, expected, rtol=1e-14)
    assert np.all(flow.regime == Regime.SIPHON)
    # By hand at x = 0.25, where the levels agree: sqrt(2 * 700/51) m/s.
    assert flow.velocity[5] == pytest.approx((2 * 700 / 51) ** 0.5, rel=1e-12)


def test_law_is_blocked_below_stall_and_with_the_gas_off(table_1_scene: Scene) -> None:
    law = paper_law(table_1_scene)
    stall = float(
        paper.stall_pressure(disc=table_1_scene.disc, density=1e3, angular_velocity=table_1_scene.rotor.speed)
    )
    flow = law.evaluate(
        fill_ratio=[0.0, 0.0, 0.5], gas_pressure=[stall * (1 - 1e-9), stall * (1 + 1e-9), 0.0]
    )
    assert list(flow.regime) == [Regime.BLOCKED, Regime.SIPHON, Regime.BLOCKED]
    assert flow.velocity[0] == flow.velocity[2] == 0.0
    assert 0 < flow.velocity[1] < 1e-3


def test_answers_have_the_shape_of_all_arguments_together(table_1_scene: Scene) -> None:
    """Of `primed`, too, on which this law does not depend."""
    flow = paper_law(table_1_scene).evaluate(fill_ratio=0.2, gas_pressure=0.7e6, primed=[False, True])
    assert {np.shape(values) for values in vars(flow).values()} == {(2,)}


def test_table_reproduces_the_law(table_1_scene: Scene) -> None:
    table = paper_law(table_1_scene).table()
    level = table["pressure_per_fill_difference"] * (0.3 - 0.1)
    squared = float((table["velocity_squared_per_pressure"] * (0.9e6 + level))[0])
    flow = paper_law(table_1_scene).evaluate(fill_ratio=0.3, opposite_fill_ratio=0.1, gas_pressure=0.9e6)
    assert float(flow.velocity) == pytest.approx(squared**0.5, rel=1e-15)


def test_scene_fixes_prescribed_k(table_1_scene: Scene) -> None:
    assert paper_law(with_tables(table_1_scene, tube={"drag_coefficient": 20.0})).drag_coefficient == 20.0


@pytest.mark.parametrize(
    "arguments",
    [
        {"fill_ratio": 0.51, "gas_pressure": 1e5},
        {"fill_ratio": -0.01, "gas_pressure": 1e5},
        {"fill_ratio": np.nan, "gas_pressure": 1e5},
        {"fill_ratio": 0.2, "opposite_fill_ratio": 0.6, "gas_pressure": 1e5},
        {"fill_ratio": 0.2, "gas_pressure": np.nan},
        {"fill_ratio": 0.2, "gas_pressure": -2e5},
    ],
)
def test_law_refuses_what_cannot_be(table_1_scene: Scene, arguments: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"fill_ratio|gas_pressure"):
        paper_law(table_1_scene).evaluate(**arguments)


def test_model_moves_72_mm_per_transferred_mass(table_1_scene: Scene) -> None:
    model = paper_model(table_1_scene)
    transferred = 0.1 * model.chamber_volume * model.density
    moment = model.moment.pair_moment(fill_ratio=0.35, opposite_fill_ratio=0.15)
    assert float(moment) == pytest.approx(72e-3 * transferred, rel=1e-14)
    swapped = model.moment.pair_moment(fill_ratio=0.15, opposite_fill_ratio=0.35)
    assert float(swapped) == -float(moment)
