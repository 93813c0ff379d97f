"""Tables of the law: of their order, with knots where the tolerance asks for them, inverted to round-off."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicHermiteSpline

from ringbalance.reduced_model.pieces.compiled_point import set_all_roots
from ringbalance.reduced_model.pieces.inverse import (
    ROOT_PLACES,
    WIDTH_OF_ROOT,
    root_of_velocity,
    set_roots,
    velocity_under,
)
from ringbalance.reduced_model.pieces.point import SIPHON
from ringbalance.reduced_model.pieces.rows import LawRows
from ringbalance.reduced_model.pieces.table import (
    Table,
    TableColumn,
    knots_of,
    smooth_table,
    table_at,
)
from ringbalance.reduced_model.tube.heads import roots_of

X = np.linspace(0.2, 3.0, 2049)


def test_error_falls_with_the_sixth_power_of_the_step() -> None:
    x = np.linspace(0, 3, 1001)
    errors = []
    for n in (17, 33, 65):
        nodes = np.linspace(0, 3, n)
        errors.append(np.max(np.abs(smooth_table(nodes, np.sin(2 * nodes)).quintic(x) - np.sin(2 * x))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 5.3)
    assert errors[-1] < 1e-8


def test_pieces_are_those_of_scipy() -> None:
    nodes = np.sort(np.random.default_rng(2).uniform(0.0, 3.0, 12))
    value, slope, curvature = np.sin(2 * nodes), 2 * np.cos(2 * nodes), -4 * np.sin(2 * nodes)
    table = Table(knots=nodes, columns=np.concatenate([value, slope, curvature]))
    x = np.linspace(nodes[0], nodes[-1], 501)
    np.testing.assert_allclose(table.cubic(x, 0), CubicHermiteSpline(nodes, value, slope)(x), atol=1e-14)
    quintic = BPoly.from_derivatives(nodes, np.stack([value, slope, curvature], axis=1))
    np.testing.assert_allclose(table.quintic(x), quintic(x), atol=1e-12)
    np.testing.assert_allclose(table.straight(x, 0), np.interp(x, nodes, value), atol=1e-15)
    np.testing.assert_allclose(table.quintic([-9.0, 9.0]), value[[0, -1]], atol=1e-15)


@pytest.mark.parametrize("allowed", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(("derivatives", "constant"), [(0, 8), (1, 384), (2, 46080)])
def test_knots_stand_where_the_tolerance_asks_for_them(
    allowed: float, derivatives: int, constant: int
) -> None:
    """A Hermite piece of length h and degree n - 1 misses h^n/`constant` of an exponential."""
    column = TableColumn(value=np.exp(X), allowed=allowed * np.exp(X), derivatives=(np.exp(X),) * derivatives)
    level = TableColumn(value=np.ones_like(X), allowed=np.zeros_like(X))
    knots = knots_of(X, [level, column], shortest=2)
    assert np.all(knots % 2 == 0)
    assert (knots[0], knots[-1]) == (0, X.size - 1)
    # At the worst halving makes a piece half as long as it could be.
    fewest = 2.8 / (constant * allowed) ** (1 / (2 * (derivatives + 1)))
    assert knots.size <= max(2.1 * fewest, 9)
    table = table_at(X, knots, [column])
    kinds = (table.straight, table.cubic, lambda x, _: table.quintic(x))
    error = float(np.max(np.abs(kinds[derivatives](X, 0) / np.exp(X) - 1)))
    assert error < 1.001 * allowed or knots.size == X.size // 2 + 1
    assert error > 1e-3 * allowed or knots.size == 9


@given(u=st.lists(st.floats(1e-7, 1e5), min_size=1, max_size=20))
def test_a_velocity_loses_the_head_that_drives_it(u: list[float]) -> None:
    """u = s^8/(1 + s^4), which creeps and then grows as the root of the head, s^8; inside and beyond."""
    s = np.geomspace(0.1, 30.0, 400)
    fourth = s**4
    columns = [
        fourth / (1 + fourth),
        4 * s**3 / (1 + fourth) ** 2,
        4 * s**2 * (3 - 5 * fourth) / (1 + fourth) ** 3,
        np.zeros_like(s),
    ]
    table = Table(knots=s, columns=np.concatenate(columns))
    rows = LawRows.of(1)
    rows.add_way(SIPHON, table, 1000.0, more=())
    whole = rows.arrays({})
    numbers, pieces = (each.tolist() for each in whole)
    cells, near_roots = [0.0] * ROOT_PLACES, np.zeros((len(pieces), WIDTH_OF_ROOT)).tolist()
    set_roots(numbers, pieces, SIPHON, cells, near_roots)
    compiled = np.zeros((1, ROOT_PLACES)), np.zeros((len(pieces), WIDTH_OF_ROOT))
    set_all_roots(*whole, 1, *compiled)
    assert (compiled[0].tolist(), compiled[1].tolist()) == ([cells], near_roots)
    inside = (s[0] ** 8 / 2 < np.array(u)) & (np.array(u) < s[-1] ** 4 / 2)
    roots = roots_of(table, u)
    right = np.sqrt((np.array(u) + np.sqrt(np.array(u) ** 2 + 4 * np.array(u))) / 2) ** 0.5
    np.testing.assert_allclose(roots[inside], right[inside], rtol=1e-9)
    for speed, root in zip(u, roots.tolist(), strict=True):
        assert velocity_under(numbers, pieces, SIPHON, 1000.0 * root**8) == pytest.approx(speed, rel=1e-12)
        found, slope = root_of_velocity(cells, near_roots, pieces, SIPHON, speed)
        assert found == pytest.approx(1000.0**0.125 * root, rel=1e-12)
        more = root_of_velocity(cells, near_roots, pieces, SIPHON, speed * (1 + 1e-6))[0]
        assert speed * 1e-6 / (more - found) == pytest.approx(slope, rel=1e-4)


def test_nothing_outside_can_change_a_table() -> None:
    source = np.linspace(0, 1, 5)
    table = Table(knots=source, columns=source)
    source[0] = 99.0
    assert table.knots[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        table.knots[0] = 1.0


@pytest.mark.parametrize(
    "broken",
    [
        {"knots": np.array([0.0, 0.0])},
        {"knots": np.array([1.0]), "columns": np.array([1.0])},
        {"columns": np.array([1.0, np.nan])},
        {"columns": np.array([1.0, 2.0, 3.0])},
        {"columns": np.array([])},
    ],
)
def test_tables_that_make_no_sense_are_refused(broken: dict[str, object]) -> None:
    good: dict[str, object] = {"knots": np.array([0.0, 1.0]), "columns": np.array([0.0, 1.0])}
    with pytest.raises(ValueError, match=r"finite|knots|columns"):
        Table(**(good | broken))  # type: ignore[arg-type]
