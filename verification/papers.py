"""The two papers as the cases use them: printed numbers, scenes, and curves thinned for figures.

Liquid ring: Pan, Wu, Gao and Mu, "Performance Analysis and Control Simulation of Pneumatic Liquid
Online Automatic Balancing System for Rotating Machinery"; each number stands with the value of one unit of
its last digit.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint, eccentric_scene
from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.keys.declaration import keys_of
from ringbalance.scene.models import Disc, Scene
from ringbalance.scene.origins import raw_value_at, with_values_at
from ringbalance.verification.evidence import input_uncertainty, printed

CHAMBER_VOLUME: Final = printed(67.7e-6, last_digit=0.1e-6)
"""Eq. 4."""
MAX_LIQUID_VOLUME: Final = printed(33.9e-6, last_digit=0.1e-6)
"""Eq. 5."""
INITIAL_LIQUID_VOLUME: Final = printed(16.9e-6, last_digit=0.1e-6)
"""Eq. 6."""
RING_RADIUS: Final = printed(34.9e-3, last_digit=0.1e-3)
"""R1'min, after Eq. 6."""
CHAMBER_MOMENT: Final = printed(1333e-6, last_digit=1e-6)
"""After Eq. 7."""
DISC_MOMENT: Final = printed(1885e-6, last_digit=1e-6)
"""Eq. 8."""
DENSE_DISC_MOMENT: Final = printed(3770e-6, last_digit=10e-6)
"""After Eq. 8, twice 1885 and so known to ten."""
LOWEST_PRESSURE: Final = printed(0.54e6, last_digit=0.01e6)
HIGHEST_PRESSURE: Final = printed(1.77e6, last_digit=0.01e6)
"""Working range, after Eq. 19."""
DEPARTURE_LOW: Final = printed(0.456, last_digit=0.001)
"""Under Fig. 4, at LOW_PRESSURE_PA."""
DEPARTURE_HIGH: Final = printed(0.229, last_digit=0.001)
"""Under Fig. 4, at HIGH_PRESSURE_PA."""
LOW_PRESSURE_PA: Final = 0.7e6
HIGH_PRESSURE_PA: Final = 1.5e6
"""Gas pressures of Fig. 4, Pa."""
DENSITY_KG_M3: Final = 1000.0
"""Table 1, kg/m^3."""
LAMBDA_TOLERANCE: Final = 0.007
"""Section 5.2: 72 mm within 0.7 %."""


def at_paper_density(scene: Scene) -> Scene:
    """A scene with the density of Table 1, 1000 kg/m^3, in place of the liquid's own."""
    return dataclasses.replace(scene, liquid=dataclasses.replace(scene.liquid, density=DENSITY_KG_M3))


def rounded_radius(quantity: Callable[[float], float]) -> float:
    """Standard uncertainty of a function of R1'min from the rounding of the printed value."""
    return input_uncertainty([(quantity, RING_RADIUS.value, RING_RADIUS.uncertainty)])


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


RPM: Final = 2 * math.pi / 60
DRIVEN_SCENE: Final = "eccentric_mass_paper"
_CURVE_POINTS: Final = 240


@lru_cache(maxsize=1)
def driven_scene() -> EccentricScene:
    """The eccentric-mass paper's own rotor."""
    return eccentric_scene(load_scene(bundled_scene(DRIVEN_SCENE)))


def thinned(values: npt.ArrayLike) -> FloatArray:
    """Evenly chosen values along the last axis, at most 240, the first and last among them."""
    array = np.asarray(values, dtype=np.float64)
    return np.asarray(array[..., _curve_indices(array.shape[-1])], dtype=np.float64)


def envelope(values: npt.ArrayLike) -> FloatArray:
    """Largest value between neighbouring points of `thinned`, so that a thinned curve keeps its peaks."""
    array = np.asarray(values, dtype=np.float64)
    return np.asarray(np.maximum.reduceat(array, _curve_indices(array.size)), dtype=np.float64)


def convergence_time(time: FloatArray, error: FloatArray, *, limit: float) -> float:
    """Instant from which on an error stays within a limit, s; infinite when the last is beyond it."""
    beyond = np.flatnonzero(error > limit)
    if beyond.size == 0:
        return float(time[0])
    last = int(beyond[-1])
    return math.inf if last == time.size - 1 else float(time[last + 1])


def _curve_indices(size: int) -> IntArray:
    return np.unique(np.linspace(0, size - 1, _CURVE_POINTS).round().astype(np.int64))


def changed(scene: EccentricScene, values: Mapping[str, Any]) -> EccentricScene:
    """The scene with some values replaced, and with the defaults that follow from them.

    Unlike `SceneFile.with_values` it checks nothing: at the upper end of an assumed noise, for example, the
    limit may lie below the noise. Args: `values`: by path, SI.
    """
    scene, changes = with_values_at(scene, values), set(values)
    for path in scene.defaulted:
        part, _, name = path.partition(".")
        if not hasattr(scene, part) or path in changes:
            continue
        record: Any = type(getattr(scene, part))
        presence = keys_of(record)[name].presence
        if not changes.isdisjoint(presence.needs):
            needed = [raw_value_at(scene, need) for need in presence.needs]
            scene = with_values_at(scene, {path: presence.value(*needed)})
            changes.add(path)
    return scene


def at_constant_speed(
    scene: EccentricScene, *, time_limit: float, speed: float | None = None
) -> EccentricScene:
    """The scene at one speed. Args: `speed`: rad/s; default the first of the scene's profile."""
    speed = scene.rotor.speed_profile[0].speed if speed is None else speed
    constant = changed(scene, {"rotor.speed_profile": (SpeedPoint(time=0.0, speed=speed),)})
    return changed(constant, {"run.time_limit": time_limit})
