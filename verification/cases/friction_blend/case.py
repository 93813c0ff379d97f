"""Friction factors against smooth-tube and rough-tube measurements."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure
from ringbalance.verification.published import FrictionPoints, friction_formula, sand_rough_tubes, smooth_tube

Friction = Callable[[FloatArray, FloatArray], FloatArray]

_SMOOTH_DATA: Final = 0.011
_ROUGH_DATA: Final = 0.02
_TURBULENT: Final = 4000.0
_FULLY_ROUGH: Final = 70.0
_STEP: Final = 1.01


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    friction = partial(_friction, defect=defect)
    measured, rough = smooth_tube(), sand_rough_tubes()
    smooth = measured.where(measured.reynolds > _TURBULENT)
    laminar = np.geomspace(1, 1000, 200)
    sweep = np.exp(np.arange(np.log(100), np.log(1e5), np.log(_STEP)))
    curve = friction(sweep, np.zeros_like(sweep))
    high = friction(rough.reynolds, rough.roughness) / rough.friction - 1
    grain = rough.reynolds * np.sqrt(rough.friction / 8) * rough.roughness
    found = {
        "laminar": np.max(np.abs(friction(laminar, np.zeros_like(laminar)) * laminar / 64 - 1)),
        "smooth_share": np.mean(_within(smooth, friction, _SMOOTH_DATA)),
        "rough_share": np.mean(_within(rough, friction, _ROUGH_DATA)),
        "fully_rough": np.max(np.abs(high[grain > _FULLY_ROUGH])),
        "jump": np.max(np.abs(np.diff(curve) / curve[:-1])),
        "head_slope": np.min(np.diff(np.log(curve * sweep**2)) / np.log(_STEP)),
    }
    return Evidence(
        found={name: Found(value=float(value)) for name, value in found.items()},
        numbers={
            "smooth_points": float(smooth.reynolds.size),
            "rough_points": float(rough.reynolds.size),
            "rough_worst": float(np.max(high)),
        },
        series=(_figure(friction, smooth),),
    )


def _friction(reynolds: FloatArray, roughness: FloatArray, *, defect: str | None) -> FloatArray:
    wall = np.zeros_like(roughness) if defect == "roughness_ignored" else roughness
    f = friction_formula(reynolds, wall)
    if defect == "sudden_switch":
        turbulent = 0.316 * reynolds**-0.25
        return np.where(reynolds < 2040, 64 / reynolds, np.where(reynolds < _TURBULENT, turbulent, f))
    return f / 4 if defect == "fanning_factor" else f


def _within(points: FrictionPoints, friction: Friction, uncertainty: float) -> BoolArray:
    """Where the deviation lies within both uncertainties (95 %); that of the measurements is relative."""
    allowed = np.hypot(points.uncertainty(), uncertainty * points.friction)
    deviation = np.abs(friction(points.reynolds, points.roughness) - points.friction)
    return np.asarray(deviation <= allowed)


def _figure(friction: Friction, points: FrictionPoints) -> Series:
    near = friction(points.reynolds, points.roughness)
    return figure(
        "friction factor of a smooth tube",
        ("Reynolds number", "1", points.reynolds),
        Curve("found", "1", near, uncertainty=points.uncertainty()),
        Curve("McKeon et al. (2004)", "1", points.friction, style="reference"),
        log=True,
    )
