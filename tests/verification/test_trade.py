"""The trade: fronts and trade-off points by hand, moved mass against an independent solver, and the whole
document."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ringbalance.cli import main
from ringbalance.mesh.cut.tilted import tilted_liquid
from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.chamber.values import by_quadrature
from ringbalance.reduced_model.selection.range_flow import TABLES
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.reference.block_chambers import imported
from ringbalance.verification.selection_studies import study as trade_module
from ringbalance.verification.selection_studies.chambers import forget_solves
from ringbalance.verification.selection_studies.choice import choose
from ringbalance.verification.selection_studies.choices import judge, random_scene
from ringbalance.verification.selection_studies.hierarchy import ModelHierarchy, Values
from ringbalance.verification.selection_studies.laws import CLOSED, REGIMES, LawBook, LawModels, k_hierarchy
from ringbalance.verification.selection_studies.measure import (
    Clock,
    CostModel,
    committed_costs,
    knee,
    measure,
    pareto_front,
)
from ringbalance.verification.selection_studies.operation import (
    courses,
    moved_mass,
    settling_hierarchy,
)
from ringbalance.verification.selection_studies.study import (
    held_tolerance,
    thinned,
    trade_study,
)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))


def test_a_front_by_hand() -> None:
    costs, errors = [1.0, 2.0, 3.0, 4.0, 4.0], [1e-1, 2e-1, 1e-3, 1e-3, 1e-6]
    assert pareto_front(costs, errors) == [0, 2, 4]


def test_a_knee_by_hand() -> None:
    assert knee([1.0, 10.0, 1000.0], [1.0, 1e-5, 1e-6]) == 1
    assert knee([1.0, 100.0, 1000.0], [1.0, 0.9, 1e-6]) in (0, 2)
    assert knee([1.0, 2.0], [1.0, 0.1]) == 1
    assert knee([3.0, 1.0], [2.0, 1.0]) == 1


def test_a_measured_hierarchy_of_k(scene: Scene) -> None:
    hierarchy = k_hierarchy(scene)
    found = measure(hierarchy, values=Values(hierarchy), costs=choose_costs(), clock=Clock())
    errors = {m.fidelity.name: m.error for m in found.fidelities}
    top = tube_loss(scene, np.array([float(point.split()[0]) for point in hierarchy.points])).k.value
    assert errors["k = 50"] == pytest.approx(float(np.max(np.abs(51 / (top + 1) - 1))), rel=1e-2)
    assert errors["finite-element tables"] == 0.0
    assert all(m.seconds is not None and m.seconds > 0 and m.memory is not None for m in found.fidelities)
    assert min((m for m in found.fidelities if m.on_front), key=lambda m: m.cost).fidelity.name == "k = 50"


def choose_costs() -> CostModel:
    return committed_costs()


def test_the_moved_mass_against_an_independent_solver(scene: Scene) -> None:
    """Quadrature, explicit segments and inertia against scipy on the law's own velocity."""
    book = LawBook(scene)
    law = book.law(LawModels(level=CLOSED, loss=TABLES, regimes=REGIMES))
    times = {course.name: course for course in courses(scene)}
    rate, gas_time = law.tube_area / law.chamber_volume, 0.2

    def steady(_: float, x: np.ndarray) -> np.ndarray:
        flow = law.evaluate(
            fill_ratio=x, opposite_fill_ratio=0.5 - x, gas_pressure=scene.gas.pressure, primed=True
        )
        return np.asarray(-rate * flow.velocity)

    solved = solve_ivp(steady, (0.0, gas_time), [0.25], rtol=1e-10, atol=1e-13, method="LSODA")
    moved = (0.25 - solved.y[0, -1]) * law.density * law.chamber_volume
    found = moved_mass(scene, law=law, course=times["quadrature in time"], gas_time=gas_time)
    assert found == pytest.approx(moved, rel=1e-6)
    few = moved_mass(scene, law=law, course=times["4 explicit segments"], gas_time=gas_time)
    assert 1e-4 < abs(few / moved - 1) < 0.1
    slow = moved_mass(scene, law=law, course=times["with tube inertia"], gas_time=gas_time)
    start = math.log(2) * law.density * scene.tube.length * 17.0 / scene.gas.pressure
    assert 1 - slow / moved == pytest.approx(start / gas_time, rel=0.6)


def test_the_ways_through_an_operation_are_those_the_scene_gives_numbers_for(scene: Scene) -> None:
    assert courses(scene)[-1].modelled == ("tube inertia", "liquid held in the tube")
    gas = dataclasses.replace(
        scene.gas, conductance=1e-8, critical_ratio=0.3, dead_volume=1e-6, valve_lag=5e-3
    )
    richer = courses(dataclasses.replace(scene, gas=gas))
    assert richer[-1].modelled == (
        "tube inertia",
        "liquid held in the tube",
        "gas filling",
        "valve lag",
    )
    assert "gas filling" in richer[0].lacks
    assert LawBook(scene).models()[-1].regimes == REGIMES


def test_a_thinned_hierarchy_keeps_its_ends(scene: Scene) -> None:
    whole = k_hierarchy(scene)
    assert [fidelity.name for fidelity in thinned(whole).fidelities] == [
        fidelity.name for fidelity in whole.fidelities
    ]


