"""The smooth table: exact on its polynomials, of sixth order, inverted to round-off."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.reduced_model.tables import (
    HermiteTable,
    level_table,
    table_from_samples,
)


def test_error_falls_with_the_sixth_power_of_the_step() -> None:
    x = np.linspace(0, 3, 1001)
    errors = []
    for n in (17, 33, 65):
        table = table_from_samples(start=0.0, stop=3.0, value=np.sin(2 * np.linspace(0, 3, n)))
        errors.append(np.max(np.abs(table(x) - np.sin(2 * x))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 5.3)
    assert errors[-1] < 1e-8


@given(x=st.lists(st.floats(-5, 8), min_size=1, max_size=20))
def test_inverse_undoes_the_table_inside_and_beyond(x: list[float]) -> None:
    table = table_from_samples(start=-2.0, stop=4.0, value=np.sinh(np.linspace(-2, 4, 61)))
    np.testing.assert_allclose(table.inverse(table(x)), x, rtol=1e-11, atol=1e-12)


def test_beyond_its_ends_the_table_goes_on_straight() -> None:
    table = table_from_samples(start=0.0, stop=1.0, value=np.exp(np.linspace(0, 1, 21)))
    for end, out in ((0.0, -0.7), (1.0, 1.9)):
        y, slope = table.with_slope(end)
        assert float(table(out)) == pytest.approx(float(y + (out - end) * slope), rel=1e-13)


def test_nothing_outside_can_change_a_table() -> None:
    source = np.linspace(0, 1, 5)
    table = HermiteTable(start=0.0, step=1.0, value=source, slope=source, curvature=source)
    source[0] = 99.0
    assert table.value[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        table.value[0] = 1.0


@pytest.mark.parametrize(
    "broken",
    [{"step": 0.0}, {"value": np.array([1.0])}, {"slope": np.array([1.0, np.nan])}, {"start": np.inf}],
)
def test_tables_that_make_no_sense_are_refused(broken: dict[str, object]) -> None:
    two = np.array([0.0, 1.0])
    good: dict[str, object] = {"start": 0.0, "step": 1.0, "value": two, "slope": two, "curvature": two}
    with pytest.raises(ValueError, match=r"finite|positive|two nodes"):
        HermiteTable(**(good | broken))  # type: ignore[arg-type]


def test_a_table_through_a_step_stays_between_its_neighbours() -> None:
    steps = np.array([0.1, 0.4, 0.5, 0.5, 0.002, 0.3, 0.31])
    table = level_table(start=0.0, stop=6.0, value=steps)
    x = np.linspace(0.0, 6.0, 6001)
    cell = np.minimum(x.astype(int), 5)
    low, high = (f(steps[cell], steps[cell + 1]) for f in (np.minimum, np.maximum))
    assert np.all((table(x) >= low - 1e-12) & (table(x) <= high + 1e-12))
    np.testing.assert_allclose(table(np.arange(7.0)), steps)
    fine = np.linspace(0, 3, 301)
    smooth = level_table(start=0.0, stop=3.0, value=np.exp(fine))
    assert np.max(np.abs(smooth(fine[:-1] + 0.004) / np.exp(fine[:-1] + 0.004) - 1)) < 1e-4
