"""Waves on the ring in an imported chamber: natural frequencies, and the answer to gravity across a shaft."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.cut.faceting import SAFETY, faceting
from ringbalance.mesh.liquid_body import Level, liquid_body
from ringbalance.mesh.quadratic_tetrahedra import tetrahedra
from ringbalance.physics import deferred
from ringbalance.physics.pressure.tetrahedra import TetrahedronSpace
from ringbalance.physics.results import Estimate, Statistics, Status, StatusCode
from ringbalance.physics.sloshing.fast import LOWEST
from ringbalance.physics.sloshing.range import SMALL, swept
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry

if TYPE_CHECKING:
    from ringbalance.physics.sloshing.body import ReducedWaves

LEVELS: Final = 2
"""Of the Coriolis force: more bring in scales that a mesh does not resolve."""
_SAFETY: Final = 1.25
"""On the change from the last level."""
_SPARE: Final = 5
"""Potentials beyond the waves asked for: rotation mixes neighbours."""
_OF_SURFACE: Final = 0.5
"""Share of a wave's kinetic energy in potential flow from which it is a wave of the surface: where neighbours
share one, no more than one of them has most of it."""
_PERHAPS: Final = 0.35
"""The same with one level less, where a wave is only looked for again."""
_OVERLAP: Final = 1.1
"""Over `LOWEST`: how much too fast a wave may be found that is counted among the slower ones."""


@dataclass(frozen=True, kw_only=True)
class RingWaves:
    """Small waves on the liquid in one imported chamber."""

    surface_radius: float
    """a, m."""
    frequency_ratio: Estimate
    """s, natural angular frequency seen in the disc over the angular velocity, lowest first, shape (n,)."""
    vortical_share: FloatArray
    """Of each wave's kinetic energy, what is no potential flow, shape (n,): 0 for a wave that is the same all
    along the shaft.  Where it is not 0 and s < 2 the liquid has inertial waves at all neighbouring
    frequencies, and s is the middle of a resonance."""
    amplification: Estimate
    """Change of the chamber's moment over that of a surface which follows gravity at once, shape ()."""
    amplification_interval: FloatArray
    """Lower and upper end (95 %), shape (2,), as those of `SloshingResponse`."""
    pressure_amplification: Estimate
    """Change of the mean pressure on the outer wall over that under such a surface, shape ()."""
    pressure_amplification_interval: FloatArray
    """The same of it, shape (2,)."""
    surface_amplitude: Estimate
    """Largest displacement of the surface, m zero-to-peak, shape ()."""
    surface_amplitude_interval: FloatArray
    """The same of it, m, shape (2,)."""
    damped_share: float
    """Amplification with the walls' Stokes layers over that without viscosity."""
    statistics: Statistics
    status: Status


@dataclass(frozen=True, kw_only=True)
class WaveSystem:
    """The waves' problem of one surface in one chamber, for every speed."""

    reduced: ReducedWaves
    scale: float
    """Largest distance of the liquid from the shaft, m."""
    faceting: float
    """Relative error of a frequency by the facets of the wall, and where the mesh leaves the free surface."""
    unknowns: int


