"""Small oscillations of the liquid ring: natural frequencies, and the response to gravity across the shaft.

Natural frequencies scale with the speed, so a fill at which one of them equals it is resonant with gravity
across the shaft at every speed. A new force on the free surface or another damping goes into
`sloshing_system`, which builds the matrices; here they are solved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from ringbalance.mesh.chamber import default_cells
from ringbalance.mesh.faceting import SAFETY, faceting
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.convergence import gci
from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.physics.sloshing_system import SloshingSystem, imported_system, sloshing_system
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc

FORMAL_ORDER: Final = 4.0
"""Order of an eigenvalue of quadratic elements: twice that of its mode in the energy norm."""


@dataclass(frozen=True, kw_only=True)
class _SloshingModes:
    """Planar modes of the liquid in one chamber, lowest first."""

    fill_ratio: FloatArray
    """x, shape (n,)."""
    surface_radius: FloatArray
    """a, m, shape (n,)."""
    frequency_ratio: Estimate
    """s, natural angular frequency seen in the disc over the angular velocity, shape (n, modes)."""


def _systems(
    disc: Disc, radius: float, cells: tuple[tuple[int, int], ...]
) -> Iterator[tuple[SloshingSystem, float]]:
    """Systems below a surface of a radius, m, each with its unit of length, m, finest mesh first.

    A sector has meshes with these cells, the middle section of an imported chamber has two.
    """
    if disc.geometry is None:
        for each in cells:
            yield sloshing_system(disc=disc, surface_radius=radius, cells=each), disc.outer_radius
        return
    for coarse in (False, True):
        yield imported_system(disc.geometry, surface_radius=radius, width=disc.axial_width, coarse=coarse)


def _half_widths(
    disc: Disc, radius: float, cells: tuple[tuple[int, int], ...], values: FloatArray
) -> FloatArray:
    """Uncertainties (95 %) of the values on the finest mesh. Args: `values`: shape (meshes, quantities).

    Source: grid convergence of Celik et al. (2008); for a section in straight lines, of order two, the whole
    change by halving them, and the error of the depth by the facets of a wall.
    """
    if disc.geometry is not None:
        outer = disc.outer_radius
        # Frequencies grow with the root of the depth; r^2 changes by twice r times the depth.
        deeper = SAFETY * faceting(disc.geometry).wall / (2 * outer)
        missed = deeper / (2 * (outer - radius)) * np.abs(values[0])
        return np.asarray(np.abs(values[0] - values[1]) + missed)
    sizes = [1 / counts[1] for counts in cells]
    records = (
        gci(values=each, sizes=sizes, formal_order=FORMAL_ORDER, round_off=1e-12 * float(np.abs(each).max()))
        for each in values.T
    )
    return np.array([record.uncertainty for record in records])


def sloshing_modes(
    *, disc: Disc, fill_ratio: npt.ArrayLike, modes: int = 4, cells: tuple[tuple[int, int], ...] | None = None
) -> _SloshingModes:
    """Lowest natural frequencies of the liquid in one chamber, over the angular velocity.

    (-s^2 S + 2 i s C + A) psi = 0; without Coriolis force and plates s_n^2 = k tanh(k ln(R2/a)), k = n
    pi/theta.
    Args:
        fill_ratio: x, any shape, flattened to (n,), above 0 and at most 1.
        modes: number of modes, at least 1.
        cells: three meshes, finest first; default twice `default_cells` and two coarser ones, with
            more cells along the angle for many modes.  An imported chamber is solved in its middle section.
    Raises: ValueError: fill ratios outside (0, 1], no modes, or not three meshes.
    Validity: small planar waves without viscosity on a circular surface, that is g much smaller than
    omega^2 a; the ends are flat and the section is the same along the shaft, so gravity across it drives no
    other waves.
    Source: Eq. 10 of the liquid-ring paper with the inertia that it leaves out; derived in `section_system`.
    """
    fills = np.atleast_1d(np.asarray(fill_ratio, dtype=np.float64)).ravel()
    if fills.size == 0 or not np.all((fills > 0) & (fills <= 1)) or modes < 1:
        raise ValueError("fill_ratio must lie within (0, 1], and at least one mode must be asked for")
    meshes = cells or default_sloshing_cells(disc=disc, modes=modes)
    if len(meshes) != 3:
        raise ValueError("cells must list three meshes, finest first")
    radii = np.atleast_1d(surface_radius(disc=disc, fill_ratio=fills))
    ratios = np.array(
        [[_lowest(system, modes) for system, _ in _systems(disc, float(a), meshes)] for a in radii]
    )
    widths = [_half_widths(disc, float(a), meshes, at) for a, at in zip(radii, ratios, strict=True)]
    return _SloshingModes(
        fill_ratio=fills,
        surface_radius=radii,
        frequency_ratio=Estimate(value=ratios[:, 0].copy(), uncertainty=np.array(widths)),
    )


def default_sloshing_cells(*, disc: Disc, modes: int = 4) -> tuple[tuple[int, int], ...]:
    """Three meshes that keep the lowest four frequencies of a chamber within 1e-4.

    Args: `disc`: the disc; only its central angle counts. `modes`: number of modes; each has half a wave more
        along the angle than the one before.
    Returns: Cells along the radius and the angle, finest first.
    Source: about five cells a wave on the coarsest mesh bring a quadratic element into its asymptotic range.
    """
    radial, angular = default_cells(disc=disc)
    more = max(2, -(-4 * modes // angular) * 2)
    return tuple((more * radial // k, more * angular // k) for k in (1, 2, 4))


def resonant_fills(*, disc: Disc, modes: int = 4) -> tuple[tuple[int, float], ...]:
    """Fill ratios at which a natural frequency equals the speed, s_n(x) = 1, at any speed.

    Args: `modes`: number of modes, lowest first; higher ones resonate in thinner rings and are
        damped more.
    Returns: Mode number (from 1) and fill ratio of each, by mode.
    Raises: ValueError: no modes.
    Source: `sloshing_modes`; the frequencies grow with the fill.
    """
    if modes < 1:
        raise ValueError("at least one mode must be asked for")
    top = disc.max_fill_ratio
    meshes = default_sloshing_cells(disc=disc, modes=modes)[1:]
    tolerance = 1e-6 if disc.geometry is None else 1e-3

    def excess(logarithm: float, mode: int) -> float:
        a = float(surface_radius(disc=disc, fill_ratio=np.exp(logarithm)))
        system, _ = next(_systems(disc, a, meshes))
        return float(_lowest(system, modes)[mode - 1] - 1)

    fills = []
    low, high = np.log(1e-4 * top), float(np.log(top))
    for mode in range(1, modes + 1):
        if excess(high, mode) > 0 > excess(low, mode):
            high = float(brentq(excess, low, high, args=(mode,), xtol=tolerance))
            fills.append((mode, float(np.exp(high))))
    return tuple(fills)


def _lowest(system: SloshingSystem, modes: int) -> FloatArray:
    ratios = system.natural_frequencies()
    if ratios.size < modes:
        raise ValueError(f"a mesh has {ratios.size} modes, not {modes}: give it more cells along the surface")
    return ratios[:modes]


SMALL_WAVE_RATIO: Final = 0.3
"""Displacement of the surface over the depth of the ring up to which waves count as small."""
FREQUENCY_UNCERTAINTY: Final = 0.06
"""U (95 %), relative, of a natural frequency by linear theory for waves of the height that experiments have.

