"""What uncertain inputs do to wall pressure, moment and lambda: linear sensitivities of the closed forms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import half_angle, surface_radius
from ringbalance.scene.models import Disc, InputUncertainty, Scene
from ringbalance.scene.uncertain import nominal_value, with_value

FloatArray = npt.NDArray[np.float64]

CHAMBER_INPUTS: Final = (
    "outer_radius",
    "inner_radius",
    "axial_width",
    "central_angle",
    "plate_thickness",
    "density",
    "speed",
)
_STEP: Final = 1e-3
_POINTS: Final = 48


@dataclass(frozen=True, kw_only=True)
class InputEffect:
    """95 % half-widths by input; arrays along the fill ratio."""

    wall_pressure: FloatArray
    """Pa."""
    moment: FloatArray
    """kg m."""
    moment_per_mass: float
    """lambda at equal fills, m."""


def half_widths(scene: Scene) -> Mapping[str, float]:
    """Absolute 95 % half-widths of a scene's inputs; the liquid's own where the scene states none.

    Args:
        scene: the scene.

    Returns:
        SI half-width by quantity; only those above zero.
    """
    liquid = scene.liquid
    found = {
        "density": liquid.density_uncertainty * liquid.density,
        "kinematic_viscosity": liquid.viscosity_uncertainty * liquid.kinematic_viscosity,
    }
    for stated in scene.uncertainty:
        width = _absolute(scene, stated)
        if width is not None:
            found[stated.quantity] = width
    return {name: width for name, width in found.items() if width > 0}


def _absolute(scene: Scene, stated: InputUncertainty) -> float | None:
    value = nominal_value(scene=scene, quantity=stated.quantity)
    if value is None:
        return None
    return stated.half_width * (abs(value) if stated.relative else 1.0)


def input_effects(*, scene: Scene, fill_ratio: FloatArray) -> Mapping[str, InputEffect]:
    """Effect of each uncertain input of the chamber, at a fixed fill ratio.

    Args:
        scene: the scene.
        fill_ratio: x, shape (n,).

    Returns:
        InputEffect by quantity; empty when every input is exact.

    Source: ASME V&V 20-2009, propagation of input uncertainty by local sensitivities.
    """
    widths = {name: w for name, w in half_widths(scene).items() if name in CHAMBER_INPUTS}
    return {name: _effect(scene, fill_ratio, name, width) for name, width in widths.items()}


def _effect(scene: Scene, fill_ratio: FloatArray, quantity: str, width: float) -> InputEffect:
    value = nominal_value(scene=scene, quantity=quantity)
    if value is None:
        raise ValueError(f"the scene has no {quantity}")
    sides = [
        chamber_closed_forms(
            scene=with_value(scene=scene, quantity=quantity, value=value + s * _STEP * width),
            fill_ratio=fill_ratio,
        )
        for s in (-1.0, 1.0)
    ]
    pressure, moment, ratio = (np.abs(b - a) / (2 * _STEP) for a, b in zip(*sides, strict=True))
    return InputEffect(wall_pressure=pressure, moment=moment, moment_per_mass=float(ratio))


def chamber_closed_forms(
    *, scene: Scene, fill_ratio: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Wall pressure, moment and central lambda without gravity; for sensitivities and shares only.

    P = rho omega^2 (R2^2 - a^2)/2, U = rho B int 2 r^2 sin(alpha), lambda = 2 a sin(alpha)/alpha.

    Args:
        scene: the scene.
        fill_ratio: x, shape (n,).

    Returns:
        P, Pa, and U, kg m, shape (n,); lambda at equal fills, m, shape ().

    Source: exact geometry of the chamber; the reported values come from finite elements instead.
    """
    disc, rho = scene.disc, scene.liquid.density
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    centre = surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio / 2)
    alpha = half_angle(disc=disc, radius=centre)
    return (
        rho * scene.rotor.speed**2 * (disc.outer_radius**2 - a**2) / 2,
        rho * disc.axial_width * _moment_area(disc, a),
        np.asarray(2 * centre * np.sin(alpha) / alpha, dtype=np.float64),
    )


def _moment_area(disc: Disc, surface: FloatArray) -> FloatArray:
    """Integral of 2 r^2 sin(alpha(r)) from the surface to the wall, m^3."""
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    half = (disc.outer_radius - surface) / 2
    r = surface[:, None] + half[:, None] * (1 + points)
    return np.asarray(half * (2 * r**2 * np.sin(half_angle(disc=disc, radius=r)) @ weights))