def ring_waves(
    *,
    geometry: ChamberGeometry,
    surface_radius: float,
    angular_velocity: float = 1.0,
    kinematic_viscosity: float = 0.0,
    gravity: float = 0.0,
    axial_gravity: float = 0.0,
    frequency_ratio: float = 1.0,
    modes: int = 6,
    levels: int = LEVELS,
) -> RingWaves:
    """Natural frequencies and forced response of the waves, with Coriolis force and in three dimensions.

    (-s^2 + 2 i s C + A + i s sqrt(i s E) W) c = F, E = nu/(omega R^2); the reference is a surface always
    across the sum of both fields.
    Args:
        surface_radius: a, m; along a vertical shaft, of the cylinder on whose potential the paraboloid is
            half-way along the chamber.
        kinematic_viscosity: nu, m^2/s, zero or more; zero leaves resonance without a limit.
        gravity: across the shaft, m/s^2: turns in the disc's frame.
        axial_gravity: along the shaft, m/s^2: shapes the surface and excites no wave.
        frequency_ratio: s of the force, above 0; 1 for gravity.
        modes: number of frequencies, 1 to 12.  From s = 2.1 on none is missing; below, their number is
            counted, but where a coarse mesh does not tell waves of the surface from inertial ones, some of
            the latter are among them.
        levels: of the Coriolis force, 2 or more; the change from the last one is part of the uncertainty.
    Returns: RingWaves.  Status NO_RING where gravity exceeds omega^2 a, OUT_OF_RANGE where waves would not be
        small, NOT_CONVERGED where a linear solve failed.
    Raises: ValueError: arguments out of range, or a free surface that misses the chamber.
    Validity: small waves; thin Stokes layers on the walls without the Coriolis force in them.
    Source: derived in `physics/sloshing/body.py` and `physics/sloshing/fast.py`.
    """
    _check(angular_velocity, kinematic_viscosity, gravity, frequency_ratio, modes, levels)
    tilt = -axial_gravity / angular_velocity**2
    system = wave_system(geometry, surface_radius, tilt, modes, levels)
    ekman = kinematic_viscosity / (abs(angular_velocity) * system.scale**2)
    values, shares, widths = frequencies(system, modes)
    counts = system.reduced.levels[-2:]
    before, last = (np.array(answer(system.reduced, n, frequency_ratio, ekman)) for n in counts)
    scale = gravity / angular_velocity**2
    relative = system.faceting + system.reduced.squared_errors[0] + system.reduced.left_out
    change = _SAFETY * np.abs(last - before) + relative * last
    amplitude = Estimate(value=np.array(scale * last[2]), uncertainty=np.array(scale * change[2]))
    ends = _intervals(system.reduced, frequency_ratio, ekman, values, change[:3] / last[:3])
    return RingWaves(
        surface_radius=surface_radius,
        frequency_ratio=Estimate(value=values, uncertainty=widths),
        vortical_share=shares,
        amplification=Estimate(value=np.array(last[0]), uncertainty=np.array(change[0])),
        amplification_interval=ends[:, 0].copy(),
        pressure_amplification=Estimate(value=np.array(last[1]), uncertainty=np.array(change[1])),
        pressure_amplification_interval=ends[:, 1].copy(),
        surface_amplitude=amplitude,
        surface_amplitude_interval=scale * ends[:, 2],
        damped_share=float(last[3]),
        statistics=Statistics(unknowns=system.unknowns, relative_residual=system.reduced.residual),
        status=_status(system, surface_radius, scale * float(ends[1, 2]), scale),
    )


def _check(omega: float, viscosity: float, gravity: float, ratio: float, modes: int, levels: int) -> None:
    if not (np.isfinite([omega, ratio]).all() and omega != 0 and ratio > 0):
        raise ValueError(
            "angular_velocity must be finite and not zero, frequency_ratio finite and above zero"
        )
    if not (np.isfinite([viscosity, gravity]).all() and viscosity >= 0 and gravity >= 0):
        raise ValueError("kinematic_viscosity and gravity must be finite and not negative")
    if not (1 <= modes <= 12 and levels >= 2):
        raise ValueError("modes must be 1 to 12, and levels at least 2")


@lru_cache(maxsize=32)
def wave_system(geometry: ChamberGeometry, radius: float, tilt: float, modes: int, levels: int) -> WaveSystem:
    """The waves' small problem below a surface of this radius, m; `tilt`: gravity along z over omega^2, m."""
    body = liquid_body(tetrahedra(geometry), Level(constant=radius**2 / 2, tilt=(0.0, 0.0, tilt)))
    scale = float(np.hypot(*body.nodes[:, :2].T).max())
    space = TetrahedronSpace(body=replace(body, nodes=body.nodes / scale))
    level = Level(constant=radius**2 / 2 / scale**2, tilt=(0.0, 0.0, tilt / scale))
    reduced = deferred.reduced_waves(
        space=space,
        level=level,
        wall=OUTER_WALL,
        waves=modes,
        potentials=modes + _SPARE,
        levels=levels,
    )
    surface = space.facets(FREE_SURFACE)
    missed = np.abs(level.value(surface.points)) / (radius / scale)
    # Frequencies grow with the root of the depth; r^2 changes by twice r times the depth.
    deeper = SAFETY * faceting(geometry).wall / (2 * scale) + scale * np.average(
        missed, weights=surface.weights
    )
    doubt = float(deeper) / (2 * (scale - radius))
    return WaveSystem(reduced=reduced, scale=scale, faceting=doubt, unknowns=space.unknowns)


