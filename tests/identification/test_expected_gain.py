"""Expected gains against fits that are really made again."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from ringbalance.identification.next_measurement import MeasurementCandidate, _expected_gains
from ringbalance.scene.arrays import FloatArray

DURATIONS = np.array([0.05, 0.1, 0.2, 0.3])
TRUE = np.array([2.0, 1.5])
NOISE = 0.02


def moved(parameters: FloatArray, durations: FloatArray) -> FloatArray:
    """An amount that saturates: the first parameter is its end, the second its rate."""
    return np.asarray(parameters[0] * -np.expm1(-parameters[1] * durations))


def derivatives(durations: FloatArray) -> FloatArray:
    step = 1e-6
    columns = [
        (moved(TRUE + step * unit, durations) - moved(TRUE - step * unit, durations)) / (2 * step)
        for unit in np.eye(2)
    ]
    return np.column_stack(columns) / NOISE


@cache
def spread_of_refits(durations: tuple[float, ...], draws: int = 1500) -> FloatArray:
    """Standard deviations of both parameters over fits to fresh data, by quartiles: outliers do not count."""
    random, found, times = np.random.default_rng(0), [], np.array(durations)
    for _ in range(draws):
        data = moved(TRUE, times) + NOISE * random.standard_normal(times.size)
        fit = least_squares(lambda p, d=data: (moved(p, times) - d) / NOISE, TRUE)
        found.append(fit.x)
    low, high = np.percentile(found, [25, 75], axis=0)
    return np.asarray((high - low) / 1.349)


def test_the_expected_interval_is_that_of_refits() -> None:
    """Enough data for a linear problem: ten of each duration, and ten at 2 s."""
    many = np.repeat(DURATIONS, 10)
    gain = _expected_gains(
        derivatives(many).T @ derivatives(many),
        parameter=0,
        candidates=[MeasurementCandidate(text="2 s", derivatives=derivatives(np.full(10, 2.0)))],
    )[0]
    refit = spread_of_refits((*many, *np.full(10, 2.0)))[0]
    # 1500 draws know a quartile's spread to 3 % (one standard deviation).
    assert gain.after == pytest.approx(refit, rel=0.1)
    assert gain.ratio < 0.3


def test_what_nothing_determines_is_infinite_until_something_does() -> None:
    one = np.array([[1.0, 1.0]])
    gains = _expected_gains(
        one.T @ one,
        parameter=0,
        candidates=[
            MeasurementCandidate(text="the same again", derivatives=one),
            MeasurementCandidate(text="another", derivatives=np.array([[1.0, -1.0]])),
        ],
    )
    assert [gain.candidate for gain in gains] == ["another", "the same again"]
    assert gains[0].before == float("inf")
    assert gains[0].after == pytest.approx(np.sqrt(0.5))
    assert gains[1].after == float("inf")
    assert (gains[0].ratio, gains[1].ratio) == (0.0, 1.0)


@given(
    rows=st.lists(st.tuples(*[st.floats(-5, 5)] * 3), min_size=1, max_size=6),
    parameter=st.integers(0, 2),
)
def test_a_measurement_never_harms(rows: list[tuple[float, float, float]], parameter: int) -> None:
    information = np.diag([1.0, 4.0, 9.0])
    (gain,) = _expected_gains(
        information,
        parameter=parameter,
        candidates=[MeasurementCandidate(text="c", derivatives=np.array(rows))],
    )
    assert gain.after <= gain.before * (1 + 1e-12)
    exact = np.sqrt(np.linalg.inv(information + np.array(rows).T @ np.array(rows))[parameter, parameter])
    assert gain.after == pytest.approx(float(exact), rel=1e-6)
