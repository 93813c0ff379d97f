"""Limits of many plants in compiled code against those of one law in numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.injection.dynamics import PLANT, Dynamics
from ringbalance.reduced_model.injection.limits import residual_fills, stalled_fills
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio, stalled_fill_ratio
from ringbalance.scene.designs import Designs
from ringbalance.scene.models import Scene

# Blocked, stalls, draws gas first, draws gas at many fills.
PRESSURES = 0.1e6, 0.45e6, 0.7e6, 2e6


def test_limits_of_plants_are_those_of_their_law(paper_scene: Scene) -> None:
    model, total = calibrate(paper_scene).model, 2 * paper_scene.disc.initial_fill
    scenes = [replace(paper_scene, gas=replace(paper_scene.gas, pressure=p)) for p in PRESSURES]
    plants = np.zeros(len(scenes), dtype=PLANT)
    for place, scene in enumerate(scenes):
        Dynamics.of(scene, model).fill(plants[place : place + 1], total=total)
    stalled = np.zeros(len(scenes))
    stalled_fills(plants, stalled)
    expected = [
        stalled_fill_ratio(law=model.flow, total=total, gas_pressure=pressure) for pressure in PRESSURES
    ]
    assert stalled == pytest.approx(expected, abs=1e-7)
    assert stalled[0] == total / 2
    drawn = [residual_fill_ratio(scene, law=model.flow) for scene in scenes]
    assert residual_fills(plants, Designs.stacked(scenes)) == pytest.approx(drawn, abs=1e-9)
