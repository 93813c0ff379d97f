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
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.convergence import gci
from ringbalance.physics.results import Estimate, Statistics
from ringbalance.physics.sloshing.imported import ring_waves
from ringbalance.physics.sloshing.system import sloshing_system
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Disc

IMPORTED_SHARES: Final = np.array([0.04, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 1.0])
"""Of the largest fill, at which the waves in an imported chamber are looked at: each takes seconds."""
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
    cells: tuple[tuple[int, int], ...]
    """Cells of the meshes, finest first."""
    statistics: Statistics


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
            more cells along the angle for many modes.
    Raises: ValueError: fill ratios outside (0, 1], no modes, or fewer than three meshes.
    Validity: small planar waves without viscosity on a circular surface, that is g much smaller than
    omega^2 a; the ends are flat, so gravity across the shaft drives no others.
    Source: Eq. 10 of the liquid-ring paper with the inertia that it leaves out; derived in `sloshing_system`.
    """
    fills = np.atleast_1d(np.asarray(fill_ratio, dtype=np.float64)).ravel()
    if fills.size == 0 or not np.all((fills > 0) & (fills <= 1)) or modes < 1:
        raise ValueError("fill_ratio must lie within (0, 1], and at least one mode must be asked for")
    if disc.geometry is not None:
        return _imported(disc, disc.geometry, fills, modes)
    meshes = cells or default_sloshing_cells(disc=disc, modes=modes)
    if len(meshes) < 3:
        raise ValueError("cells must list at least three meshes, finest first")
    radii = np.atleast_1d(surface_radius(disc=disc, fill_ratio=fills))
    found = np.array([[_lowest(disc, float(a), counts, modes) for counts in meshes] for a in radii])
    widths = np.apply_along_axis(_half_width, 1, found, meshes)
    return _SloshingModes(
        fill_ratio=fills,
        surface_radius=radii,
        frequency_ratio=Estimate(value=found[:, 0].copy(), uncertainty=widths),
        cells=meshes,
        statistics=Statistics(unknowns=(2 * meshes[0][0] + 1) * (2 * meshes[0][1] + 1)),
    )


def _imported(disc: Disc, geometry: ChamberGeometry, fills: FloatArray, modes: int) -> _SloshingModes:
    """Waves in three dimensions, those along the shaft among them, on a chamber's own mesh."""
    radii = np.atleast_1d(surface_radius(disc=disc, fill_ratio=fills))
    waves = [ring_waves(geometry=geometry, surface_radius=float(radius)) for radius in radii]
    values, widths = (
        np.array([getattr(each.frequency_ratio, name)[:modes] for each in waves])
        for name in ("value", "uncertainty")
    )
    return _SloshingModes(
        fill_ratio=fills,
        surface_radius=radii,
        frequency_ratio=Estimate(value=values, uncertainty=widths),
        cells=((len(geometry.cells), 1),),
        statistics=waves[0].statistics,
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
    if disc.geometry is not None:
        return _imported_resonances(disc, modes, top)
    middle = default_sloshing_cells(disc=disc, modes=modes)[1]

    def excess(logarithm: float, mode: int) -> float:
        a = float(surface_radius(disc=disc, fill_ratio=np.exp(logarithm)))
        return float(_lowest(disc, a, middle, modes)[mode - 1] - 1)

    found = []
    low, high = np.log(1e-4 * top), float(np.log(top))
    for mode in range(1, modes + 1):
        if excess(high, mode) > 0 > excess(low, mode):
            high = float(brentq(excess, low, high, args=(mode,), xtol=1e-6))
            found.append((mode, float(np.exp(high))))
    return tuple(found)


def _imported_resonances(disc: Disc, modes: int, top: float) -> tuple[tuple[int, float], ...]:
    """Between fills at which the waves are solved, by a straight line: to two digits."""
    found = sloshing_modes(disc=disc, fill_ratio=top * IMPORTED_SHARES, modes=modes)
    fills, ratios = found.fill_ratio, found.frequency_ratio.value
    return tuple(
        (mode + 1, float(np.interp(1.0, ratios[:, mode], fills)))
        for mode in range(ratios.shape[1])
        if ratios[0, mode] < 1 < ratios[-1, mode]
    )


def _lowest(disc: Disc, a: float, cells: tuple[int, int], modes: int) -> FloatArray:
    system = sloshing_system(disc=disc, surface_radius=a, cells=cells)
    ratios = system.natural_frequencies()
    if ratios.size < modes:
        raise ValueError(f"a mesh of {cells} cells has {ratios.size} modes, not {modes}")
    return ratios[:modes]


def _half_width(values: FloatArray, meshes: tuple[tuple[int, int], ...]) -> float:
    sizes = [1 / counts[1] for counts in meshes]
    noise = 1e-12 * float(np.abs(values).max())
    return gci(values=list(values), sizes=sizes, formal_order=FORMAL_ORDER, round_off=noise).uncertainty
