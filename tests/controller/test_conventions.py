"""A run in the terms of balancing shops."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from paper_disc import CREST, VAPOUR, level, pressure

from ringbalance.controller.document import conventions
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.scene import Scene
from scenes import with_tables


def test_unbalances_and_vibrations_follow_from_the_amplitudes(paper_scene: Scene) -> None:
    run = simulate(paper_scene, paper_model(paper_scene))
    values = {each.key: each.value or 0.0 for each in conventions(run)}
    before, after = float(run.amplitude[0]), float(run.amplitude[-1])
    assert values["unbalance_reduction"] == pytest.approx(1 - after / before)
    assert values["residual_unbalance"] * paper_scene.rotor.influence_coefficient == pytest.approx(after)
    # 10 um at 10 000 rpm.
    assert values["initial_velocity"] == pytest.approx(7.405e-3, rel=1e-3)
    assert values["gas_per_correction"] < run.gas.normal_volume


def test_the_reduction_ratio_is_that_of_one_correction(paper_scene: Scene) -> None:
    """Definition of ISO 21940-21: the first correction ends where the second begins."""
    run = simulate(paper_scene, paper_model(paper_scene))
    first, second = sorted({each.time for each in run.injections})[:2]
    before, after = (float(run.amplitude[np.searchsorted(run.time, at)]) for at in (first, second))
    values = {each.key: each.value for each in conventions(run)}
    assert values["unbalance_reduction_ratio"] == pytest.approx(1 - after / before)
    assert 0.1 < 1 - after / before < (values["unbalance_reduction"] or 0.0) - 0.1
    nothing = {each.key: each.value for each in conventions(replace(run, injections=()))}
    assert nothing["unbalance_reduction_ratio"] is None
    assert nothing["unbalance_reduction"] == values["unbalance_reduction"]


def test_grades_of_the_run_and_of_the_limit_are_apart(paper_scene: Scene) -> None:
    """G = U W/M: 20 kg at 10 000 rpm; API 617 allows both planes G 0.665 together."""
    assert not {"grade_reached", "api_617_unbalance"} & {
        each.key for each in conventions(simulate(paper_scene, paper_model(paper_scene)))
    }
    scene = with_tables(paper_scene, rotor={"mass": 20.0})
    run = simulate(scene, paper_model(scene))
    rows = {each.key: each for each in conventions(run)}
    speed, influence = scene.rotor.speed, scene.rotor.influence_coefficient
    for key, amplitude in (("grade_reached", float(run.amplitude[-1])), ("grade_of_limit", run.limit)):
        assert rows[key].value == pytest.approx(amplitude / influence * speed / 20.0)
    assert rows["grade_reached"].value != rows["grade_of_limit"].value
    allowed = rows["api_617_unbalance"]
    assert (allowed.value or 0.0) * speed / 20.0 == pytest.approx(0.665e-3, rel=1e-3)
    assert ": not exceeded at the end" in allowed.name
    poor = replace(run, amplitude=np.full_like(run.amplitude, 1e-6))
    (exceeded,) = (each for each in conventions(poor) if each.key == "api_617_unbalance")
    assert ": exceeded at the end" in exceeded.name


@pytest.mark.parametrize(("fill", "sure", "perhaps"), [(0.42, 7200, 5090), (0.436, 7470, 5280)])
def test_a_correction_is_sure_to_last_down_to_the_speed_that_vapour_leaves(
    paper_scene: Scene, fill: float, sure: float, perhaps: float
) -> None:
    """A full tube parts over the crest where (D_m - P) (n/n_0)^2 exceeds ambient less cavity pressure."""
    result = Holding.of(paper_scene, fill_ratio=fill)
    missing = pressure(CREST) - pressure(level(fill))
    for speed, cavity, rpm in ((result.sure_speed, VAPOUR, sure), (result.likely_speed, VAPOUR / 2, perhaps)):
        by_hand = 10_000 * math.sqrt(-cavity / missing)
        assert by_hand == pytest.approx(rpm, rel=1e-3)
        assert (speed or 0.0) * 30 / math.pi == pytest.approx(by_hand, rel=1e-3)


def test_a_run_prints_the_sure_speed_first(paper_scene: Scene) -> None:
    run = simulate(paper_scene, paper_model(paper_scene))
    rows = {each.key: each for each in conventions(run)}
    held = Holding.of(paper_scene, fill_ratio=max(float(each[-1]) for each in run.fill_ratio.values()))
    assert rows["lasting_speed"].value == held.sure_speed
    assert rows["likely_lasting_speed"].value == held.likely_speed
    assert (held.sure_speed or 0.0) > 1.4 * (held.likely_speed or math.inf)


def test_chambers_are_level_where_a_column_holds_at_equal_fills(paper_scene: Scene) -> None:
    """Liquid runs back from the fullest chamber first, and from equal fills last."""
    rows = {
        each.key: each.value or 0.0 for each in conventions(simulate(paper_scene, paper_model(paper_scene)))
    }
    missing = pressure(CREST) - pressure(level(paper_scene.disc.initial_fill))
    for key, before, cavity in (
        ("levelled_speed", "lasting_speed", VAPOUR),
        ("likely_levelled_speed", "likely_lasting_speed", VAPOUR / 2),
    ):
        by_hand = 10_000 * math.sqrt(-cavity / missing)
        assert rows[key] * 30 / math.pi == pytest.approx(by_hand, rel=1e-3)
        assert rows[key] < rows[before]
    lost = with_tables(paper_scene, tube={"hump_radius": None})
    values = {each.key: each for each in conventions(simulate(lost, paper_model(lost)))}
    assert values["likely_levelled_speed"].value is None
    assert values["likely_levelled_speed"].status != "ok"


def test_a_crest_that_only_dissolved_gas_lets_part_is_undecided(paper_scene: Scene) -> None:
    """Between the speeds of vapour and of a cavity halfway to ambient pressure."""
    slower = with_tables(paper_scene, rotor={"speed": 6000 * math.pi / 30})
    held = Holding.of(slower, fill_ratio=0.42)
    assert (held.sure_speed, held.holds) == (None, False)
    assert held.likely_speed == pytest.approx(5090 * math.pi / 30, rel=1e-3)
    assert held.finding is not None
    assert held.finding.code == "crest_undecided"
    without = with_tables(paper_scene, tube={"hump_radius": None})
    assert Holding.of(without, fill_ratio=0.4).likely_speed is None
