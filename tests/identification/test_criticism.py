"""Criticism of fits: silent where the model is right, and it names the test that fails where it is not."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.identification.criticism import (
    LEVEL,
    NEEDED,
    _Criticism,
    _LawComparison,
    _LinearFit,
    _runs_probability,
    summaries,
)
from ringbalance.scene.arrays import FloatArray

ROWS = 60
SHUFFLED = np.random.default_rng(1).permutation(ROWS)
PRESSURES = np.tile([0.4, 0.6, 0.8, 1.0, 1.2, 1.4], ROWS // 6)[SHUFFLED]
FILLS = np.repeat(np.linspace(0.1, 0.4, 10), 6)[SHUFFLED]


def linear_fit(measured: FloatArray, design: FloatArray, *, known: bool) -> _LinearFit:
    """Least squares with a weak prior on the first parameter as the last row."""
    prior = np.zeros(design.shape[1])
    prior[0] = 0.1
    rows, wanted = np.vstack([design, prior]), np.append(measured, 0.0)
    residuals = wanted - rows @ np.linalg.lstsq(rows, wanted, rcond=None)[0]
    if not known:
        residuals[:-1] /= np.sqrt(np.sum(residuals[:-1] ** 2) / (measured.size - design.shape[1]))
    data = np.append(np.ones(measured.size, dtype=np.bool_), False)
    return _LinearFit(
        residuals=residuals,
        derivatives=rows,
        block=np.where(data, "transfer mass", ""),
        known_noise=data if known else np.zeros_like(data),
        turn=np.eye(measured.size),
    )


def judged(measured: FloatArray, design: FloatArray, *, known: bool = True) -> _Criticism:
    return _Criticism.of(linear_fit(measured, design, known=known))


DESIGN = np.column_stack([np.sqrt(PRESSURES), FILLS])


@pytest.mark.parametrize("known", [True, False])
def test_false_alarms_come_at_the_nominal_rate(known: bool) -> None:
    """5 % nominal; 600 fits have a standard deviation of 0.9 %, and the runs are discrete: 2.5 to 7.5 %."""
    draw = np.random.default_rng(7)
    alarms = sum(
        not judged(DESIGN @ [3.0, 2.0] + draw.standard_normal(ROWS), DESIGN, known=known).describes
        for _ in range(600)
    )
    assert 0.025 < alarms / 600 < 0.075


@pytest.mark.parametrize("known", [True, False])
def test_a_sensor_that_drifts_is_seen_in_the_order_of_measurement(known: bool) -> None:
    draw = np.random.default_rng(3)
    drift = 6 * np.arange(ROWS) / ROWS
    found = judged(DESIGN @ [3.0, 2.0] + drift + draw.standard_normal(ROWS), DESIGN, known=known)
    assert not found.describes
    assert next(each for each in found.findings if each.fails).test in {"runs", "size"}
    assert any(each.test == "runs" and each.fails for each in found.findings)
    assert found.text.startswith("the fit does not describe the data: ")


def test_a_stated_noise_that_is_too_small_is_rejected() -> None:
    draw = np.random.default_rng(11)
    found = judged(DESIGN @ [3.0, 2.0] + 2 * draw.standard_normal(ROWS), DESIGN)
    assert found.findings[0].test == "size"
    assert "2 times as large as the stated noise" in found.findings[0].text or not found.describes
    free = judged(DESIGN @ [3.0, 2.0] + 2 * draw.standard_normal(ROWS), DESIGN, known=False)
    assert all(f.test != "size" for f in free.findings)


@given(change=st.tuples(*[st.floats(-50, 50)] * 2))
def test_degrees_of_freedom_do_not_depend_on_what_parameters_describe(change: tuple[float, float]) -> None:
    fit = linear_fit(np.random.default_rng(5).standard_normal(ROWS), DESIGN, known=True)
    moved = replace(fit, residuals=fit.residuals + fit.derivatives @ change)
    assert fit.beyond_parameters(moved.residuals) == pytest.approx(
        fit.beyond_parameters(fit.residuals), abs=1e-10
    )
    assert fit.freedom(fit.block != "") == pytest.approx(ROWS - DESIGN.shape[1], abs=0.1)


def test_few_rows_are_not_judged() -> None:
    few = _LinearFit(
        residuals=np.array([1.0, -1.0, 1.0]),
        derivatives=np.ones((3, 1)),
        block=np.array(["flow flow_rate"] * 3),
        known_noise=np.ones(3, dtype=np.bool_),
        turn=np.eye(3),
    )
    found = _Criticism.of(few)
    assert found.describes
    assert found.text.startswith("too few")


@pytest.mark.parametrize(("plus", "minus"), [(2, 2), (3, 5), (4, 4), (6, 3)])
def test_runs_are_counted_right(plus: int, minus: int) -> None:
    """Against all orders of the signs."""
    orders = set(itertools.permutations([True] * plus + [False] * minus)) if plus + minus < 9 else None
    if orders is None:
        places = itertools.combinations(range(plus + minus), plus)
        orders = {tuple(i in place for i in range(plus + minus)) for place in places}
    counts = [1 + sum(a != b for a, b in itertools.pairwise(order)) for order in orders]
    for runs in range(2, plus + minus + 1):
        expected = sum(count <= runs for count in counts) / len(counts)
        assert _runs_probability(plus, minus, runs) == pytest.approx(expected, rel=1e-12)


def _comparison(true: FloatArray, noise: float) -> Any:
    """A square-root law against a linear one, each with its factor fitted."""
    pressure = np.linspace(0.4, 1.4, 24)
    measured = true + noise * np.random.default_rng(4).standard_normal(24)
    own, other = np.sqrt(pressure), pressure
    factor = float(own @ measured / (own @ own))
    fit = _LinearFit(
        residuals=(measured - factor * own) / noise,
        derivatives=own[:, None] / noise,
        block=np.array(["flow flow_rate"] * 24),
        known_noise=np.ones(24, dtype=np.bool_),
        turn=np.eye(24),
    )
    return _LawComparison.of(fit, other="laminar flow", residuals=(measured - factor * other) / noise)


def test_laws_are_told_apart_where_data_allow() -> None:
    pressure = np.linspace(0.4, 1.4, 24)
    clear = _comparison(np.sqrt(pressure), 0.01)
    assert clear.separation > NEEDED
    assert "prefer the fitted law to laminar" in clear.text
    assert "prefer laminar flow to the fitted" in _comparison(pressure, 0.01).text
    assert "cannot tell" in _comparison(np.sqrt(pressure), 3.0).text


def test_laws_of_one_outcome_share_a_sentence() -> None:
    """The one that the data prefer comes first, with its consequence."""
    found = [
        _LawComparison(other=name, separation=separation, preference=preference)
        for name, separation, preference in [
            ("a", 1.0, 0.0),
            ("b", 99.0, 50.0),
            ("c", 1.0, 9.0),
            ("d", 99.0, -50.0),
            ("e", 99.0, 1.0),
        ]
    ]
    said = dict(summaries(found))
    assert list(said) == ["other", "between", "fitted", "undecided"]
    assert said["undecided"] == "these data cannot tell the fitted law from a or c"
    assert "the data prefer d to the fitted law, so that the fitted values may be wrong" in said["other"]


def test_the_separation_is_the_power_of_a_test() -> None:
    """At the needed separation nine of ten draws reject the other law at the 5 % level, two-sided."""
    draws = np.random.default_rng(0).standard_normal(200_000) + np.sqrt(NEEDED)
    assert np.mean(np.abs(draws) > 1.959964) == pytest.approx(0.9, abs=0.003)
    assert LEVEL == 0.05
