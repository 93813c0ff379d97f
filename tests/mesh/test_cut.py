"""Imported chambers against closed forms: boxes, sectors and what every chamber has in common."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from ringbalance.mesh.chamber_table import SLOPE_TOLERANCE, TOLERANCE, _refined, chamber_table
from ringbalance.mesh.faceting import drawing_shares
from ringbalance.mesh.geometry import (
    chamber_volume,
    half_angle,
    liquid_area,
    liquid_first_moment,
    moment_across,
    surface_centroid,
    surface_radius,
    wall_square,
)
from ringbalance.mesh.wall_integrals import (
    COLUMNS,
    LONGEST_SIDE_RATIO,
    integrals,
    split_patches,
    wall_patches,
    walls_about,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import STRETCHED, CellKind, ChamberGeometry
from ringbalance.scene.models import Disc
from ringbalance.verification.reference.chambers import block_chamber, disc_chamber

KINDS = get_args(CellKind)
X0, X1, HALF, WIDTH = 0.02, 0.045, 0.02, 0.06


def box(*, kind: CellKind = "hexahedron", turned: float = 0.0) -> ChamberGeometry:
    """x0 <= x <= x1, |y| <= w, |z| <= B/2, turned about the shaft; its outer wall is flat."""

    def place(cube: FloatArray) -> FloatArray:
        x, y = X0 + (X1 - X0) * cube[..., 0], HALF * (2 * cube[..., 1] - 1)
        c, s = np.cos(turned), np.sin(turned)
        return np.stack([c * x - s * y, s * x + c * y, WIDTH * (cube[..., 2] - 0.5)], axis=-1)

    return block_chamber((2, 3, 2), place, kind=kind)


def in_box(a: float) -> tuple[float, float, float, float]:
    """V, its moment along x, and their derivatives by a^2, of the box outside r = a, by quadrature."""

    def start(y: float) -> float:
        return min(max(X0, float(np.sqrt(max(a * a - y * y, 0.0)))), X1)

    def on_surface(y: float) -> bool:
        return bool(X0 < start(y) < X1)

    corners = [np.sqrt(a * a - x * x) for x in (X0, X1) if a > x]
    marks = [0.0, *sorted(y for y in corners if y < HALF), HALF]
    functions = (
        lambda y: X1 - start(y),
        lambda y: (X1**2 - start(y) ** 2) / 2,
        lambda y: -on_surface(y) / (2 * start(y)),
        lambda y: -0.5 * on_surface(y),
    )
    pieces = list(pairwise(marks))
    found = [sum(quad(f, *p, epsabs=1e-14, epsrel=1e-12)[0] for p in pieces) for f in functions]
    v, u, dv, du = (2 * WIDTH * value for value in found)
    return v, u, dv, du


@pytest.mark.parametrize("kind", KINDS)
def test_a_box_holds_what_quadrature_says(kind: CellKind) -> None:
    """The integrals' own limit: six Gauss points on graphs, and pieces of 1e-12 of the volume left alone."""
    radii = np.array([0.0201, 0.024, 0.0283, 0.033, 0.0449, 0.0455, 0.048])
    walls = walls_about(*split_patches(*wall_patches(box(kind=kind)), longest=LONGEST_SIDE_RATIO))
    found = integrals(walls, radii**2)[[0, 1, 4, 5]]
    expected = np.array([in_box(a) for a in radii]).T
    size = np.abs(expected).max(axis=1, keepdims=True)
    assert np.max(np.abs(found - expected)[:2] / size[:2]) < 1e-9
    assert np.max(np.abs(found - expected)[2:] / size[2:]) < 1e-6