def test_tolerances_of_a_scene_are_held_within_what_choices_are_made_for() -> None:
    assert held_tolerance(0.5) == 0.1
    assert held_tolerance(1e-9) == 1e-6
    assert held_tolerance(0.01) == 0.01


@pytest.mark.parametrize("number", [1, 4])
def test_random_scenes_get_choices_that_hold(scene: Scene, number: int) -> None:
    judged = judge(random_scene(scene, number), quantities=("wall_pressure", "moment", "k"))
    assert len(judged) >= 6
    assert all(j.held and j.said for j in judged)
    assert max(j.cost_ratio for j in judged) <= 2.0


def test_a_column_that_spills_is_not_taken_for_one_without_a_crest(scene: Scene) -> None:
    # Its flow leaves gas over the crest, which takes 13 % of the velocity; a primed column would lose none.
    judged = judge(random_scene(scene, 36), quantities=("velocity",), tolerances=(0.1, 0.01))
    assert len(judged) == 2
    assert all(j.held for j in judged)
    assert max(j.cost_ratio for j in judged) <= 2.0


def test_integrals_over_an_imported_chamber_are_made_again_to_be_timed(scene: Scene) -> None:
    disc = imported(scene.disc, cells=(1, 4, 1))
    by_quadrature(dataclasses.replace(scene, disc=disc), 0.25)
    assert tilted_liquid.cache_info().currsize > 0
    forget_solves()
    assert tilted_liquid.cache_info().currsize == 0


def test_a_random_scene_is_the_same_again(scene: Scene) -> None:
    assert random_scene(scene, 5) == random_scene(scene, 5)
    assert random_scene(scene, 5) != random_scene(scene, 6)


@pytest.fixture
def only_k(monkeypatch: pytest.MonkeyPatch) -> None:
    """One model hierarchy instead of all."""

    def hierarchies(scene: Scene, quantities: list[str]) -> tuple[ModelHierarchy, ...]:
        assert "k" in quantities
        return (k_hierarchy(scene),)

    monkeypatch.setattr(trade_module, "hierarchies_of", hierarchies)


@pytest.mark.usefixtures("only_k")
def test_the_document_is_whole_and_the_same_again_but_for_its_times(scene: Scene) -> None:
    first, again = (trade_study(scene, level="light").document() for _ in range(2))
    assert json.loads(json.dumps(first, allow_nan=False)) == first
    assert {key for key in first if first[key] != again[key]} <= {"times"}
    (found,) = first["quantities"]
    assert [c["tolerance"] for c in found["choices"]] == [0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.01]
    assert any("is below what" in text for text in found["choices"][-1]["reasons"])
    assert found["knee"] in {fidelity["name"] for fidelity in found["rungs"] if fidelity["on_front"]}
    assert first["times"]["counted_over_measured"]["median"] > 0


@pytest.mark.usefixtures("only_k")
def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, costs = str(bundled_scene("liquid_ring_paper")), tmp_path / "costs.json"
    assert main(["trade", path, "--json", "--out", str(tmp_path), "--save-costs", str(costs)]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "trade.json").read_text()) == printed
    assert json.loads(costs.read_text())["seconds"]["formula"] > 0
    assert main(["trade", path]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "trade-off point: fluids" in shown
    assert "0e+00 left out" not in shown
    assert "estimated contribution" in shown
    # A model that is its own reference was compared with nothing.
    assert "checked: 0.0e+00" not in shown


def test_a_scene_that_cannot_be_used_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = bundled_scene("liquid_ring_paper").read_text()
    slow = tmp_path / "slow.toml"
    slow.write_text(text.replace('speed = "10000 rpm"', 'speed = "60 rpm"'))
    assert main(["trade", str(slow)]) == 2
    assert "rotor" in capsys.readouterr().err
    for tolerance in ("0 %", "-1 %", "200 %"):
        wrong = tmp_path / "wrong.toml"
        wrong.write_text(text.replace('tolerance = "1 %"', f'tolerance = "{tolerance}"'))
        assert main(["trade", str(wrong)]) == 2
        assert "tolerance" in capsys.readouterr().err


@pytest.mark.heavy
def test_every_quantity_of_the_paper_disc_keeps_every_tolerance(scene: Scene) -> None:
    study = trade_study(scene, timed=False)
    assert {trade.hierarchy.quantity for trade in study.trades} == {
        "wall_pressure",
        "moment",
        "k",
        "velocity",
        "transferred_mass",
        "settling_time",
    }
    for trade in study.trades:
        errors = {m.fidelity.name: m.error for m in trade.fidelities}
        for choice in study.choices[trade.hierarchy.quantity]:
            assert errors[choice.fidelity.name] <= 1.002 * choice.tolerance
            enough = [m.cost for m in trade.fidelities if m.error <= choice.tolerance]
            assert choice.cost <= 2 * min(enough)


def test_the_choice_does_not_change_from_run_to_run(scene: Scene) -> None:
    hierarchy = k_hierarchy(scene)
    assert choose(hierarchy, 0.1).fidelity.name == choose(k_hierarchy(scene), 0.1).fidelity.name


def test_no_model_of_the_settling_time_is_ruled_out_by_an_estimate(scene: Scene) -> None:
    """Where no run settles the cheapest says so as well as any, and estimates cannot know."""
    hierarchy = settling_hierarchy(LawBook(scene))
    assert all(contribution.rough for contribution in hierarchy.contributions.values())
