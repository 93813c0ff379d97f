"""A sector with plates by adaptive quadrature and root finding, without any code of the program."""

from __future__ import annotations

import math
from functools import cached_property

from scipy.integrate import quad
from scipy.optimize import brentq

from ringbalance.scene.models import Disc


class ExactChamber:
    """One chamber of a disc."""

    def __init__(self, disc: Disc) -> None:
        self.disc = disc

    def half_angle(self, r: float) -> float:
        return self.disc.central_angle / 2 - math.asin(self.disc.plate_thickness / r)

    def area(self, a: float) -> float:
        """m^2, between a radius and the outer wall."""
        outer = self.disc.outer_radius
        return float(quad(lambda r: 2 * r * self.half_angle(r), a, outer, epsabs=0, epsrel=1e-13)[0])

    @cached_property
    def whole(self) -> float:
        """Area of the chamber, m^2."""
        return self.area(self.disc.inner_radius)

    def surface(self, x: float) -> float:
        """Radius of the free surface at a fill ratio, m."""
        low, high = self.disc.inner_radius, self.disc.outer_radius
        if x == 0:
            return high
        return float(brentq(lambda a: self.area(a) - x * self.whole, low, high, xtol=1e-16, rtol=1e-15))

    def moment(self, x: float, density: float) -> float:
        """kg m."""
        a, b = self.surface(x), self.disc.outer_radius
        value = quad(lambda r: 2 * r * r * math.sin(self.half_angle(r)), a, b, epsabs=0, epsrel=1e-13)[0]
        return float(density * self.disc.axial_width * value)

    def central_lambda(self) -> float:
        """At equal fills, m."""
        a = self.surface(self.disc.max_fill_ratio / 2)
        return 2 * a * math.sin(self.half_angle(a)) / self.half_angle(a)
