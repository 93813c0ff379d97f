"""Margins of the sampled loop, as a gain factor and a phase, beside what the uncertainty takes of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.controller.tuning.loop_factor import stationary_deviation

_FREQUENCIES: Final = np.concatenate([np.geomspace(1e-5, 1e-2, 400), np.linspace(1e-2, math.pi, 1600)])
"""Angles of z on the unit circle, rad."""


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Of the linear loop about the balanced state."""

    gain_factor: float
    """By which the loop factor may grow, the lag angle being right."""
    phase: float
    """Error of the lag angle that the loop bears, its loop factor being right, rad."""
    disk: float
    """Disk margin, 0 to 2: gain and phase may change together, at every frequency by other amounts."""
    disk_gain_factor: float
    """By which the gain may then grow or fall, (2 + disk)/(2 - disk)."""
    disk_phase: float
    """By which the phase may then turn, 2 atan(disk/2), rad."""
    gain_uncertainty: float
    """Expanded uncertainty (95 %) of the loop factor, relative."""
    phase_uncertainty: float
    """The same of the lag angle, rad."""

    @property
    def left_gain_factor(self) -> float:
        """Gain factor that is left at the edge of both uncertainties; below 1 the loop may be unstable."""
        kept = max(math.cos(min(self.phase_uncertainty, math.pi / 2)), 0.0)
        return self.gain_factor * kept / (1.0 + self.gain_uncertainty)

    @property
    def left_phase(self) -> float:
        """Phase that is left there, rad; below 0 the loop may be unstable."""
        grown = min((1.0 + self.gain_uncertainty) / self.gain_factor, 1.0)
        return math.acos(grown) - self.phase_uncertainty


def loop_margins(
    *,
    loop_factor: float,
    gain_uncertainty: float,
    phase_uncertainty: float,
    integral: float = 0.0,
    derivative: float = 0.0,
) -> Margins:
    """Margins of L(z) = h C(z)/(z - 1), C = 1 + (i/2)(z + 1)/(z - 1) + q (1 - 1/z), with negative feedback.

    With P alone the gain factor is 2/h, the phase acos(h/2), and the disk margin 2 (2 - h)/(2 + h), whose
    gain factor is 2/h as well.  i = dt/Ti (`integral`), q = Td/dt (`derivative`).
    Source: Seiler, Packard and Gahinet, "An Introduction to Disk Margins", IEEE Control Systems Magazine 40
        (2020), with the balanced sensitivity (S - T)/2.
    """
    z = np.exp(1j * _FREQUENCIES)
    shape = 1.0 + integral / 2.0 * (z + 1.0) / (z - 1.0) + derivative * (1.0 - 1.0 / z)
    loop = loop_factor * shape / (z - 1.0)
    disk = min(float(np.min(np.abs(2.0 * (1.0 + loop) / (1.0 - loop)))), 2.0)
    if math.isinf(
        stationary_deviation(loop_factor=loop_factor, noise=0.0, integral=integral, derivative=derivative)
    ):
        disk = 0.0
    return Margins(
        gain_factor=2.0 / loop_factor,
        phase=math.acos(min(loop_factor / 2.0, 1.0)),
        disk=disk,
        disk_gain_factor=math.inf if disk >= 2.0 else (2.0 + disk) / (2.0 - disk),
        disk_phase=2.0 * math.atan(disk / 2.0),
        gain_uncertainty=gain_uncertainty,
        phase_uncertainty=phase_uncertainty,
    )
