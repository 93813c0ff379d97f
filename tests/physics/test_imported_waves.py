"""Plane waves of imported chambers: those of the same sector, and sections that have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from block_discs import ribbed_chamber, sector_chamber

from ringbalance.mesh.geometry import liquid_area, surface_radius
from ringbalance.mesh.section import NoPlaneWavesError, middle_section
from ringbalance.physics.sloshing import resonant_fills, sloshing_modes, sloshing_response
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.models import Disc
from ringbalance.verification.reference.chambers import disc_chamber

_FILL = 0.3


def imported(disc: Disc, kind: CellKind = "hexahedron27") -> Disc:
    return replace(disc, geometry=disc_chamber(disc, (6, 16, 2), kind=kind))


@pytest.mark.parametrize("kind", ["hexahedron27", "hexahedron"])
def test_frequencies_and_swing_are_those_of_the_sector(disc: Disc, kind: CellKind) -> None:
    own, built_in = imported(disc, kind), disc
    found, expected = (sloshing_modes(disc=each, fill_ratio=_FILL, modes=3) for each in (own, built_in))
    gap = np.abs(found.frequency_ratio.value - expected.frequency_ratio.value)
    assert np.all(gap <= found.frequency_ratio.uncertainty + expected.frequency_ratio.uncertainty)
    limit = 1e-2 if kind == "hexahedron27" else 5e-2
    assert np.all(found.frequency_ratio.uncertainty <= limit * found.frequency_ratio.value)
    swings = [
        sloshing_response(
            disc=each, fill_ratio=_FILL, angular_velocity=300.0, kinematic_viscosity=1e-6, gravity=9.81
        )
        for each in (own, built_in)
    ]
    for name in ("amplification", "pressure_amplification", "surface_amplitude"):
        values = [float(getattr(swing, name).value[0]) for swing in swings]
        assert values[0] == pytest.approx(values[1], rel=0.05), name


def test_resonant_fills_are_those_of_the_sector(disc: Disc) -> None:
    found, expected = (dict(resonant_fills(disc=each, modes=3)) for each in (imported(disc), disc))
    assert found == pytest.approx(expected, rel=2e-2)


@pytest.mark.parametrize("coarse", [False, True])
@pytest.mark.parametrize("layers", [1, 2])
def test_a_section_holds_the_liquid_and_its_walls(disc: Disc, coarse: bool, layers: int) -> None:
    """With two layers of cells the middle plane goes through nodes."""
    geometry = disc_chamber(disc, (4, 12, layers))
    a = float(surface_radius(disc=disc, fill_ratio=_FILL))
    section = middle_section(geometry, surface_radius=a, coarse=coarse)
    mesh = section.mesh
    first, second = (mesh.p[:, mesh.t[k]] - mesh.p[:, mesh.t[0]] for k in (1, 2))
    area = np.abs(first[0] * second[1] - first[1] * second[0]).sum() / 2 * section.scale**2
    assert area == pytest.approx(float(liquid_area(disc=disc, surface_radius=a)), rel=0.03)
    named = np.concatenate(list(mesh.boundaries.values()))
    np.testing.assert_array_equal(np.sort(named), np.sort(mesh.boundary_facets()))
    assert set(mesh.boundaries) == {"free_surface", "outer_wall", "plate_left", "plate_right"}
    on = mesh.p[:, np.unique(mesh.facets[:, mesh.boundaries["outer_wall"]])]
    np.testing.assert_allclose(np.hypot(*on) * section.scale, disc.outer_radius, rtol=0.02)


def test_a_rib_that_parts_the_surface_is_refused() -> None:
    geometry = ribbed_chamber(np.pi / 2)
    with pytest.raises(NoPlaneWavesError, match="one line from wall to wall"):
        middle_section(geometry, surface_radius=0.95)
    assert middle_section(geometry, surface_radius=0.8).mesh.nelements > 100


def test_a_full_ring_has_no_ends_and_is_refused() -> None:
    geometry = sector_chamber((2, 16, 2), radii=(0.5, 1.0), angle=2 * np.pi, width=1.0)
    with pytest.raises(NoPlaneWavesError):
        middle_section(geometry, surface_radius=0.75)
