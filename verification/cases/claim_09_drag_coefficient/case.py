"""k(u) over fills, bores, liquids and pressures, each tube at the velocity that it takes by itself."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from scipy.optimize import brentq

from ringbalance.reduced_model.paper.formulas import PAPER_DRAG_COEFFICIENT
from ringbalance.scene import known_liquids, liquid_at
from ringbalance.scene.models import Liquid, Scene
from ringbalance.verification.comparison import from_half_width
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Reference, Series, Table, figure
from ringbalance.verification.reference.tube_running import Running, driving_head, running_tube, tube_curve

_ABOUT: Final = 0.1
_BORES: Final = (0.5, 0.75, 1.0, 1.5, 2.0)
"""In units of the scene's."""
_PRESSURES: Final = (0.5, 1.0, 2.0)
"""In units of the scene's."""
_ROOM: Final = 293.15
_NARROWEST: Final = 0.1
"""Smallest bore searched for k = 50, in units of the scene's."""


reference = {
    "k_scene": Reference(
        value=PAPER_DRAG_COEFFICIENT, uncertainty=from_half_width(_ABOUT * PAPER_DRAG_COEFFICIENT)
    )
}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    own = running_tube(scene, head=driving_head(scene, share=0.5))
    fills = [running_tube(scene, head=driving_head(scene, share=s)) for s in np.linspace(0, 1, 11)]
    bores = [_with_bore(scene, factor) for factor in _BORES]
    liquids = {liquid.name: _with_liquid(scene, liquid) for liquid in _liquids()}
    everywhere = _everywhere(scene)
    near = np.mean([abs(k / PAPER_DRAG_COEFFICIENT - 1) <= _ABOUT for k in everywhere])
    return Evidence(
        found={
            "k_scene": Found(value=own.k, input=from_half_width(own.half_width)),
            "fill_spread": _range(fills),
            "bore_spread": _range(bores),
            "liquid_spread": _range(list(liquids.values())),
        },
        numbers={
            "gas": scene.gas.pressure,
            "velocity": own.velocity,
            "k_low": min(one.k for one in fills),
            "k_high": max(one.k for one in fills),
            "bore_low": min(one.k for one in bores),
            "bore_high": max(one.k for one in bores),
            "liquid_low": min(one.k for one in liquids.values()),
            "liquid_high": max(one.k for one in liquids.values()),
            "combinations": float(len(everywhere)),
            "near": float(near),
            "bore_for_50": _bore_for(scene, PAPER_DRAG_COEFFICIENT),
        },
        series=(_over_velocity(scene),),
        tables=(_table(liquids),),
    )


def _liquids() -> tuple[Liquid, ...]:
    """Every known liquid, at room temperature or the temperature nearest to it for which there are data."""
    return tuple(
        liquid_at(
            name=known.name,
            temperature=min(max(_ROOM, known.temperatures[0]), known.temperatures[-1]),
        )
        for known in known_liquids()
    )


def _with_liquid(scene: Scene, liquid: Liquid, pressure: float = 1.0) -> Running:
    changed = dataclasses.replace(scene, liquid=liquid)
    return running_tube(changed, head=pressure * scene.gas.pressure / liquid.density)


def _with_bore(scene: Scene, factor: float, pressure: float = 1.0) -> Running:
    """Bends keep their shape: their radius grows with the bore, so that a wide tube still bends."""
    tube = scene.tube
    bends = tuple(
        dataclasses.replace(bend, radius=max(bend.radius, factor * tube.bore)) for bend in tube.bends
    )
    changed = dataclasses.replace(scene, tube=dataclasses.replace(tube, bore=factor * tube.bore, bends=bends))
    return running_tube(changed, head=pressure * scene.gas.pressure / scene.liquid.density)


def _everywhere(scene: Scene) -> list[float]:
    found = []
    for liquid in _liquids():
        changed = dataclasses.replace(scene, liquid=liquid)
        found += [_with_bore(changed, bore, pressure).k for bore in _BORES for pressure in _PRESSURES]
    return found


def _range(runs: Sequence[Running]) -> Found:
    low, high = min(runs, key=lambda one: one.k), max(runs, key=lambda one: one.k)
    both = math.hypot(low.half_width, high.half_width) if high.k > low.k else 0.0
    return Found(value=high.k - low.k, input=from_half_width(both))


def _bore_for(scene: Scene, k: float) -> float:
    """Bore at which the scene's path has a given k; the scene's own where no narrower one has it."""

    def excess(factor: float) -> float:
        return _with_bore(scene, factor).k - k

    if excess(1.0) >= 0 or excess(_NARROWEST) <= 0:
        return scene.tube.bore
    return float(brentq(excess, _NARROWEST, 1.0, xtol=1e-6)) * scene.tube.bore


def _over_velocity(scene: Scene) -> Series:
    curve = tube_curve(scene)
    return figure(
        "k against the velocity, the scene's tube and liquid",
        ("velocity", "m/s", curve.velocity),
        Curve("k(u)", "1", curve.k.value, uncertainty=curve.k.uncertainty),
        Curve("50", "1", np.full(curve.velocity.shape, PAPER_DRAG_COEFFICIENT), style="paper"),
        log=True,
    )


def _table(liquids: Mapping[str, Running]) -> Table:
    runs = liquids.values()
    return Table(
        name="k of the scene's tube with each known liquid, equal fills, the scene's gas pressure",
        columns={
            "liquid": list(liquids),
            "velocity": [one.velocity for one in runs],
            "Reynolds number": [one.reynolds for one in runs],
            "k": [one.k for one in runs],
            "half-width": [one.half_width for one in runs],
            "flow": [one.flow_state for one in runs],
        },
        units={"velocity": "m/s", "Reynolds number": "1", "k": "1", "half-width": "1"},
    )
