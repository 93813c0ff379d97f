"""Piecewise polynomials against those of SciPy, which set them up and evaluate them in other ways."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline, RectBivariateSpline

from ringbalance.scene.splines import GridPieces, Pieces

RANDOM = np.random.default_rng(1)
FIRST, SECOND = np.sort(RANDOM.random(9)), np.cumsum(RANDOM.random(5))
VALUES = RANDOM.standard_normal((9, 5))
A, B = RANDOM.uniform(FIRST[0], FIRST[-1], (2, 40)), RANDOM.uniform(SECOND[0], SECOND[-1], (2, 40))


def test_spline_through_columns() -> None:
    expected = CubicSpline(FIRST, VALUES)
    assert Pieces.spline(FIRST, VALUES)(A) == pytest.approx(expected(A), rel=1e-11, abs=1e-11)
    assert Pieces.spline(FIRST, VALUES[:, 0])(A[0, 0]) == pytest.approx(expected(A[0, 0])[0], rel=1e-11)


def test_beyond_the_nodes_the_outermost_piece_goes_on() -> None:
    x = np.array([FIRST[0] - 0.1, FIRST[-1] + 0.1])
    assert Pieces.spline(FIRST, VALUES)(x) == pytest.approx(CubicSpline(FIRST, VALUES)(x), rel=1e-10)


def test_values_and_slopes_of_cubics() -> None:
    found = Pieces.hermite(FIRST, VALUES, VALUES[::-1])
    expected = CubicHermiteSpline(FIRST, VALUES, VALUES[::-1])
    assert found(A) == pytest.approx(expected(A), rel=1e-11, abs=1e-11)
    assert found.derivative()(A) == pytest.approx(expected(A, 1), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("degree", [1, 3])
def test_pieces_over_a_grid(degree: int) -> None:
    make = GridPieces.straight if degree == 1 else GridPieces.spline
    expected = RectBivariateSpline(FIRST, SECOND, VALUES, kx=degree, ky=degree).ev(A, B)
    assert make(FIRST, SECOND, VALUES)(A, B) == pytest.approx(expected, rel=1e-11, abs=1e-11)
