"""Crater that the gas jet of an injection digs into the ring, at the opening of the valve, over the fill.

A scene without the hole has a range instead, over holes, valves and directions that are built.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.gas_jet import (
    DECAY,
    DECAY_FACTOR,
    DISCHARGE_RANGE,
    Jet,
    blowing_number,
    crater_depth,
    jet_of,
)
from ringbalance.reduced_model.gas_line import line_ends
from ringbalance.results.numbers import format_given, percent
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.fitted import HOLE_ERROR, JET_ERROR
from ringbalance.scene.models import GasHoleDirection, Scene
from ringbalance.scene.rules.working import surface_tension
from ringbalance.scene.uncertain import NORMAL_95

_HOLES_M: Final = (2e-3, 8e-3)
"""Diameters of gas holes, from a bore of small lines to half of a chamber's depth."""


@dataclass(frozen=True, kw_only=True)
class Crater:
    """Crater in the ring of a driven chamber as the valve opens; shape of the fill."""

    depth: FloatArray
    """Depth in a ring without a floor, m; of a hole that does not blow at the ring an upper bound."""
    ratio: FloatArray
    """Depth over that of the ring; from 1 on the jet reaches the outer wall."""
    blowing_number: FloatArray
    """Gas velocity squared over that at which the surface breaks into droplets; a lower bound, since
    the surface tension is an upper one."""

    @classmethod
    def of(cls, scene: Scene, fill_ratio: npt.ArrayLike) -> Crater:
        """Crater of a scene that gives its gas hole.

        Args: `fill_ratio`: above zero; designs on the last axis.
        """
        fill, disc, liquid = np.asarray(fill_ratio, dtype=np.float64), scene.disc, scene.liquid
        level = surface_radius(disc=disc, fill_ratio=fill)
        jet, path = _jet(scene), _path(scene, level)
        decay = DECAY * DECAY_FACTOR ** (scene.tube.model_error(JET_ERROR) / NORMAL_95)
        depth = crater_depth(
            jet,
            distance=path,
            surface_radius=level,
            density=liquid.density,
            speed=scene.rotor.speed,
            decay=decay,
        )
        blown = blowing_number(
            jet.at(path + depth, decay=decay),
            tension=surface_tension(scene.liquid),
            density=liquid.density,
            acceleration=np.square(scene.rotor.speed) * level,
        )
        ring = np.maximum(disc.outer_radius - level, 1e-12)
        return cls(depth=depth, ratio=depth / ring, blowing_number=blown)


def largest_ratio(scene: Scene, least_fill: FloatArray) -> FloatArray:
    """Largest part of the ring's depth that the jet digs where no injection begins at less than a fill.

    The ring is the shallower, and its crater the larger part of it, the less a chamber holds.
    Args: `least_fill`: infinite where nothing is injected. Returns: NaN where the scene gives no gas hole.
    """
    if scene.disc.gas_hole_diameter is None:
        return np.full(least_fill.shape, math.nan)
    injected = np.isfinite(least_fill)
    return np.where(injected, Crater.of(scene, np.where(injected, least_fill, 1.0)).ratio, 0.0)


def _jet(scene: Scene) -> Jet:
    """Jet into a vented chamber, through the hole and the scene's valve; without a valve, the hole alone."""
    gas, (low, high) = scene.gas, DISCHARGE_RANGE
    error = np.clip(scene.tube.model_error(HOLE_ERROR) / NORMAL_95, -1.0, 1.0)
    discharge = (low + high) / 2 + (high - low) / 2 * error
    return jet_of(
        supply_pressure=gas.pressure + gas.ambient_pressure,
        chamber_pressure=gas.ambient_pressure,
        temperature=gas.temperature,
        area=discharge * math.pi / 4 * np.square(_stated(scene.disc.gas_hole_diameter)),
        conductance=gas.conductance,
        critical_ratio=gas.critical_ratio,
    )


def _path(scene: Scene, level: FloatArray) -> FloatArray:
    """Shortest way of the gas from the hole to the free surface, m.

    Along the shaft the jet meets a side wall after half of the width, inward the inner wall; it spreads along
    the wall up to the liquid, faster than a free jet, which is why that is a bound.
    """
    disc, hole = scene.disc, _stated(scene.disc.gas_hole_radius)
    before = {
        "outward": 0.0,
        "axial": disc.axial_width / 2,
        "inward": 2 * (hole - disc.inner_radius),
    }[disc.gas_hole_direction or "outward"]
    return np.asarray(np.maximum(level - hole, 0.0) + before)


def _stated(value: float | None) -> float:
    """A value of the hole, or one for each of many designs. Raises: ValueError: the scene gives no hole."""
    if value is None:
        raise ValueError("the scene gives no gas hole")
    return value


def crater_range(scene: Scene) -> Crater:
    """Craters at equal fills that a scene may have which gives no gas hole, shape (2, n).

    Holes of `_HOLES_M` lie at the inner wall and over the fullest ring, and blow at the ring (first row) or
    along the shaft, through the scene's valve or both ends of the default range of lines.
    """
    disc, ends = scene.disc, line_ends(scene)
    fullest = float(surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio))
    sizes, radii, lines = (
        np.ravel(each) for each in np.meshgrid(_HOLES_M, [disc.inner_radius, fullest], range(len(ends)))
    )
    conductances, ratios = np.array([(each.line.conductance, each.line.critical_ratio) for each in ends]).T
    holes = {"disc.gas_hole_diameter": sizes, "disc.gas_hole_radius": radii}
    valves = {"gas.conductance": conductances[lines], "gas.critical_ratio": ratios[lines]}
    built = Designs.of(scene, holes | valves).scene
    directions: tuple[GasHoleDirection, ...] = ("outward", "axial")
    craters = [
        Crater.of(replace(built, disc=replace(built.disc, gas_hole_direction=each)), disc.max_fill_ratio / 2)
        for each in directions
    ]
    return Crater(**{name: np.stack([vars(each)[name] for each in craters]) for name in vars(craters[0])})


def jet_text(scene: Scene) -> str:
    """Crater at equal fills in one phrase; where the scene gives no hole, its range."""
    hole = scene.disc.gas_hole_diameter
    if hole is None:
        ratios, sizes = crater_range(scene).ratio, [format_given(size, "m", digits=2) for size in _HOLES_M]
        return (
            f"not in the scene: a hole of {' to '.join(sizes)} between the inner wall and the fullest ring "
            f"would dig {percent(float(ratios.min()))} to {percent(float(ratios.max()))} of the ring's depth "
            "at equal fills; state disc.gas_hole_diameter"
        )
    crater = Crater.of(scene, scene.disc.max_fill_ratio / 2)
    most = "" if scene.disc.gas_hole_direction == "outward" else "at most "
    line = "" if scene.gas.conductance is None else " behind its valve"
    depth, size = (format_given(each, "m", digits=2) for each in (float(crater.depth), hole))
    return (
        f"{scene.disc.gas_hole_direction} from a hole of {size}{line}, it digs {most}{depth}, "
        f"{percent(float(crater.ratio))} of the ring's depth, at equal fills; blowing number {most}"
        f"{float(crater.blowing_number):.2g}, droplets from about 1 on"
    )
