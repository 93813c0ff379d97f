"""Settings by runs of drawn devices: what is recommended, and what it is judged by."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ball_balancer.balancer import BallBalancer
from ball_balancer.scene_keys import BallScene
from own_balancers import EXAMPLE

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.balancer import Draws, Remedy, balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.judging.remedies import Remedied
from ringbalance.controller.judging.search import search, searched
from ringbalance.controller.judging.tuning import Tuning
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.results.requirements import MET, MISSED
from ringbalance.scene.loader import scene_from
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene, scene_as

pytestmark = pytest.mark.usefixtures("ball_registered")


def bundled(name: str, **values: object) -> Scene:
    scene = rb.load_scene(rb.bundled_scene(name)).with_values(
        {path.replace("__", "."): value for path, value in values.items()}
    )
    return liquid_ring_scene(scene)


@pytest.fixture(scope="module")
def paper() -> Tuning:
    return rb.tune(bundled("liquid_ring_paper"))


def test_the_papers_disc_works_at_a_lower_pressure(paper: Tuning) -> None:
    assert paper.own is not None
    assert paper.own.verdict == MISSED
    assert 0.78 < paper.own.fraction.value < 0.90
    assert paper.succeeded
    assert 0.52e6 <= paper.recommended.settings["gas.pressure"] <= 0.60e6
    assert paper.longer is not None
    assert paper.longer.verdict == MET
    by_level = {each.level: each for each in paper.along}
    assert by_level[min(by_level)].judgement.fraction.count == 0
    # Too much pressure leaves too little moment.
    assert by_level[max(by_level)].judgement.fraction.value < paper.recommended.fraction.low
    moments = [each.usable_moment[1] for each in paper.along if each.level > 0.55e6]
    assert moments == sorted(moments, reverse=True)


def test_the_smallest_residual_is_what_the_judged_devices_end_with(paper: Tuning) -> None:
    """Neither a bound of the noise nor the limit, and graded where the rotor's mass is known."""
    amplitudes = paper.judgement.outcomes.final_amplitude
    assert paper.rotor is not None
    (row,) = paper.standards
    residual = row.value or 0.0
    assert row.key == "minimum_achievable_unbalance"
    within = np.mean(amplitudes <= residual * abs(paper.rotor.influence) * (1 + 1e-12))
    assert paper.judgement.required_fraction <= within <= 1
    assert residual * abs(paper.rotor.influence) < paper.rotor.limit
    assert row.key in {each["key"] for each in paper.to_dict()["quantities"]}
    heavy = replace(paper, rotor=replace(paper.rotor, mass=25.0))
    grades = {each.key: each.value or 0.0 for each in heavy.standards}
    assert grades["grade_reached"] == pytest.approx(residual * paper.rotor.speed / 25.0)
    assert grades["grade_reached"] < grades["grade_of_limit"]


def test_a_tuned_scene_is_a_scene(paper: Tuning) -> None:
    again = liquid_ring_scene(paper.recommended_scene)
    assert again.gas.pressure == paper.recommended.settings["gas.pressure"]
    assert again.controller.proportional == pytest.approx(paper.scene.controller.proportional)
    document = paper.to_dict()
    assert document["verdict"] == MET
    assert json.loads(json.dumps(document, allow_nan=False))["settings"] == document["settings"]


def test_too_little_pressure_is_told_from_capacity() -> None:
    (outcomes,) = judged_all(balancer_of(bundled("liquid_ring_paper", gas__pressure="0.42 MPa")), [{}])
    assert outcomes.verdict == MISSED
    assert set(outcomes.outcomes.ended) == {"stalled"}


def test_no_pressure_above_the_one_that_is_available_is_searched() -> None:
    """[design] states it; the highest one itself is a level, and settings start at the scene's own."""
    free = LiquidRingBalancer(bundled("liquid_ring_paper")).trials()[0].scan_axis
    capped = (
        LiquidRingBalancer(bundled("liquid_ring_paper", design__pressure="0.6 MPa")).trials()[0].scan_axis
    )
    below = LiquidRingBalancer(bundled("liquid_ring_paper", design__pressure="0.1 MPa")).trials()[0].scan_axis
    assert free is not None
    assert capped is not None
    assert below is not None
    assert max(free.levels) > 2 * max(capped.levels)
    assert max(capped.levels) == 0.6e6
    assert set(capped.levels) - {0.6e6} == {each for each in free.levels if each < 0.6e6}
    assert list(capped.first) == [at for at in free.first if at < len(capped.levels)]
    assert (below.levels, below.first) == ((0.1e6,), (0,))


