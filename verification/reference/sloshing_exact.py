"""Waves in a chamber without plates by cosines of the angle: a reference that shares no step with the meshes.

With rho = ln(R2/r) and the angle counted from one plate the potential and the stream function are

    phi = sum B_n cosh(k rho)/sinh(k H) cos(k angle),    psi = - sum B_n sinh(k rho)/sinh(k H) sin(k angle),

k = n pi/theta, H = ln(R2/a); every term obeys the walls.  What is left is the free surface, s^2 phi - 2 i s
psi - a q = -i s (G + c) with a q = sum B_n k cos(k angle), tested with each cosine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad_vec
from scipy.linalg import eigvals

from ringbalance.scene.arrays import ComplexArray, FloatArray

_TERMS = 160


@dataclass(frozen=True, kw_only=True)
class CosineWaves:
    """The free surface's condition on cosines; lengths in outer radii, times in 1/omega."""

    central_angle: float
    """theta, rad."""
    wavenumber: FloatArray
    """k, shape (n,)."""
    mass: FloatArray
    """Of phi, shape (n, n), diagonal."""
    spring: FloatArray
    """Of a q, diagonal."""
    mixed: FloatArray
    """Of -psi: integral of cos(m ...) sin(n ...), rows m."""

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
        """Swing of the first moment under G = r exp(i angle), over that of a surface that follows at once."""
        load = _load(self)
        swing, still = (
            _potential(self, frequency_ratio, load, still=still) * self.wavenumber for still in (False, True)
        )

        def size(flux: ComplexArray) -> float:
            return float(np.hypot(abs(load.real @ flux), abs(load.imag @ flux)))

        return size(swing) / size(still)

    def pressure_amplification(self, *, frequency_ratio: float, depth: float) -> float:
        """Swing of the mean wall pressure under the same forcing, over that of such a surface.

        Cosines have no mean, so phi has the same one, none, on wall and surface, and p' is left with the
        difference of G and with 2 psi at the surface: p'/rho = G + c - i s phi - 2 psi.
        """
        half, radius = self.central_angle / 2, np.exp(-depth)
        drive = (1 - radius) * np.sin(half) / half
        found = _potential(self, frequency_ratio, radius * _load(self), still=False)
        order = self.wavenumber * self.central_angle / np.pi
        stream = -np.sum(found * (1 - np.cos(np.pi * order)) / (np.pi * order))
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
    """B, of the forced waves or of a surface that follows at once."""
    s = frequency_ratio
    inertia = 0.0 if still else s**2 * waves.mass + 2j * s * waves.mixed
    return np.asarray(np.linalg.solve(inertia - waves.spring, -1j * s * load), dtype=np.complex128)
