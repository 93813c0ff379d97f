"""The paper's own printed digits, with the roundings that lead to them; source: the liquid-ring paper."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from ringbalance.reduced_model import paper
from ringbalance.scene.models import Scene

ROUNDED_RADIUS = 34.9e-3


def test_eq_12_equals_the_integrated_element_without_plates(table_1_scene: Scene) -> None:
    bare = dataclasses.replace(table_1_scene.disc, plate_thickness=0.0)
    volume = np.linspace(0, 0.5, 7) * paper.chamber_volume_paper(disc=bare)
    radius = paper.surface_radius_paper(disc=bare, liquid_volume=volume)
    density, omega = 1000.0, 1047.2
    by_volume = paper.wall_pressure_paper(
        disc=bare, density=density, angular_velocity=omega, liquid_volume=volume
    )
    by_radius = density * omega**2 * (bare.outer_radius**2 - radius**2) / 2
    np.testing.assert_allclose(by_volume, by_radius, rtol=1e-12, atol=1e-6)


def test_surface_radius_inverts_eq_3(table_1_scene: Scene) -> None:
    disc = table_1_scene.disc
    radius = np.linspace(disc.inner_radius, disc.outer_radius, 11)
    volume = disc.axial_width * paper.flat_strip_area(disc=disc, surface_radius=radius)
    np.testing.assert_allclose(
        paper.surface_radius_paper(disc=disc, liquid_volume=np.maximum(volume, 0)), radius, rtol=1e-12
    )


def test_surface_radius_refuses_more_than_the_chamber_holds(table_1_scene: Scene) -> None:
    with pytest.raises(ValueError, match="liquid_volume"):
        paper.surface_radius_paper(disc=table_1_scene.disc, liquid_volume=68e-6)


def test_eq_22_taken_literally_doubles_eq_7(table_1_scene: Scene) -> None:
    disc = table_1_scene.disc
    mass = paper.correction_mass(disc=disc, density=1000.0, fill_ratio=disc.max_fill_ratio)
    literal = float(np.abs(paper.correction_moment(real_mass=mass, imaginary_mass=0.0)))
    eq_7 = float(paper.moment_paper(disc=disc, density=1000.0, surface_radius=ROUNDED_RADIUS))
    assert literal / eq_7 == pytest.approx(2 * 0.914, abs=2e-3)
