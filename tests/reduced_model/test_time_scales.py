"""Each time scale against the differential equation that it comes from, solved by scipy."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

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
def teststart_up_loss_is_that_of_the_column(gas_time: float, power: int, laminar: float) -> None:
    lost = start_up_loss(start_up=3e-3, gas_time=gas_time, laminar=laminar)
    assert lost == pytest.approx(moved(gas_time, power=power), rel=1e-6)
    assert 0 < lost < 1


def test_a_long_injection_loses_tau_ln_2() -> None:
    tau, long = 3e-3, 30.0
    assert start_up_loss(start_up=tau, gas_time=long) * long == pytest.approx(tau * math.log(2), rel=1e-9)


def test_the_deciding_injection_is_the_one_at_the_limit(table_1_scene: Scene) -> None:
    """0.08 s/um times 0.05 um; the trial's short step; the limit over the rate."""
    control = table_1_scene.controller
    kinds: dict[Literal["target_vector", "law_based"], float] = {
        "target_vector": 4e-3,
        "law_based": 0.05 / 7.2,
    }
    for kind, expected in kinds.items():
        scene = with_tables(table_1_scene, controller={"kind": kind})
        assert deciding_gas_time(scene, rate=7.2e-6) == pytest.approx(expected)
    trial = with_tables(table_1_scene, controller={"kind": "trial"})
    assert deciding_gas_time(trial, rate=7.2e-6) == control.short_step
    slow = with_tables(table_1_scene, controller={"minimum_gas_time": 0.02})
    assert deciding_gas_time(slow, rate=0.0) == 0.02


def test_a_line_that_is_not_given_is_a_range_and_not_unknown(table_1_scene: Scene) -> None:
    """C of 0.2 to 1 l/(s bar) and 5 to 10 ms of lag are longer than an injection of 4 ms."""
    gas = dataclasses.replace(table_1_scene.gas, conductance=None, critical_ratio=None, valve_lag=None)
    scene = dataclasses.replace(table_1_scene, gas=gas)
    silent = _lines(scene)
    for found in silent.values():
        assert found.estimated_contribution is None
        assert "100 % over a default range" in found.why
    assert "5 to 10 ms" in silent[LAG].why
    own = dataclasses.replace(gas, conductance=1e-8, critical_ratio=0.3, valve_lag=1e-3)
    known = _lines(dataclasses.replace(table_1_scene, gas=own))[LAG]
    assert known.estimated_contribution == pytest.approx(0.25)
    assert "default range" not in known.why


def _lines(scene: Scene) -> dict[str, ModelUsed]:
    return {used.term: used for used in models_used(scene) if used.term in (FILLING, LAG)}