@pytest.mark.parametrize("kind", ["hexahedron27", "tetra10", "hexahedron20"])
def test_the_built_in_chamber_as_a_mesh_is_the_closed_form_but_for_its_drawn_arcs(
    disc: Disc, kind: CellKind
) -> None:
    """An arc of angle h is drawn R (h/2)^4/32 away at most: that times its length is missing, at most."""
    cells = (3, 16, 2)
    imported = replace(disc, geometry=disc_chamber(disc, cells, kind=kind))
    away = disc.outer_radius * (disc.central_angle / cells[1] / 2) ** 4 / 32
    x = np.linspace(0.05, 0.95, 7)
    a, b = surface_radius(disc=disc, fill_ratio=x), surface_radius(disc=imported, fill_ratio=x)
    assert np.max(np.abs(a - b)) < 2 * away
    film = away / (disc.outer_radius - disc.inner_radius)
    for at in (liquid_area, liquid_first_moment, wall_square):
        plain, meshed = at(disc=disc, surface_radius=a), at(disc=imported, surface_radius=a)
        assert np.max(np.abs(meshed - plain)) < 3 * film * plain.max() + 2 * TOLERANCE * plain.max()
    # The plates' faces are straight in the mesh too.
    for slope in (half_angle, surface_centroid):
        plain, meshed = slope(disc=disc, radius=a), slope(disc=imported, radius=a)
        assert np.max(np.abs(meshed / plain - 1)) < 2 * SLOPE_TOLERANCE
    volume = chamber_volume(disc=disc)
    assert chamber_volume(disc=imported) == pytest.approx(volume, rel=4 * film)
    assert np.max(np.abs(moment_across(disc=imported, surface_radius=b))) < 1e-15
    # At the wall itself, to which a port is looked for where a column does not flow.
    last = disc.outer_radius * (1 + np.linspace(-1e-15, 1e-15, 21))
    assert np.min(liquid_area(disc=imported, surface_radius=last)) >= 0


@pytest.mark.parametrize(("kind", "order"), [("tetra", 2.0), ("hexahedron", 2.0), ("tetra10", 4.0)])
def test_drawn_arcs_converge(disc: Disc, kind: CellKind, order: float) -> None:
    """Chords leave (h^2/24) of R^2 for arcs of angle h, quadratic ones a part of h^4.

    The next term is h^2/20 of that: at three cells it moves a rate by 0.015.
    """
    errors = []
    for angular in (3, 6, 12):
        meshed = replace(disc, geometry=disc_chamber(disc, (1, angular, 1), kind=kind))
        errors.append(abs(chamber_volume(disc=meshed) / chamber_volume(disc=disc) - 1))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, order, atol=0.05)
    # Chords miss (theta/12)^2/6 of R2^2 theta/2 outside and gain as much of R1^2 inside.
    assert errors[-1] < ((disc.central_angle / 12) ** order) / 6


@given(turn=st.floats(-1.0, 1.0), kind=st.sampled_from(["tetra", "hexahedron27"]))
@settings(max_examples=6)
def test_turning_about_the_shaft_changes_only_the_direction_of_the_moment(
    turn: float, kind: CellKind
) -> None:
    levels = np.array([0.022, 0.0449, 0.047]) ** 2
    plain, turned = (
        integrals(
            walls_about(*split_patches(*wall_patches(box(kind=kind, turned=t)), longest=LONGEST_SIDE_RATIO)),
            levels,
        )
        for t in (0.0, turn)
    )
    unit = np.array([np.cos(turn), np.sin(turn)])[:, None]
    # What pieces of 1e-12 of the volume hold differs from way of cutting to way of cutting.
    np.testing.assert_allclose(turned[0], plain[0], atol=1e-9 * plain[0].max())
    np.testing.assert_allclose(turned[1:3], unit * plain[1], atol=1e-9 * plain[1].max())


