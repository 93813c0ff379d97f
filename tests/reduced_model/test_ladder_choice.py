"""The choice of a rung on ladders whose errors are known: kept, cheap, checked, or refused."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ringbalance.reduced_model.cost_model import CostModel
from ringbalance.reduced_model.ladder_choice import MARGIN, Values, choose
from ringbalance.reduced_model.rungs import Contribution, Ladder, Rung, relative_error

COSTS = CostModel(seconds={"step": 1.0}, fitted_on="test")


def made_ladder(
    worths: Mapping[str, float], costs: list[float], *, estimates: float = 1.0, width: float = 0.0
) -> Ladder:
    """Rung i leaves out all but the first i terms, and is off by exactly what they are worth."""
    names = list(worths)

    def rung(i: int) -> Rung:
        left = names[i:]
        return Rung(
            name=f"rung {i}",
            models={},
            leaves_out=frozenset(left),
            work={"step": costs[i]},
            solve=lambda _: np.array([1.0 + sum(worths[name] for name in left)]),
        )

    return Ladder(
        quantity="made",
        title="made",
        values=("1",),
        points=("a", "b"),
        check=(0,),
        relative_to="each",
        contributions={
            name: Contribution(term=name, value=worth * estimates, formula="", source="")
            for name, worth in worths.items()
        },
        rungs=tuple(rung(i) for i in range(len(names) + 1)),
        top_uncertainty=width,
        top_uncertainty_from="test",
    )


WORTHS = {"plates": 0.3, "gravity": 3e-3, "sloshing": 2e-5}
DEAR = [1.0, 10.0, 100.0, 1000.0]


@pytest.mark.parametrize(
    ("tolerance", "rung"),
    [
        (0.1, "rung 1"),
        (1e-2, "rung 1"),
        (1e-3, "rung 2"),
        (1e-4, "rung 2"),
        (1e-5, "rung 3"),
        (1e-6, "rung 3"),
    ],
)
def test_the_cheapest_that_will_do(tolerance: float, rung: str) -> None:
    assert choose(made_ladder(WORTHS, DEAR), tolerance, costs=COSTS).rung.name == rung


@pytest.mark.parametrize("factor", [1e-3, 1e-2, 0.1, 10.0, 50.0])
@pytest.mark.parametrize("tolerance", [0.1, 1e-2, 1e-3, 1e-4, 1e-5])
def test_a_wrong_estimate_is_found_by_the_check(factor: float, tolerance: float) -> None:
    """Up to a thousandth of what it should be, since that is what the check allows for."""
    right = choose(made_ladder(WORTHS, DEAR), tolerance, costs=COSTS)
    wrong = choose(made_ladder(WORTHS, DEAR, estimates=factor), tolerance, costs=COSTS)
    assert wrong.rung.name == right.rung.name
    if factor < 1 and wrong.first.name != right.rung.name:
        assert wrong.climbed
        assert any(reason.startswith("climbed") for reason in wrong.reasons)


def test_without_the_check_a_wrong_estimate_is_believed() -> None:
    ladder = made_ladder(WORTHS, DEAR, estimates=1e-3)
    chosen = choose(ladder, 1e-3, check=False, costs=COSTS)
    assert chosen.rung.name == "rung 0"
    assert Values(ladder).error(chosen.rung, ladder.top, (0, 1)) > 1e-3


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, 1e-10, 2.0, 0.11, float("nan"), float("inf")])
def test_senseless_tolerances_are_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match=r"within 1e-06 and 0\.1"):
        choose(made_ladder(WORTHS, DEAR), tolerance, costs=COSTS)


def test_a_tolerance_below_the_tops_own_uncertainty_is_answered_with_it() -> None:
    ladder = made_ladder(WORTHS, DEAR, width=1e-3)
    said = [
        any(
            "is below what “rung 3”, the highest rung, is known to" in r
            for r in choose(ladder, t, costs=COSTS).reasons
        )
        for t in (1e-2, 1e-3, 9e-4, 1e-6)
    ]
    assert said == [False, False, True, True]


def test_a_term_without_an_estimate_is_always_checked() -> None:
    ladder = made_ladder({"hump": 0.5}, [1.0, 10.0])
    unknown = Contribution(term="hump", value=None, formula="", source="")
    blind = Ladder(**{**ladder.__dict__, "contributions": {"hump": unknown}})
    assert choose(blind, 0.1, costs=COSTS).rung.name == "rung 1"


def test_a_ladder_without_points_is_refused() -> None:
    ladder = made_ladder(WORTHS, DEAR)
    with pytest.raises(ValueError, match="made"):
        choose(Ladder(**{**ladder.__dict__, "points": ()}), 0.01, costs=COSTS)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    sizes=st.lists(st.floats(-8.0, 0.0), min_size=1, max_size=6),
    steps=st.lists(st.floats(0.0, 3.0), min_size=6, max_size=6),
    skew=st.floats(-1.0, 1.0),
    tolerance=st.floats(-6.0, -1.0),
)
def test_every_choice_keeps_its_tolerance_and_is_the_cheapest(
    sizes: list[float], steps: list[float], skew: float, tolerance: float
) -> None:
    worths = {f"term {i}": 10**size for i, size in enumerate(sorted(sizes, reverse=True))}
    costs = [float(10 ** sum(steps[:i])) for i in range(len(sizes) + 1)]
    ladder, wanted = made_ladder(worths, costs, estimates=10**skew), float(10**tolerance)
    values = Values(ladder)
    chosen = choose(ladder, wanted, costs=COSTS, values=values)
    # What is worth less than a thousandth by the estimate may be ten times that in fact, once for each term.
    assert values.error(chosen.rung, ladder.top, (0, 1)) <= (MARGIN + 0.011 * len(sizes)) * wanted
    enough = [
        r for r in ladder.rungs if values.error(r, ladder.top, (0, 1)) <= (1 - 0.011 * len(sizes)) * wanted
    ]
    assert chosen.cost <= 1.0001 * min(COSTS.of_rung(r, points=2) for r in enough)


def test_relative_errors_by_hand() -> None:
    found, reference = np.array([[1.1, 0.0], [2.0, 1.0]]), np.array([[1.0, 0.0], [2.0, 4.0]])
    assert relative_error(found=found, reference=reference, relative_to="each") == pytest.approx(0.75)
    assert relative_error(found=found[:1], reference=reference[:1], relative_to="each") == pytest.approx(0.1)
    zero = np.array([[0.0]])
    assert relative_error(found=np.array([[5.0]]), reference=zero, relative_to="largest") == 1.0
    assert relative_error(found=zero, reference=zero, relative_to="each") == 0.0
