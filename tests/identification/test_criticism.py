"""Criticism of fits: silent where the model is right, and it names the test that fails where it is not."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from ringbalance.identification.criticism import (
    _Criticism,
    _LinearFit,
    _runs_probability,
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


def test_few_rows_are_not_judged() -> None:
    few = _LinearFit(
        residuals=np.array([1.0, -1.0, 1.0]),
        derivatives=np.ones((3, 1)),
        block=np.array(["flow flow_rate"] * 3),
        known_noise=np.ones(3, dtype=np.bool_),
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
