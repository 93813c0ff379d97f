"""Which input decides: indices of closed forms, and what is said of them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.balancer import Outcomes, settles_within
from ringbalance.controller.judging.judge import Judgement
from ringbalance.controller.judging.ranking import first_order_index, ranked
from ringbalance.controller.liquid_ring.offers import drawn_input
from ringbalance.controller.trials import DrawnInput
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.draws import quantiles
from ringbalance.scene.errors import LOSS, MODEL_ERRORS, PHASE
from scenes import with_tables

NAMES = ("a", "b", "c")


def places(count: int) -> dict[str, FloatArray]:
    return {name: quantiles(name, range(count), seed=7) for name in NAMES}


def test_indices_of_the_ishigami_function() -> None:
    """y = sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1 (Ishigami and Homma, 1990), S = 0.3139, 0.4424, 0.

    The mean of a sine over an eighth of its period is (8/pi) sin(pi/8) of its middle, of one of half the
    period (4/pi) sin(pi/4): by eighths the indices are the squares of these times the exact ones.
    """
    count = 1 << 16
    drawn = places(count)
    x = [2 * math.pi * drawn[name] - math.pi for name in NAMES]
    y = np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
    result = [first_order_index(y, drawn[name]) for name in NAMES]
    first = 0.3139 * (math.sin(math.pi / 8) / (math.pi / 8)) ** 2
    second = 0.4424 * (math.sin(math.pi / 4) / (math.pi / 4)) ** 2
    assert result == pytest.approx([first, second, 0.0], abs=0.01)


@pytest.mark.parametrize("count", [64, 1024])
def test_a_threshold_on_one_input_has_index_one_and_the_others_none(count: int) -> None:
    drawn = places(count)
    met = (drawn["a"] < 0.75).astype(float)
    assert first_order_index(met, drawn["a"]) == pytest.approx(1.0)
    noise = math.sqrt(14) / count
    assert all(abs(first_order_index(met, drawn[name])) < 4 * noise for name in ("b", "c"))
    assert first_order_index(np.ones(count), drawn["a"]) == 0.0


def test_the_noise_of_an_index_is_what_chance_gives() -> None:
    drawn = [quantiles(f"x{i}", range(256), seed=1) for i in range(200)]
    y = np.random.default_rng(3).random(256) < 0.8
    result = [first_order_index(y.astype(float), each) for each in drawn]
    assert np.mean(result) == pytest.approx(0.0, abs=2e-3)
    assert np.std(result) == pytest.approx(math.sqrt(14) / 256, rel=0.2)


class Named:
    """A balancer of which only the kinds of its inputs are asked."""

    def drawn_input(self, name: str) -> DrawnInput:
        return DrawnInput(common=name == "b", measure="" if name == "c" else "measure_input")


def judgement(settled: Any, inputs: dict[str, FloatArray]) -> Judgement:
    n = settled.size
    times = np.where(settled, 1.0, math.inf)
    outcomes = Outcomes(
        settling_time=times,
        final_amplitude=np.zeros(n),
        energy=np.zeros(n),
        usable_moment=np.ones(n),
        unbalance=np.ones(n),
        ended=("settled",) * n,
        inputs=inputs,
    )
    demands = (settles_within(2.0, stated=True),)
    return Judgement(settings={}, required_fraction=0.9, demands=demands, outcomes=outcomes)


def test_what_decides_is_measured_where_it_can_be() -> None:
    """Met below 0.8 of one input: in its middle half, up to 0.75, by all devices."""
    drawn = places(256)
    balancer: Any = Named()
    result = ranked(balancer, judgement(drawn["b"] < 0.8, drawn))
    (best,) = result.worth_measuring
    assert (best.name, best.common, best.middle.value) == ("b", True, 1.0)
    assert [each.code for each in result.findings()] == ["measure_input"]
    alone = ranked(balancer, judgement(drawn["c"] < 0.8, drawn))
    assert alone.inputs[0].name == "c"
    assert alone.inputs[0].decides
    assert [each.code for each in alone.findings()] == ["nothing_to_measure"]
    nobody = judgement(np.zeros(256, dtype=bool), drawn)
    assert not list(ranked(balancer, nobody).findings())


def test_where_all_or_none_meet_time_or_amplitude_is_ranked() -> None:
    """By eighths of a ramp S is 1 - 1/64."""
    drawn = places(256)
    balancer: Any = Named()
    for settled, outcome in ((True, "settling_time"), (False, "final_amplitude")):
        result = judgement(np.full(256, settled), drawn)
        ranks: dict[str, Any] = {outcome: drawn["a"]}
        ranking = ranked(balancer, with_tables(result, outcomes=ranks))
        best = ranking.inputs[0]
        assert (best.name, best.outcome) == ("a", outcome)
        assert best.index == pytest.approx(1 - 1 / 64, abs=0.01)
        assert not list(ranking.findings())


def test_kinds_of_inputs_of_a_liquid_ring() -> None:
    """A tolerance varies; a model's error is common to all discs, and another quantity shows it."""
    assert drawn_input("bore") == DrawnInput(common=False, measure="measure_input", path="tube.bore")
    assert drawn_input("draw_down_factor") == DrawnInput(
        common=True, measure="measure_residual", path=drawn_input("draw_down_factor").path
    )
    designs = ("model: ends, even", "model: pressure of the cavity", "model: end of the crest")
    assert set(designs) < set(MODEL_ERRORS)
    for name in (LOSS, *designs):
        group = name.partition(",")[0]
        assert drawn_input(name) == DrawnInput(common=True, measure="measure_flow", name=group)


def test_both_parts_of_a_models_error_are_ranked_as_one() -> None:
    """Of y = a + b over equal ranges each has half of the variance; together they decide."""

    class Paired(Named):
        def drawn_input(self, name: str) -> DrawnInput:
            return replace(super().drawn_input(name), name="both" if name in "ab" else "")

    drawn = places(1024)
    balancer: Any = Paired()
    result = judgement(np.full(1024, True), drawn)
    ranks: dict[str, Any] = {"settling_time": drawn["a"] + drawn["b"]}
    ranking = ranked(balancer, with_tables(result, outcomes=ranks))
    assert [each.name for each in ranking.inputs] == ["both", "c"]
    assert ranking.inputs[0].index == pytest.approx(1.0, abs=0.05)


def test_where_a_vibration_starts_varies_between_devices() -> None:
    assert drawn_input(PHASE) == DrawnInput(common=False, measure="", path="rotor.initial_phase")
