"""What a report gets of a scene with eccentric masses."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from ringbalance.controller.eccentric_mass.study import EccentricStudy, eccentric_study
from ringbalance.scene import bundled_scene, eccentric_scene, load_scene
from ringbalance.verification.eccentric_mass.scenes import changed


@pytest.fixture(scope="module")
def study() -> EccentricStudy:
    return eccentric_study(eccentric_scene(load_scene(bundled_scene("eccentric_mass_paper"))))


def test_the_locked_run_is_what_balancing_is_judged_by(study: EccentricStudy) -> None:
    assert study.locked.outcome.value == "locked"
    assert study.locked.unbalanced_amplitude == study.run.unbalanced_amplitude
    assert study.locked.worst_amplitude > study.run.worst_amplitude
    assert json.loads(json.dumps(study.document(), allow_nan=False))["locked"]["settled"] is False


def test_the_moment_of_both_masses_side_by_side_is_the_capacity(study: EccentricStudy) -> None:
    masses = study.scene.masses
    side_by_side = math.cos(masses.arc_length / masses.guide_radius / 2)
    row = next(row for row in study.requirements if row.quantity == "balancing moment")
    assert row.achieved == pytest.approx(2 * masses.mass * masses.guide_radius * side_by_side)
    assert row.required == pytest.approx(study.scene.imbalance.mass * study.scene.imbalance.radius)


def test_a_requirement_that_is_missed_says_so(study: EccentricStudy) -> None:
    assert all(row.met for row in study.requirements)
    heavy = changed(study.scene, "imbalance", mass=3 * study.scene.imbalance.mass)
    missed = {row.quantity for row in eccentric_study(heavy).requirements if not row.met}
    assert {"balancing moment", "amplitude at the end", "settling time"} <= missed


def test_a_loop_at_its_gain_margin_is_at_the_edge(study: EccentricStudy) -> None:
    speed = study.gains.speed
    edge = changed(study.scene, "friction_filter", speed_gain=speed.value * speed.gain_margin * (1 + 1e-6))
    beyond = eccentric_study(replace(edge, run=replace(edge.run, time_limit=1.0)))
    assert not beyond.gains.speed.stable
    assert beyond.gains.speed.radius == pytest.approx(1.0, abs=1e-4)
    row = next(row for row in beyond.requirements if row.quantity == "gain margin of the speed control")
    assert not row.met
