"""The exact quasi-static ring under gravity: a circle about -g/omega^2, or a paraboloid about the shaft.

p = rho omega^2 (|r + g/omega^2|^2 - c^2)/2 across the shaft, p = rho (omega^2 (r^2 - c^2)/2 - g z) along it;
c from the liquid's volume, by quadrature of the closed-form area.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from ringbalance.mesh.geometry import half_angle, liquid_area, surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc

_GAUSS: Final = 60


@dataclass(frozen=True, kw_only=True)
class ExactRing:
    """The free surface and the pressure below it, exactly."""

    density: float
    """rho, kg/m^3."""
    angular_velocity: float
    """omega, rad/s."""
    offset: tuple[float, float]
    """g/omega^2 across the shaft in the chamber's axes, m."""
    axial: float
    """g/omega^2 along the negative z axis, m; zero across the shaft."""
    level: float
    """c, m."""

    def radius(self, angle: npt.ArrayLike, axial_place: npt.ArrayLike = 0.0) -> FloatArray:
        """Radius of the free surface.

        Args: `angle`: from the chamber's centre line, rad, any shape. `axial_place`: z, m, broadcasts.
        Returns: r, m.
        Source: r^2 + 2 r G.e_r + |G|^2 = c^2 with G = g/omega^2; r^2 = c^2 + 2 G z along the shaft.
        """
        phi, z = np.asarray(angle, dtype=np.float64), np.asarray(axial_place, dtype=np.float64)
        along = self.offset[0] * np.cos(phi) + self.offset[1] * np.sin(phi)
        across = self.offset[0] ** 2 + self.offset[1] ** 2
        return np.asarray(-along + np.sqrt(along**2 + self.level**2 - across + 2 * self.axial * z))

    def pressure(self, places: FloatArray) -> FloatArray:
        """Pressure of the liquid, the gas counted as zero.

        Args: `places`: m, shape (2 or 3, ...).
        Returns: Pa.
        """
        square = (places[0] + self.offset[0]) ** 2 + (places[1] + self.offset[1]) ** 2
        depth = self.axial * places[2] if len(places) == 3 else 0.0
        scale = self.density * self.angular_velocity**2
        return np.asarray(scale * ((square - self.level**2) / 2 - depth))


def exact_ring(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    fill_ratio: float,
    across: tuple[float, float] = (0.0, 0.0),
    along: float = 0.0,
) -> ExactRing:
    """The ring that holds a fill ratio under gravity.

    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `fill_ratio`: x. `across`: gravity across
        the shaft in the chamber's axes, m/s^2. `along`: gravity along the negative z axis, m/s^2.
    Raises: ValueError: gravity so strong that no closed ring holds the liquid.
    """
    square = angular_velocity**2
    target = fill_ratio * float(liquid_area(disc=disc, surface_radius=disc.inner_radius))
    middle = float(surface_radius(disc=disc, fill_ratio=fill_ratio))

    def ring(level: float) -> ExactRing:
        return ExactRing(
            density=density,
            angular_velocity=angular_velocity,
            offset=(across[0] / square, across[1] / square),
            axial=along / square,
            level=level,
        )

    area = _mean_area_along if along else _area_across
    reach = 1.5 * float(np.hypot(*across)) / square + 1.5 * along / square * disc.axial_width / middle
    level = brentq(
        lambda c: area(disc, ring(c)) - target, middle - reach, middle + reach, xtol=1e-17, rtol=1e-15
    )
    return ring(float(level))


def _rule() -> tuple[FloatArray, FloatArray]:
    abscissa, weight = np.polynomial.legendre.leggauss(_GAUSS)
    return np.asarray(abscissa), np.asarray(weight)


def _on_rays(disc: Disc, radius: Callable[[FloatArray], FloatArray], eta: FloatArray) -> FloatArray:
    """Surface radius on the rays phi = eta alpha(r), whose angle depends on the radius through the plates."""
    r = np.full(eta.shape, disc.outer_radius)
    for _ in range(100):
        update = radius(eta * half_angle(disc=disc, radius=r))
        if np.max(np.abs(update - r)) < 1e-16:
            break
        r = update
    return r


def _area_across(disc: Disc, ring: ExactRing) -> float:
    """With phi = eta alpha(r) the area element is alpha r dr d eta, so each ray holds half of A(r_s)."""
    eta, weight = _rule()
    return float(weight @ liquid_area(disc=disc, surface_radius=_on_rays(disc, ring.radius, eta)) / 2)


def _mean_area_along(disc: Disc, ring: ExactRing) -> float:
    zeta, weight = _rule()
    radius = ring.radius(np.zeros_like(zeta), disc.axial_width / 2 * zeta)
    return float(weight @ liquid_area(disc=disc, surface_radius=radius) / 2)