def test_a_limit_follows_from_the_grade() -> None:
    """G = U omega/m, and kappa U is the vibration; a limit that the scene states stays that of its runs."""
    grade = {"rotor__mass": "25 kg", "requirement__grade": "0.4 mm/s"}
    scene = bundled("liquid_ring_paper", **grade, controller__limit=None)
    rotor = scene.rotor
    expected = 0.4e-3 * 25.0 / rotor.speed * rotor.influence_coefficient
    assert LiquidRingBalancer(scene).limit == scene.controller.limit == pytest.approx(expected)
    assert scene.with_values({"requirement.grade": None}).controller.limit == pytest.approx(0.05e-6)
    assert bundled("liquid_ring_paper", **grade).controller.limit == pytest.approx(0.05e-6)
    strict = scene.with_values({"requirement.residual": "0.02 um", "controller.limit": "0.05 um"})
    balancer = LiquidRingBalancer(strict)
    assert balancer.limit == 0.02e-6
    point = {axis.name: axis.levels[3] for axis in balancer.trials()[0].axes}
    settings = balancer.trials()[0].settings(point)
    assert settings is not None
    assert settings["controller.limit"] == 0.02e-6


def test_a_default_gain_is_not_the_scenes() -> None:
    given = bundled("liquid_ring_paper")
    left_out = bundled("liquid_ring_paper", controller__proportional=None)
    assert LiquidRingBalancer(given).trials()[0].stated
    assert not LiquidRingBalancer(left_out).trials()[0].stated


def test_what_cannot_settle_is_not_run() -> None:
    """With the liquid at its best: the unbalance is twice the usable moment."""
    scene = bundled("liquid_ring_paper", rotor__initial_vibration={"amplitude": "20 um", "phase": "90 deg"})
    (outcomes,) = balancer_of(scene).run_all([{}], Draws.block(0, 8, complete=False))
    assert set(outcomes.ended) == {"capacity_exceeded"}
    assert np.all(outcomes.final_amplitude > scene.controller.limit)
    assert np.all(np.isnan(outcomes.energy))


def test_the_search_finds_the_settings_of_another_balancer() -> None:
    balancer = BallBalancer(scene_as(BallScene, scene_from(content=EXAMPLE, file="balls.toml")))
    result = search(balancer, balancer.trials(), progress=lambda _: None)
    assert result[0].count == max(each.count for each in result)
    assert searched(balancer) == result[0].candidate.settings


def test_six_chambers_work_with_settings_of_their_own_and_with_those_that_the_command_saves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "tuned.toml"
    words = ["tune", str(rb.bundled_scene("six_chamber")), "--save", str(target), "--json"]
    assert main(words) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert document["own"]["verdict"] == MET
    assert document["fraction"]["value"] >= 0.99
    assert document["along"]["levels"] == []
    scene = liquid_ring_scene(rb.load_scene(target))
    settings = document["settings"]
    assert scene.controller.kind == settings["controller.kind"] == "law_based"
    assert scene.controller.offsets(6) == pytest.approx(6 * (settings["controller.gas_time_offset"] or [0.0]))
    # The verdict and what is saved are those of the best valve on sale, and an ideal one is told apart.
    best = max(document["valves"], key=lambda each: each["fraction"]["value"])
    assert document["verdict"] == best["verdict"] == MET
    assert document["fraction"] == best["fraction"]
    assert settings == {**best["changes"], **best["settings"]}
    assert scene.gas.conductance == settings["gas.conductance"]
    assert document["ideal_part"]["verdict"] == MET
    assert judged_all(balancer_of(scene), [{}])[0].verdict == MET
    assert math.isfinite(document["settling_time_s"]["p90"])


def test_the_verdict_is_that_of_the_best_part_on_sale_and_not_that_of_an_ideal_one(paper: Tuning) -> None:
    assert paper.own is not None
    missed = Remedied(
        remedies=(Remedy(code="valve", name="Slow", changes={"gas.conductance": 1e-9}),),
        judgement=paper.own,
        size=1.0,
    )
    result = replace(paper, choices=(missed,))
    assert (paper.succeeded, result.succeeded) == (True, False)
    assert result.status.startswith("not met with any valve on sale that was tried (1): with the best, ")
    assert "required; met: with the recommended settings and an ideal valve 100" in result.status
    document = result.to_dict()
    assert document["verdict"] == document["own"]["verdict"] == "not met"
    assert document["ideal_part"]["verdict"] == MET
    # A part that does not suffice is not recommended.
    assert "gas.conductance" not in document["settings"]
    met = replace(result, choices=(missed, replace(missed, judgement=paper.recommended)))
    assert met.succeeded
    assert met.to_dict()["settings"]["gas.conductance"] == 1e-9


def test_a_verdict_that_rests_on_a_lag_that_the_program_assumes_says_so(paper: Tuning) -> None:
    valve = Remedy(code="valve", name="Fast", changes={"gas.conductance": 1e-8, "gas.valve_lag": 0.02})
    for assumed, says in (
        (("gas.valve_lag",), " if it has the valve lag of 20 ms that the program assumes"),
        ((), ""),
    ):
        part = Remedied(remedies=(replace(valve, assumed=assumed),), judgement=paper.recommended, size=1.0)
        assert replace(paper, choices=(part,)).status.startswith(f"met with Fast{says}: with this valve ")
        assert part.document()["assumed"] == ("valve lag of 20 ms" if assumed else "")
