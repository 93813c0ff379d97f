"""Natural frequencies of the liquid ring in a chamber, in units of the speed, by finite elements.

They scale with the speed, so a fill at which one of them equals it is resonant with gravity across the shaft
at every speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from ringbalance.mesh.chamber import default_cells
from ringbalance.mesh.cut.faceting import SAFETY, faceting
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.convergence import gci
from ringbalance.physics.results import Estimate
from ringbalance.physics.sloshing.system import SloshingSystem, imported_system, sloshing_system
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc

FORMAL_ORDER: Final = 4.0
"""Of an eigenvalue of quadratic elements: twice the order of its mode in the energy's norm."""


@dataclass(frozen=True, kw_only=True)
class _SloshingModes:
    """Planar modes of the liquid in one chamber, lowest first."""

    fill_ratio: FloatArray
    """x, shape (n,)."""
    surface_radius: FloatArray
    """a, m, shape (n,)."""
    frequency_ratio: Estimate
    """s, natural angular frequency seen in the disc over the angular velocity, shape (n, modes)."""


@dataclass(frozen=True, kw_only=True)
class Meshes:
    """On which waves are solved: those given of a sector, two of an imported chamber's section."""

    disc: Disc
    cells: tuple[tuple[int, int], ...]
    """Of a sector, finest first."""

    @property
    def levels(self) -> tuple[int, ...]:
        """Numbers of the meshes, finest first."""
        return tuple(range(len(self.cells) if self.disc.geometry is None else 2))

    def system(self, radius: float, level: int) -> tuple[SloshingSystem, float]:
        """The problem below a surface of this radius, m, and its unit of length, m."""
        disc = self.disc
        if disc.geometry is None:
            found = sloshing_system(disc=disc, surface_radius=radius, cells=self.cells[level])
            return found, disc.outer_radius
        return imported_system(
            disc.geometry, surface_radius=radius, width=disc.axial_width, coarse=bool(level)
        )

    def half_width(self, values: FloatArray, radius: float) -> float:
        """Uncertainty (95 %) of the first of the values on each mesh.

        Source: grid convergence of Celik et al. (2008); of a section in straight lines, of order two, all
        that halving them changes, and what the facets of a wall, between its nodes, miss of the depth.
        """
        if self.disc.geometry is None:
            noise = 1e-12 * float(np.abs(values).max())
            sizes = [1 / counts[1] for counts in self.cells]
            return gci(
                values=list(values), sizes=sizes, formal_order=FORMAL_ORDER, round_off=noise
            ).uncertainty
        outer = self.disc.outer_radius
        # Frequencies grow with the root of the depth; r^2 changes by twice r times the depth.
        deeper = SAFETY * faceting(self.disc.geometry).wall / (2 * outer)
        return float(abs(values[0] - values[1]) + deeper / (2 * (outer - radius)) * abs(values[0]))


def sloshing_modes(
    *,
    disc: Disc,
    fill_ratio: npt.ArrayLike,
    modes: int = 4,
    cells: tuple[tuple[int, int], ...] | None = None,
) -> _SloshingModes:
    """Lowest natural frequencies of the liquid in one chamber, over the angular velocity.

    (-s^2 S + 2 i s C + A) psi = 0; without Coriolis force and plates s_n^2 = k tanh(k ln(R2/a)), k = n
    pi/theta.
    Args:
        fill_ratio: x, any shape, flattened to (n,), above 0 and at most 1.
        modes: how many, at least 1.
        cells: three meshes or more, finest first; default twice `default_cells` and two coarser ones, with
            more cells along the angle for many modes.  An imported chamber is solved in its middle section.
    Raises: ValueError: fill ratios outside (0, 1], no modes, or fewer than three meshes.
    Validity: small planar waves without viscosity on a circular surface, that is g much smaller than
    omega^2 a; the ends are flat and the section is the same along the shaft, so gravity across it drives no
    others.
    Source: Eq. 10 of the liquid-ring paper with the inertia that it leaves out; derived in `section_system`.
    """
    fills = np.atleast_1d(np.asarray(fill_ratio, dtype=np.float64)).ravel()
    if fills.size == 0 or not np.all((fills > 0) & (fills <= 1)) or modes < 1:
        raise ValueError("fill_ratio must lie within (0, 1], and at least one mode must be asked for")
    meshes = Meshes(disc=disc, cells=cells or default_sloshing_cells(disc=disc, modes=modes))
    if len(meshes.cells) < 3:
        raise ValueError("cells must list at least three meshes, finest first")
    radii = np.atleast_1d(surface_radius(disc=disc, fill_ratio=fills))
    found = np.array([[_lowest(meshes, float(a), level, modes) for level in meshes.levels] for a in radii])
    widths = [
        [meshes.half_width(values, float(a)) for values in at.T] for a, at in zip(radii, found, strict=True)
    ]
    return _SloshingModes(
        fill_ratio=fills,
        surface_radius=radii,
        frequency_ratio=Estimate(value=found[:, 0].copy(), uncertainty=np.array(widths)),
    )


def default_sloshing_cells(*, disc: Disc, modes: int = 4) -> tuple[tuple[int, int], ...]:
    """Three meshes that keep the lowest four frequencies of a chamber within 1e-4.

    Args: `disc`: the disc; only its central angle counts. `modes`: how many are wanted; each has half a wave
        more along the angle than the one before.
    Returns: Cells along the radius and the angle, finest first.
    Source: about five cells a wave on the coarsest mesh bring a quadratic element into its asymptotic range.
    """
    radial, angular = default_cells(disc=disc)
    more = max(2, -(-4 * modes // angular) * 2)
    return tuple((more * radial // k, more * angular // k) for k in (1, 2, 4))


def resonant_fills(*, disc: Disc, modes: int = 4) -> tuple[tuple[int, float], ...]:
    """Fills at which a natural frequency equals the speed, s_n(x) = 1, whatever the speed.

    Args: `modes`: how many of the lowest modes are looked at; higher ones resonate in thinner rings and are
        damped more.
    Returns: Mode number (from 1) and fill ratio of each, by mode.
    Raises: ValueError: no modes.
    Source: `sloshing_modes`; the frequencies grow with the fill.
    """
    if modes < 1:
        raise ValueError("at least one mode must be asked for")
    top = disc.max_fill_ratio
    meshes = Meshes(disc=disc, cells=default_sloshing_cells(disc=disc, modes=modes)[1:])
    tolerance = 1e-6 if disc.geometry is None else 1e-3

    def excess(logarithm: float, mode: int) -> float:
        a = float(surface_radius(disc=disc, fill_ratio=np.exp(logarithm)))
        return float(_lowest(meshes, a, 0, modes)[mode - 1] - 1)

    found = []
    low, high = np.log(1e-4 * top), float(np.log(top))
    for mode in range(1, modes + 1):
        if excess(high, mode) > 0 > excess(low, mode):
            high = float(brentq(excess, low, high, args=(mode,), xtol=tolerance))
            found.append((mode, float(np.exp(high))))
    return tuple(found)


def _lowest(meshes: Meshes, a: float, level: int, modes: int) -> FloatArray:
    ratios = meshes.system(a, level)[0].natural_frequencies()
    if ratios.size < modes:
        raise ValueError(f"a mesh has {ratios.size} modes, not {modes}: give it more cells along the surface")
    return ratios[:modes]
