"""The choice of a model on model hierarchies whose errors are known: kept, cheap, checked, or refused."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ringbalance.reduced_model.contribution import Contribution
from ringbalance.verification.selection_studies.choice import MARGIN, choose
from ringbalance.verification.selection_studies.hierarchy import (
    Fidelity,
    ModelHierarchy,
    Values,
    relative_error,
)
from ringbalance.verification.selection_studies.measure import CostModel

COSTS = CostModel(seconds={"step": 1.0}, fitted_on="test")


def made_hierarchy(
    worths: Mapping[str, float], costs: list[float], *, estimates: float = 1.0, width: float = 0.0
) -> ModelHierarchy:
    """Model i leaves out all but the first i terms, and is off by exactly what they are worth."""
    names = list(worths)

    def fidelity(i: int) -> Fidelity:
        left = names[i:]
        return Fidelity(
            name=f"model {i}",
            models={},
            leaves_out=frozenset(left),
            work={"step": costs[i]},
            solve=lambda _: np.array([1.0 + sum(worths[name] for name in left)]),
        )

    return ModelHierarchy(
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
        fidelities=tuple(fidelity(i) for i in range(len(names) + 1)),
        top_uncertainty=width,
        top_uncertainty_from="test",
    )


WORTHS = {"plates": 0.3, "gravity": 3e-3, "sloshing": 2e-5}
COSTLY = [1.0, 10.0, 100.0, 1000.0]


@pytest.mark.parametrize(
    ("tolerance", "fidelity"),
    [
        (0.1, "model 1"),
        (1e-2, "model 1"),
        (1e-3, "model 2"),
        (1e-4, "model 2"),
        (1e-5, "model 3"),
        (1e-6, "model 3"),
    ],
)
def test_the_cheapest_that_will_do(tolerance: float, fidelity: str) -> None:
    assert choose(made_hierarchy(WORTHS, COSTLY), tolerance, costs=COSTS).fidelity.name == fidelity


@pytest.mark.parametrize("factor", [1e-3, 1e-2, 0.1, 10.0, 50.0])
@pytest.mark.parametrize("tolerance", [0.1, 1e-2, 1e-3, 1e-4, 1e-5])
def test_a_wrong_estimate_is_found_by_the_check(factor: float, tolerance: float) -> None:
    """Up to a thousandth of what it should be, since that is what the check allows for."""
    right = choose(made_hierarchy(WORTHS, COSTLY), tolerance, costs=COSTS)
    wrong = choose(made_hierarchy(WORTHS, COSTLY, estimates=factor), tolerance, costs=COSTS)
    assert wrong.fidelity.name == right.fidelity.name
    if factor < 1 and wrong.first.name != right.fidelity.name:
        assert wrong.climbed
        assert any(reason.startswith("refined") for reason in wrong.reasons)


def test_without_the_check_a_wrong_estimate_is_believed() -> None:
    hierarchy = made_hierarchy(WORTHS, COSTLY, estimates=1e-3)
    chosen = choose(hierarchy, 1e-3, check=False, costs=COSTS)
    assert chosen.fidelity.name == "model 0"
    assert Values(hierarchy).error(chosen.fidelity) > 1e-3


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, 1e-10, 2.0, 0.11, float("nan"), float("inf")])
def test_senseless_tolerances_are_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match=r"within 1e-06 and 0\.1"):
        choose(made_hierarchy(WORTHS, COSTLY), tolerance, costs=COSTS)


def test_a_tolerance_below_the_tops_own_uncertainty_is_answered_with_it() -> None:
    hierarchy = made_hierarchy(WORTHS, COSTLY, width=1e-3)
    said = [
        any(
            "is below what “model 3”, the finest model, is known to" in r
            for r in choose(hierarchy, t, costs=COSTS).reasons
        )
        for t in (1e-2, 1e-3, 9e-4, 1e-6)
    ]
    assert said == [False, False, True, True]


def test_a_term_without_an_estimate_is_always_checked() -> None:
    hierarchy = made_hierarchy({"hump": 0.5}, [1.0, 10.0])
    unknown = Contribution(term="hump", value=None, formula="", source="")
    blind = ModelHierarchy(**{**hierarchy.__dict__, "contributions": {"hump": unknown}})
    assert choose(blind, 0.1, costs=COSTS).fidelity.name == "model 1"


def test_a_hierarchy_without_points_is_refused() -> None:
    hierarchy = made_hierarchy(WORTHS, COSTLY)
    with pytest.raises(ValueError, match="made"):
        choose(ModelHierarchy(**{**hierarchy.__dict__, "points": ()}), 0.01, costs=COSTS)


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
    hierarchy, wanted = made_hierarchy(worths, costs, estimates=10**skew), float(10**tolerance)
    values = Values(hierarchy)
    chosen = choose(hierarchy, wanted, costs=COSTS, values=values)
    # What is worth less than a thousandth by the estimate may be ten times that in fact, once for each term.
    assert values.error(chosen.fidelity) <= (MARGIN + 0.011 * len(sizes)) * wanted
    enough = [r for r in hierarchy.fidelities if values.error(r) <= (1 - 0.011 * len(sizes)) * wanted]
    assert chosen.cost <= 1.0001 * min(COSTS.cost(r.counted(2)) for r in enough)


def test_relative_errors_by_hand() -> None:
    found, reference = np.array([[1.1, 0.0], [2.0, 1.0]]), np.array([[1.0, 0.0], [2.0, 4.0]])
    assert relative_error(found=found, reference=reference, relative_to="each") == pytest.approx(0.75)
    assert relative_error(found=found[:1], reference=reference[:1], relative_to="each") == pytest.approx(0.1)
    zero = np.array([[0.0]])
    assert relative_error(found=np.array([[5.0]]), reference=zero, relative_to="largest") == 1.0
    assert relative_error(found=zero, reference=zero, relative_to="each") == 0.0
