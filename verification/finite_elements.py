"""Finite elements for several cases: errors of fields, totals of rings, mutations of the problem.

A ring is computed once per process.  Mutations replace functions of the solver, which has no parameter for
them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, Final
from unittest.mock import patch

import numpy as np

from ringbalance.mesh.chamber import default_cells
from ringbalance.mesh.geometry import chamber_volume, liquid_area
from ringbalance.physics.cell_mapping import quadrature
from ringbalance.physics.convergence import GridVerdict
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid
from ringbalance.physics.results import Estimate
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Convergence, Found
from ringbalance.verification.papers import RING_RADIUS, with_plate
from ringbalance.verification.reference.chambers import exact_moment

_COMPLEX_STEP: Final = 1e-30


def refined_cells(disc: Disc, levels: Sequence[int], *, dimension: int) -> list[tuple[int, ...]]:
    """Cells of a chamber's meshes, radial, angular and, in three dimensions, axial, for levels 1, 2, ..."""
    radial, divisor = (2, 4) if dimension == 2 else (1, 8)
    angular = default_cells(disc=disc)[1] // divisor
    return [(radial * n, angular * n, n)[:dimension] for n in levels]


def field_error(solution: PressureSolution, exact: Callable[[FloatArray], FloatArray]) -> float:
    """Root mean square over the liquid of a pressure's error, relative to that of the exact pressure."""
    mapping = solution.basis.mapping
    # More quadrature points than the solve uses: the error at its own points alone is not representative.
    points, weights = quadrature(solution.chamber.mesh.refdom, 8)
    true = exact(solution.chamber.length_scale * mapping.F(points))
    volumes = np.abs(mapping.detDF(points)) * weights
    return relative_rms(mapping.at_points(solution.pressure, points), true, volumes)


def relative_rms(computed: FloatArray, true: FloatArray, weights: FloatArray) -> float:
    """Root mean square of an error over that of the truth, weighted."""
    return float(np.sqrt(np.sum(weights * (computed - true) ** 2) / np.sum(weights * true**2)))


def slopes(field: Callable[[Any], FloatArray], points: FloatArray) -> FloatArray:
    """Derivatives of an analytic field along each coordinate, shape (..., dimension, *points.shape[1:]).

    By a step into the complex plane, exact to rounding. Args: `points`: shape (dimension, ...).
    """
    steps = 1j * _COMPLEX_STEP * np.eye(len(points)).reshape(2 * points.shape[:1] + (1,) * (points.ndim - 1))
    derivatives = [np.asarray(field(points + step)).imag / _COMPLEX_STEP for step in steps]
    return np.stack(derivatives, axis=derivatives[0].ndim - points.ndim + 1)


@lru_cache(maxsize=64)
def ring_of(scene: Scene, fills: tuple[float, ...], *, density: float | None = None) -> RingQuantities:
    """Finite-element totals of a scene without gravity, with another density, kg/m^3, where one is given."""
    return ring_quantities(
        disc=scene.disc,
        density=density or scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        fill_ratio=fills,
        dimension=2,
    )


def found_of(quantities: RingQuantities, name: str, index: int) -> Found:
    """One total of a ring by its name and the index of its fill.

    It is inconclusive where the meshes do not converge steadily.
    """
    estimate: Estimate = getattr(quantities, name)
    converges = quantities.convergence[name][index].verdict in (GridVerdict.MONOTONE, GridVerdict.ROUND_OFF)
    return Found.within(
        estimate.value[index],
        estimate.uncertainty[index],
        conclusive=quantities.status.ok and converges,
    )


def chamber_moment(scene: Scene, *, density: float, factor: float = 1.0) -> Found:
    """Moment of one chamber at its largest fill times a factor, kg m, by finite elements.

    Its corrected value is the moment of a ring of the printed radius without plates.
    """
    bare = with_plate(scene.disc, 0.0)
    liquid = scene.disc.axial_width * float(liquid_area(disc=bare, surface_radius=RING_RADIUS.value))
    fill = liquid / chamber_volume(disc=bare)
    bare_moment = float(exact_moment(disc=bare, density=density, fill_ratio=fill))
    ring = ring_of(scene, (scene.disc.max_fill_ratio,), density=density)
    number = found_of(ring, "moment", 0).scaled(factor)
    return dataclasses.replace(number, corrected=factor * bare_moment)


def mesh_table(quantities: RingQuantities, name: str, unit: str, index: int) -> Convergence:
    """Convergence of one total of a ring over its meshes, coarse to fine."""
    record = quantities.convergence[name][index]
    values = quantities.mesh_values[name][::-1, index]
    sizes = [quantities.cells[-1][0] / cells[0] for cells in reversed(quantities.cells)]
    estimate: Estimate = getattr(quantities, name)
    finest = float(estimate.value[index])
    return Convergence(
        quantity=name.replace("_", " "),
        unit=unit,
        formal_order=4.0,
        size=sizes,
        value=values.tolist(),
        observed_order=(record.observed_order,),
        gci=float(estimate.uncertainty[index]) / abs(finest) if finest else None,
        geometry="quadratic",
        note=f"{' x '.join(map(str, quantities.cells[0]))} cells on the finest mesh; {record.text}",
    )


@contextmanager
def mutated_force(*, x_factor: float = 1.0, y_factor: float = 1.0) -> Iterator[None]:
    """Multiply the body force of every liquid solved inside, along the centre line and across it."""
    true = RotatingLiquid.body_force

    def body_force(liquid: RotatingLiquid, points: FloatArray) -> FloatArray:
        force = true(liquid, points)
        force[:2] *= np.array([x_factor, y_factor]).reshape(2, *[1] * (force.ndim - 1))
        return force

    with patch.object(RotatingLiquid, "body_force", body_force):
        yield
