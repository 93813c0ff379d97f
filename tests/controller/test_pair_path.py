"""Tabulated flows of a pair, interpreted and compiled, against an adaptive Runge-Kutta method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.ensemble.transfer import PairTransfer, gas_off, gas_on
from ringbalance.controller.liquid_ring.integrators import quadrature
from ringbalance.controller.liquid_ring.pair_path import FlowPaths
from ringbalance.controller.liquid_ring.transfer import Drive
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.models import Scene
from ringbalance.verification.reference.transfers import adaptive_ode

ODE = adaptive_ode(tolerance=1e-13)


def worst_error(model: BalancerModel, *, pressure: float, total: float = 0.5, tries: int = 30) -> float:
    """Largest error in fill; a column that holds in one way and not in the other is an error of 1."""
    shared = PairTransfer.of(model=model, total=total, gas_pressure=pressure).shared[0]
    random, worst = np.random.default_rng(3), 0.0
    for _ in range(tries):
        on, wet = random.random() < 0.6, random.random() < 0.5
        drive = Drive(
            law=model.flow,
            fill=random.uniform(max(0.0, total - 0.5), min(total, 0.5)),
            total=total,
            exchange_rate=model.tube_area / model.chamber_volume,
            gas_pressure=pressure if on else 0.0,
            primed=wet or not on,
        )
        time = 10 ** random.uniform(-3, 1)
        exact = float(ODE(drive, np.array([time])).fill[-1])
        plain = quadrature(drive, np.array([time]))
        if on:
            fill, column = gas_on(shared, drive.fill, wet, time)
        else:
            fill, column = gas_off(shared, drive.fill, True, time)
        worst = max(
            worst, abs(fill - exact), abs(float(plain.fill[-1]) - exact), float(column != plain.primed)
        )
    return worst


@pytest.mark.parametrize("total", [0.5, 0.35, 0.7])
@pytest.mark.parametrize("name", ["constant", "square_root", "proportional", "two_regimes", "levelling"])
def test_every_flow_of_a_small_law_is_right(
    model: BalancerModel, laws: Mapping[str, Any], name: str, total: float
) -> None:
    assert worst_error(replace(model, flow=laws[name]), pressure=1e5, total=total) < 2e-11


@pytest.fixture(scope="module")
def slow(paper_scene: Scene) -> BalancerModel:
    """A disc so slow that its tube holds a column with the gas off."""
    rotor = replace(paper_scene.rotor, speed=0.12 * paper_scene.rotor.speed)
    tube = replace(paper_scene.tube, hump_radius=0.040)
    return calibrate(replace(paper_scene, rotor=rotor, tube=tube)).model


@pytest.mark.parametrize("pressure", [2e3, 8e3, 5e4])
def test_every_flow_of_a_calibrated_law_is_right(slow: BalancerModel, pressure: float) -> None:
    # Eight flows have gas on and off, the tube wet and dry; twice as many notice the same defects.
    assert worst_error(slow, pressure=pressure, tries=8) < 2e-11


def test_that_disc_does_run_back(slow: BalancerModel) -> None:
    drive = Drive(law=slow.flow, fill=0.2, total=0.5, exchange_rate=0.02, gas_pressure=0.0, primed=True)
    assert set(FlowPaths.of(drive, primed=True).sense) >= {-1, 1}


def test_changes_are_found_to_the_last_bit(laws: Mapping[str, Any]) -> None:
    def steps(x: Any, *_: Any) -> tuple[Any, Any]:
        return np.where(x >= 0.1, 5.0, 0.0), np.where(x < 0.1001, Regime.SEPARATED, Regime.SIPHON)

    law = replace(laws["constant"], function=steps)
    drive = Drive(law=law, fill=0.2, total=0.5, exchange_rate=0.02, gas_pressure=1e5, primed=True)
    found = FlowPaths.of(drive, primed=True)
    # The second change lies in the same cell of the scan as the first.
    assert list(found.sense) == [0, 1, 1]
    assert list(found.edges) == [0.1, 0.1001]
    # One path: from full to the last number that does not flow.
    assert list(found.path) == [-1, 0, 0]
    assert found.nodes[1, 0] == 0.5
    assert found.nodes[1, -1] == np.nextafter(0.1, 0.0)
    assert found.nodes[0, -1] == pytest.approx(0.4 / (5.0 * 0.02), rel=1e-13)
