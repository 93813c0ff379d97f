"""Splines, roots and minima in numpy alone, against those of scipy."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy import interpolate

from ringbalance.physics.roots import bracketed_minimum, bracketed_root
from ringbalance.physics.splines import CubicSpline, Surface, monotone_slopes
from ringbalance.reduced_model.tables import table_from_samples

X = np.array([0.0, 0.3, 0.9, 1.4, 2.0, 2.2, 3.1])
Y = np.array([-1.0, 0.2, 0.5, 1.7, 2.0])
Z = np.sin(X)[:, None] * np.exp(0.3 * Y)[None, :] + Y[None, :] ** 2
AT = np.linspace(X[0], X[-1], 40), np.linspace(Y[0], Y[-1], 40)


def test_a_cubic_spline_is_that_of_scipy() -> None:
    expected = interpolate.CubicSpline(X, Z[:, 1])(AT[0])
    np.testing.assert_allclose(CubicSpline.through(X, Z[:, 1])(AT[0]), expected, rtol=1e-13)


@pytest.mark.parametrize(("make", "order"), [(Surface.bicubic, 3), (Surface.bilinear, 1)])
def test_a_surface_is_that_of_scipy(make: Callable[..., Surface], order: int) -> None:
    expected = interpolate.RectBivariateSpline(X, Y, Z, kx=order, ky=order).ev(*AT)
    np.testing.assert_allclose(make(X, Y, Z)(*AT), expected, rtol=1e-12)


@pytest.mark.parametrize("count", [2, 4, 6, 7, 20, 100, 101, 102, 400])
def test_a_quintic_table_is_the_spline_of_scipy(count: int) -> None:
    x = np.linspace(0.0, 2.0, count)
    value = np.sin(3 * x) + x
    order = min(5, (count - 1) // 2 * 2 + 1)
    spline = interpolate.make_interp_spline(x, value, k=order)
    table = table_from_samples(start=0.0, stop=2.0, value=value)
    np.testing.assert_allclose(table.slope, spline(x, 1), atol=1e-9)
    between = np.linspace(0.0, 2.0, 77)
    np.testing.assert_allclose(table(between), spline(between), atol=1e-12)


@pytest.mark.parametrize("value", [[0, 1, 1, 0, 0.5, 0.4, 3], [2, 1], [0, 5, 5.1], [0, -1, 4]])
def test_monotone_slopes_are_those_of_scipy(value: list[float]) -> None:
    y = np.asarray(value, dtype=np.float64)
    expected = interpolate.PchipInterpolator(np.arange(y.size), y).derivative()(np.arange(y.size))
    np.testing.assert_allclose(monotone_slopes(y), expected, atol=1e-14)


def test_root_and_minimum() -> None:
    assert bracketed_root(lambda x: x**3 - 2, 0.0, 2.0) == pytest.approx(2 ** (1 / 3), rel=1e-12)
    assert bracketed_root(lambda x: math.exp(20 * x) - 3, -1.0, 2.0) == pytest.approx(
        math.log(3) / 20, rel=1e-11
    )
    assert bracketed_minimum(lambda x: (x - 0.7) ** 2, 0.0, 2.0, tolerance=1e-9) == pytest.approx(
        0.7, abs=1e-7
    )
    with pytest.raises(ValueError, match="sign"):
        bracketed_root(lambda x: x + 1, 0.0, 1.0)
