"""The paper's own printed digits, with the roundings that lead to them; source: the liquid-ring paper."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from ringbalance.physics.pressure.hydrostatics import hydrostatic_pressure
from ringbalance.reduced_model import paper
from ringbalance.scene.models import Scene

ROUNDED_RADIUS = 34.9e-3


def printed(value: float, digits: int) -> str:
    return f"{value:.{digits}f}"


def test_chamber_volume_is_printed_as_67_7_ml(table_1_scene: Scene) -> None:
    assert printed(paper.chamber_volume_paper(disc=table_1_scene.disc) * 1e6, 1) == "67.7"


def test_liquid_volumes_follow_from_the_rounded_chamber_volume(table_1_scene: Scene) -> None:
    # 33.85 ml is printed as 33.9 because it is half of the already rounded 67.7 ml.
    assert printed(round(0.5 * 67.7 + 1e-9, 1), 1) == "33.9"
    assert paper.max_liquid_volume_paper(disc=table_1_scene.disc) * 1e6 == pytest.approx(33.85, abs=1e-3)
    assert printed(0.5 * paper.max_liquid_volume_paper(disc=table_1_scene.disc) * 1e6, 1) == "16.9"


@pytest.mark.parametrize("liquid_ml", [None, 33.85, 33.9])
def test_smallest_ring_radius_is_printed_as_34_9_mm(table_1_scene: Scene, liquid_ml: float | None) -> None:
    exact = paper.max_liquid_volume_paper(disc=table_1_scene.disc)
    volume = exact if liquid_ml is None else liquid_ml * 1e-6
    radius = float(paper.surface_radius_paper(disc=table_1_scene.disc, liquid_volume=volume))
    assert printed(radius * 1e3, 1) == "34.9"


def test_moment_1333_g_mm_needs_the_rounded_radius(table_1_scene: Scene) -> None:
    disc = table_1_scene.disc
    exact = float(
        paper.surface_radius_paper(disc=disc, liquid_volume=paper.max_liquid_volume_paper(disc=disc))
    )
    rounded, unrounded = (
        float(paper.moment_paper(disc=disc, density=1000.0, surface_radius=a)) * 1e6
        for a in (ROUNDED_RADIUS, exact)
    )
    assert printed(rounded, 0) == "1333"
    assert printed(unrounded, 0) == "1334"
    assert printed(float(paper.capacity(chamber_moment=rounded)), 0) == "1885"
    assert printed(float(paper.capacity(chamber_moment=2 * rounded)), 0) == "3771"  # the paper doubles 1885


def test_departures_of_fig_4(table_1_scene: Scene) -> None:
    def departures(pair_volume: float | None) -> list[str]:
        values = paper.departure(
            disc=table_1_scene.disc,
            density=1000.0,
            angular_velocity=table_1_scene.rotor.speed,
            gas_pressure=[0.7e6, 1.5e6],
            pair_volume=pair_volume,
        )
        return [printed(100 * v, 1) for v in values]

    from_rounded_radius = paper.flat_strip_area(disc=table_1_scene.disc, surface_radius=ROUNDED_RADIUS)
    assert departures(None) == ["45.7", "22.9"]
    assert departures(2 * 16.9e-6)[0] == "45.6"
    assert departures(float(from_rounded_radius) * table_1_scene.disc.axial_width) == ["45.6", "22.9"]


def test_stall_pressure_of_the_papers_disc(table_1_scene: Scene) -> None:
    stall = paper.stall_pressure(
        disc=table_1_scene.disc, density=1000.0, angular_velocity=table_1_scene.rotor.speed
    )
    assert printed(stall / 1e6, 3) == "0.381"


def test_eq_12_equals_the_integrated_element_without_plates(table_1_scene: Scene) -> None:
    bare = dataclasses.replace(table_1_scene.disc, plate_thickness=0.0)
    volume = np.linspace(0, 0.5, 7) * paper.chamber_volume_paper(disc=bare)
    radius = paper.surface_radius_paper(disc=bare, liquid_volume=volume)
    common = {"density": 1000.0, "angular_velocity": 1047.2}
    by_volume = paper.wall_pressure_paper(disc=bare, liquid_volume=volume, **common)
    by_radius = hydrostatic_pressure(inner=radius, outer=bare.outer_radius, **common)
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
