"""Waves in imported chambers, against plane ones, closed forms, and themselves on finer meshes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.linalg import eigvals
from scipy.sparse import csc_matrix, diags_array
from scipy.sparse.linalg import splu

from ringbalance.mesh.geometry import surface_radius
from ringbalance.mesh.liquid_body import Level, liquid_body
from ringbalance.mesh.quadratic_tetrahedra import tetrahedra
from ringbalance.physics.pressure.tetrahedra import TetrahedronSpace
from ringbalance.physics.results import StatusCode
from ringbalance.physics.sloshing.body import guesses
from ringbalance.physics.sloshing.fast import LOWEST, fast_waves
from ringbalance.physics.sloshing.imported import RingWaves, ring_waves
from ringbalance.physics.sloshing.modes import sloshing_modes
from ringbalance.physics.sloshing.projection import Fields
from ringbalance.physics.sloshing.response import sloshing_response
from ringbalance.scene.models import Disc
from ringbalance.verification.reference.block_chambers import block_chamber, disc_chamber, sector_chamber
from ringbalance.verification.reference.sloshing_exact import CosineWaves

_FILL, _NU, _OMEGA = 0.25, 1e-6, 1000.0


@lru_cache(maxsize=1)
def _disc() -> Disc:
    return Disc(
        outer_radius=0.0445, inner_radius=0.0205, axial_width=0.062, central_angle=np.pi / 2, chambers=4,
        plate_thickness=0.002777, max_fill_ratio=0.5, initial_fill=0.25,
    )  # fmt: skip


@lru_cache(maxsize=4)
def _waves(cells: tuple[int, int, int]) -> RingWaves:
    radius = float(surface_radius(disc=_disc(), fill_ratio=_FILL))
    return ring_waves(
        geometry=disc_chamber(_disc(), cells),
        surface_radius=radius,
        angular_velocity=_OMEGA,
        kinematic_viscosity=_NU,
        gravity=9.8,
    )


def _nearest(values: np.ndarray, to: float) -> int:
    return int(np.abs(values - to).argmin())


def test_waves_that_are_the_same_along_the_shaft_are_the_plane_ones() -> None:
    waves = _waves((12, 12, 6))
    plane = sloshing_modes(disc=_disc(), fill_ratio=_FILL, modes=2).frequency_ratio.value[0]
    for exact in plane:
        here = _nearest(waves.frequency_ratio.value, exact)
        assert waves.frequency_ratio.value[here] == pytest.approx(exact, rel=1e-3)
        assert abs(waves.frequency_ratio.value[here] - exact) <= waves.frequency_ratio.uncertainty[here]
        assert waves.vortical_share[here] < 0.02


def test_the_answer_to_gravity_is_the_plane_one() -> None:
    waves = _waves((12, 12, 6))
    plane = sloshing_response(
        disc=_disc(), fill_ratio=_FILL, angular_velocity=_OMEGA, kinematic_viscosity=_NU, gravity=9.8
    )
    assert waves.status.ok
    assert waves.amplification.value == pytest.approx(plane.amplification.value[0], rel=1e-3)
    assert waves.pressure_amplification.value == pytest.approx(
        plane.pressure_amplification.value[0], rel=1e-3
    )
    # The highest place is at a corner, where meshes differ.
    assert waves.surface_amplitude.value == pytest.approx(plane.surface_amplitude.value[0], rel=0.15)
    assert waves.damped_share == pytest.approx(plane.damped_share[0], abs=1e-3)


def test_waves_along_the_shaft_have_vorticity_and_an_uncertainty_that_says_so() -> None:
    waves = _waves((12, 12, 6))
    # The first wave along the shaft of this chamber lies next to the first plane one.
    axial = waves.frequency_ratio.value[1]
    assert 0.68 < axial < 0.72
    assert waves.vortical_share[1] > 0.03
    assert waves.frequency_ratio.uncertainty[1] > 1e-3


def test_without_rotation_a_box_has_the_frequencies_of_its_closed_form() -> None:
    """A box far from the shaft, spun so that only its centrifugal gravity counts: s^2 = g k tanh(k h)."""
    far, depth, across, along = 2000.0, 0.5, 1.0, 0.8

    def box(cube: np.ndarray) -> np.ndarray:
        return np.stack(
            [far + 2 * depth * (cube[..., 0] - 0.5), across * (cube[..., 1] - 0.5), along * cube[..., 2]],
            axis=-1,
        )

    waves = ring_waves(geometry=block_chamber((8, 6, 6), box), surface_radius=far, modes=3)
    k = np.pi * np.sort([1 / across, 1 / along, np.hypot(1 / across, 1 / along)])
    # s is large (s^2 about far), so what the Coriolis force does is of order 1 / s.
    assert waves.frequency_ratio.value == pytest.approx(np.sqrt(far * k * np.tanh(k * depth)), rel=2e-3)
    assert waves.vortical_share.max() < 0.01


# Facets of 22.5 deg change the mean depth, a fifth of the radius, by 0.064 and s by half of that, 0.05 with
# the estimate's safety.  Inertial waves that have a part in a wave have less than half of its energy, spread
# over two levels, and half of the last one's counts: 0.12 more.  The finer mesh keeps them apart.
@pytest.mark.parametrize(("cells", "widest"), [((4, 4, 2), 0.17), ((6, 6, 2), 0.05)])
def test_straight_cells_on_a_round_wall_are_in_the_uncertainty(
    cells: tuple[int, int, int], widest: float
) -> None:
    geometry = sector_chamber(cells, radii=(0.5, 1.0), angle=np.pi / 2, width=0.3, kind="hexahedron")
    lowest = ring_waves(geometry=geometry, surface_radius=0.8, modes=4).frequency_ratio
    exact = CosineWaves.of(central_angle=np.pi / 2, depth=float(np.log(1 / 0.8))).frequencies(modes=2)
    assert np.all(np.abs(lowest.value[:2] - exact) <= lowest.uncertainty[:2])
    assert lowest.uncertainty[0] <= widest * exact[0]


def _waves_along(a: float, angle: float, width: float) -> np.ndarray:
    """Frequencies above 2 of waves Q(r, t) cos(pi z/width) in a sector, by polynomials for the pressure.

    With xi_h = (s + 2 i J) grad Q/(s (s^2 - 4)) and xi_z = Q_z/s^2: (xi, grad v) = <Q/g, v>.
    """
    legendre = np.polynomial.legendre
    x, w = legendre.leggauss(14)
    flat, slope = legendre.legvander(x, 9), legendre.legval(x, legendre.legder(np.eye(10))).T
    r, dr, dt = (1 + a) / 2 + (1 - a) / 2 * x, (1 - a) / 2, angle / 2

    def sums(weight: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        return np.asarray((left * (w * weight)[:, None]).T @ right)

    even, steep = sums(np.ones(14), flat, flat), sums(np.ones(14), slope, slope)
    mixed = sums(np.ones(14), slope, flat)
    across = np.kron(sums(r, slope, slope) * dt / dr, even) + np.kron(
        sums(1 / r, flat, flat) * dr / dt, steep
    )
    along = (np.pi / width) ** 2 * np.kron(sums(r, flat, flat), even) * dr * dt
    turned = np.kron(mixed.T, mixed) - np.kron(mixed, mixed.T)
    end = (-1.0) ** np.arange(10)
    surface = np.kron(np.outer(end, end), even) * dt
    size, none = len(across), np.zeros_like(across)
    parts = [4 * along, -2j * turned, -(across + along + 4 * surface), none]
    first = np.block([[np.zeros((3 * size, size)), np.eye(3 * size)], [-p for p in parts]])
    last = np.eye(4 * size)
    last[3 * size :, 3 * size :] = surface
    s = eigvals(first, last)
    real = s[np.isfinite(s) & (np.abs(s.imag) < 1e-6)].real
    return np.sort(real[real > 2.05])


# In the narrower chamber the fourth plane wave and the second one along the shaft are at 2.6253, both.
@pytest.mark.parametrize("width", [0.4, 0.3755])
def test_no_wave_of_a_short_chamber_is_missing(width: float) -> None:
    radius, angle = 0.76, np.pi / 2
    geometry = sector_chamber((8, 16, 6), radii=(0.5, 1.0), angle=angle, width=width)
    waves = ring_waves(geometry=geometry, surface_radius=radius, modes=7).frequency_ratio
    plane = CosineWaves.of(central_angle=angle, depth=float(np.log(1 / radius))).frequencies(modes=6)
    exact = np.sort(np.concatenate([plane, _waves_along(radius, angle, width)]))[:7]
    assert np.all(np.abs(waves.value - exact) <= waves.uncertainty)
    # A wave along this chamber is resolved by six cells.
    assert np.all(waves.uncertainty <= 0.02 * exact)


def _count(fields: Fields, s: float) -> int:
    """Negative ones among the eigenvalues of K(s) - M, by Sylvester's law of inertia."""
    space = fields.space
    x, y, z = (space.gradient[k::3] for k in range(3))
    weights = diags_array(space.weights)
    turned = y.T @ weights @ x - x.T @ weights @ y
    across = x.T @ weights @ x + y.T @ weights @ y
    stiff = (across + 2j / s * turned) / (s**2 - 4) + z.T @ weights @ z / s**2
    factors = splu(
        csc_matrix(stiff - fields.surface_mass),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    assert np.array_equal(factors.perm_r, factors.perm_c)
    return int(np.sum(factors.U.diagonal().real < 0))


@pytest.mark.parametrize(
    ("angle", "width", "waves"), [(np.pi / 2, 0.3755, 7), (2 * np.pi, 0.3, 14), (0.4, 0.4, 6)]
)
def test_the_number_of_waves_is_that_of_the_matrices_inertia(angle: float, width: float, waves: int) -> None:
    """On a full ring, too, whose waves m > 3 are orthogonal to all low powers of x and y."""
    geometry = sector_chamber((2, 24 if angle > np.pi else 6, 2), radii=(0.5, 1.0), angle=angle, width=width)
    body = liquid_body(tetrahedra(geometry), Level(constant=0.76**2 / 2))
    fields = Fields(TetrahedronSpace(body=body), Level(constant=0.76**2 / 2))
    fast = fast_waves(fields, guesses(fields, 12), waves)
    assert fast.slower + fast.frequency.size == waves
    # The constant is counted, and is no wave.
    assert _count(fields, LOWEST) == fast.slower + 1
    for place in np.flatnonzero(np.diff(fast.frequency) > 1e-3 * fast.frequency[:-1]):
        between = float(fast.frequency[place : place + 2].mean())
        assert _count(fields, between) == fast.slower + 1 + place + 1


def test_a_vertical_shaft_tilts_the_surface_and_slows_nothing_at_high_speed() -> None:
    geometry = sector_chamber((4, 6, 3), radii=(0.5, 1.0), angle=np.pi / 2, width=1.0)
    flat = ring_waves(geometry=geometry, surface_radius=0.8, modes=1)
    steep = ring_waves(geometry=geometry, surface_radius=0.8, modes=1, axial_gravity=0.05)
    change = steep.frequency_ratio.value[0] / flat.frequency_ratio.value[0] - 1
    # The paraboloid's depth changes by g z / (omega^2 a) from end to end, evenly about the middle.
    assert 1e-5 < abs(change) < 0.01


@pytest.mark.parametrize(
    ("gravity", "code"), [(0.9, StatusCode.NO_RING), (0.5, StatusCode.OUT_OF_RANGE), (1e-4, StatusCode.OK)]
)
def test_the_status_says_where_waves_are_not_small(gravity: float, code: StatusCode) -> None:
    geometry = sector_chamber((3, 4, 2), radii=(0.5, 1.0), angle=np.pi / 2, width=1.0)
    found = ring_waves(geometry=geometry, surface_radius=0.8, gravity=gravity, kinematic_viscosity=1e-6)
    assert found.status.code is code


@pytest.mark.parametrize(
    "wrong",
    [{"angular_velocity": 0.0}, {"gravity": -1.0}, {"modes": 0}, {"levels": 1}, {"frequency_ratio": 0.0}],
)
def test_impossible_arguments_are_refused(wrong: dict[str, float]) -> None:
    geometry = sector_chamber((1, 2, 1), radii=(0.5, 1.0), angle=np.pi / 2, width=1.0)
    with pytest.raises(ValueError, match="|".join(wrong)):
        ring_waves(geometry=geometry, surface_radius=0.8, **wrong)  # type: ignore[arg-type]
