"""Remedies tried by runs: of a made-up machine that works as closed forms say, and of the paper's disc."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.balancer import Draws, Outcomes, Remedy, balancer_of, settles_within
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, Judgement, judged_all
from ringbalance.controller.judging.remedies import Remedied, tried_choices, tried_remedies
from ringbalance.controller.liquid_ring.offers import remedies_of
from ringbalance.controller.trials import SearchAxis, Trials
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.draws import quantiles
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import SceneFile


@dataclass(frozen=True)
class Machine:
    """Devices settle, in 1 s, whose place q in a distribution lies below 0.5 (limit/50 nm)(1.5 mm/bore).

    A gain below the bore's in mm spoils each.
    """

    scene: Scene
    offered: tuple[Remedy, ...]
    verdict_draws: tuple[int, int] = (64, 1024)

    def on_scene(self, scene: SceneFile) -> Machine:
        assert isinstance(scene, Scene)
        return Machine(scene, self.offered)

    def remedies(self) -> tuple[Remedy, ...]:
        return self.offered

    def choices(self) -> tuple[Remedy, ...]:
        return self.offered

    def trials(self) -> tuple[Trials, ...]:
        gains = tuple(0.125 * number for number in range(1, 9))
        axis = SearchAxis(name="gain", levels=gains, first=tuple(range(8)))
        return (Trials(kind="toy", axes=(axis,), settings=dict),)

    def required_fraction(self) -> float:
        return 0.9

    def demands(self) -> Any:
        return (settles_within(2.0, stated=True),)

    def reported(self) -> Any:
        return ()

    def run_all(
        self, settings: Sequence[Mapping[str, Any]], draws: Draws, *, watch_time: float = 60.0
    ) -> tuple[Outcomes, ...]:
        del watch_time
        q, n = quantiles("q", draws.numbers, seed=0), len(draws.numbers)
        share = 0.5 * (self.scene.controller.limit / 50e-9) * (1.5e-3 / self.scene.tube.bore)
        return tuple(
            Outcomes(
                settling_time=np.where(q < share * each.get("gain", 1.0), 1.0, math.inf),
                final_amplitude=q,
                energy=np.zeros(n),
                usable_moment=np.ones(n),
                unbalance=np.ones(n),
                ended=("",) * n,
                numbers=draws.numbers,
                inputs={"q": q},
            )
            for each in settings
        )


def bore(factor: float) -> Remedy:
    return Remedy(code="bore", changes={"tube.bore": factor * 1.5e-3})


def limit(factor: float) -> Remedy:
    return Remedy(code="limit", changes={"controller.limit": factor * 50e-9}, continuous=True)


def tried(paper_scene: Scene, *offered: Remedy) -> tuple[Remedied, ...]:
    machine: Any = Machine(paper_scene, offered)
    (own,) = judged_all(machine, [{"gain": 1.0}], most=64)
    return tried_remedies(machine, own, search=lambda _: {"gain": 1.0})


def test_remedies_that_meet_come_first_with_the_smallest_change(paper_scene: Scene) -> None:
    """Of bores 0.7 settles 5/7, 0.5 all, and 0.35 is not tried; a limit of 2.2 times is a larger change."""
    rows = tried(paper_scene, bore(0.7), bore(0.5), bore(0.35), limit(1.2), limit(2.2), limit(4.0))
    result = [(row.code, row.judgement.fraction.value, row.met) for row in rows]
    assert [row.changes for row in rows[:2]] == [bore(0.5).changes, limit(2.2).changes]
    assert [met for *_, met in result] == [True, True, False, False, False]
    # Between a limit of 60 nm and 110 nm, 81 nm is tried too.
    assert [value for *_, value, _ in result[2:]] == pytest.approx([0.81, 5 / 7, 0.6], abs=0.02)
    assert len(rows) == 5


def test_the_best_two_go_together_where_neither_meets(paper_scene: Scene) -> None:
    rows = tried(paper_scene, bore(0.7), limit(1.6))
    assert [row.code for row in rows] == ["limit+bore", "limit", "bore"]
    assert rows[0].met
    assert rows[0].changes == {**limit(1.6).changes, **bore(0.7).changes}
    document = rows[0].document()
    assert document["verdict"] == "met"
    assert document["half_settle_s"] == 1.0


def test_a_remedy_that_meets_meets_on_other_devices(paper_scene: Scene) -> None:
    first = tried(paper_scene, bore(0.7), bore(0.5), limit(1.2))[0]
    machine: Any = Machine(paper_scene.with_values(first.changes), ())
    (again,) = judged_all(machine, [first.judgement.settings], first=128, most=128, start=1 << 22)
    assert again.verdict == "met"
    assert again.fraction.value >= first.judgement.fraction.low


def test_what_makes_it_worse_is_not_carried_on(paper_scene: Scene) -> None:
    """A bore of four times the scene's leaves 1/8 of the devices: too few after 16."""
    rows = tried(paper_scene, bore(4.0), bore(8.0), Remedy(code="refused", changes={"tube.bore": -1.0}))
    assert [row.judgement.fraction.of for row in rows] == [16]
    assert rows[0].judgement.fraction.value == pytest.approx(1 / 8, abs=0.2)


