"""What both solvers are given: the paper's disc at a quarter full, and two pressures, in units of the outer
radius.

    physical:  p = (x^2 + y^2 - a^2)/2                  (unit: rho omega^2 R2^2)
    made_up:   p = (x^2 + y^2)/2 + exp(x) sin(2 y + 0.3) cos(1.5 z + 0.2)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.chamber import ChamberMesh
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.pressure.assembly import volume_points
from ringbalance.physics.pressure.solve import PressureProblem, PressureSolution
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.models import Disc
from ringbalance.scene.narrowing import liquid_ring_scene

PROBLEMS = ("physical", "made_up")
FILL_RATIO = 0.25


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One setting of one solver on one problem."""

    problem: str
    solver: str
    setting: str
    unknowns: int
    error: float
    """Of the pressure, relative, in L2."""
    mesh_seconds: float
    """Processor time on one thread, which other load on the machine disturbs less than the clock."""
    solve_seconds: float
    """Of assembly and solution, likewise."""


def paper_disc() -> Disc:
    """The liquid-ring paper's disc. Returns: The disc of the bundled scene."""
    return liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper"))).disc


def paper_surface(disc: Disc) -> float:
    """Radius of its free surface at a quarter full. Returns: m."""
    return float(surface_radius(disc=disc, fill_ratio=FILL_RATIO))


def made_up(x: FloatArray) -> FloatArray:
    """The made-up part of the second pressure.

    Args: `x`: places in units of R2, shape (3, ...).
    Returns: exp(x) sin(2 y + 0.3) cos(1.5 z + 0.2), shape (...).
    """
    return np.asarray(np.exp(x[0]) * np.sin(2 * x[1] + 0.3) * np.cos(1.5 * x[2] + 0.2))


def exact(problem: str, x: FloatArray, surface: float) -> FloatArray:
    """Exact pressure.

    Args: `x`: places in units of R2, shape (3, ...). `surface`: radius of the free surface in the same unit.
    Returns: Pressure in units of rho omega^2 R2^2, shape (...).
    """
    square = (x[0] ** 2 + x[1] ** 2) / 2
    return np.asarray(square - surface**2 / 2 if problem == "physical" else square + made_up(x))


def gradient(problem: str, x: FloatArray) -> FloatArray:
    """Gradient of the exact pressure.

    Args: `x`: places in units of R2, shape (3, ...).
    Returns: The shape of `x`.
    """
    slope = np.stack([x[0], x[1], np.zeros_like(x[0])])
    if problem == "physical":
        return slope
    growth, wave, along = np.exp(x[0]), 2 * x[1] + 0.3, 1.5 * x[2] + 0.2
    slope += growth * np.stack(
        [
            np.sin(wave) * np.cos(along),
            2 * np.cos(wave) * np.cos(along),
            -1.5 * np.sin(wave) * np.sin(along),
        ]
    )
    return slope


def right_hand_sides(problem: str, disc: Disc) -> PressureProblem:
    """The problem as our solver takes it, in metres.

    Returns: Right-hand sides; pressures stay in units of rho omega^2 R2^2.
    """
    unit, surface = disc.outer_radius, paper_surface(disc) / disc.outer_radius
    rate = 0.0 if problem == "physical" else 1 - 4 - 2.25
    return PressureProblem(
        source=lambda x: (2 + rate * made_up(x / unit)) / unit**2,
        wall_flux=lambda x, n: np.asarray(np.sum(gradient(problem, x / unit) * n, axis=0) / unit),
        surface_pressure=lambda x: exact(problem, x / unit, surface),
    )


def relative_error(problem: str, chamber: ChamberMesh, solution: PressureSolution) -> float:
    """Error of our solution, at more points than it was solved with: there it may be small by chance.

    Returns: |p_h - p| / |p| in L2 over the mesh.
    """
    volume = volume_points(chamber, extra=3)
    surface = float(chamber.surface_radius.mean()) / chamber.length_scale
    true = exact(problem, volume.points, surface)
    difference = volume.at_points(solution.pressure) - true
    return float(np.sqrt(np.sum(volume.weights * difference**2) / np.sum(volume.weights * true**2)))
