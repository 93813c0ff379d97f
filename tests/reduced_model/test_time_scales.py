"""Each time scale against the differential equation that it comes from, solved by scipy."""

from __future__ import annotations

import math
from typing import Any

import pytest
from scipy.integrate import solve_ivp

from ringbalance.reduced_model.estimates import deciding_gas_time, start_up_loss
from ringbalance.reduced_model.terms import FILLING, LAG, ModelUsed, models_used
from ringbalance.scene.models import Scene
from scenes import with_tables


def moved(gas_time: float, *, power: int) -> float:
    """Fraction of u0 T that a column loses whose drag grows with a power of the velocity, tau = 3 ms."""
    tau = 3e-3
    path = solve_ivp(
        lambda _, y: [(1 - y[0] ** power) / tau, y[0]], (0, gas_time), [0.0, 0.0], rtol=1e-10, atol=1e-12
    )
    return 1 - float(path.y[1, -1]) / gas_time


@pytest.mark.parametrize("gas_time", [1e-4, 2e-3, 4e-3, 0.8])
@pytest.mark.parametrize(("power", "laminar"), [(2, 0.0), (1, 1.0)])
def test_start_up_loss_is_that_of_the_column(gas_time: float, power: int, laminar: float) -> None:
    lost = start_up_loss(start_up=3e-3, gas_time=gas_time, laminar=laminar)
    assert lost == pytest.approx(moved(gas_time, power=power), rel=1e-6)
    assert 0 < lost < 1


def test_a_long_injection_loses_tau_ln_2() -> None:
    tau, long = 3e-3, 30.0
    assert start_up_loss(start_up=tau, gas_time=long) * long == pytest.approx(tau * math.log(2), rel=1e-9)


@pytest.mark.parametrize(
    ("controller", "rate", "expected"),
    [
        ({"kind": "target_vector"}, 7.2e-6, 4e-3),  # 0.08 s/um times 0.05 um
        ({"kind": "law_based"}, 7.2e-6, 0.05 / 7.2),  # the limit over the rate
        ({"kind": "trial"}, 7.2e-6, 0.05),  # the short step
        ({"minimum_gas_time": 0.02}, 0.0, 0.02),
    ],
)
def test_the_deciding_injection_is_the_one_at_the_limit(
    table_1_scene: Scene, controller: dict[str, Any], rate: float, expected: float
) -> None:
    scene = with_tables(table_1_scene, controller=controller)
    assert deciding_gas_time(scene, rate=rate) == pytest.approx(expected)


def test_a_line_that_is_not_given_is_a_range_and_not_unknown(table_1_scene: Scene) -> None:
    """C of 0.2 to 1 l/(s bar) and 5 to 10 ms of lag are longer than an injection of 4 ms."""
    silent = _lines(table_1_scene, conductance=None, critical_ratio=None, valve_lag=None)
    for used in silent.values():
        assert used.estimated_contribution is None
        assert "100 % over a default range" in used.why
    assert "5 to 10 ms" in silent[LAG].why
    lag = _lines(table_1_scene, conductance=1e-8, critical_ratio=0.3, valve_lag=1e-3)[LAG]
    assert lag.estimated_contribution == pytest.approx(0.25)
    assert "default range" not in lag.why


def _lines(scene: Scene, **gas: float | None) -> dict[str, ModelUsed]:
    used = models_used(with_tables(scene, gas=gas))
    return {each.term: each for each in used if each.term in (FILLING, LAG)}
