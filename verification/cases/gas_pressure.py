"""Claims on the gas pressure: the least that starts a flow, and the moment reached with a denser liquid."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    Evidence,
    FigureCurve,
    Found,
    Level,
    NotRunError,
    as_found,
    figure,
)
from ringbalance.verification.finite_elements import found_of, ring_of
from ringbalance.verification.loops import flow_law_of
from ringbalance.verification.papers import DENSITY_KG_M3, HIGHEST_PRESSURE, LOWEST_PRESSURE
from ringbalance.verification.reference.chambers import exact_moment, wall_pressure_of

_SCAN_POINTS: Final = 101
_GAIN_STANDARD_UNCERTAINTY: Final = 1e-6
"""Standard uncertainty of the gain: the fill at which the flow ends is located to 1e-6 of the largest."""
_REFINEMENTS: Final = 3
"""Number of scans for the fill at which the flow ends, each 100 times finer; a figure needs one less."""


def working_pressure(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Stall by Eq. 19 and by the true wall pressure, and priming over the crest, beside the printed range.

    Raises: NotRunError: a scene without a crest.
    """
    crest, omega, outer = scene.tube.hump_radius, scene.rotor.speed, scene.disc.outer_radius
    if crest is None:
        raise NotRunError("the scene's tube has no siphon crest to prime over")

    def priming(radius: float) -> float:
        """Gas pressure that lifts an almost empty chamber's liquid over the crest, the other side vented."""
        return DENSITY_KG_M3 * omega**2 * (outer**2 - radius**2) / 2

    stall = paper.stall_pressure(disc=scene.disc, density=DENSITY_KG_M3, angular_velocity=omega)
    velocity_high = paper.velocity_from_pressures(
        density=DENSITY_KG_M3,
        drag_coefficient=paper.PAPER_DRAG_COEFFICIENT,
        pressure_difference=HIGHEST_PRESSURE.value,
    )
    radius = np.linspace(scene.disc.inner_radius, outer, 61)
    shown = figure(
        "pressure that starts the flow from an almost empty chamber",
        ("inner radius of the siphon crest", "m", radius),
        FigureCurve("priming, other chamber vented", "Pa", np.array([priming(float(r)) for r in radius])),
        FigureCurve("0.54 MPa", "Pa", np.full(radius.shape, LOWEST_PRESSURE.value), style="paper"),
        FigureCurve("stall by Eq. 19", "Pa", np.full(radius.shape, stall), style="reference"),
    )
    return Evidence(
        quantities={
            "by_eq_19": Found(value=stall, reference=LOWEST_PRESSURE),
            "by_priming": Found(value=priming(crest), reference=LOWEST_PRESSURE),
        },
        numbers={
            "by_ring": wall_pressure_of(scene, scene.disc.max_fill_ratio, density=DENSITY_KG_M3),
            "scene_hump": crest,
            "velocity_high": velocity_high,
        },
        series=(shown,),
    )


def denser_liquid_ends(scene: Scene) -> Evidence:
    """Gains in moment alone."""
    laws = [_law(scene, density) for density in (scene.liquid.density, 2 * scene.liquid.density)]
    return Evidence(quantities=as_found(gain=_gain(scene, laws), gain_raised=_gain(scene, laws, raised=2)))


def denser_liquid(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Gain in balancing moment at one gas pressure with a liquid of twice the density."""
    light, full = scene.liquid.density, scene.disc.max_fill_ratio
    dense = light if defect == "weightless" else 2 * light
    # Back pressure when the driven chamber is empty: the wall pressure of a full opposite one.
    stalls = [found_of(ring_of(scene, (full,), density=d), "wall_pressure", 0).value for d in (light, dense)]
    laws = [_law(scene, density) for density in (light, dense)]
    reach = [_reach(law, scene.gas.pressure) for law in laws]
    raised = _gain(scene, laws, raised=2 if defect is None else 1)
    usable = [
        min(reached, full - residual_fill_ratio(scene, law=law))
        for law, reached in zip(laws, reach, strict=True)
    ]
    pressure = np.linspace(0.02, 2.5, 60) * wall_pressure_of(scene, full)
    refinements = _REFINEMENTS - 1
    abilities = [
        np.array([_ability(scene, density, _reach(law, float(p), refinements=refinements)) for p in pressure])
        for law, density in zip(laws, (light, 2 * light), strict=True)
    ]
    shown = figure(
        "ability of a pair against the gas pressure, by the calibrated law",
        ("gas pressure", "Pa", pressure),
        FigureCurve("the scene's liquid", "kg m", abilities[0]),
        FigureCurve("twice as dense", "kg m", abilities[1]),
    )
    return Evidence(
        # Twice the density, twice the ability.
        quantities={
            "gain": Found(
                value=_gain(scene, laws), numerical=_GAIN_STANDARD_UNCERTAINTY, corrected=raised
            ).against(2.0),
            "gain_raised": Found(value=raised, numerical=_GAIN_STANDARD_UNCERTAINTY).against(2.0),
        },
        numbers={
            "stall_light": stalls[0],
            "stall_dense": stalls[1],
            "gas": scene.gas.pressure,
            "reach_light": reach[0],
            "reach_dense": reach[1],
            "usable_light": usable[0],
            "gain_usable": _ability(scene, 2 * light, usable[1]) / _ability(scene, light, usable[0]),
            "gain_full": _gain(scene, laws, full=True),
            "gain_vapour": _gain(scene, [laws[0], _law(scene, 2 * light, degassed=True)], full=True),
            "push": scene.gas.ambient_pressure - scene.liquid.vapour_pressure,
            "prime_light": _priming(scene, light),
            "prime_dense": _priming(scene, dense),
        },
        series=(shown,),
    )


def _gain(scene: Scene, laws: Sequence[FlowLaw], *, raised: int = 1, full: bool = False) -> float:
    """Balancing moment reached with the second law and twice the density, over that with the first law.

    Args: `raised`: factor of the gas pressure under the second law. `full`: True if its tube stays full.
    Raises: NotRunError: the gas does not start the flow of the scene's own liquid.
    """
    gas, light = scene.gas.pressure, scene.liquid.density
    reach = _reach(laws[0], gas)
    if reach <= scene.disc.max_fill_ratio / 2:
        raise NotRunError(
            "the gas pressure of this scene does not start the flow from equal fills at every radius that "
            "the siphon crest may have"
        )
    dense = _reach(laws[1], raised * gas, full=full)
    return _ability(scene, 2 * light, dense) / _ability(scene, light, reach)


def _law(scene: Scene, density: float, *, degassed: bool = False) -> FlowLaw:
    """Flow law. Args: `degassed`: True if the liquid holds no gas: its cavity is at vapour pressure."""
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
        fill = np.linspace(high, low, _SCAN_POINTS)
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
    return max(density * omega**2 * (level**2 - crest**2) / 2, 0.0)