Bias of 2.2 % and twice the scatter of 2.8 % over every second tank of Addington, Dynamics of fuel in tanks,
College of Aeronautics report CoA/N-99 (1960), without the scatter of the measurements themselves: real waves
are slower in deep liquid and faster in shallow one.  The case `measured_waves` calculates it again.
"""
LOWEST_TRUE: Final = 1 - FREQUENCY_UNCERTAINTY
"""Lower end of a natural frequency, over that of linear theory."""
HIGHEST_TRUE: Final = 1 + FREQUENCY_UNCERTAINTY
_GRID_POINTS: Final = 25
_REFINEMENTS: Final = 3
_REFINED_POINTS: Final = 9
"""Points between the neighbours of an extreme, in each refinement."""


def _extremes(
    response: Callable[[FloatArray], FloatArray], *, natural: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Extremes of a forced response while all natural frequencies vary within `FREQUENCY_UNCERTAINTY`.

    With frequencies q times as high the liquid responds to gravity as by theory to a force at s = 1/q.
    Args:
        response: function from frequency ratios of the force, shape (m,), to values, shape (m, quantities).
        natural: natural frequencies over the speed, at which peaks may lie.
    Returns: Lower and upper ends, shape (quantities,) each: in general not symmetric about the value.
    """
    low, high = 1 / HIGHEST_TRUE, 1 / LOWEST_TRUE
    peaks = natural[(natural > low) & (natural < high)]
    ratios = np.unique([*np.linspace(low, high, _GRID_POINTS), *peaks])
    values = response(ratios)
    for _ in range(_REFINEMENTS):
        extremes = np.unique([*values.argmin(axis=0), *values.argmax(axis=0)])
        before, after = np.maximum(extremes - 1, 0), np.minimum(extremes + 1, ratios.size - 1)
        ends = zip(ratios[before], ratios[after], strict=True)
        between = np.setdiff1d([x for end in ends for x in np.linspace(*end, _REFINED_POINTS)], ratios)
        order = np.argsort(np.append(ratios, between))
        values = np.concatenate([values, response(between)])[order]
        ratios = np.append(ratios, between)[order]
    return values.min(axis=0), values.max(axis=0)


