"""calibrate, simulate and compare give every estimate alike: value, model and text."""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import pytest

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.compare import compare
from ringbalance.controller.document import simulation_document
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.terms import IN_INJECTIONS, models_used
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from scenes import with_tables

BUNDLED = ("liquid_ring_paper", "perfluorinated_oil", "silicone_oil_100cst", "six_chamber")
LINE = {"conductance": 1e-7, "critical_ratio": 0.3, "dead_volume": 5e-6, "valve_lag": 2e-5}


def short(scene: Scene) -> Scene:
    """The scene with a run of a few samples, a gas line and a valve's lag: what is estimated stays."""
    run = replace(scene.run, time_limit=0.5 * scene.controller.period)
    return with_tables(scene, run=run, gas=LINE)


def check(scene: Scene, calibration: Calibration) -> None:
    """Compare the commands on one scene; the calibration may be that of another tolerance."""
    expected = [asdict(used) for used in models_used(scene)]
    run = simulation_document(simulate(scene, calibration.model))
    assert run["models_used"] == expected
    modelled = {row["term"] for row in expected if row["estimated_contribution"]} & set(IN_INJECTIONS)
    assert modelled == set(run["terms_modelled"])


def check_comparison(scene: Scene, calibration: Calibration) -> None:
    """`compare` reports for the scene whose rotor it takes what holds for it as tuned."""
    ring = balancer_of(scene, flow_law=calibration.flow_law)
    comparison = compare(ring, ring, most=1)
    tuned = comparison.sides[0].scene
    assert isinstance(tuned, Scene)
    assert comparison.to_dict()["models_used"][0] == [asdict(used) for used in models_used(tuned)]


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_scenes_agree_at_every_tolerance(name: str) -> None:
    scene = short(liquid_ring_scene(load_scene(bundled_scene(name))))
    calibration = calibrate(scene)
    assert calibration.models_used == models_used(scene)
    check_comparison(scene, calibration)
    check(replace(scene, tolerance=0.003), calibration)


def test_sloshing_is_judged_at_the_worst_fill(paper_scene: Scene) -> None:
    """At 3000 rpm the wall pressure without sloshing is off by 2.3 % at the largest fill."""
    scene = with_tables(paper_scene, rotor={"speed": 3000 * math.pi / 30})
    rows = {row["term"]: row for row in calibration_document(calibrate(scene))["models_used"]}
    row = rows["gravity ripple at 1x and sloshing"]
    assert row["estimated_contribution"] > 0.023
    assert row["model"].startswith("apart")


@pytest.mark.parametrize(("rpm", "code"), [(600, "no_ring"), (2000, "out_of_range"), (10_000, "ok")])
def test_calibrate_inherits_the_status_of_the_waves(paper_scene: Scene, rpm: float, code: str) -> None:
    scene = with_tables(paper_scene, rotor={"speed": rpm * math.pi / 30})
    assert calibration_document(calibrate(scene))["status"]["code"] == code
