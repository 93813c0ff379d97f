"""calibrate, simulate, trade and report give every estimate alike: value, decision and text."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import Any

import pytest

from ringbalance.controller import outcome
from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.compare import compare
from ringbalance.controller.document import simulation_document
from ringbalance.controller.loop import simulate
from ringbalance.controller.terms import run_models
from ringbalance.reduced_model.calibration import Calibration, calibrate
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.selection.registry import models_used
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.selection_studies.chambers import chamber_hierarchies
from ringbalance.verification.selection_studies.choices import random_scene
from ringbalance.verification.selection_studies.study import hierarchies_of, terms_document

BUNDLED = ("liquid_ring_paper", "perfluorinated_oil", "silicone_oil_100cst", "six_chamber")
RANDOM = (1, 2, 3, 5, 8, 13, 14, 17, 30, 35)
LINE = {"conductance": 1e-7, "critical_ratio": 0.3, "dead_volume": 5e-6, "valve_lag": 2e-5}
IN_TIME = ("tube inertia", "gas filling", "valve lag", "liquid held in the tube")

Rows = Mapping[str, Mapping[str, Any]]


@pytest.fixture(autouse=True)
def no_remedies(monkeypatch: pytest.MonkeyPatch) -> None:
    """What mends a run that ends at its time limit is no estimate, and takes longer than so short a run."""
    monkeypatch.setattr(outcome, "standing_remedy", lambda *_: "")


def short(scene: Scene) -> Scene:
    """The scene with a run of a few samples, a gas line and a valve's lag: what is estimated stays."""
    run = replace(scene.run, time_limit=0.5 * scene.controller.period)
    return replace(scene, run=run, gas=replace(scene.gas, **LINE))  # type: ignore[arg-type]


def by_term(rows: list[dict[str, Any]]) -> Rows:
    return {row["term"]: row for row in rows}


def check(scene: Scene, calibration: Calibration) -> None:
    """Compare the commands on one scene; the calibration may be that of another tolerance."""
    expected = [asdict(used) for used in models_used(scene)]
    run = simulation_document(simulate(scene, calibration.model))
    assert run["models_used"] == expected
    traded = by_term(terms_document(scene))
    assert [*traded] == [row["term"] for row in expected]
    for row in expected:
        other = traded[row["term"]]
        assert other["estimated_contribution"] == row["estimated_contribution"]
        assert row["why"].startswith(other["why"])
        assert other["above"] == (f"is above the tolerance of {tolerance(scene)}" in row["why"])
    modelled = {term for term in IN_TIME if traded[term]["above"]}
    assert modelled == set(run["terms_modelled"])


def check_comparison(scene: Scene, calibration: Calibration) -> None:
    """`compare` reports for the scene whose rotor it takes what holds for it as tuned."""
    ring = balancer_of(scene, flow_law=calibration.flow_law)
    comparison = compare(ring, ring, runs=1)
    tuned = comparison.sides[0].scene
    assert isinstance(tuned, Scene)
    assert comparison.document()["models_used"][0] == [asdict(used) for used in models_used(tuned)]


def tolerance(scene: Scene) -> str:
    return f"{100 * scene.tolerance:.2g} %"


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_scenes_agree_at_every_tolerance(name: str) -> None:
    scene = short(liquid_ring_scene(load_scene(bundled_scene(name))))
    calibration = calibrate(scene)
    assert calibration.models_used == models_used(scene)
    check_comparison(scene, calibration)
    # 0.3 % lies between what calibrate (0.38 %) and simulate (0.26 %) once had for the inertia.
    for bound in (0.01, 0.003):
        check(replace(scene, tolerance=bound), calibration)


@pytest.mark.parametrize("number", RANDOM)
def test_random_scenes_agree(paper_scene: Scene, number: int) -> None:
    """The second tolerance lies just below the estimate of the inertia, where a decision changes first."""
    scene = short(random_scene(paper_scene, number))
    calibration = calibrate(scene)
    assert calibration.models_used == models_used(scene)
    check(scene, calibration)
    inertia = by_term(terms_document(scene))["tube inertia"]["estimated_contribution"]
    if inertia is not None:
        near = replace(scene, tolerance=(1 - 1e-9) * inertia)
        used = {row.term: row for row in run_models(scene=near, model=calibration.model)}
        assert used["tube inertia"].modelled
        assert by_term(terms_document(near))["tube inertia"]["above"]


@pytest.mark.parametrize(
    "change",
    [
        lambda s: replace(s, rotor=replace(s.rotor, speed=3000 * math.pi / 30)),
        lambda s: replace(s, rotor=replace(s.rotor, speed=600 * math.pi / 30)),
        lambda s: s,
    ],
)
def test_the_trades_own_contributions_are_the_same(
    paper_scene: Scene, change: Callable[[Scene], Scene]
) -> None:
    scene = change(paper_scene)
    found = {row["term"]: row["estimated_contribution"] for row in terms_document(scene)}
    quantities = ("wall_pressure", "k", "transferred_mass")
    hierarchies = {hierarchy.quantity: hierarchy for hierarchy in hierarchies_of(scene, quantities)}
    pressure, mass = hierarchies["wall_pressure"].contributions, hierarchies["transferred_mass"].contributions
    waves = pressure["gravity, ripple at 1x"].value, pressure["sloshing at 1x"].value
    assert found["gravity ripple at 1x and sloshing"] == sum(value or 0.0 for value in waves)
    assert found["plates between the chambers"] == pressure["plates between the chambers"].value
    loss = hierarchies["k"].contributions
    assert found["friction by rotation"] == loss["friction by rotation"].value
    assert found["loss of the tube"] == loss["loss of the tube"].value
    assert {term: found[term] for term in IN_TIME} == {term: mass[term].value for term in IN_TIME}


def test_sloshing_is_judged_at_the_worst_fill(paper_scene: Scene) -> None:
    """At 3000 rpm the wall pressure without sloshing is off by 2.3 % at the largest fill."""
    scene = replace(paper_scene, rotor=replace(paper_scene.rotor, speed=3000 * math.pi / 30))
    found = by_term(calibration_document(calibrate(scene))["models_used"])[
        "gravity ripple at 1x and sloshing"
    ]
    assert found["estimated_contribution"] > 0.023
    assert found["model"].startswith("apart")


@pytest.mark.parametrize(("rpm", "code"), [(600, "out_of_range"), (1000, "out_of_range"), (10_000, "ok")])
def test_calibrate_inherits_the_status_of_the_waves(paper_scene: Scene, rpm: float, code: str) -> None:
    scene = replace(paper_scene, rotor=replace(paper_scene.rotor, speed=rpm * math.pi / 30))
    status, traded = calibration_document(calibrate(scene))["status"], chamber_hierarchies(scene)[0].status
    assert status["code"] == code == str(traded.code)
    assert status["text"] == traded.text or code == "ok"
