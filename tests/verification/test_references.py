"""The references themselves are compared with routes that share nothing with them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import dblquad

from ringbalance.mesh.geometry import chamber_volume, half_angle, liquid_area, surface_radius
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.cases import sections as case
from ringbalance.verification.evidence import input_uncertainty
from ringbalance.verification.reference.chambers import central_lambda, exact_moment, exact_wall_pressure
from ringbalance.verification.reference.pressure import Manufactured, _exact_ring


def test_the_moment_is_that_of_a_sector_without_plates(paper_scene: Scene) -> None:
    # Closed form: 2/3 rho B (R2^3 - a^3) sin(theta/2).
    disc = dataclasses.replace(paper_scene.disc, plate_thickness=0.0)
    a = math.sqrt(disc.outer_radius**2 - 0.4 * (disc.outer_radius**2 - disc.inner_radius**2))
    expected = 2 / 3 * 1000 * disc.axial_width * (disc.outer_radius**3 - a**3) * math.sin(math.pi / 4)
    assert float(exact_moment(disc=disc, density=1000, fill_ratio=0.4)) == pytest.approx(expected, rel=1e-12)


def test_the_moment_with_plates_by_two_integrals(paper_scene: Scene) -> None:
    disc = paper_scene.disc
    a = float(surface_radius(disc=disc, fill_ratio=0.3))

    def angle(r: float) -> float:
        return math.pi / 4 - math.asin(disc.plate_thickness / r)

    value, _ = dblquad(
        lambda phi, r: r**2 * math.cos(phi),
        a,
        disc.outer_radius,
        lambda r: -angle(r),
        angle,
        epsabs=0,
        epsrel=1e-10,
    )
    result = float(exact_moment(disc=disc, density=1000, fill_ratio=0.3))
    assert result == pytest.approx(1000 * disc.axial_width * value, rel=1e-9)


def test_lambda_approaches_its_limit_at_the_centre(paper_scene: Scene) -> None:
    disc, x = paper_scene.disc, np.array([0.2499, 0.2501])
    moments = exact_moment(disc=disc, density=1.0, fill_ratio=[x, disc.max_fill_ratio - x])
    near = (moments[0] - moments[1]) / (chamber_volume(disc=disc) * (x - disc.max_fill_ratio / 2))
    assert near == pytest.approx([central_lambda(disc=disc)] * 2, rel=1e-6)


def test_the_wall_pressure_holds_the_centrifugal_force_of_a_thin_film(paper_scene: Scene) -> None:
    disc = paper_scene.disc
    fill = 1e-6
    film = fill * chamber_volume(disc=disc) / disc.axial_width
    arc = 2 * disc.outer_radius * float(half_angle(disc=disc, radius=disc.outer_radius))
    thin = 1000 * 500.0**2 * disc.outer_radius * film / arc
    result = exact_wall_pressure(disc=disc, density=1000, angular_velocity=500.0, fill_ratio=fill)
    assert float(result) == pytest.approx(thin, rel=1e-5)


@pytest.mark.parametrize("dimension", [2, 3])
def test_derivatives_of_the_manufactured_pressure(dimension: int) -> None:
    exact = Manufactured(length=0.0445, width=0.062)
    point = np.array([0.031, 0.012, 0.009])[:dimension]
    step = 1e-5
    shifts = step * np.eye(dimension)
    ahead = np.array([exact.pressure(point + d) for d in shifts])
    behind = np.array([exact.pressure(point - d) for d in shifts])
    np.testing.assert_allclose(exact.gradient(point), (ahead - behind) / (2 * step), rtol=1e-6)


def test_the_manufactured_flow_satisfies_its_equation() -> None:
    """All derivatives once more by central differences, in the equation itself."""
    point, step = np.array([0.12, 0.21]), 1e-4

    def derivative(field: Callable[[np.ndarray], np.ndarray], axis: int) -> np.ndarray:
        shift = step * np.eye(2)[axis]
        return np.asarray((field(point + shift) - field(point - shift)) / (2 * step))

    def second(axis: int) -> np.ndarray:
        shift = step * np.eye(2)[axis]
        ahead, behind = case.velocity(point + shift), case.velocity(point - shift)
        return (ahead + behind - 2 * case.velocity(point)) / step**2

    u, v, w = case.velocity(point)
    gradients = [derivative(case.velocity, axis) for axis in (0, 1)]
    assert gradients[0][0] + gradients[1][1] == pytest.approx(0.0, abs=1e-7)
    turning = np.array([w, 0.0, -u])
    slope = np.array([*(derivative(case.pressure, axis) for axis in (0, 1)), 0.0])
    expected = (
        3.0 * (u * gradients[0] + v * gradients[1]) + 5.0 * turning - 0.7 * (second(0) + second(1)) + slope
    )
    np.testing.assert_allclose(case.body_force(point), expected, rtol=1e-5, atol=1e-5)


def test_the_exact_ring_across_the_shaft_is_a_circle_that_holds_the_liquid(disc: Disc) -> None:
    ring = _exact_ring(disc=disc, density=800, angular_velocity=60.0, fill_ratio=0.4, transverse=(5.0, 4.0))
    angle = np.linspace(-0.5, 0.5, 7)
    surface = ring.radius(angle) * np.exp(1j * angle)
    centre = -complex(5.0, 4.0) / 60.0**2
    np.testing.assert_allclose(np.abs(surface - centre), ring.level, rtol=1e-13)
    np.testing.assert_allclose(ring.pressure(np.stack([surface.real, surface.imag])), 0, atol=1e-9)
    assert counted_area(disc, centre, ring.level) == pytest.approx(
        0.4 * float(liquid_area(disc=disc, surface_radius=disc.inner_radius)), rel=1e-4
    )


def test_the_exact_ring_along_the_shaft_is_a_paraboloid_that_holds_the_liquid(disc: Disc) -> None:
    ring = _exact_ring(disc=disc, density=800, angular_velocity=60.0, fill_ratio=0.4, axial=9.81)
    z = np.linspace(-disc.axial_width / 2, disc.axial_width / 2, 2001)
    radius = ring.radius(0.0, z)
    np.testing.assert_allclose(radius**2 - ring.level**2, 2 * 9.81 / 60.0**2 * z, atol=1e-15)
    volume = np.trapezoid(liquid_area(disc=disc, surface_radius=radius), z)
    assert float(volume) == pytest.approx(0.4 * chamber_volume(disc=disc), rel=1e-6)


def counted_area(disc: Disc, centre: complex, level: float) -> float:
    """Area of the chamber beyond a circle, on a fine polar grid."""
    radial, angular = 1500, 1500
    r = disc.inner_radius + (disc.outer_radius - disc.inner_radius) * (np.arange(radial) + 0.5) / radial
    alpha = half_angle(disc=disc, radius=r)
    phi = np.outer(alpha, 2 * (np.arange(angular) + 0.5) / angular - 1)
    beyond = np.abs(r[:, None] * np.exp(1j * phi) - centre) > level
    return float(
        np.sum(beyond.mean(axis=1) * 2 * alpha * r) * (disc.outer_radius - disc.inner_radius) / radial
    )


@pytest.fixture
def disc(paper_scene: Scene) -> Disc:
    return paper_scene.disc


def test_input_uncertainty_of_a_product() -> None:
    # f = a b with a = 3 +- 0.1, b = 4 +- 0.2: u^2 = (4 0.1)^2 + (3 0.2)^2.
    result = input_uncertainty([(lambda a: a * 4, 3.0, 0.1), (lambda b: 3 * b, 4.0, 0.2)])
    assert result == pytest.approx(math.hypot(0.4, 0.6))