def frequencies(system: WaveSystem, modes: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Frequencies of the surface's waves, their vortical shares and expanded uncertainties."""
    fast = system.reduced.fast
    slow = _slow(system, min(modes, fast.slower))
    widths = _SAFETY * fast.error + system.faceting * fast.frequency
    both = zip(slow, (fast.frequency, fast.vortical_share, widths), strict=True)
    values, shares, widths = (np.concatenate(pair)[:modes] for pair in both)
    return values, shares, widths


def _slow(system: WaveSystem, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same for so many waves slower than those that are found by their pressure."""
    reduced = system.reduced
    values, potential, weights = _waves(reduced, reduced.levels[-1])
    before, probable, _ = _waves(reduced, reduced.levels[-2])
    # Waves of the surface by their frequency; the likeliest of the others if these do not suffice.
    surface = (potential > _OF_SURFACE) & (values < _OVERLAP * LOWEST)
    by_rank = np.lexsort((values, np.where(surface, -1.0, -potential * (values < LOWEST))))
    chosen = np.sort(by_rank[:count])
    values, potential, weights = values[chosen], potential[chosen], weights[chosen]
    errors = reduced.squared_errors
    change = np.abs(values[:, None] - before[probable > _PERHAPS]).min(axis=1)
    # A field that is left out acts on a frequency by half its kinetic energy; the next level is taken to have
    # what the last one has.
    next_level = weights[:, reduced.levels[-2] :].sum(axis=1)
    relative = (weights[:, : errors.size] @ errors + next_level) / 2 + reduced.left_out + system.faceting
    return values, 1 - potential, _SAFETY * change + values * relative


def _waves(reduced: ReducedWaves, fields: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Frequencies with so many fields, the kinetic energy's potential share, and its parts by field.

    The oscillator c'' + 2 C c' + A c = 0 is d/dt (c', A^(1/2) c) = B (...) with a real antisymmetric B, whose
    eigenvalues are +- i s.
    """
    coriolis, stiff = (m[:fields, :fields] for m in (reduced.coriolis, reduced.stiffness))
    squares, axes = np.linalg.eigh(stiff)
    root = (axes * np.sqrt(np.maximum(squares, 0.0))) @ axes.T
    first_order = np.block([[-2 * coriolis, -root], [root, np.zeros_like(root)]])
    values, shapes = np.linalg.eigh(1j * first_order)
    shapes = shapes[:, values > 0]
    kinetic = np.abs(shapes[:fields].T) ** 2
    parts = kinetic / kinetic.sum(axis=1, keepdims=True)
    potential = parts[:, : reduced.levels[0]].sum(axis=1)
    # Of a potential with l = s^2 without rotation, |s| <= 1 + sqrt(1 + l): what is faster is not resolved.
    slowest = slice(0, reduced.squared_errors.size)
    fastest = 1 + np.sqrt(1 + np.linalg.eigvalsh(stiff[slowest, slowest])[-1])
    found = values[values > 0]
    kept = (found > _SLOWEST) & (found < fastest)
    return found[kept], potential[kept], parts[kept]


_SLOWEST: Final = 1e-4
"""Frequency ratio below which a field is at rest."""


def answer(reduced: ReducedWaves, fields: int, ratio: float, ekman: float) -> tuple[float, ...]:
    """Amplification of moment and wall pressure, largest displacement for g/omega^2 = 1 (any unit of length),

    and the share that damping leaves.
    """
    cut = slice(0, fields)
    swinging = (
        -(ratio**2) * np.eye(fields) + 2j * ratio * reduced.coriolis[cut, cut] + reduced.stiffness[cut, cut]
    )
    layers = 1j * ratio * np.sqrt(1j * ratio * ekman) * reduced.wall_loss[cut, cut]
    outflow = reduced.outflow[:, cut]
    forcing = outflow[1] + 1j * outflow[2]
    damped, free = (np.linalg.solve(matrix, forcing) for matrix in (swinging + layers, swinging))
    moment, undamped = (float(np.linalg.norm(outflow[1:] @ c)) for c in (damped, free))
    wall = reduced.wall
    pressure = wall.drive + (1j * ratio * wall.flow[cut] + wall.surface[cut]) @ damped
    return (
        moment / float(np.linalg.norm(reduced.quasi_static[1:])),
        float(abs(pressure / wall.still)),
        float(np.abs(reduced.displacement[:, cut] @ damped).max()),
        moment / undamped,
    )


def _intervals(
    reduced: ReducedWaves, ratio: float, ekman: float, natural: FloatArray, share: FloatArray
) -> FloatArray:
    """Ends of the first three of `answer` by natural frequencies and by `share`, the solution's own error."""
    fields = reduced.levels[-1]

    def response(ratios: FloatArray) -> FloatArray:
        return np.array([answer(reduced, fields, float(s), ekman)[:3] for s in ratios])

    low, high = swept(response, frequency_ratio=ratio, natural=natural)
    return np.stack([low * (1 - np.minimum(share, 1.0)), high * (1 + share)])


def _status(system: WaveSystem, radius: float, amplitude: float, tilt: float) -> Status:
    if system.reduced.excess > _ACCEPTED:
        text = f"a linear solve left {system.reduced.excess:.0f} times its tolerance: use a better mesh"
        return Status(code=StatusCode.NOT_CONVERGED, text=text)
    if tilt >= radius:
        text = "gravity is stronger than omega^2 a: turn the disc faster"
        return Status(code=StatusCode.NO_RING, text=text)
    share = amplitude / (system.scale - radius)
    if share > SMALL:
        text = (
            f"waves may reach {share:.2g} of the ring's depth, too high for this theory: turn the disc faster"
        )
        return Status(code=StatusCode.OUT_OF_RANGE, text=text)
    return Status()


_ACCEPTED: Final = 10.0
"""Residual of a solve over the one asked for."""
