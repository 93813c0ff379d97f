"""Liquid under gravity in a box, by its walls alone, against adaptive quadrature over its volume."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from ringbalance.mesh.chamber_table import ChamberTable, TiltedLiquid, chamber_table, tilted_liquid
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.reference.chambers import block_chamber

X0, X1, HALF, WIDTH = 0.02, 0.045, 0.02, 0.06
FILLS = (0.1, 0.4, 0.8)


def table() -> ChamberTable:
    def place(cube: FloatArray) -> FloatArray:
        low, high = np.array([X0, -HALF, -WIDTH / 2]), np.array([X1, HALF, WIDTH / 2])
        return np.asarray(low + (high - low) * cube)

    return chamber_table(block_chamber((2, 3, 2), place, kind="hexahedron"))


def section(level: float, centre: tuple[float, float]) -> FloatArray:
    """Area outside |r - c|^2 = level, its moment along x, and int max(|r - c|^2 - level, 0) over x = x1."""

    def start(y: float) -> float:
        square = level - (y - centre[1]) ** 2
        return float(np.clip(centre[0] + np.sqrt(max(square, 0.0)), X0, X1))

    def excess(y: float) -> float:
        return max((X1 - centre[0]) ** 2 + (y - centre[1]) ** 2 - level, 0.0)

    marks = {-HALF, HALF}
    for x in (X0, X1):
        reach = np.sqrt(max(level - (x - centre[0]) ** 2, 0.0))
        marks |= {float(np.clip(centre[1] + side * reach, -HALF, HALF)) for side in (-1, 1)}
    points = sorted(marks)
    functions = (lambda y: X1 - start(y), lambda y: (X1**2 - start(y) ** 2) / 2, excess)
    return np.array([sum(quad(f, a, b, epsrel=1e-11)[0] for a, b in pairwise(points)) for f in functions])


def compared(found: TiltedLiquid, at: tuple[int, int], expected: FloatArray) -> None:
    """Pieces of 1e-12 of the volume are left alone, and the square of 1e-8 of it."""
    moment, square = WIDTH * expected[1], expected[2] / (2 * HALF)
    assert found.moment[at] == pytest.approx(moment, rel=1e-8)
    assert found.wall_square[at] == pytest.approx(square, rel=1e-7)


@pytest.mark.parametrize("length", [1e-4, 4e-3])
def test_a_horizontal_shaft(length: float) -> None:
    turn, volume = 4, (X1 - X0) * 2 * HALF * WIDTH
    found = tilted_liquid(table(), length=length, vertical=False, turn=turn, fills=FILLS)
    for n, fill in enumerate(FILLS):
        for m in range(turn):
            psi = 2 * np.pi * m / turn
            centre = (-length * np.cos(psi), -length * np.sin(psi))
            level = brentq(
                lambda s, c=centre, x=fill: WIDTH * section(s, c)[0] - x * volume, 1e-4, 4e-3, xtol=1e-16
            )
            compared(found, (n, m), section(level, centre))


def test_a_vertical_shaft() -> None:
    """Slices across the shaft lie outside circles of r^2 = L + 2 G z."""
    length, volume = 2e-3, (X1 - X0) * 2 * HALF * WIDTH
    found = tilted_liquid(table(), length=length, vertical=True, turn=0, fills=FILLS)
    places, weights = np.polynomial.legendre.leggauss(40)

    def mean(level: float) -> FloatArray:
        slices = [section(level + length * WIDTH * z, (0.0, 0.0)) for z in places]
        return np.asarray(weights @ np.array(slices) / 2)

    for n, fill in enumerate(FILLS[1:], start=1):
        level = brentq(lambda s, x=fill: WIDTH * mean(s)[0] - x * volume, 4e-4, 3e-3, xtol=1e-15)
        assert found.moment[n, 0] == pytest.approx(WIDTH * mean(level)[1], rel=1e-5)
        assert found.wall_square[n, 0] == pytest.approx(mean(level)[2] / (2 * HALF), rel=1e-4)


def test_added_liquid_enters_at_the_surface() -> None:
    """dU/dV' is the change of U from fill to fill."""
    step = 1e-3
    fills = (0.4 - step, 0.4, 0.4 + step)
    found = tilted_liquid(table(), length=3e-3, vertical=False, turn=3, fills=fills)
    change = (found.moment[2] - found.moment[0]) / (2 * step * table().volume)
    np.testing.assert_allclose(found.centroid[1], change, rtol=1e-5)


def test_a_flat_wall_that_gravity_dries_in_its_middle_holds_no_closed_ring() -> None:
    """The concentric surface leaves 0.05 mm there, less than gravity takes unless it points to the wall."""
    a, length = X1 - 5e-5, 3e-3
    fill = float(table().at_radius(a, 0)) / table().volume
    found = tilted_liquid(table(), length=length, vertical=False, turn=4, fills=(fill,))
    # Along the wall, G phi less x1 phi^2/2 at an angle phi; away from it, G less its mean over the angle.
    half = np.arctan(HALF / X1)
    assert min(length**2 / (2 * X1), length * (1 - np.sin(half) / half)) > 5e-5
    assert found.closed[0].tolist() == [True, False, False, False]
