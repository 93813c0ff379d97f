"""What the same gas pressure achieves with a liquid of twice the density."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.pressure.hydrostatics import hydrostatic_pressure
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    Curve,
    Evidence,
    Found,
    Level,
    NotRunError,
    Reference,
    Series,
    figure,
)
from ringbalance.verification.loops import flow_law_of
from ringbalance.verification.reference.exact_chamber import exact_moment, wall_pressure_of
from ringbalance.verification.rings import found_of, ring_of

_POINTS: Final = 101
_STANDARD: Final = 1e-6
"""Standard uncertainty of a gain: the fill at which the flow ends is found to a millionth of the largest."""
_REFINEMENTS: Final = 3
"""Each finds the fill at which the flow ends a hundred times more closely; a figure needs one less."""

reference = {"gain": Reference(value=2.0), "gain_raised": Reference(value=2.0)}
"""Twice the density, twice the ability."""


def values(scene: Scene) -> dict[str, float]:
    laws = [_law(scene, density) for density in (scene.liquid.density, 2 * scene.liquid.density)]
    return {"gain": _gain(scene, laws), "gain_raised": _gain(scene, laws, raised=2)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    light = scene.liquid.density
    felt = light if defect == "weightless" else 2 * light
    stalls = [_stall_by_elements(scene, density) for density in (light, felt)]
    laws = [_law(scene, density) for density in (light, felt)]
    reach_light, reach_dense = (_reach(law, scene.gas.pressure) for law in laws)
    raised = _gain(scene, laws, raised=2 if defect is None else 1)
    usable = [
        min(reach, scene.disc.max_fill_ratio - residual_fill_ratio(scene, law=law))
        for law, reach in zip(laws, (reach_light, reach_dense), strict=True)
    ]
    return Evidence(
        found={
            "gain": Found(value=_gain(scene, laws), numerical=_STANDARD, corrected=raised),
            "gain_raised": Found(value=raised, numerical=_STANDARD),
        },
        numbers={
            "stall_light": stalls[0].value,
            "stall_dense": stalls[1].value,
            "gas": scene.gas.pressure,
            "reach_light": reach_light,
            "reach_dense": reach_dense,
            "usable_light": usable[0],
            "gain_usable": _ability(scene, 2 * light, usable[1]) / _ability(scene, light, usable[0]),
            "gain_full": _gain(scene, laws, full=True),
            "gain_vapour": _gain(scene, [laws[0], _law(scene, 2 * light, degassed=True)], full=True),
            "push": scene.gas.ambient_pressure - scene.liquid.vapour_pressure,
            "prime_light": _priming(scene, light),
            "prime_dense": _priming(scene, felt),
        },
        series=(_figure(scene, laws),),
    )


def _gain(scene: Scene, laws: Sequence[FlowLaw], *, raised: int = 1, full: bool = False) -> float:
    """Ability on hand with the second law's liquid of twice the density, over that with the first law's.

    Args: `raised`: factor of the gas pressure under the second law. `full`: whether its tube stays full.
    Raises: NotRunError: the gas does not start the flow of the scene's own liquid.
    """
    gas, light = scene.gas.pressure, scene.liquid.density
    own = _reach(laws[0], gas)
    if own <= scene.disc.max_fill_ratio / 2:
        raise NotRunError(
            "the gas pressure of this scene does not start the flow from equal fills at every radius that "
            "the siphon crest may have"
        )
    dense = _reach(laws[1], raised * gas, full=full)
    return _ability(scene, 2 * light, dense) / _ability(scene, light, own)


def _stall_by_elements(scene: Scene, density: float) -> Found:
    """Wall pressure of a full opposite chamber: what the gas has to overcome when the driven one is empty."""
    return found_of(ring_of(scene, (scene.disc.max_fill_ratio,), density=density), "wall_pressure", 0)


def _law(scene: Scene, density: float, *, degassed: bool = False) -> FlowLaw:
    """Args: `degassed`: whether the liquid holds no gas, so that its cavity is at vapour pressure."""
    liquid = dataclasses.replace(scene.liquid, density=density)
    if degassed:
        liquid = dataclasses.replace(liquid, dissolved_gas="none")
    return flow_law_of(dataclasses.replace(scene, liquid=liquid))


def _reach(
    law: FlowLaw, gas_pressure: float, *, full: bool = False, refinements: int = _REFINEMENTS
) -> float:
    """Largest fill of the opposite chamber that a law reaches from equal fills and an empty tube."""
    largest = law.max_fill_ratio
    start = law.evaluate(fill_ratio=largest / 2, gas_pressure=gas_pressure, primed=full)
    low, high = 0.0, largest / 2
    for _ in range(refinements):
        fill = np.linspace(high, low, _POINTS)
        flow = law.evaluate(fill_ratio=fill, gas_pressure=gas_pressure, primed=full or bool(start.primed))
        stopped = np.flatnonzero(flow.velocity <= 0)
        if not stopped.size:
            return largest - low
        if stopped[0] == 0:
            return largest - high
        high, low = fill[stopped[0] - 1], fill[stopped[0]]
    return float(largest - high)


def _ability(scene: Scene, density: float, fill: float) -> float:
    fills = np.array([fill, scene.disc.max_fill_ratio - fill])
    moment = exact_moment(disc=scene.disc, density=density, fill_ratio=fills)
    return float(moment[0] - moment[1])


def _priming(scene: Scene, density: float) -> float:
    """Gas pressure that lifts the liquid over the crest from equal fills, the other chamber vented."""
    crest, omega = scene.tube.hump_radius, scene.rotor.speed
    if crest is None:
        return 0.0
    level = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio / 2))
    return max(hydrostatic_pressure(density=density, angular_velocity=omega, inner=crest, outer=level), 0.0)


def _figure(scene: Scene, laws: Sequence[FlowLaw]) -> Series:
    pressure = np.linspace(0.02, 2.5, 60) * wall_pressure_of(scene, scene.disc.max_fill_ratio)

    def ability(law: FlowLaw, density: float) -> np.ndarray:
        fills = [_reach(law, float(p), refinements=_REFINEMENTS - 1) for p in pressure]
        return np.array([_ability(scene, density, fill) for fill in fills])

    return figure(
        "ability of a pair against the gas pressure, by the calibrated law",
        ("gas pressure", "Pa", pressure),
        Curve("the scene's liquid", "kg m", ability(laws[0], scene.liquid.density)),
        Curve("twice as dense", "kg m", ability(laws[1], 2 * scene.liquid.density)),
    )