def test_the_table_agrees_with_the_integrals_and_falls() -> None:
    geometry = box(kind="hexahedron")
    table = chamber_table(geometry)
    levels = table.level_of(table.volume * np.linspace(0.998, 0.002, 57))
    walls = walls_about(*table.patches)
    found, exact = np.concatenate(table.at(levels)), integrals(walls, levels)
    exact[[3, 7]] /= table.wall_area
    size = np.abs(exact).max(axis=1)
    assert np.max(np.abs(found - exact)[:2] / size[:2, None]) < TOLERANCE
    assert np.max(np.abs(found - exact)[[4, 5, 7]] / size[[4, 5, 7], None]) < SLOPE_TOLERANCE
    assert np.all(np.diff(table.columns[0]) <= 0)
    fills = np.linspace(0, 1, 31)
    np.testing.assert_allclose(
        table.at(table.level_of(fills * table.volume))[0][0], fills * table.volume, atol=1e-12 * table.volume
    )


@pytest.mark.parametrize("column", [0, 1, 3])
def test_every_slope_that_is_asked_for_refines_the_table(column: int) -> None:
    """A narrow wiggle of each of them, half as high as the values' tolerance: area, moment, wet wall."""
    height, width, middle = TOLERANCE / 2, TOLERANCE / (20 * SLOPE_TOLERANCE), 1 / 16

    def exact(levels: FloatArray) -> FloatArray:
        x = (levels - middle) / width
        bump = np.exp(-np.minimum(x**2, 700.0))
        columns = np.stack([1 - levels] * COLUMNS + [-np.ones_like(levels)] * COLUMNS)
        columns[column] += height * x * bump
        columns[COLUMNS + column] += height / width * (1 - 2 * x**2) * bump
        return columns

    start = np.linspace(0.0, 1.0, 9)
    nodes, _, _ = _refined(start, exact(start), exact)
    assert np.min(np.diff(nodes)) < 10 * width