@dataclass(frozen=True, kw_only=True)
class SloshingResponse:
    """Forced planar oscillation of the liquid in one chamber, along an array of fill ratios."""

    fill_ratio: FloatArray
    """x, shape (n,)."""
    surface_radius: FloatArray
    """a, m, shape (n,)."""
    amplification: Estimate
    """Change of the chamber's moment over that with a surface which follows gravity instantly, shape (n,).

    Half-widths, here and below, are those of the numerical solution alone; the intervals include them."""
    amplification_interval: FloatArray
    """Lower and upper end (95 %) of the amplification by `FREQUENCY_UNCERTAINTY`, shape (n, 2). Where a mode
    may be resonant, the upper end depends on the damping."""
    pressure_amplification: Estimate
    """Change of the mean pressure on the outer wall over that with an instantly following surface, shape
    (n,)."""
    pressure_amplification_interval: FloatArray
    """Lower and upper end (95 %) of the pressure's amplification, shape (n, 2)."""
    surface_amplitude: Estimate
    """Largest displacement of the surface, m zero-to-peak, shape (n,)."""
    surface_amplitude_interval: FloatArray
    """Lower and upper end (95 %) of the surface's amplitude, m, shape (n, 2)."""
    status: Status


def sloshing_response(
    *,
    disc: Disc,
    fill_ratio: npt.ArrayLike,
    angular_velocity: float,
    kinematic_viscosity: float,
    gravity: float,
    cells: tuple[tuple[int, int], ...] | None = None,
) -> SloshingResponse:
    """Response of the liquid in one chamber to gravity that turns in the disc's frame.

    (-s^2 S + 2 i s C + A + i s sqrt(i s E) W) psi = i s F with G = g r exp(i (angle + s omega t)), E =
    nu/(omega R2^2); the reference is A psi = i s F, a surface always normal to the sum of both fields.  The
    wall pressure follows from psi by p'/rho = G + c - i s phi - 2 psi.
    Args:
        fill_ratio: x, any shape, flattened to (n,), above 0 and at most 1.
        kinematic_viscosity: nu, m^2/s, zero or more; zero leaves resonance without a limit.
        cells: three meshes, finest first; default those of `sloshing_modes`.
    Returns: SloshingResponse; its status reports waves that might not be small, or no ring under gravity.
    Raises: ValueError: fill ratios outside (0, 1], or an argument outside its range.
    Validity: small planar waves, of an imported chamber those of its middle section: waves along the shaft
        and the effect of a section that changes along it are neglected; thin Stokes layers on all walls
        without the Coriolis force, which makes the damping, and with it a peak, good to a factor of two.
    Source: derived in `section_system`; the layers as in Landau and Lifshitz, "Fluid Mechanics", section 24.
    """
    fills = np.atleast_1d(np.asarray(fill_ratio, dtype=np.float64)).ravel()
    if fills.size == 0 or not np.all((fills > 0) & (fills <= 1)):
        raise ValueError("fill_ratio must lie within (0, 1], and there must be at least one")
    if not (np.isfinite(angular_velocity) and angular_velocity > 0):
        raise ValueError("angular_velocity must be finite and above zero")
    if not (np.isfinite([kinematic_viscosity, gravity]).all() and kinematic_viscosity >= 0 and gravity >= 0):
        raise ValueError("kinematic_viscosity and gravity must be finite and not negative")
    radii = np.atleast_1d(surface_radius(disc=disc, fill_ratio=fills))
    meshes = cells or default_sloshing_cells(disc=disc)
    ekman = kinematic_viscosity / (angular_velocity * disc.outer_radius**2)
    answers = np.array(
        [
            [
                _answers(system, np.array([1.0]), ekman)[0] * [1.0, unit / disc.outer_radius, 1.0]
                for system, unit in _systems(disc, float(a), meshes)
            ]
            for a in radii
        ]
    )
    widths = np.array(
        [_half_widths(disc, float(a), meshes, at) for a, at in zip(radii, answers, strict=True)]
    )
    scale = gravity / angular_velocity**2
    amplitude = Estimate(value=scale * answers[:, 0, 1], uncertainty=scale * widths[:, 1])
    # Peaks are searched for on the middle one of three meshes.
    middle = 0 if disc.geometry is not None else len(meshes) // 3
    systems = (next(islice(_systems(disc, float(a), meshes), middle, None))[0] for a in radii)
    ends = np.array(
        [
            _extremes(partial(_answers, system, ekman=ekman), natural=system.natural_frequencies())
            for system in systems
        ]
    )
    # The relative error of the solution is about the same at either end as in the middle.
    share = widths / answers[:, 0]
    ends *= 1 + np.stack([-np.minimum(share, 1.0), share], axis=1)
    return SloshingResponse(
        fill_ratio=fills,
        surface_radius=radii,
        amplification=Estimate(value=answers[:, 0, 0].copy(), uncertainty=widths[:, 0]),
        amplification_interval=ends[:, :, 0].copy(),
        pressure_amplification=Estimate(value=answers[:, 0, 2].copy(), uncertainty=widths[:, 2]),
        pressure_amplification_interval=ends[:, :, 2].copy(),
        surface_amplitude=amplitude,
        surface_amplitude_interval=scale * ends[:, :, 1],
        status=_status(fills, disc.outer_radius - radii, scale * ends[:, 1, 1], scale - radii),
    )


