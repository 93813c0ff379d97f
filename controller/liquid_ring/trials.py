"""Settings that a liquid ring offers to try, in units of what its loop and its valve do at a pressure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final

import numpy as np

from ringbalance.controller.liquid_ring.loop_factor import vibration_rates
from ringbalance.controller.terms import dead_time
from ringbalance.controller.trials import Axis, Point, Trials, rounded
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import raw_value_at

PRESSURE: Final = "gas.pressure"
_GAIN: Final = Axis(
    name="loop factor", levels=(0.06, 0.1, 0.16, 0.25, 0.4, 0.6, 0.8, 1.0, 1.25, 1.6, 1.9), first=(3, 5, 7, 9)
)
_OFFSET: Final = Axis(
    name="offset over dead time",
    levels=(0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0),
    first=(0, 4, 8),
)
_INTEGRAL: Final = Axis(
    name="period over integral time", levels=(0.0, 0.03, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7), first=(2, 4, 6)
)
_PRESSURES: Final = tuple(float(f) for f in np.round(1.1 ** np.arange(-12, 13), 3))
"""Times the scene's."""
_FIRST: Final = tuple(range(6, 19))
"""Of these, 0.56 to 1.8 times the scene's."""
_OFFSET_STEP: Final = 1e-4
"""s, to which an offset is rounded."""
_OWN: Final = {"target_vector": (_GAIN, _OFFSET, _INTEGRAL), "law_based": (_OFFSET,), "trial": ()}
_INSTEAD: Final = {"target_vector": ("law_based",), "law_based": ("target_vector",), "trial": ()}
"""Kinds of controller beside the scene's; valve-open times of a trial are its scene's."""


@dataclass(frozen=True, kw_only=True)
class _Loop:
    """Under one gas pressure."""

    rate: float
    """b of `loop_factor`, m/s."""
    dead_time: float
    """s."""

    @classmethod
    def of(cls, scene: Scene, model: BalancerModel) -> _Loop:
        rate = float(np.max(np.mean(vibration_rates(scene, model), axis=1)))
        return cls(rate=rate, dead_time=dead_time(scene, model, rate=rate))


def trials(scene: Scene, model: BalancerModel, *, limit: float) -> tuple[Trials, ...]:
    """Of the scene's kind of controller first. Args: `limit`: by which runs are judged, m."""

    @cache
    def loop(pressure: float) -> _Loop:
        return _Loop.of(_at(scene, pressure), model)

    def of(kind: str) -> Trials:
        def settings(point: Point) -> Mapping[str, Any] | None:
            pressure = point.get(PRESSURE, scene.gas.pressure)
            return _settings(scene, kind, point, loop(pressure), limit=limit)

        return Trials(kind=kind, axes=_OWN[kind], settings=settings, stated=stated, along=_pressures(scene))

    gain = scene.origin_of("controller.proportional")
    stated = gain != "default" or scene.controller.kind != "target_vector"
    kind = scene.controller.kind
    return tuple(of(each) for each in (kind, *_INSTEAD[kind]))


def _settings(
    scene: Scene, kind: str, point: Point, loop: _Loop, *, limit: float
) -> Mapping[str, Any] | None:
    if loop.rate <= 0.0:
        return None
    found: dict[str, Any] = {
        PRESSURE: point.get(PRESSURE, scene.gas.pressure),
        "controller.kind": kind,
        "controller.limit": min(limit, scene.controller.limit),
    }
    if _GAIN.name in point:
        found["controller.proportional"] = rounded(point[_GAIN.name] / loop.rate)
        part = point[_INTEGRAL.name]
        found["controller.integral_time"] = rounded(scene.controller.period / part) if part else None
    if _OFFSET.name in point:
        offset = round(point[_OFFSET.name] * loop.dead_time / _OFFSET_STEP) * _OFFSET_STEP
        found["controller.gas_time_offset"] = (round(offset, 6),) if offset else None
    return {path: value for path, value in found.items() if value != raw_value_at(scene, path)}


def _pressures(scene: Scene) -> Axis:
    levels = [rounded(factor * scene.gas.pressure) for factor in _PRESSURES]
    levels[len(levels) // 2] = scene.gas.pressure
    return Axis(name=PRESSURE, levels=tuple(levels), first=_FIRST, unit="Pa")


def _at(scene: Scene, pressure: float) -> Scene:
    return replace(scene, gas=replace(scene.gas, pressure=pressure))