def test_the_wall_pressure_counts_the_wet_part_of_a_flat_wall(disc: Disc) -> None:
    """Of |y| <= w at x1 the part outside a is wet: mean of max(x1^2 + y^2 - a^2, 0)."""
    flat = replace(disc, geometry=box(), axial_width=WIDTH, outer_radius=float(np.hypot(X1, HALF)))
    for a in (0.03, 0.047):
        first = np.sqrt(max(a * a - X1 * X1, 0.0))
        wet = quad(lambda y, a=a: X1**2 + y * y - a * a, first, HALF)[0] / HALF
        assert wall_square(disc=flat, surface_radius=a) == pytest.approx(wet, rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_what_facets_may_miss_holds_what_they_miss(disc: Disc, kind: CellKind) -> None:
    """The true chamber is known here; an interval three times too wide would say little."""
    geometry, fills = disc_chamber(disc, (1, 8, 2), kind=kind), np.linspace(0.05, 0.9, 5)
    meshed = replace(disc, geometry=geometry)
    shares, volume = drawing_shares(meshed, fills), chamber_volume(disc=meshed)
    missing = abs(volume - chamber_volume(disc=disc))
    assert shares.volume * volume / 3 < missing < shares.volume * volume
    a, b = (surface_radius(disc=each, fill_ratio=fills) for each in (disc, meshed))
    plain, drawn = (
        disc.axial_width * liquid_first_moment(disc=each, surface_radius=at)
        for each, at in ((disc, a), (meshed, b))
    )
    assert np.all(np.abs(plain - drawn) < shares.first_moment * drawn)
    assert np.all(shares.first_moment * drawn < 4 * np.abs(plain - drawn))
    walls = [wall_square(disc=each, surface_radius=at) for each, at in ((disc, a), (meshed, b))]
    assert np.all(np.abs(walls[0] - walls[1]) < shares.wall_pressure * walls[1])
    centres = [surface_centroid(disc=each, radius=at) for each, at in ((disc, a), (meshed, b))]
    assert np.all(np.abs(centres[0] - centres[1]) < shares.centroid * centres[1])


@pytest.mark.parametrize("quantity", ["outer_radius", "inner_radius", "axial_width", "central_angle"])
def test_a_stretched_chamber_has_the_table_of_its_mesh_moved(disc: Disc, quantity: str) -> None:
    """Stretched sectors stay sectors; the integrals over the moved nodes are made again for comparison."""
    plain = replace(disc, plate_thickness=0.0)
    geometry = disc_chamber(plain, (3, 16, 2), kind="hexahedron27")
    dimensions = {name: getattr(plain, name) for name in STRETCHED}
    value = 1.02 * dimensions[quantity]
    moved = geometry.stretched(dimensions=dimensions, quantity=quantity, value=value)
    table, fresh = (
        chamber_table(moved),
        chamber_table(replace(moved, digest=f"fresh {quantity}", stretch=None)),
    )
    volumes = fresh.volume * np.linspace(0.05, 0.95, 9)
    assert table.volume == pytest.approx(fresh.volume, rel=1e-6)
    # What quadratic cells draw of a stretched arc differs by R (h/2)^4/32 at most.
    np.testing.assert_allclose(table.level_of(volumes), fresh.level_of(volumes), rtol=1e-6)
    at = fresh.level_of(volumes)
    np.testing.assert_allclose(table.at(at)[0][[0, 1, 3]], fresh.at(at)[0][[0, 1, 3]], rtol=3e-6)
    np.testing.assert_allclose(table.at(at)[1][:2], fresh.at(at)[1][:2], rtol=3e-5)


@pytest.mark.parametrize("quantity", ["axial_width", "central_angle"])
def test_a_stretched_chamber_beside_its_middle_keeps_its_moment_across(disc: Disc, quantity: str) -> None:
    """Of a sector turned by an angle t all moments across are tan(t) times those along."""
    plain, turn = replace(disc, plate_thickness=0.0), 0.01
    geometry = disc_chamber(plain, (3, 16, 2), kind="hexahedron27")
    x, y, z = geometry.points.T
    points = np.column_stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), z])
    dimensions = {name: getattr(plain, name) for name in STRETCHED}
    moved = replace(geometry, points=points, digest="turned").stretched(
        dimensions=dimensions, quantity=quantity, value=1.05 * dimensions[quantity]
    )
    columns = chamber_table(moved).columns[:, 0]
    angle = turn * (1.05 if quantity == "central_angle" else 1.0)
    assert columns[2] / columns[1] == pytest.approx(np.tan(angle), rel=2e-4)


def test_a_surface_that_crosses_one_edge_of_a_wall_twice() -> None:
    """The side y = w bulges by b (1 - (2 z/B)^2), which quadratic cells draw exactly."""
    bulge, a = 0.004, 0.029

    def place(cube: FloatArray) -> FloatArray:
        x, z = X0 + (X1 - X0) * cube[..., 0], 2 * cube[..., 2] - 1
        y = HALF * (2 * cube[..., 1] - 1) + bulge * cube[..., 1] * (1 - z**2)
        return np.stack([x, y, WIDTH / 2 * z], axis=-1)

    def slice_at(y: float) -> float:
        start = max(X0, float(np.sqrt(max(a * a - y * y, 0.0))))
        return (X1 - start) * WIDTH * float(np.sqrt(1 - max(y - HALF, 0.0) / bulge))

    geometry = block_chamber((1, 1, 1), place, kind="hexahedron27")
    patches, outer = split_patches(*wall_patches(geometry), longest=LONGEST_SIDE_RATIO)
    found = integrals(walls_about(patches, outer), np.array([a**2]))[0, 0]
    corner = float(np.sqrt(a**2 - X0**2))
    marks = sorted([-HALF, -corner, corner, HALF, HALF + bulge])
    expected = sum(
        quad(slice_at, *piece, epsabs=1e-18, epsrel=1e-12)[0]
        for piece in pairwise(marks)
        if piece[0] >= -HALF
    )
    assert found == pytest.approx(expected, rel=1e-9)
