"""The friction formula beside a mixing-length solution, on smooth and on sand-rough walls."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from types import MappingProxyType
from typing import Final

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from ringbalance.physics.tube.friction import friction_factor
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure
from ringbalance.verification.reference.mixing_length import MixingLength, mixing_length, mixing_length_flow
from ringbalance.verification.validation.comparison import friction
from ringbalance.verification.validation.kinds import measurements

Friction = Callable[[FloatArray, FloatArray], FloatArray]

_CLOSURES: Final = MappingProxyType(
    {
        None: MixingLength(),
        "karman_too_small": MixingLength(karman=0.36),
        "undamped": MixingLength(damping=None),
        "sand_ignored": MixingLength(rough=False),
    }
)
_EVEN: Final = {"light": (1e5, 1e6), "heavy": (1e5, 1.5e5, 2e5, 3e5, 5e5, 7e5, 1e6)}
_LOW: Final = (3e3, 1e4)
_HIGH: Final = 1e5
_SMOOTH: Final = {"light": 5, "heavy": 1}
_SAND: Final = {"light": 40, "heavy": 8}
"""Every which measured point is taken, of smooth tubes and of sand."""
_FULLY_ROUGH: Final = 70.0
"""ks+ above which the wall is fully rough."""
_BETWEEN: Final = (3.0, 40.0)
"""ks+ between smooth and fully rough."""
_SHOWN: Final = 126.0
"""R/ks of the figure."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    closure = _CLOSURES[defect]

    def by_length(reynolds: FloatArray, roughness: FloatArray) -> FloatArray:
        flows = (
            mixing_length_flow(reynolds=re, relative_roughness=e, closure=closure)
            for re, e in zip(reynolds, roughness, strict=True)
        )
        return np.array([flow.friction_factor for flow in flows])

    sand = friction(measurements("nikuradse_1933")).where(slice(None, None, _SAND[level]))
    reynolds, rough = (sand.columns[name] for name in ("reynolds", "relative_roughness"))
    every = friction(measurements("mckeon_2004"))
    smooth = every.where(every.columns["reynolds"] >= _HIGH).where(slice(None, None, -_SMOOTH[level]))
    even = np.array(_LOW + _EVEN[level])
    apart = by_length(even, np.zeros_like(even)) / friction_factor(reynolds=even, relative_roughness=0.0) - 1
    measured = by_length(smooth.columns["reynolds"], np.zeros(smooth.measured.size)) / smooth.measured - 1
    wall = by_length(reynolds, rough) / sand.measured - 1
    formula = sand.predicted / sand.measured - 1
    grain = reynolds * np.sqrt(sand.measured / 8) * rough
    between = (grain > _BETWEEN[0]) & (grain < _BETWEEN[1])
    return Evidence(
        found=as_found(
            quadrature=_quadrature_gap(closure),
            smooth=np.max(np.abs(apart[even >= _HIGH])),
            between=np.mean(np.abs(wall[between])),
        ),
        numbers={
            "low": float(np.max(np.abs(apart[even < _HIGH]))),
            "measured": float(np.max(np.abs(measured))),
            "formula_between": float(np.mean(formula[between])),
            "formula_worst": float(np.max(formula[between])),
            "bar": float(np.max((sand.stated / sand.measured)[between])),
            "rough": float(np.max(np.abs(wall[grain > _FULLY_ROUGH]))),
            "formula_rough": float(np.max(np.abs(formula[grain > _FULLY_ROUGH]))),
        },
        series=(_figure(by_length),),
    )


def _quadrature_gap(closure: MixingLength) -> float:
    """Friction factor at Re = 1e5 against an integral of slopes that are roots of (1 + l^2 s) s = tau."""
    flow = mixing_length_flow(reynolds=_HIGH, closure=closure)
    radius = flow.friction_reynolds

    def flux(y: float) -> float:
        squared = float(mixing_length(wall_distance=y, radius=radius, closure=closure)) ** 2
        tau = 1 - y / radius
        return float(brentq(lambda s: (1 + squared * s) * s - tau, 0.0, 1.0, xtol=1e-15)) * tau**2

    cuts = [0.0, 5.0, 30.0, 200.0, radius]
    bulk = sum(float(quad(flux, a, b, epsrel=1e-9)[0]) for a, b in itertools.pairwise(cuts))
    return abs(flow.friction_factor / (8 / bulk**2) - 1)


def _figure(by_length: Friction) -> Series:
    """One sand over Re, where formula and measurements part."""
    sand = friction(measurements("nikuradse_1933"))
    wall = np.isclose(sand.columns["relative_roughness"], 0.5 / _SHOWN)
    shown = sand.where(wall).where(slice(None, None, 8))
    reynolds, roughness = (shown.columns[name] for name in ("reynolds", "relative_roughness"))
    return figure(
        f"friction factor on sand of R/ks = {_SHOWN:.0f}",
        ("Reynolds number", "1", reynolds),
        Curve("formula", "1", shown.predicted, uncertainty=shown.stated),
        Curve("mixing length", "1", by_length(reynolds, roughness), style="paper"),
        Curve("Nikuradse (1933)", "1", shown.measured, style="reference"),
        log=True,
    )