def _answers(system: SloshingSystem, ratios: FloatArray, ekman: float) -> FloatArray:
    """Amplification, largest displacement for g/omega^2 = 1 (any unit of length), amplification of the wall
    pressure, by rows along the ratios.
    """
    s = ratios[:, None, None]
    forcing = 1j * s * (system.outflow[1] + 1j * system.outflow[2])[:, None]
    swinging = -(s**2) * system.kinetic + 2j * s * system.coriolis + system.centrifugal
    layers = 1j * s * np.sqrt(1j * s * ekman) * system.wall_loss
    damped, still = (
        np.linalg.solve(matrix, forcing)[:, :, 0].T
        for matrix in (swinging + layers, system.centrifugal.astype(np.complex128))
    )
    # Amplitude of the liquid's first moment, both components.
    moment, reference = (np.linalg.norm(system.outflow[1:] @ psi, axis=0) for psi in (damped, still))
    displacement = np.abs(system.flux @ damped).max(axis=0) / ratios
    pressure = (
        system.wall_drive - 1j * ratios * (system.potential @ damped) + 2 * (system.surface_mean @ damped)
    )
    return np.stack([moment / reference, displacement, np.abs(pressure / system.wall_drive)], axis=1)


def _status(fills: FloatArray, depth: FloatArray, amplitude: FloatArray, beyond: FloatArray) -> Status:
    if np.any(beyond >= 0):
        x = fills[np.argmax(beyond)]
        return Status(
            code=StatusCode.NO_RING,
            text=f"at a fill ratio of {x:.3g} gravity is stronger than omega^2 a: turn the disc faster",
        )
    share = amplitude / depth
    worst = int(np.argmax(share))
    if share[worst] > SMALL_WAVE_RATIO:
        return Status(
            code=StatusCode.OUT_OF_RANGE,
            text=(
                f"at a fill ratio of {fills[worst]:.3g} waves may reach {share[worst]:.2g} of the ring's "
                "depth, too high for this theory: avoid that fill, or turn the disc faster"
            ),
        )
    return Status()
