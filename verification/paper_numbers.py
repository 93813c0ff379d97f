"""The numbers that the liquid-ring paper prints, each with the value of one unit of its last digit.

Pan, Wu, Gao and Mu, "Performance Analysis and Control Simulation of Pneumatic Liquid Online Automatic
Balancing System for Rotating Machinery".
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Reference, from_rounding, input_uncertainty


@dataclass(frozen=True, kw_only=True)
class _Printed:
    """A printed number."""

    value: float
    """SI."""
    last_digit: float
    """One unit of the last digit printed, SI."""

    @property
    def reference(self) -> Reference:
        """The number with the standard uncertainty of its rounding."""
        return Reference(value=self.value, uncertainty=from_rounding(self.last_digit))


CHAMBER_VOLUME: Final = _Printed(value=67.7e-6, last_digit=0.1e-6)
"""Eq. 4."""
MAX_LIQUID_VOLUME: Final = _Printed(value=33.9e-6, last_digit=0.1e-6)
"""Eq. 5."""
INITIAL_LIQUID_VOLUME: Final = _Printed(value=16.9e-6, last_digit=0.1e-6)
"""Eq. 6."""
RING_RADIUS: Final = _Printed(value=34.9e-3, last_digit=0.1e-3)
"""R1'min, after Eq. 6."""
CHAMBER_MOMENT: Final = _Printed(value=1333e-6, last_digit=1e-6)
"""After Eq. 7."""
DISC_MOMENT: Final = _Printed(value=1885e-6, last_digit=1e-6)
"""Eq. 8."""
DENSE_DISC_MOMENT: Final = _Printed(value=3770e-6, last_digit=10e-6)
"""After Eq. 8, twice 1885 and so known to ten."""
LOWEST_PRESSURE: Final = _Printed(value=0.54e6, last_digit=0.01e6)
HIGHEST_PRESSURE: Final = _Printed(value=1.77e6, last_digit=0.01e6)
"""Working range, after Eq. 19."""
DEPARTURE_LOW: Final = _Printed(value=0.456, last_digit=0.001)
"""Under Fig. 4, at LOW_PRESSURE."""
DEPARTURE_HIGH: Final = _Printed(value=0.229, last_digit=0.001)
"""Under Fig. 4, at HIGH_PRESSURE."""
LOW_PRESSURE: Final = 0.7e6
HIGH_PRESSURE: Final = 1.5e6
"""Of Fig. 4, Pa."""
DENSITY: Final = 1000.0
"""Table 1, kg/m^3."""
LAMBDA_TOLERANCE: Final = 0.007
"""Section 5.2: 72 mm within 0.7 %."""


def at_paper_density(scene: Scene) -> Scene:
    """A scene with the density of Table 1, 1000 kg/m^3, in place of the liquid's own."""
    return dataclasses.replace(scene, liquid=dataclasses.replace(scene.liquid, density=DENSITY))


def rounded_radius(quantity: Callable[[float], float]) -> float:
    """Standard uncertainty that the rounding of the printed R1'min gives to a quantity of it."""
    return input_uncertainty([(quantity, RING_RADIUS.value, from_rounding(RING_RADIUS.last_digit))])


def with_plate(disc: Disc, thickness: float) -> Disc:
    """A disc with another plate thickness, m."""
    return dataclasses.replace(disc, plate_thickness=thickness)


@lru_cache(maxsize=1)
def fig_7_readings() -> tuple[Scene, Scene]:
    """The paper's disc with its bore from k = 50, and from the calibrated law: both readings of Fig. 7.

    The figure fixes only the product kappa lambda rho S u, and the paper gives no bore.  Each bundled scene
    has the paper's rate under the law that its bore came from.
    """
    k_50, calibrated = (
        liquid_ring_scene(load_scene(bundled_scene(name)))
        for name in ("liquid_ring_paper", "liquid_ring_paper_calibrated")
    )
    return k_50, calibrated
