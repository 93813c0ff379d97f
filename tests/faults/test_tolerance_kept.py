"""On random scenes the answer at a tolerance is within it of the finest models, or its status is not ok."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import Calibration, calibrate
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.selection.registry import models_used
from ringbalance.scene import Scene, bundled_scene, load_scene
from ringbalance.scene.narrowing import with_tolerance
from ringbalance.scene.tube_models import FINEST_MODELS
from ringbalance.verification.selection_studies.choices import random_scene

pytestmark = pytest.mark.faults

GRAVITY = "gravity, mean over a turn"
NUMBERS = (2, 3, 8, 12, 17, 23, 40, 46)
"""Fast and slow rotors, on horizontal and vertical shafts."""


def scene_at_the_edge(number: int) -> Scene:
    """Random scene whose tolerance is just above the estimate of gravity, where leaving it out costs most."""
    base = load_scene(bundled_scene("liquid_ring_paper"))
    assert isinstance(base, Scene)
    scene = random_scene(base, number)
    gravity = {used.term: used.estimated_contribution for used in models_used(scene)}[GRAVITY]
    assert gravity is not None
    return replace(scene, tolerance=min(max(1.2 * gravity, 1e-6), 0.1))


TUBE_TOLERANCES = (0.2, 0.1, 0.01, 0.001)
LAMINAR = 51
"""Without a crest, laminar: a change of k moves the velocity by as much, and that k again."""


@pytest.mark.parametrize("number", [*NUMBERS, LAMINAR])
def test_the_tube_keeps_the_tolerance_at_every_fill_and_pressure(number: int) -> None:
    """Without gravity, which is another choice: k, and the velocity wherever the regime can be told."""
    base = load_scene(bundled_scene("liquid_ring_paper"))
    assert isinstance(base, Scene)
    drawn = random_scene(base, number)
    scene = replace(drawn, environment=replace(drawn.environment, gravity=0.0))
    finest = calibrate(with_tolerance(scene, models="finest"))
    assert finest.scene.tube.models == FINEST_MODELS
    simpler = 0
    for tolerance in TUBE_TOLERANCES:
        selected = calibrate(replace(scene, tolerance=tolerance))
        simpler += selected.scene.tube.models != FINEST_MODELS
        for name in ("k", "velocity"):
            value, expected = answers(selected)[name], answers(finest)[name]
            assert abs(value - expected) <= tolerance * abs(expected), name
        fills = scene.disc.max_fill_ratio * np.linspace(0.15, 0.85, 8)
        for pressure in scene.gas.pressure * np.array([0.75, 1.0, 1.5]):
            one, other = (
                made.flow_law.evaluate(fill_ratio=fills, gas_pressure=pressure) for made in (selected, finest)
            )
            told = (one.regime != Regime.UNDECIDED) & (other.regime != Regime.UNDECIDED)
            difference = np.abs(one.velocity - other.velocity)
            assert np.all(one.regime[told] == other.regime[told])
            assert np.all(difference[told] <= tolerance * np.abs(other.velocity[told]))
            assert np.all(difference <= one.uncertainty + other.uncertainty)
    assert simpler


def answers(calibration: Calibration) -> dict[str, float]:
    """What a user asks for, each at the operating point or, of a chamber, at the largest fill."""
    chamber, point = calibration.chamber, calibration.operating_point
    largest = chamber.reported[-1]
    return {
        "lambda": float(chamber.moment_per_mass.value),
        "wall pressure": float(chamber.wall_pressure.value[largest]),
        "moment": float(chamber.moment.value[largest]),
        "k": point.k or 0.0,
        "velocity": point.velocity,
    }


@pytest.mark.parametrize("number", NUMBERS)
def test_the_answer_keeps_the_tolerance_or_reports_a_status(number: int) -> None:
    scene = scene_at_the_edge(number)
    selected, finest = calibrate(scene), calibrate(with_tolerance(scene, models="finest"))
    assert finest.chamber.gravity_modelled
    status = selected.chamber.status
    if not status.ok:
        assert status.text
        return
    expected = answers(finest)
    for name, value in answers(selected).items():
        assert abs(value - expected[name]) <= scene.tolerance * abs(expected[name]), name
    for name in ("wall_pressure", "moment"):
        one, other = getattr(selected.chamber, name), getattr(finest.chamber, name)
        ends = [chamber.reported[-1] for chamber in (selected.chamber, finest.chamber)]
        difference = abs(one.value[ends[0]] - other.value[ends[1]])
        assert difference <= one.uncertainty[ends[0]] + other.uncertainty[ends[1]]
    assert np.all(selected.chamber.wall_pressure.unmodelled[1:] > 0)
