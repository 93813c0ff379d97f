"""Exact solutions of chambers: totals by quadrature, meshes with nodes on the true walls, and waves.

Waves in a chamber without plates by cosines of the angle: a reference that shares no step with the meshes.

With rho = ln(R2/r) and the angle counted from one plate the potential and the stream function are

    phi = sum B_n cosh(k rho)/sinh(k H) cos(k angle),    psi = - sum B_n sinh(k rho)/sinh(k H) sin(k angle),

k = n pi/theta, H = ln(R2/a); every term obeys the walls.  What is left is the free surface, s^2 phi - 2 i s
psi - a q = -i s (G + c) with a q = sum B_n k cos(k angle), tested with each cosine.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad, quad_vec
from scipy.linalg import eigvals

from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.chamber_file.elements import CORNERS, NODES, between, boundary_facets, reference_nodes
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry
from ringbalance.scene.models import Disc, Scene

_RELATIVE = 1e-13


def exact_moment(*, disc: Disc, density: float, fill_ratio: npt.ArrayLike) -> FloatArray:
    """Moment of one chamber's liquid along its centre line, kg m.

    U = 2 rho B integral of r^2 sin(alpha(r)) dr from a(x) to R2, by adaptive quadrature.
    """

    def integrand(r: float) -> float:
        return float(r**2 * np.sin(half_angle(disc=disc, radius=r)))

    inner = surface_radius(disc=disc, fill_ratio=fill_ratio)
    scale = 2 * density * disc.axial_width
    values = [
        scale * float(quad(integrand, float(a), disc.outer_radius, epsabs=0, epsrel=_RELATIVE)[0])
        for a in inner.ravel()
    ]
    return np.asarray(values, dtype=np.float64).reshape(inner.shape)


def exact_wall_pressure(
    *, disc: Disc, density: float, angular_velocity: float, fill_ratio: npt.ArrayLike
) -> FloatArray:
    """Liquid pressure on the outer wall without gravity, rho omega^2 (R2^2 - a(x)^2)/2, above the gas, Pa."""
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    depth = (disc.outer_radius - a) * (disc.outer_radius + a) / 2
    return np.asarray(density * angular_velocity**2 * depth, dtype=np.float64)


def wall_pressure_of(
    scene: Scene, fill_ratio: npt.ArrayLike, *, disc: Disc | None = None, density: float | None = None
) -> FloatArray:
    """`exact_wall_pressure` of a scene, with another disc or density where one is given."""
    return exact_wall_pressure(
        disc=disc or scene.disc,
        density=density or scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        fill_ratio=fill_ratio,
    )


def central_lambda(*, disc: Disc) -> float:
    """Moment per transferred mass with a pair at its centre, 2 a sin(alpha(a))/alpha(a), m.

    Limit of [U(x) - U(x_max - x)]/(rho V (x - x_max/2)) at x = x_max/2.
    """
    a = surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio / 2)
    alpha = half_angle(disc=disc, radius=a)
    return float(2 * a * np.sin(alpha) / alpha)


def exact_totals(scene: Scene) -> dict[str, float]:
    """Volume, m^3, and at the largest fill moment, kg m, and wall pressure, Pa; lambda at equal fills, m."""
    disc, full = scene.disc, scene.disc.max_fill_ratio
    return {
        "volume": chamber_volume(disc=disc),
        "moment": float(exact_moment(disc=disc, density=scene.liquid.density, fill_ratio=full)),
        "wall_pressure": float(wall_pressure_of(scene, full)),
        "lambda": central_lambda(disc=disc),
    }


def whole_ring_pressure(scene: Scene) -> float:
    """Wall pressure at the largest fill with the ring as one rectangular element, Pa: a deliberate error.

    Centrifugal force of a ring of unit angle over its outer face, integral of rho omega^2 r^2 dr / R2.
    """
    outer = scene.disc.outer_radius
    inner = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio))
    return scene.liquid.density * scene.rotor.speed**2 * (outer**3 - inner**3) / (3 * outer)


_CUBE_NODES: Final = (2 * reference_nodes("hexahedron27")).astype(np.int64)
"""Coordinates of the nodes of a cube, in halves of its edge."""
_BOUNDARIES: Final = {
    "inner_wall": (0, 0),
    "outer_wall": (0, 1),
    "plate_right": (1, 0),
    "plate_left": (1, 1),
    "end_back": (2, 0),
    "end_front": (2, 1),
}
_KUHN: Final = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
"""Corners of tetrahedra that fill a cube and fit together from cube to cube."""


def block_chamber(
    cells: tuple[int, int, int],
    mapping: Callable[[FloatArray], FloatArray],
    *,
    kind: CellKind = "hexahedron27",
) -> ChamberGeometry:
    """A mapped block of hexahedra, or of the six tetrahedra into which each is cut.

    Args:
        mapping: from the unit cube, shape (..., 3), to coordinates, m; the first coordinate goes outward.
    """
    shape = tuple(2 * n + 1 for n in cells)
    steps = [np.linspace(0, 1, n) for n in shape]
    points = mapping(np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape(shape)
    starts = np.stack(np.meshgrid(*[2 * np.arange(n) for n in cells], indexing="ij"), axis=-1)
    # Coordinates of the nodes of each cell in a cube, in halves, shape (cells, nodes, 3).
    if CORNERS[kind] == 8:
        local = _CUBE_NODES[None, : NODES[kind]]
    else:
        corners = _CUBE_NODES[np.array(_KUHN)]
        local = np.stack([corners[:, list(each)].sum(axis=1) // len(each) for each in between(kind)], axis=1)
    at = (starts.reshape(-1, 1, 1, 3) + local).reshape(-1, local.shape[1], 3)
    bare = ChamberGeometry(
        file="block",
        digest=hashlib.sha256(points.tobytes() + f"{cells} {kind}".encode()).hexdigest(),
        kind=kind,
        points=points,
        cells=numbers[at[..., 0], at[..., 1], at[..., 2]],
        boundaries={},
    )
    facets = boundary_facets(bare)
    lattice = np.stack(np.unravel_index(facets, shape), axis=-1)
    boundaries = {
        name: facets[np.all(lattice[..., axis] == end * (shape[axis] - 1), axis=1)]
        for name, (axis, end) in _BOUNDARIES.items()
    }
    return replace(bare, boundaries=boundaries)


def disc_chamber(
    disc: Disc, cells: tuple[int, int, int], *, kind: CellKind = "hexahedron27"
) -> ChamberGeometry:
    """The built-in chamber of a disc, plates included, as a mesh."""
    t = disc.plate_thickness
    faces = [float(np.sqrt(radius**2 - t**2)) for radius in (disc.inner_radius, disc.outer_radius)]

    def mapping(cube: FloatArray) -> FloatArray:
        # Along a plate's straight face distances grow evenly.
        radius = np.hypot(faces[0] + cube[..., 0] * (faces[1] - faces[0]), t)
        turned = (2 * cube[..., 1] - 1) * half_angle(disc=disc, radius=radius)
        axial = disc.axial_width * (cube[..., 2] - 0.5)
        return np.stack([radius * np.cos(turned), radius * np.sin(turned), axial], axis=-1)

    return block_chamber(cells, mapping, kind=kind)


_TERMS = 160


@dataclass(frozen=True, kw_only=True)
class CosineWaves:
    """Free-surface condition tested with cosines; lengths in outer radii, times in 1/omega."""

    central_angle: float
    """theta, rad."""
    wavenumber: FloatArray
    """k, shape (n,)."""
    mass: FloatArray
    """Matrix of phi, shape (n, n), diagonal."""
    spring: FloatArray
    """Matrix of a q, diagonal."""
    mixed: FloatArray
    """Matrix of -psi: integral of cos(m ...) sin(n ...), rows m."""

    @classmethod
    def of(cls, *, central_angle: float, depth: float) -> CosineWaves:
        """The problem at a depth H = ln(R2/a); the lowest frequencies converge like the cube of 1/terms."""
        n = np.arange(1, _TERMS + 1)
        k = np.asarray(np.pi * n / central_angle, dtype=np.float64)
        rows, columns = np.meshgrid(n, n, indexing="ij")
        odd = (rows + columns) % 2 == 1
        gap = np.where(odd, columns**2 - rows**2, 1)
        return cls(
            central_angle=central_angle,
            wavenumber=k,
            mass=np.diag(1 / np.tanh(k * depth)) * central_angle / 2,
            spring=np.diag(k) * central_angle / 2,
            mixed=np.where(odd, central_angle / np.pi * 2 * columns / gap, 0.0),
        )

    def frequencies(self, *, modes: int) -> FloatArray:
        """Lowest natural frequencies over the speed, s, of (s^2 mass + 2 i s mixed - spring) B = 0."""
        n = self.wavenumber.size
        mass = np.diagonal(self.mass)[:, None]
        s = eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [self.spring / mass, -2j * self.mixed / mass]]))
        real = s[np.abs(s.imag) < 1e-6 * np.abs(s)].real
        return np.asarray(np.sort(real[real > 0])[:modes], dtype=np.float64)

    def amplification(self, *, frequency_ratio: float) -> float:
        """Swing of the first moment under G = r exp(i angle), over that of a quasi-static surface."""
        load = _load(self)
        swing, still = (
            _potential(self, frequency_ratio, load, still=still) * self.wavenumber for still in (False, True)
        )

        def size(flux: ComplexArray) -> float:
            return float(np.hypot(abs(load.real @ flux), abs(load.imag @ flux)))

        return size(swing) / size(still)

    def pressure_amplification(self, *, frequency_ratio: float, depth: float) -> float:
        """Swing of the mean wall pressure under this forcing, over that of a quasi-static surface.

        The mean of every cosine is zero, so that of phi is zero on wall and surface, and p' has only the
        difference of G and 2 psi at the surface: p'/rho = G + c - i s phi - 2 psi.
        """
        half, radius = self.central_angle / 2, np.exp(-depth)
        drive = (1 - radius) * np.sin(half) / half
        waves = _potential(self, frequency_ratio, radius * _load(self), still=False)
        order = self.wavenumber * self.central_angle / np.pi
        stream = -np.sum(waves * (1 - np.cos(np.pi * order)) / (np.pi * order))
        return float(abs(1 + 2 * stream / drive))


def _load(waves: CosineWaves) -> ComplexArray:
    """Integrals of exp(i angle) with each cosine."""
    half = waves.central_angle / 2

    def rows(angle: float) -> ComplexArray:
        return np.asarray(np.exp(1j * angle) * np.cos(waves.wavenumber * (angle + half)))

    return np.asarray(quad_vec(rows, -half, half, epsabs=1e-12)[0])


def _potential(
    waves: CosineWaves, frequency_ratio: float, load: ComplexArray, *, still: bool
) -> ComplexArray:
    """Coefficients B of the forced waves, or of a quasi-static surface if `still`."""
    s = frequency_ratio
    inertia = 0.0 if still else s**2 * waves.mass + 2j * s * waves.mixed
    return np.asarray(np.linalg.solve(inertia - waves.spring, -1j * s * load), dtype=np.complex128)
