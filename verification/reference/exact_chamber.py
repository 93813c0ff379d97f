"""A chamber's volume, moment and lambda by quadrature of the closed form: a route without any mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad

from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene

_RELATIVE = 1e-13


def exact_moment(*, disc: Disc, density: float, fill_ratio: npt.ArrayLike) -> FloatArray:
    """Moment of one chamber's liquid along its centre line, kg m.

    U = 2 rho B integral of r^2 sin(alpha(r)) dr from a(x) to R2, by adaptive quadrature.
    """
    inner = surface_radius(disc=disc, fill_ratio=fill_ratio)
    scale = 2 * density * disc.axial_width
    values = [scale * _radial_integral(disc, float(a)) for a in inner.ravel()]
    return np.asarray(values, dtype=np.float64).reshape(inner.shape)


def _radial_integral(disc: Disc, inner: float) -> float:
    def integrand(r: float) -> float:
        return float(r**2 * np.sin(half_angle(disc=disc, radius=r)))

    return float(quad(integrand, inner, disc.outer_radius, epsabs=0, epsrel=_RELATIVE)[0])


def exact_wall_pressure(
    *, disc: Disc, density: float, angular_velocity: float, fill_ratio: npt.ArrayLike
) -> FloatArray:
    """Liquid pressure on the outer wall without gravity, rho omega^2 (R2^2 - a(x)^2)/2, above the gas, Pa."""
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    depth = (disc.outer_radius - a) * (disc.outer_radius + a) / 2
    return np.asarray(density * angular_velocity**2 * depth, dtype=np.float64)


def wall_pressure_of(
    scene: Scene, fill_ratio: npt.ArrayLike, *, disc: Disc | None = None, density: float | None = None
) -> FloatArray:
    """`exact_wall_pressure` of a scene, with another disc or density where one is given."""
    return exact_wall_pressure(
        disc=disc or scene.disc,
        density=density or scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        fill_ratio=fill_ratio,
    )


def central_lambda(*, disc: Disc) -> float:
    """Moment per transferred mass with a pair at its centre, 2 a sin(alpha(a))/alpha(a), m.

    Limit of [U(x) - U(x_max - x)]/(rho V (x - x_max/2)) at x = x_max/2.
    """
    a = surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio / 2)
    alpha = half_angle(disc=disc, radius=a)
    return float(2 * a * np.sin(alpha) / alpha)


def exact_totals(scene: Scene) -> dict[str, float]:
    """Volume, m^3, and at the largest fill moment, kg m, and wall pressure, Pa; lambda at equal fills, m."""
    disc, full = scene.disc, scene.disc.max_fill_ratio
    return {
        "volume": chamber_volume(disc=disc),
        "moment": float(exact_moment(disc=disc, density=scene.liquid.density, fill_ratio=full)),
        "wall_pressure": float(wall_pressure_of(scene, full)),
        "lambda": central_lambda(disc=disc),
    }


def whole_ring_pressure(scene: Scene) -> float:
    """Wall pressure at the largest fill if the whole ring were one rectangular element, Pa: a mistake.

    Centrifugal force of a ring of unit angle over its outer face, integral of rho omega^2 r^2 dr / R2.
    """
    outer = scene.disc.outer_radius
    inner = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio))
    return scene.liquid.density * scene.rotor.speed**2 * (outer**3 - inner**3) / (3 * outer)
