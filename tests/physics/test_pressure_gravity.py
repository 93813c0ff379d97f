"""Gravity: the free surface that the solver finds against the circle and the paraboloid that theory knows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.mesh.chamber import default_cells
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid
from ringbalance.physics.pressure.surface import _find_surface, refined_surface, solve_with_gravity
from ringbalance.physics.results import StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc

G = 9.80665


def across(speed: float, angle: float) -> RotatingLiquid:
    """Water at a speed in rpm with gravity across the shaft at an angle in the chamber's frame."""
    gravity = (G * np.cos(angle), G * np.sin(angle))
    return RotatingLiquid(density=1000.0, angular_velocity=speed * np.pi / 30, gravity=gravity)


def along(speed: float) -> RotatingLiquid:
    return RotatingLiquid(density=1000.0, angular_velocity=speed * np.pi / 30, gravity=(0.0, 0.0, -G))


def level(solution: PressureSolution, liquid: RotatingLiquid) -> FloatArray:
    """Radius, at mid-height, of the exact isobar through each surface node, m: a constant if it is one."""
    chamber, omega = solution.chamber, liquid.angular_velocity
    nodes = chamber.places[:, chamber.grid[0]]
    pull = np.zeros(3)
    pull[: len(liquid.gravity)] = liquid.gravity
    x, y = nodes[0] + pull[0] / omega**2, nodes[1] + pull[1] / omega**2
    axial = nodes[2] if len(nodes) == 3 else 0.0
    return np.asarray(np.sqrt(x**2 + y**2 + 2 * pull[2] * axial / omega**2))


@pytest.mark.parametrize("speed", [400.0, 1000.0, 10_000.0])
@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5, np.pi, -1.2])
def test_the_surface_is_a_circle_about_minus_g_over_omega_squared(
    disc: Disc, speed: float, angle: float
) -> None:
    liquid = across(speed, angle)
    spread, mismatch = [], []
    for k in (4, 2, 1):
        cells = tuple(n // k for n in default_cells(disc=disc))
        solution = solve_with_gravity(disc=disc, liquid=liquid, fill_ratio=0.3, cells=cells)
        assert solution.status.ok, solution.status.text
        spread.append(float(np.ptp(level(solution, liquid))) / disc.outer_radius)
        mismatch.append(solution.statistics.extra["surface_flux_mismatch"])
        assert abs(solution.statistics.extra["volume_error"]) < 1e-14
    rates = np.log2(np.array(spread[:-1]) / spread[1:])
    assert np.all(rates > 2.7), rates
    assert spread[-1] < 5e-7
    assert np.log2(mismatch[0] / mismatch[-1]) > 2 * 2.0
    assert mismatch[-1] < 5e-7


def test_a_film_of_micrometres_is_found_at_high_speed(disc: Disc) -> None:
    depth = 5e-6
    fill = 2 * depth * disc.outer_radius / (disc.outer_radius**2 - disc.inner_radius**2)
    liquid = across(60_000.0, 0.4)
    solution = solve_with_gravity(disc=disc, liquid=liquid, fill_ratio=fill, cells=(4, 24))
    assert solution.status.ok
    assert np.ptp(level(solution, liquid)) < 1e-3 * depth


@pytest.mark.parametrize(
    ("speed", "angle", "fill", "word"),
    [
        (100.0, 0.0, 0.3, "rpm"),
        (250.0, 0.0, 0.05, "dry"),
        (10_000.0, 0.3, 1e-7, "dry"),
        (600.0, np.pi / 2, 0.97, "inner radius"),
    ],
)
def test_no_ring_is_a_status_and_not_a_solve(
    disc: Disc, speed: float, angle: float, fill: float, word: str
) -> None:
    liquid = across(speed, angle)
    solution = solve_with_gravity(disc=disc, liquid=liquid, fill_ratio=fill, cells=(4, 12))
    assert solution.status.code is StatusCode.NO_RING
    assert word in solution.status.text
    assert not np.any(solution.pressure)
    assert solution.statistics.unknowns == 0


def test_axial_gravity_that_empties_one_end_is_no_ring(disc: Disc) -> None:
    solution = solve_with_gravity(disc=disc, liquid=along(250.0), fill_ratio=0.2, cells=(2, 6, 2))
    assert solution.status.code is StatusCode.NO_RING


def test_a_start_from_the_coarser_mesh_leads_to_the_same_surface(disc: Disc) -> None:
    liquid = across(500.0, 1.0)
    coarse = _find_surface(disc=disc, liquid=liquid, fill_ratio=0.3, cells=(4, 12))
    cold = _find_surface(disc=disc, liquid=liquid, fill_ratio=0.3, cells=(8, 24))
    start = refined_surface(coarse.chamber.surface_radius)
    warm = _find_surface(disc=disc, liquid=liquid, fill_ratio=0.3, cells=(8, 24), start=start)
    assert warm.statistics.iterations < cold.statistics.iterations
    np.testing.assert_allclose(
        warm.chamber.surface_radius, cold.chamber.surface_radius, atol=1e-9 * disc.outer_radius
    )


@given(fill=st.floats(0.1, 0.9), angle=st.floats(0.0, np.pi), speed=st.floats(800.0, 20_000.0))
def test_opposite_angles_give_mirror_images(fill: float, angle: float, speed: float) -> None:
    disc = Disc(
        outer_radius=0.06,
        inner_radius=0.03,
        axial_width=0.05,
        central_angle=1.0,
        chambers=6,
        plate_thickness=2e-3,
        max_fill_ratio=0.5,
        initial_fill=0.25,
    )
    first, second = (
        _find_surface(disc=disc, liquid=across(speed, sign * angle), fill_ratio=fill, cells=(2, 6))
        for sign in (1, -1)
    )
    assert first.status.ok
    np.testing.assert_allclose(
        first.chamber.surface_radius, second.chamber.surface_radius[::-1], atol=1e-9 * 0.06
    )
