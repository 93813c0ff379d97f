"""The friction formula: its blend of laminar and turbulent flow, and a mixing-length solution beside it.

Turbulent flow in a straight tube by Prandtl's mixing length: in wall units (friction velocity, nu) the shear
stress is tau = r/R of the wall's, and

    (1 + l^2 s) s = tau,    s = -du/dr = 2 tau/(1 + sqrt(1 + 4 l^2 tau)),    u(R) = 0

so that the bulk velocity is U+ = int s r^2 dr/R^2.  l is Nikuradse's mixing length with van Driest's damping;
sand undoes the damping and then moves the origin.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad
from scipy.optimize import brentq

from ringbalance.physics.tube.friction import friction_factor
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure
from ringbalance.verification.validation.comparison import friction, measurements

_TURBULENT: Final = 4000.0
_STEP: Final = 1.01
_NIKURADSE_SLOPE = 0.4
_UNDAMPED = 60.0
"""ks+ from which on the viscous layer is gone."""
_ROUGH_WALL = 8.5
"""u+ at y = ks in the log law of a fully rough wall."""
_PARTS: Final = 24
"""Of the way from the wall to the axis, each so many times as long as the one before, from y+ = 1 on."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
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


def blend(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Exact where laminar, without a jump, one velocity a head."""

    def friction_of(reynolds: FloatArray) -> FloatArray:
        f = friction_factor(reynolds=reynolds, relative_roughness=0.0)
        if defect == "sudden_switch":
            f = np.where(reynolds < _TURBULENT, 0.316 * reynolds**-0.25, f)
            return np.where(reynolds < 2040, 64 / reynolds, f)
        return f / 4 if defect == "fanning_factor" else f

    laminar = np.geomspace(1, 1000, 200)
    sweep = np.exp(np.arange(np.log(100), np.log(1e5), np.log(_STEP)))
    curve = friction_of(sweep)
    shown = figure(
        "friction factor of a smooth tube",
        ("Reynolds number", "1", sweep),
        Curve("blend", "1", curve),
        Curve("64/Re", "1", 64 / sweep, style="reference"),
        log=True,
    )
    return Evidence(
        found=as_found(
            laminar=np.max(np.abs(friction_of(laminar) * laminar / 64 - 1)),
            jump=np.max(np.abs(np.diff(curve) / curve[:-1])),
            head_slope=np.min(np.diff(np.log(curve * sweep**2)) / np.log(_STEP)),
        ),
        series=(shown,),
    )


@dataclass(frozen=True, kw_only=True)
class MixingLength:
    """Constants of the closure."""

    karman: float = 0.4
    """kappa; Nikuradse's polynomial is scaled by kappa/0.4."""
    damping: float | None = 26.0
    """A+ of van Driest's damping; None: without."""
    rough: bool = True
    """Whether sand on the wall is felt."""


_CLOSURES: Final = MappingProxyType(
    {
        None: MixingLength(),
        "karman_too_small": MixingLength(karman=0.36),
        "undamped": MixingLength(damping=None),
        "sand_ignored": MixingLength(rough=False),
    }
)


def turbulent(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The friction formula beside a mixing-length solution, on smooth and on sand-rough walls."""
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
        series=(_on_one_sand(by_length),),
    )


def mixing_length(
    *, wall_distance: npt.ArrayLike, radius: float, grain: float = 0.0, closure: MixingLength | None = None
) -> FloatArray:
    """Mixing length in wall units.

    l/R = (kappa/0.4) (0.14 - 0.08 (1 - y/R)^2 - 0.06 (1 - y/R)^4) D,
    D = 1 - exp(-y/A) + exp(-60 y/(A ks)), at most 1: grains of ks = 60 undo the damping; above, y + dy stands
    for y with dy = exp(-8.5 kappa) (ks - 60), which gives the log law's 8.5 of a fully rough wall.
    Args: `wall_distance`: y+, any shape. `radius`: R+. `grain`: ks+, of the sand. `closure`: constants;
        default the usual ones.
    Returns: l+, the shape of `wall_distance`.
    Source: Nikuradse, VDI Forschungsheft 356 (1932) and 361 (1933), the 8.5; van Driest, J. Aeronaut. Sci. 23
        (1956) 1007, smooth and rough damping; a shift of the origin after Rotta, J. Aeronaut. Sci. 17 (1950).
    """
    c = closure or MixingLength()
    sand = grain if c.rough else 0.0
    shift = float(np.exp(-_ROUGH_WALL * c.karman)) * max(sand - _UNDAMPED, 0.0)
    y = np.asarray(wall_distance, dtype=np.float64) + shift
    core = 1 - np.minimum(y / radius, 1.0)
    length = radius * c.karman / _NIKURADSE_SLOPE * (0.14 - 0.08 * core**2 - 0.06 * core**4)
    return np.asarray(length * _damping(y, sand, c.damping), dtype=np.float64)


def _damping(y: FloatArray, sand: float, constant: float | None) -> FloatArray | float:
    if constant is None or sand >= _UNDAMPED:
        return 1.0
    damped = -np.expm1(-y / constant)
    return damped + np.exp(-_UNDAMPED * y / (constant * sand)) if sand > 0 else damped


class _TurbulentFlow(NamedTuple):
    """Friction of a flow, and its size in wall units."""

    friction_factor: float
    """f (Darcy)."""
    friction_reynolds: float
    """R+ = u_tau R/nu."""


def _bulk_velocity(radius: float, grain: float, closure: MixingLength) -> float:
    """U+, by Gauss' rule in parts that grow away from the wall."""
    ends = np.concatenate([[0.0], np.geomspace(min(1.0, radius / 2), radius, _PARTS)])
    half = np.diff(ends)[:, None] / 2
    y = ends[:-1, None] + half * (1 + _NODES)
    tau = 1 - y / radius
    length = mixing_length(wall_distance=y, radius=radius, grain=grain, closure=closure)
    slope = 2 * tau / (1 + np.sqrt(1 + 4 * length**2 * tau))
    return float(np.sum(half * _WEIGHTS * slope * tau**2))


def mixing_length_flow(
    *, reynolds: float, relative_roughness: float = 0.0, closure: MixingLength | None = None
) -> _TurbulentFlow:
    """Friction factor of turbulent flow by the mixing length, for comparison with measured correlations.

    Re = 2 R+ U+, f = 8/U+^2.
    Args: `reynolds`: Re, above about 3000. `relative_roughness`: ks/d of sand. `closure`: constants; default
        the usual ones.
    Raises: ValueError: a Reynolds number that is not positive and finite, or a negative roughness.
    Range: turbulent flow. Smooth, it lies within 6 % of measurements for Re from 6e3 to 1e6 and within 3 % of
        the friction formula from 1e4, but 10 to 30 % above both near Re 3000; on sand up to 18 % off. Its
        core makes the bulk some 0.6 u_tau too fast, so f reads low, the more the rougher the wall.
    Source: Prandtl's mixing length, constants as in `mixing_length`.
    """
    if not (np.isfinite(reynolds) and reynolds > 0 and relative_roughness >= 0):
        raise ValueError("reynolds must be positive and finite, relative_roughness not negative")

    def bulk(radius: float) -> float:
        return _bulk_velocity(radius, 2 * relative_roughness * radius, closure or MixingLength())

    def miss(log_radius: float) -> float:
        radius = float(np.exp(log_radius))
        return float(np.log(2 * radius * bulk(radius) / reynolds))

    # No flow is faster than laminar flow, R+ = sqrt(2 Re), and none slower than half its friction velocity.
    low, high = np.log(0.99 * np.sqrt(2 * reynolds)), np.log(reynolds + 2)
    radius = float(np.exp(brentq(miss, low, high, xtol=1e-12)))
    return _TurbulentFlow(friction_factor=8 / bulk(radius) ** 2, friction_reynolds=radius)


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


def _on_one_sand(by_length: Callable[[FloatArray, FloatArray], FloatArray]) -> Series:
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
