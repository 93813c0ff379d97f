"""Margins by hand and by simulation, and the record of what a wrong k does."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.algorithms.by_name import target_vector_of
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Outcome
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_model
from ringbalance.reports.pages.consequences import Consequences, LoopGain, find_consequences, loop_gain
from ringbalance.scene.models import Scene

TRUE_K = 3.5


@pytest.fixture(scope="module")
def noisy(scene: Scene) -> Scene:
    sensor = replace(scene.sensor, amplitude_noise=1e-8, phase_noise=0.01)
    return replace(scene, sensor=sensor, run=replace(scene.run, time_limit=15.0))


@pytest.fixture(scope="module")
def true_model(scene: Scene) -> BalancerModel:
    """The same disc with a k that is not 50: known in closed form, so that all can be checked by hand."""
    fast = paper_model(replace(scene, tube=replace(scene.tube, drag_coefficient=TRUE_K)))
    return replace(fast, name="calibrated")


@pytest.fixture(scope="module")
def found(noisy: Scene, true_model: BalancerModel) -> Consequences:
    return find_consequences(noisy, true_model, paper=paper_model(noisy), members=500)


def gain_of(scene: Scene, model: BalancerModel) -> LoopGain:
    gain = loop_gain(scene, model)
    assert gain is not None
    return gain


def small(scene: Scene, *, lag_error: float = 0.0, **controller: Any) -> Scene:
    """An unbalance of 10 nm along chamber A, an exact sensor and the proportional part alone."""
    settings = replace(
        scene.controller,
        integral_time=None,
        derivative_time=0.0,
        minimum_gas_time=0.0,
        limit=1e-12,
        assumed_lag_angle=scene.rotor.lag_angle + lag_error,
        **controller,
    )
    rotor = replace(scene.rotor, initial_amplitude=1e-8, initial_phase=-scene.rotor.lag_angle)
    return replace(scene, rotor=rotor, controller=settings)


# --- margins ---


def test_the_gain_per_operation_by_hand(scene: Scene, model: BalancerModel) -> None:
    gain = gain_of(scene, model)
    u = math.sqrt(2 * 0.7e6 / (1000 * 51))
    area = math.pi / 4 * 1.5e-3**2
    by_hand = scene.rotor.influence_coefficient * 0.072 * 1000 * area * u
    assert gain.velocity == pytest.approx(u)
    assert gain.drag_coefficient == pytest.approx(50)
    assert gain.moment_per_transferred_mass == pytest.approx(0.072)
    assert gain.slope == pytest.approx(by_hand)
    assert gain.per_operation == pytest.approx(scene.controller.proportional * by_hand)


@pytest.mark.parametrize("h", [0.5, 0.9, 1.4])
def test_an_operation_leaves_one_minus_h(scene: Scene, model: BalancerModel, h: float) -> None:
    slope = gain_of(scene, model).slope
    run = simulate(small(scene, proportional=h / slope), model)
    seen = [s.measurement.amplitude for s in run.samples if s.measurement is not None]
    assert seen[1] / seen[0] == pytest.approx(abs(1 - h), abs=1e-3)
    assert (run.overshoots > 0) == (h > 1)


def test_margins_follow_the_drag_coefficient(scene: Scene, model: BalancerModel) -> None:
    gain = gain_of(scene, model)
    curve = gain.over_drag
    assert curve.overshoot_gain == pytest.approx(np.sqrt((curve.values + 1) / 51) / gain.slope)
    assert gain.instability_gain == pytest.approx(2 / gain.slope)


def test_a_law_that_is_tabled_has_its_margins_as_well(
    scene: Scene, model: BalancerModel, laws: Mapping[str, Any]
) -> None:
    gain = gain_of(scene, replace(model, flow=laws["constant"]))
    assert gain.velocity == 5.0
    assert gain.over_drag.overshoot_gain[10] == pytest.approx(1 / gain.slope)


@pytest.mark.parametrize(("share", "diverges"), [(0.97, False), (1.03, True)])
def test_the_lag_margin_is_where_the_loop_turns_over(
    scene: Scene, model: BalancerModel, share: float, diverges: bool
) -> None:
    gain = gain_of(scene, model)
    assert gain.lag_margin == pytest.approx(math.acos(gain.per_operation / 2))
    asked = small(scene, lag_error=share * gain.lag_margin)
    assert (simulate(asked, model).outcome is Outcome.DIVERGING) == diverges


def test_no_flow_no_gain(scene: Scene, model: BalancerModel) -> None:
    weak = replace(scene, gas=replace(scene.gas, pressure=0.0), run=replace(scene.run, time_limit=5.0))
    assert loop_gain(weak, model) is None
    record = find_consequences(weak, replace(model, name="calibrated"), paper=model, members=20)
    assert record.gains == ()
    assert record.retuned_proportional is None
    assert sum("drives no flow" in note for note in record.notes) == 2
    json.dumps(record.document(), allow_nan=False)


def test_what_the_loop_rests_on_and_nobody_gave_is_named(scene: Scene, model: BalancerModel) -> None:
    given = ("tube.length", "tube.hump_radius", "rotor.influence_coefficient")
    mixed: tuple[tuple[str, Any], ...] = (("tube.bore", "assumed"), *((path, "given") for path in given))
    for origins, told in ((mixed, ["tube.bore (assumed)"]), ((), [])):
        asked = replace(scene, origins=origins, run=replace(scene.run, time_limit=1.0))
        notes = find_consequences(asked, replace(model, name="calibrated"), paper=model, members=20).notes
        named = [note for note in notes if "nobody gave" in note]
        assert len(named) == len(told)
        assert all(path in note for path, note in zip(told, named, strict=True))


def test_any_law_has_its_gain_and_its_runs(
    noisy: Scene, model: BalancerModel, laws: Mapping[str, Any]
) -> None:
    strange = replace(model, name="restless", flow=laws["restless"])
    record = find_consequences(noisy, strange, paper=model, members=20)
    assert [gain.law for gain in record.gains] == ["paper", "restless"]
    assert {run.name for run in record.runs} >= {"paper", "calibrated", "law_based"}


# --- the record ---


def test_the_same_controller_meets_both_laws(
    found: Consequences, noisy: Scene, true_model: BalancerModel
) -> None:
    runs = {run.name: run for run in found.runs}
    alone = simulate(noisy, true_model, controller=target_vector_of(noisy))
    assert np.array_equal(runs["calibrated"].simulation.amplitude, alone.amplitude)
    assert runs["calibrated"].proportional == runs["paper"].proportional == noisy.controller.proportional
    assert runs["paper"].simulation.overshoots == 0
    assert runs["calibrated"].simulation.overshoots > 5
    assert runs["law_based"].simulation.settling_time is not None
    assert runs["paper"].simulation.settling_time is not None
    assert runs["law_based"].simulation.settling_time < runs["paper"].simulation.settling_time


def test_the_retuned_gain_is_the_recommended_one(
    found: Consequences, noisy: Scene, true_model: BalancerModel
) -> None:
    # Within the uncertainty of 5 % of the influence coefficient no injection passes the whole residual.
    nominal, true = found.gains
    assert found.retuned_proportional is not None
    assert 0.5 < true.slope * found.retuned_proportional < 1 / 1.05
    retuned = next(run for run in found.runs if run.name == "calibrated_retuned")
    assert retuned.proportional == found.retuned_proportional
    assert retuned.simulation.settled
    assert retuned.simulation.overshoots == 0
    half = replace(noisy, controller=replace(noisy.controller, proportional=nominal.gain / 2))
    told = find_consequences(noisy, true_model, paper=paper_model(noisy), recommended=half, members=20)
    assert told.retuned_proportional == nominal.gain / 2


def test_probabilities_tell_the_laws_apart(found: Consequences) -> None:
    nominal, true, retuned = found.ensembles
    assert true.overshoot.low > 0.9 > nominal.overshoot.high
    assert retuned.overshoot.high < true.overshoot.low
    assert retuned.not_settled.high < true.not_settled.low


def arrays(value: Any) -> Iterator[list[Any]]:
    if isinstance(value, dict):
        for entry in value.values():
            yield from arrays(entry)
    elif isinstance(value, list):
        yield value
        for entry in value:
            yield from arrays(entry)


def test_the_document_is_small_and_clean(found: Consequences) -> None:
    document = found.document()
    text = json.dumps(document, allow_nan=False)
    assert len(text) < 40_000
    assert max(len(array) for array in arrays(document)) <= 50
    assert [run["name"] for run in document["runs"]][:2] == ["paper", "calibrated"]
    h = document["gain"][1]["gain_per_operation"]
    assert document["gain"][1]["margin_to_overshoot"] == pytest.approx(1 / h)
    assert any(f"{h:.0%}" in sentence for sentence in document["findings"])
    law = document["gain"][0]
    assert law["instability_proportional_s_per_m"] == pytest.approx(2 * law["overshoot_proportional_s_per_m"])


def test_the_fixture_is_what_it_says(true_model: BalancerModel) -> None:
    assert isinstance(true_model.flow, PaperLaw)
    assert true_model.flow.drag_coefficient == TRUE_K
