"""Asynchronous instability: surface waves that lock to the whirl of a supercritical rotor, an estimate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.results.rows import Finding
from ringbalance.scene.models import Disc, Scene

DAMPING: Final = 0.01
"""Damping ratio that a rotor has at least, about: a growth below it is not worth a warning."""
_FILLS: Final = np.linspace(0.1, 1.0, 19)
"""Shares of max_fill_ratio."""


@dataclass(frozen=True, kw_only=True)
class AsynchronousInstability:
    """Critical speed that would be hit worst, and the growth of whirl there; orders of magnitude."""

    fill_ratio: float
    """Of all chambers."""
    critical_speed: float
    """(1 - s) omega, rad/s."""
    growth: float
    """Over that critical speed: the damping ratio that would stop it."""

    @classmethod
    def of(cls, scene: Scene) -> AsynchronousInstability | None:
        """Estimate at the worst fill; None where every wave is faster than the rotor, s >= 1.

        In the disc's frame the lowest wave of a chamber turns backwards at s omega, s^2 = k T,
        T = tanh(k ln(R2/a)), k = pi/theta; seen from outside at (1 - s) omega. With its effective mass
        m = rho B a^2 I^2 s^2/(theta/2), I = int sin(k phi) sin(phi) dphi, n chambers and M = 1/K of the
        rotor, (w_c^2 - w^2) (s^2 omega^2 - (w - omega)^2) = (n m/2M) w^4, which at w_c = (1 - s) omega
        grows with Im(w)/w_c = 0.5 ((n m/2M) (1 - s)/s)^(1/2).
        Range: order of magnitude. No Coriolis force on the wave (s is 3 % higher with it), no damping, equal
            fills, M from an influence coefficient K taken well above the critical speed.
        Source: derived; the mechanism after Wolf, J. Appl. Mech. 35 (1968) 676.
        """
        disc, omega = scene.disc, abs(scene.rotor.speed)
        fills = _FILLS * disc.max_fill_ratio
        k, radius = math.pi / disc.central_angle, surface_radius(disc=disc, fill_ratio=fills)
        square = k * np.tanh(k * np.log(disc.outer_radius / radius))
        slow = square < 1
        if not np.any(slow):
            return None
        s = np.sqrt(square[slow])
        sides = 2 * _overlap(k, disc) ** 2 / disc.central_angle
        mass = scene.liquid.density * disc.axial_width * radius[slow] ** 2 * sides * s**2
        ratio = disc.chambers / 2 * mass * scene.rotor.influence_coefficient
        growth = np.sqrt(ratio * (1 - s) / s) / 2
        worst = int(np.argmax(growth))
        return cls(
            fill_ratio=float(fills[slow][worst]),
            critical_speed=float((1 - s[worst]) * omega),
            growth=float(growth[worst]),
        )

    @property
    def finding(self) -> Finding | None:
        """Where the growth exceeds what rotors damp; None elsewhere."""
        if self.growth <= DAMPING:
            return None
        numbers = {"critical_speed": self.critical_speed, "fill_ratio": self.fill_ratio}
        return Finding(code="asynchronous_instability", values={**numbers, "damping_ratio": self.growth})


def _overlap(k: float, disc: Disc) -> float:
    """I, closed form."""
    if abs(k - 1) < 1e-6:
        return math.pi / 2
    return 2 * math.cos(disc.central_angle / 2) / (k**2 - 1)