def test_what_can_be_bought_is_answered_in_its_own_order(paper_scene: Scene) -> None:
    machine: Any = Machine(paper_scene, (bore(1.0), bore(0.5)))
    # A gain serves in proportion; of 16 devices the nearest two of eight gains may serve as many.
    rows = tried_choices(machine, settings={"controller.limit": 50e-9})
    assert [row.met for row in rows] == [False, True]
    assert all(row.settings["controller.limit"] == 50e-9 for row in rows)
    assert all(row.settings["gain"] >= 0.875 for row in rows)
    assert all(min(row.judgement.outcomes.numbers) >= FIRST_VERDICT_DEVICE for row in rows)


def test_the_amplitude_that_is_surely_reached() -> None:
    """The lower bound of 62 of 64 is 0.893, that of 63 is 0.917."""
    q = (np.arange(64) + 0.5) / 64
    outcomes = Outcomes(
        settling_time=np.full(64, math.inf),
        final_amplitude=q[::-1],
        energy=q,
        usable_moment=q,
        unbalance=q,
        ended=("",) * 64,
    )
    demands = (settles_within(1.0, stated=False),)
    result = Judgement(settings={}, required_fraction=0.9, demands=demands, outcomes=outcomes)
    assert result.amplitude_reached == pytest.approx(q[62])


def test_a_device_keeps_its_inputs_under_a_remedy(paper_scene: Scene) -> None:
    balancer = balancer_of(paper_scene, flow_law="paper")
    numbers = Draws(numbers=(3, 70))
    (before,) = balancer.run_all([{}], numbers)
    changed = balancer.on_scene(paper_scene.with_values({"tube.bore": "1 mm"}))
    (after,) = changed.run_all([{}], numbers)
    assert before.inputs.keys() == after.inputs.keys()
    for name, places in before.inputs.items():
        np.testing.assert_array_equal(places, after.inputs[name])


def codes(scene: Scene) -> list[str]:
    return [each.code for each in remedies_of(scene, paper_model(scene))]


def test_remedies_are_offered_where_they_have_a_meaning(paper_scene: Scene) -> None:
    ideal = codes(paper_scene)
    assert "faster_valve" not in ideal
    assert "wider_bore" not in ideal
    assert ideal.count("limit") == 3
    valve = {"gas.conductance": "0.2 l/(s*bar)", "gas.critical_ratio": 0.3, "gas.valve_lag": "8 ms"}
    given = paper_scene.with_values(valve)
    faster = [each for each in remedies_of(given, paper_model(given)) if each.code == "faster_valve"]
    assert [each.changes for each in faster] == [
        {"gas.conductance": pytest.approx(0.4e-8), "gas.valve_lag": pytest.approx(4e-3)},
        {"gas.conductance": pytest.approx(0.8e-8), "gas.valve_lag": pytest.approx(2e-3)},
    ]
    assert balancer_of(given).choices() == ()
    assert len(balancer_of(paper_scene).choices()) == 3
    assert "limit" not in codes(paper_scene.with_values({"requirement.residual": "0.2 um"}))
    assert "wider_bore" in codes(paper_scene.with_values({"tube.bore": "0.2 mm"}))


def test_a_crest_too_low_is_moved_inwards(paper_scene: Scene) -> None:
    low = paper_scene.with_values({"tube.hump_radius": "44 mm"})
    result = [each.changes for each in remedies_of(low, paper_model(low)) if each.code == "crest"]
    assert len(result) == 3
    for changes in result:
        assert low.with_values(changes).tube.hump_radius == changes["tube.hump_radius"] < 0.0375


def test_the_bundled_complete_machine_meets_what_it_requires() -> None:
    """With its own valve and settings, on devices that these were not chosen on."""
    balancer = balancer_of(load_scene(bundled_scene("grinding_spindle")))
    (result,) = judged_all(balancer, [{}], most=64)
    assert result.verdict == "met"
    assert result.demands[0].stated
    assert balancer.choices() == ()
