"""How strongly the liquid ring in a chamber answers to gravity across the shaft, which turns once a turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.physics.sloshing.modes import Meshes, default_sloshing_cells
from ringbalance.physics.sloshing.range import SMALL, swept
from ringbalance.physics.sloshing.system import SloshingSystem
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc


@dataclass(frozen=True, kw_only=True)
class SloshingResponse:
    """Forced planar oscillation of the liquid in one chamber, along an array of fill ratios."""

    fill_ratio: FloatArray
    """x, shape (n,)."""
    surface_radius: FloatArray
    """a, m, shape (n,)."""
    amplification: Estimate
    """Change of the chamber's moment over that of a surface which follows gravity at once, shape (n,).

    Half-widths are those of the solution alone, here and below; the intervals hold them, too."""
    amplification_interval: FloatArray
    """Its lower and upper end (95 %), shape (n, 2), natural frequencies being known to
    `FREQUENCY_UNCERTAINTY` only.  Where a mode may meet the force, the upper end rests on the damping."""
    pressure_amplification: Estimate
    """Change of the mean pressure on the outer wall over that under such a surface, shape (n,)."""
    pressure_amplification_interval: FloatArray
    """The same of it, shape (n, 2)."""
    surface_amplitude: Estimate
    """Largest displacement of the surface, m zero-to-peak, shape (n,)."""
    surface_amplitude_interval: FloatArray
    """The same of it, m, shape (n, 2)."""
    damped_share: FloatArray
    """Amplification with the walls' Stokes layers over that without any viscosity, shape (n,): near 1 away
    from resonance, and where it is small the peak rests on an estimate of the damping."""
    status: Status


def sloshing_response(
    *,
    disc: Disc,
    fill_ratio: npt.ArrayLike,
    angular_velocity: float,
    kinematic_viscosity: float,
    gravity: float,
    frequency_ratio: float = 1.0,
    cells: tuple[tuple[int, int], ...] | None = None,
) -> SloshingResponse:
    """Answer of the liquid in one chamber to gravity that turns in the disc's frame.

    (-s^2 S + 2 i s C + A + i s sqrt(i s E) W) psi = i s F with G = g r exp(i (angle + s omega t)), E =
    nu/(omega R2^2); the reference is A psi = i s F, a surface always across the sum of both fields.  The
    wall pressure follows from psi by p'/rho = G + c - i s phi - 2 psi.
    Args:
        fill_ratio: x, any shape, flattened to (n,), above 0 and at most 1.
        kinematic_viscosity: nu, m^2/s, zero or more; zero leaves resonance without a limit.
        frequency_ratio: s, above 0; 1 for gravity.
        cells: three meshes or more, finest first; default those of `sloshing_modes`.
    Returns: SloshingResponse; status says where the waves might not be small, or gravity leaves no ring.
    Raises: ValueError: fill ratios outside (0, 1], or an argument outside its range.
    Validity: small planar waves, of an imported chamber those of its middle section: waves along the shaft,
        and what a section that changes along it does to them, are left out; thin Stokes layers on all walls
        without the Coriolis force, which makes the damping, and with it a peak, good to a factor of two.
    Source: derived in `section_system`; the layers as in Landau and Lifshitz, "Fluid Mechanics", section 24.
    """
    fills = np.atleast_1d(np.asarray(fill_ratio, dtype=np.float64)).ravel()
    _check(fills, angular_velocity, kinematic_viscosity, gravity, frequency_ratio)
    radii = np.atleast_1d(surface_radius(disc=disc, fill_ratio=fills))
    meshes = Meshes(disc=disc, cells=cells or default_sloshing_cells(disc=disc))
    ekman = kinematic_viscosity / (angular_velocity * disc.outer_radius**2)

    def on_mesh(radius: float, level: int) -> FloatArray:
        system, unit = meshes.system(radius, level)
        answers = _answers(system, np.array([frequency_ratio]), ekman)[0]
        return np.asarray(answers * [1.0, unit / disc.outer_radius, 1.0, 1.0])

    found = np.array([[on_mesh(float(a), level) for level in meshes.levels] for a in radii])
    widths = np.array(
        [[meshes.half_width(values, float(a)) for values in at.T] for a, at in zip(radii, found, strict=True)]
    )
    scale = gravity / angular_velocity**2
    amplitude = Estimate(value=scale * found[:, 0, 1], uncertainty=scale * widths[:, 1])
    ends = np.array([_interval(meshes, float(a), frequency_ratio, ekman) for a in radii])
    # At either end the solution errs by about the same share as in the middle.
    share = (widths / found[:, 0])[:, [0, 1, 3]]
    ends *= 1 + np.stack([-np.minimum(share, 1.0), share], axis=1)
    return SloshingResponse(
        fill_ratio=fills,
        surface_radius=radii,
        amplification=Estimate(value=found[:, 0, 0].copy(), uncertainty=widths[:, 0]),
        amplification_interval=ends[:, :, 0].copy(),
        pressure_amplification=Estimate(value=found[:, 0, 3].copy(), uncertainty=widths[:, 3]),
        pressure_amplification_interval=ends[:, :, 2].copy(),
        surface_amplitude=amplitude,
        surface_amplitude_interval=scale * ends[:, :, 1],
        damped_share=found[:, 0, 2].copy(),
        status=_status(fills, disc.outer_radius - radii, scale * ends[:, 1, 1], scale - radii),
    )


def _interval(meshes: Meshes, radius: float, ratio: float, ekman: float) -> FloatArray:
    """Ends by natural frequencies of moment, displacement (as `_answers`) and wall pressure, shape (2, 3)."""
    # Peaks are looked for on the mesh in the middle, if there are three.
    system, _ = meshes.system(radius, len(meshes.levels) // 3)

    def response(ratios: FloatArray) -> FloatArray:
        return _answers(system, ratios, ekman)[:, [0, 1, 3]]

    return np.stack(swept(response, frequency_ratio=ratio, natural=system.natural_frequencies()))


def _check(fills: FloatArray, omega: float, viscosity: float, gravity: float, ratio: float) -> None:
    if fills.size == 0 or not np.all((fills > 0) & (fills <= 1)):
        raise ValueError("fill_ratio must lie within (0, 1], and there must be at least one")
    if not (np.isfinite([omega, ratio]).all() and omega > 0 and ratio > 0):
        raise ValueError("angular_velocity and frequency_ratio must be finite and above zero")
    if not (np.isfinite([viscosity, gravity]).all() and viscosity >= 0 and gravity >= 0):
        raise ValueError("kinematic_viscosity and gravity must be finite and not negative")


def _answers(system: SloshingSystem, ratios: FloatArray, ekman: float) -> FloatArray:
    """Amplification, largest displacement for g/omega^2 = 1 (any unit of length), share left by damping, and
    amplification of the wall pressure, by rows along the ratios.
    """
    s = ratios[:, None, None]
    forcing = 1j * s * (system.outflow[1] + 1j * system.outflow[2])[:, None]
    swinging = -(s**2) * system.kinetic + 2j * s * system.coriolis + system.centrifugal
    layers = 1j * s * np.sqrt(1j * s * ekman) * system.wall_loss
    damped, free, still = (
        np.linalg.solve(matrix, forcing)[:, :, 0].T
        for matrix in (swinging + layers, swinging, system.centrifugal.astype(np.complex128))
    )
    # Of the swing of the liquid's first moment, both components.
    moment, reference, undamped = (
        np.linalg.norm(system.outflow[1:] @ psi, axis=0) for psi in (damped, still, free)
    )
    displacement = np.abs(system.flux @ damped).max(axis=0) / ratios
    pressure = (
        system.wall_drive - 1j * ratios * (system.potential @ damped) + 2 * (system.surface_mean @ damped)
    )
    columns = (moment / reference, displacement, moment / undamped, np.abs(pressure / system.wall_drive))
    return np.stack(columns, axis=1)


def _status(fills: FloatArray, depth: FloatArray, amplitude: FloatArray, beyond: FloatArray) -> Status:
    if np.any(beyond >= 0):
        x = fills[np.argmax(beyond)]
        return Status(
            code=StatusCode.NO_RING,
            text=f"at a fill ratio of {x:.3g} gravity is stronger than omega^2 a: turn the disc faster",
        )
    share = amplitude / depth
    worst = int(np.argmax(share))
    if share[worst] > SMALL:
        return Status(
            code=StatusCode.OUT_OF_RANGE,
            text=(
                f"at a fill ratio of {fills[worst]:.3g} waves may reach {share[worst]:.2g} of the ring's "
                "depth, too high for this theory: avoid that fill, or turn the disc faster"
            ),
        )
    return Status()
