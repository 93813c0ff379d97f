"""What uncertain inputs do to wall pressure, moment and lambda of a chamber, by its closed forms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import (
    head_square,
    liquid_first_moment,
    surface_centroid,
    surface_radius,
    wall_square,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.joint import combined, input_sides
from ringbalance.scene.models import Scene

CHAMBER_INPUTS: Final = (
    "outer_radius",
    "inner_radius",
    "axial_width",
    "central_angle",
    "plate_thickness",
    "density",
    "speed",
    "lambda_factor",
)


@dataclass(frozen=True, kw_only=True)
class InputEffect:
    """Expanded uncertainties (95 %) by input; arrays along the fill ratio."""

    wall_pressure: FloatArray
    """Pa."""
    hydrostatic_pressure: FloatArray
    """Pa."""
    moment: FloatArray
    """kg m."""
    moment_per_mass: float
    """lambda at equal fills, m."""


def input_effects(*, scene: Scene, fill_ratio: FloatArray) -> Mapping[str, InputEffect]:
    """Effect of each uncertain input of the chamber, at a fixed fill ratio.

    Returns: InputEffect by quantity, "fitted" for those that were fitted together; empty when every input is
        exact.
    Source: ASME V&V 20-2009, one input at a time; steps of the half-width to both sides, of which the larger
        change counts, because a sensitivity at the value itself misses what bends within the interval.
    """
    sides = input_sides(scene, among=CHAMBER_INPUTS, errors=False)
    found = {name: _effect(scene, fill_ratio, both) for name, both in sides.items()}
    parts = (
        combined({name: np.append(each.wall_pressure, 0.0) for name, each in found.items()}),
        combined({name: np.append(each.hydrostatic_pressure, 0.0) for name, each in found.items()}),
        combined({name: np.append(each.moment, 0.0) for name, each in found.items()}),
        combined({name: each.moment_per_mass for name, each in found.items()}),
    )
    return {
        name: InputEffect(
            wall_pressure=parts[0][name][:-1],
            hydrostatic_pressure=parts[1][name][:-1],
            moment=parts[2][name][:-1],
            moment_per_mass=parts[3][name],
        )
        for name in parts[0]
    }


def _effect(scene: Scene, fill_ratio: FloatArray, both: tuple[Scene, Scene]) -> InputEffect:
    fills = np.append(fill_ratio, scene.disc.max_fill_ratio / 2)
    here, *sides = (
        (
            *measured_closed_forms(scene=s, fill_ratio=fills),
            chamber_pressure(scene=s, fill_ratio=fills),
        )
        for s in (scene, *both)
    )
    pressure, moment, ratio, hydrostatic = (
        np.maximum(np.abs(low - at), np.abs(high - at)) for at, low, high in zip(here, *sides, strict=True)
    )
    return InputEffect(
        wall_pressure=pressure[:-1],
        hydrostatic_pressure=hydrostatic[:-1],
        moment=moment[:-1],
        moment_per_mass=float(ratio[-1]),
    )


def chamber_closed_forms(
    *, scene: Scene, fill_ratio: npt.ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Wall pressure, moment and lambda of a chamber without gravity.

    P = rho omega^2 <max(r^2 - a^2, 0)>/2 over the outer wall, U = rho B int x dA, lambda = 2 <x> over the
    free surface: in a sector P = rho omega^2 (R2^2 - a^2)/2 and lambda = 2 a sin(alpha)/alpha.
    Returns: P, Pa, U, kg m, and lambda, m, the shape of `fill_ratio`.
    Source: hydrostatics with the chamber's exact geometry, that of its mesh where it is imported.
    """
    disc, rho = scene.disc, scene.liquid.density
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    return (
        rho * scene.rotor.speed**2 / 2 * wall_square(disc=disc, surface_radius=a),
        rho * disc.axial_width * liquid_first_moment(disc=disc, surface_radius=a),
        2 * surface_centroid(disc=disc, radius=a),
    )


def chamber_pressure(*, scene: Scene, fill_ratio: npt.ArrayLike) -> FloatArray:
    """What a chamber's liquid presses with at the outer radius R2, rho omega^2 (R2^2 - a^2)/2; no gravity.

    The head of a chamber of any shape is this over rho, from R2; a mean over its walls is a load.
    Returns: Pa, the shape of `fill_ratio`.
    Source: Eq. 11 of the liquid-ring paper from the free surface outward.
    """
    a = surface_radius(disc=scene.disc, fill_ratio=fill_ratio)
    scale = scene.liquid.density * scene.rotor.speed**2 / 2
    return np.asarray(scale * head_square(disc=scene.disc, surface_radius=a))


def measured_closed_forms(
    *, scene: Scene, fill_ratio: npt.ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same with moment and lambda as a measured factor corrects them.

    U and lambda times `Disc.moment_factor`; P as the geometry has it.
    Returns: P, Pa, U, kg m, and lambda, m, the shape of `fill_ratio`.
    """
    pressure, moment, ratio = chamber_closed_forms(scene=scene, fill_ratio=fill_ratio)
    factor = scene.disc.moment_factor
    return pressure, factor * moment, factor * ratio
