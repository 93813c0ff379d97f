"""Closed forms of the cross-section against adaptive quadrature, and at their limits."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from ringbalance.mesh.geometry import (
    chamber_volume,
    half_angle,
    liquid_area,
    liquid_first_moment,
    surface_radius,
)
from ringbalance.scene.models import Disc


def by_quadrature(disc: Disc, inner: float, weight: str) -> float:
    """Integral over the section of 1 or x, from the plates' straight faces alone."""

    def strip(r: float) -> float:
        angle = disc.central_angle / 2 - np.arcsin(disc.plate_thickness / r)
        return float(2 * r * angle if weight == "area" else 2 * r**2 * np.sin(angle))

    return float(quad(strip, inner, disc.outer_radius, epsabs=0, epsrel=1e-13)[0])


@pytest.mark.parametrize("inner", [20.5e-3, 30e-3, 44e-3])
@pytest.mark.parametrize("plate", [0.0, 1e-3, 2.777e-3, 12e-3])
@pytest.mark.parametrize("angle", [np.pi / 4, np.pi / 2, np.pi])
def test_closed_forms_agree_with_quadrature(disc: Disc, inner: float, plate: float, angle: float) -> None:
    thick = replace(disc, plate_thickness=min(plate, 0.9 * inner * np.sin(angle / 2)), central_angle=angle)
    area, moment = by_quadrature(thick, inner, "area"), by_quadrature(thick, inner, "moment")
    assert liquid_area(disc=thick, surface_radius=inner) == pytest.approx(area, rel=1e-11)
    assert liquid_first_moment(disc=thick, surface_radius=inner) == pytest.approx(moment, rel=1e-11)


def test_the_papers_chamber_holds_67_7_millilitres(disc: Disc) -> None:
    """Section 3.1 of the liquid-ring paper; the plate thickness was inferred from this very number."""
    assert chamber_volume(disc=disc) == pytest.approx(67.7e-6, abs=0.05e-6)


def test_faces_of_the_plates_are_straight_and_offset(disc: Disc) -> None:
    radius = np.linspace(disc.inner_radius, disc.outer_radius, 7)
    angle = half_angle(disc=disc, radius=radius)
    normal = np.array([-np.sin(disc.central_angle / 2), np.cos(disc.central_angle / 2)])
    distance = -normal @ np.stack([radius * np.cos(angle), radius * np.sin(angle)])
    np.testing.assert_allclose(distance, disc.plate_thickness, rtol=1e-13)


def test_full_and_empty_chambers_end_at_the_walls(disc: Disc) -> None:
    radius = surface_radius(disc=disc, fill_ratio=[0.0, 1.0])
    np.testing.assert_allclose(radius, [disc.outer_radius, disc.inner_radius], rtol=1e-15)


@pytest.mark.parametrize("depth", [1e-6, 1e-8])
def test_a_film_keeps_its_depth(disc: Disc, depth: float) -> None:
    """Depth from the volume by rational arithmetic on a sector, where nothing cancels unseen."""
    sector = replace(disc, plate_thickness=0.0)
    r1, r2, d = (Fraction(v) for v in (sector.inner_radius, sector.outer_radius, depth))
    fill = float((r2**2 - (r2 - d) ** 2) / (r2**2 - r1**2))
    radius = float(surface_radius(disc=sector, fill_ratio=fill))
    assert sector.outer_radius - radius == pytest.approx(depth, abs=2e-17)


@given(
    fill=st.floats(1e-6, 1.0),
    angle=st.floats(0.3, np.pi),
    ratio=st.floats(0.2, 0.95),
    plate=st.floats(0.0, 0.8),
)
def test_radius_inverts_the_area(fill: float, angle: float, ratio: float, plate: float) -> None:
    inner = 0.1 * ratio
    disc = Disc(
        outer_radius=0.1,
        inner_radius=inner,
        axial_width=0.05,
        central_angle=angle,
        chambers=2,
        plate_thickness=plate * inner * np.sin(angle / 2),
        max_fill_ratio=0.5,
        initial_fill=0.25,
    )
    radius = float(surface_radius(disc=disc, fill_ratio=fill))
    whole = float(liquid_area(disc=disc, surface_radius=inner))
    area = float(liquid_area(disc=disc, surface_radius=radius))
    assert inner <= radius <= 0.1
    assert area == pytest.approx(fill * whole, rel=1e-11, abs=1e-15 * 0.1**2)
