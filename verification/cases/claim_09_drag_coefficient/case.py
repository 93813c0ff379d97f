"""k(u) over fills, bores, liquids and pressures, each tube at the velocity that it takes by itself."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from scipy.optimize import brentq

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.scene import known_liquids, liquid_at
from ringbalance.scene.models import Liquid, Scene
from ringbalance.verification.cases.claim_07_bernoulli.case import (
    Running,
    driving_head,
    running_tube,
    running_tubes,
)
from ringbalance.verification.evidence import (
    Curve,
    Evidence,
    Found,
    Level,
    Reference,
    Series,
    Table,
    figure,
    from_half_width,
)
from ringbalance.verification.loops import flow_law_of
from ringbalance.verification.paper_numbers import fig_7_readings

_ABOUT: Final = 0.1
_BORES: Final = (0.5, 0.75, 1.0, 1.5, 2.0)
"""In units of the scene's."""
_ROOM: Final = 293.15
_WARM: Final = 333.15
_OIL: Final = "silicone oil 100 cSt"
_OIL_TABLE: Final = 298.15
"""K, at which its data are given."""
_VELOCITIES: Final = (1e-4, 3000.0, 401)
"""Of the figure, m/s."""
_NARROWEST: Final = 0.1
"""Smallest bore searched for k = 50, in units of the scene's."""


reference = {
    "k_scene": Reference(
        value=PAPER_DRAG_COEFFICIENT, uncertainty=from_half_width(_ABOUT * PAPER_DRAG_COEFFICIENT)
    )
}


def values(scene: Scene) -> dict[str, float]:
    own = running_tube(scene, head=driving_head(scene, share=0.5))
    return {"k_scene": own.k, "fill_spread": _range(_over_fills(scene)).value}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    own = running_tube(scene, head=driving_head(scene, share=0.5))
    printed, bare = fig_7_readings()
    narrow = running_tube(bare, head=driving_head(bare, share=0.5))
    fills = _over_fills(scene)
    bores = [_with_bore(scene, factor) for factor in _BORES]
    differences = _differences(printed, bare)
    liquids = {liquid.name: _with_liquid(scene, liquid) for liquid in _liquids()}
    return Evidence(
        found={
            "k_scene": Found(value=own.k, input=from_half_width(own.half_width)),
            "fill_spread": _range(fills),
        },
        numbers={
            "gas": scene.gas.pressure,
            "velocity": own.velocity,
            "bore": scene.tube.bore,
            "times_50": math.sqrt((PAPER_DRAG_COEFFICIENT + 1) / (own.k + 1)),
            "printed_bore": printed.tube.bore,
            "k_own": own.k,
            "bare_bore": bare.tube.bore,
            "bare_k": narrow.k,
            "bare_velocity": narrow.velocity,
            "k_low": min(one.k for one in fills),
            "k_high": max(one.k for one in fills),
            "bore_low": min(one.k for one in bores),
            "bore_high": max(one.k for one in bores),
            "liquid_low": min(one.k for one in liquids.values()),
            "liquid_high": max(one.k for one in liquids.values()),
            "bore_for_50": _bore_for(scene, PAPER_DRAG_COEFFICIENT),
            **_numbers(differences),
        },
        series=(_over_velocity(scene),),
        tables=(_table(liquids), differences),
    )


def _over_fills(scene: Scene) -> Sequence[Running]:
    return running_tubes(scene, tuple(driving_head(scene, share=s) for s in np.linspace(0, 1, 11)))


def _liquids() -> tuple[Liquid, ...]:
    """Every known liquid, at room temperature or the temperature nearest to it for which there are data."""
    return tuple(
        liquid_at(
            name=known.name,
            temperature=min(max(_ROOM, known.temperatures[0]), known.temperatures[-1]),
        )
        for known in known_liquids()
    )


def _with_liquid(scene: Scene, liquid: Liquid) -> Running:
    changed = dataclasses.replace(scene, liquid=liquid)
    return running_tube(changed, head=scene.gas.pressure / liquid.density)


def _with_bore(scene: Scene, factor: float) -> Running:
    """With the bore multiplied; a bend's radius is at least the bore, so a wide tube still bends."""
    tube, bore = scene.tube, factor * scene.tube.bore
    bends = tuple(dataclasses.replace(bend, radius=max(bend.radius, bore)) for bend in tube.bends)
    changed = dataclasses.replace(scene, tube=dataclasses.replace(tube, bore=bore, bends=bends))
    return running_tube(changed, head=scene.gas.pressure / scene.liquid.density)


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
    curve = tube_loss(scene, np.geomspace(*_VELOCITIES))
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


def _differences(scene: Scene, bare: Scene) -> Table:
    """Velocities of both laws over those at equal fills, each on the disc that meets Fig. 7 under it."""
    full, gas = scene.disc.max_fill_ratio, scene.gas.pressure
    rows = {
        "equal fills, 0.7 MPa of gas and water": (scene.liquid, full / 2, gas),
        "1.5 times the gas pressure": (scene.liquid, full / 2, 1.5 * gas),
        "2.5 times the gas pressure": (scene.liquid, full / 2, 2.5 * gas),
        "driven chamber full": (scene.liquid, full, gas),
        "driven chamber nearly empty": (scene.liquid, 0.05 * full, gas),
        "water at 60 degrees Celsius": (liquid_at(name="water", temperature=_WARM), full / 2, gas),
        _OIL: (liquid_at(name=_OIL, temperature=_OIL_TABLE), full / 2, gas),
    }
    laws = {
        "by Eq. 19, k = 50": [
            _velocity(paper_law(_filled(scene, row[0])), *row[1:]) for row in rows.values()
        ],
        "by the calibrated law": [
            _velocity(flow_law_of(_filled(bare, row[0])), *row[1:]) for row in rows.values()
        ],
    }
    return Table(
        name="what differs between the laws once both meet Fig. 7: velocity over that at equal fills",
        columns={"condition": list(rows)} | {name: [u / v[0] for u in v] for name, v in laws.items()},
    )


def _numbers(differences: Table) -> dict[str, float]:
    """The rows of the table that the text names, by law."""
    rows = {"pressure": 2, "empty": 4, "warm": 5, "oil": 6}
    _, paper, calibrated = differences.columns.values()
    found = {f"{name}_paper": float(paper[row]) for name, row in rows.items()}
    return found | {f"{name}_calibrated": float(calibrated[row]) for name, row in rows.items()}


def _filled(scene: Scene, liquid: Liquid) -> Scene:
    return dataclasses.replace(scene, liquid=liquid)


def _velocity(law: FlowLaw, fill_ratio: float, gas_pressure: float) -> float:
    return float(law.evaluate(fill_ratio=fill_ratio, gas_pressure=gas_pressure).velocity)
