"""Limits of many plants in compiled code against those of one law in numpy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.injection.dynamics import PLANT, Dynamics
from ringbalance.reduced_model.injection.limits import residual_fills, stalled_fills
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio, stalled_fill_ratio
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.scene.designs import Designs
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Bend, Scene
from scenes import with_tables

# Blocked, stalls, draws gas first, draws gas at many fills.
PRESSURES = 0.1e6, 0.45e6, 0.7e6, 2e6


def test_limits_of_plants_are_those_of_their_law(paper_scene: Scene) -> None:
    model, total = calibrate(paper_scene).model, 2 * paper_scene.disc.initial_fill
    scenes = [with_tables(paper_scene, gas={"pressure": p}) for p in PRESSURES]
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


def test_bends_that_are_nearly_the_whole_tube_are_refused_by_their_key(paper_scene: Scene) -> None:
    """Rotation is spread along the path, a bend's friction is not: a leg without arcs loses less at the
    transition, and no velocity would belong to a head."""
    d = 0.3114e-3
    bends = [
        Bend(angle=math.radians(a), radius=r * d) for a, r in ((31, 0.5), (123, 22), (162, 1), (166, 650))
    ]
    tube = replace(
        paper_scene.tube,
        bore=d,
        bends=tuple(bends),
        length=2147 * d,
        port_radius=0.13,
        hump_radius=0.1,
        hump_position=0.25,
        hump_shape="point",
        roughness=0.0,
    )
    scene = with_tables(
        paper_scene, tube=tube, liquid={"kinematic_viscosity": 31e-6}, rotor={"speed": 1446.0}
    )
    varied = with_tables(scene, rotor={"speed": 1440.0})
    for heads in (lambda: TubeHeads.of(scene), lambda: TubeHeads.nominal(Designs.stacked([scene, varied]))):
        with pytest.raises(SceneError, match=r"\[tube\] bends: .* does not grow with the velocity"):
            heads()
