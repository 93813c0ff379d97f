"""Friction factors against smooth-tube and rough-tube measurements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure
from ringbalance.verification.published import read_rows

Friction = Callable[[FloatArray, FloatArray], FloatArray]

_SMOOTH_DATA: Final = 0.011
_ROUGH_DATA: Final = 0.02
_TURBULENT: Final = 4000.0
_FULLY_ROUGH: Final = 70.0
_STEP: Final = 1.01


@dataclass(frozen=True, kw_only=True)
class _Points:
    """Measured friction factors."""

    reynolds: FloatArray
    roughness: FloatArray
    """eps/d."""
    friction: FloatArray
    """Darcy."""
    uncertainty: float
    """Expanded uncertainty (95 %), relative."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    friction = partial(_friction, defect=defect)
    smooth, rough = _smooth_points(), _rough_points()
    laminar = np.geomspace(1, 1000, 200)
    sweep = np.exp(np.arange(np.log(100), np.log(1e5), np.log(_STEP)))
    curve = friction(sweep, np.zeros_like(sweep))
    high = friction(rough.reynolds, rough.roughness) / rough.friction - 1
    grain = rough.reynolds * np.sqrt(rough.friction / 8) * rough.roughness
    found = {
        "laminar": np.max(np.abs(friction(laminar, np.zeros_like(laminar)) * laminar / 64 - 1)),
        "smooth_share": np.mean(_within(smooth, friction)),
        "rough_share": np.mean(_within(rough, friction)),
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
    values = [
        float(friction_factor(reynolds=re, relative_roughness=float(eps)))
        for re, eps in zip(reynolds, wall, strict=True)
    ]
    f = np.array(values)
    if defect == "sudden_switch":
        turbulent = 0.316 * reynolds**-0.25
        return np.where(reynolds < 2040, 64 / reynolds, np.where(reynolds < _TURBULENT, turbulent, f))
    return f / 4 if defect == "fanning_factor" else f


def _within(points: _Points, friction: Friction) -> BoolArray:
    half_width = [
        float(friction_uncertainty(reynolds=re, relative_roughness=float(eps)))
        for re, eps in zip(points.reynolds, points.roughness, strict=True)
    ]
    allowed = np.hypot(half_width, points.uncertainty * points.friction)
    deviation = np.abs(friction(points.reynolds, points.roughness) - points.friction)
    return np.asarray(deviation <= allowed)


def _smooth_points() -> _Points:
    rows = read_rows("friction_blend", "mckeon2004_oregon_smooth.csv")
    reynolds = np.array([float(row["Re"]) for row in rows])
    turbulent = reynolds > _TURBULENT
    friction = np.array([float(row["f_darcy"]) for row in rows])[turbulent]
    return _Points(
        reynolds=reynolds[turbulent],
        roughness=np.zeros_like(friction),
        friction=friction,
        uncertainty=_SMOOTH_DATA,
    )


def _rough_points() -> _Points:
    rows = read_rows("friction_blend", "nikuradse1933_rough.csv")
    return _Points(
        reynolds=np.array([float(row["Re"]) for row in rows]),
        roughness=np.array([0.5 / float(row["R_over_ks"]) for row in rows]),
        friction=np.array([float(row["f_darcy"]) for row in rows]),
        uncertainty=_ROUGH_DATA,
    )


def _figure(friction: Friction, points: _Points) -> Series:
    near = friction(points.reynolds, points.roughness)
    half_width = np.array(
        [float(friction_uncertainty(reynolds=re, relative_roughness=0.0)) for re in points.reynolds]
    )
    return figure(
        "friction factor of a smooth tube",
        ("Reynolds number", "1", points.reynolds),
        Curve("found", "1", near, uncertainty=half_width),
        Curve("McKeon et al. (2004)", "1", points.friction, style="reference"),
        log=True,
    )
