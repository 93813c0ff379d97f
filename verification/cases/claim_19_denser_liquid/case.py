"""What the same gas pressure achieves with a liquid of twice the density."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Reference, Series, figure
from ringbalance.verification.reference.exact_chamber import exact_moment, wall_pressure_of
from ringbalance.verification.rings import found_of, ring_of

reference = {"pressure_ratio": Reference(value=1.0), "gain": Reference(value=2.0)}
"""A free gain: no more pressure, twice the ability."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    light = scene.liquid.density
    dense = 2 * light
    felt = light if defect == "weightless" else dense
    stalls = [_stall_by_elements(scene, density) for density in (light, felt)]
    ratio = stalls[1].value / stalls[0].value
    standard_uncertainty = ratio * math.hypot(*(stall.numerical / stall.value for stall in stalls))
    reach_light, reach_dense = (_reach(scene, density, scene.gas.pressure) for density in (light, felt))
    gain = _ability(scene, dense, reach_dense) / _ability(scene, light, reach_light)
    return Evidence(
        found={
            "pressure_ratio": Found(value=ratio, numerical=standard_uncertainty),
            "gain": Found(value=gain),
        },
        numbers={
            "stall_light": stalls[0].value,
            "stall_dense": stalls[1].value,
            "gas": scene.gas.pressure,
            "reach_light": reach_light,
            "reach_dense": reach_dense,
            "prime_light": _priming(scene, light),
            "prime_dense": _priming(scene, felt),
        },
        series=(_figure(scene),),
    )


def _stall_by_elements(scene: Scene, density: float) -> Found:
    """Wall pressure of a full opposite chamber: what the gas has to overcome when the driven one is empty."""
    return found_of(ring_of(scene, (scene.disc.max_fill_ratio,), density=density), "wall_pressure", 0)


def _wall(scene: Scene, density: float, fill: float) -> float:
    return float(wall_pressure_of(scene, fill, density=density))


def _reach(scene: Scene, density: float, pressure: float) -> float:
    """Largest fill of the opposite chamber that a gas pressure can hold up."""
    largest = scene.disc.max_fill_ratio

    def excess(fill: float) -> float:
        return pressure - _wall(scene, density, fill) + _wall(scene, density, largest - fill)

    if excess(largest) >= 0:
        return largest
    return float(brentq(excess, largest / 2, largest, xtol=1e-12))


def _ability(scene: Scene, density: float, fill: float) -> float:
    fills = np.array([fill, scene.disc.max_fill_ratio - fill])
    moment = exact_moment(disc=scene.disc, density=density, fill_ratio=fills)
    return float(moment[0] - moment[1])


def _priming(scene: Scene, density: float) -> float:
    """Gas pressure that lifts the liquid over the crest from equal fills, the other chamber vented."""
    if scene.tube.hump_radius is None:
        return 0.0
    level = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio / 2))
    lift = density * scene.rotor.speed**2 * (level**2 - scene.tube.hump_radius**2) / 2
    return max(lift, 0.0)


def _figure(scene: Scene) -> Series:
    pressure = np.linspace(0.02, 2.5, 60) * _wall(scene, scene.liquid.density, scene.disc.max_fill_ratio)

    def ability(factor: float) -> np.ndarray:
        density = factor * scene.liquid.density
        return np.array([_ability(scene, density, _reach(scene, density, float(p))) for p in pressure])

    return figure(
        "ability of a pair against the gas pressure",
        ("gas pressure", "Pa", pressure),
        Curve("the scene's liquid", "kg m", ability(1.0)),
        Curve("twice as dense", "kg m", ability(2.0)),
    )
