"""Laminar friction ratio of the rotating tube from the table of finite-element solutions.

Inside the table: bicubic splines of the difference of ln F from a closed formula with F's exact slow limit,
in coordinates in which F is smooth; two rectangles joined smoothly between S = 2.5 and 4.5. Outside:
extrapolated from the table's edge, with a wide uncertainty and the status OUT_OF_RANGE.

The rectangles overlap, because no single pair of coordinates is regular in both limits; with Kl = R Re,
S = R/Re and R = omega d^2/nu:

- "slow": a = ln(1 + Kl/300), b = S/(1 + S), from S = 0 (Kl alone matters) to S = 5, Kl up to 1e7;
- "fast": a = ln(1 + R/20), b = S_min(R)/S, from 1/S = 0 (Re = 0, linear, R alone matters) to S_min(R), which
  is 2 as long as Kl = R^2/S stays below 1.05e7 and follows that bound above.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.interpolate import RectBivariateSpline

from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.scene.arrays import BoolArray, FloatArray, clipped
from ringbalance.scene.platform.files import packaged_rows

Rows = Sequence[Mapping[str, str]]

KL_SCALE, ROTATION_SCALE = 300.0, 20.0
KL_LIMIT, ROTATION_LIMIT = 1e7, 1e5
FAST_S, FAST_KL = 2.0, 1.05e7
_JOIN = (2.5, 4.5)
_OUTSIDE_UNCERTAINTY = 0.3
"""Relative expanded uncertainty (95 %) far outside the table: no source holds there."""
_STEADY_KL, _UNSTEADY = 3e6, 0.244
"""Kl up to which flow is steady, and uncertainty added for unsteady flow, relative, per decade above.

Flow that fluctuates needs more pressure than the steady solution of the table.  Measured in square ducts at
Kl = 1.8e7, S = 0.5: 19 % more (Pallares, Grau and Davidson), which sets the slope; computed in time in the
tube at Kl = 1.05e7, S = 0.52: 2 % more on 9 by 14 cells, 6 % on 7 by 11.  Steady solutions beyond the table
are within 0.8 % of the extrapolated F up to Kl = 2.1e7.
"""


def slow_first(kl: npt.ArrayLike) -> FloatArray:
    """First coordinate of the slow rectangle, a = ln(1 + Kl/300)."""
    return np.log1p(np.asarray(kl, dtype=np.float64) / KL_SCALE)


def fast_first(rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """First coordinate of the fast rectangle, a = ln(1 + R/20)."""
    return np.log1p(np.asarray(rotation_reynolds, dtype=np.float64) / ROTATION_SCALE)


def least_s(rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """S_min(R) = (2^4 + (R^2/1.05e7)^4)^(1/4), below which the fast rectangle ends."""
    bound = np.asarray(rotation_reynolds, dtype=np.float64) ** 2 / FAST_KL
    return np.asarray((FAST_S**4 + bound**4) ** 0.25, dtype=np.float64)


@dataclass(frozen=True, kw_only=True, eq=False)
class Rectangle:
    """One rectangle of the table."""

    table: str
    """"slow" or "fast"."""
    difference: RectBivariateSpline
    """Spline of ln F - ln F_base over (a, b)."""
    numerical: RectBivariateSpline
    """Bilinear interpolant of the relative discretisation uncertainty."""
    a_limit: float
    b_limit: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _FrictionTable:
    """Table of laminar friction ratios with its interpolants."""

    slow: Rectangle
    fast: Rectangle
    interpolation_error: float
    """Largest relative gap to points solved between nodes, for Kl up to 1e6 (slow) and R up to 1e4 (fast)."""
    edge_interpolation_error: float
    """Largest relative gap to points solved between nodes beyond those, towards the edge of the table."""
    rows: tuple[Mapping[str, str], ...]
    """Rows of the file."""


def _base_at(table: str, a: FloatArray, b: FloatArray) -> FloatArray:
    """ln F_base = ln(1 + n E)/n with the exact excess E of slow rotation and F's power of it when fast.

    Slow: E = R^2/9216 + Kl^2/16515072, F ~ Kl^(1/4), n = 8.  Fast: E = R^2/9216, F ~ R^(1/2), n = 4.
    """
    if table == "slow":
        kl = KL_SCALE * np.expm1(a)
        return np.asarray(np.log1p(8 * (kl * b / (1 - b) / 9216 + kl**2 / 16515072)) / 8, dtype=np.float64)
    return np.asarray(np.log1p(4 * (ROTATION_SCALE * np.expm1(a)) ** 2 / 9216) / 4, dtype=np.float64)


def _columns(rows: Rows) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """a, b, F on the finest mesh and its relative discretisation uncertainty."""
    a, b, fine, uncertainty_95 = (
        np.array([float(row[name]) for row in rows]) for name in ("a", "b", "fine", "uncertainty")
    )
    return a, b, fine, uncertainty_95 / fine


def _rectangle(table: str, rows: Rows) -> Rectangle:
    """Splines over the nodes; a = 0, where F = 1, is not in the file."""
    a, b, fine, relative = _columns(rows)
    first, second = np.unique(a), np.unique(b)
    i, j = np.searchsorted(first, a), np.searchsorted(second, b)
    gap, uncertainty_95 = (np.zeros((first.size + 1, second.size)) for _ in range(2))
    gap[i + 1, j] = np.log(fine) - _base_at(table, a, b)
    uncertainty_95[i + 1, j] = relative
    nodes = np.concatenate([[0.0], first])
    # The difference starts with an even power of a: mirrored nodes give the spline its flat start.
    mirrored = np.concatenate([-nodes[3:0:-1], nodes])
    return Rectangle(
        table=table,
        difference=RectBivariateSpline(mirrored, second, np.concatenate([gap[3:0:-1], gap])),
        numerical=RectBivariateSpline(nodes, second, uncertainty_95, kx=1, ky=1),
        a_limit=float(nodes[-1]),
        b_limit=float(second[-1]),
    )


def _logarithm(rectangle: Rectangle, a: FloatArray, b: FloatArray, *, where: BoolArray) -> FloatArray:
    """ln F at the nearest point of the rectangle; zero without rotation, and where it does not count."""
    logarithm, counts = np.zeros(a.shape), where & (a > 0.0)
    a, b = clipped(a[counts], 0.0, rectangle.a_limit), clipped(b[counts], 0.0, rectangle.b_limit)
    logarithm[counts] = _base_at(rectangle.table, a, b) + rectangle.difference.ev(a, b)
    return logarithm


def _discretisation(rectangle: Rectangle, a: FloatArray, b: FloatArray) -> FloatArray:
    """Relative discretisation uncertainty at the nearest point of the rectangle."""
    return np.asarray(
        rectangle.numerical.ev(clipped(a, 0.0, rectangle.a_limit), clipped(b, 0.0, rectangle.b_limit))
    )


@lru_cache(maxsize=1)
def _friction_table() -> _FrictionTable:
    """Read the table that comes with the package, once."""
    rows = packaged_rows("ringbalance.physics", "data", "rotating_friction.csv")
    part = {name: [r for r in rows if r["table"] == name] for name in {row["table"] for row in rows}}
    slow, fast = (_rectangle(name, part[name]) for name in ("slow", "fast"))
    inner_gaps, edge_gaps = [], []
    # Relative gaps of the interpolants to points solved between the nodes.
    for name, rectangle, inner in (
        ("slow_check", slow, float(slow_first(1e6))),
        ("fast_check", fast, float(fast_first(1e4))),
    ):
        a, b, fine, _ = _columns(part[name])
        gaps = np.abs(np.exp(_logarithm(rectangle, a, b, where=a > 0)) / fine - 1)
        inner_gaps.append(float(gaps[a <= inner].max()))
        edge_gaps.append(float(gaps[a > inner].max(initial=0.0)))
    return _FrictionTable(
        slow=slow,
        fast=fast,
        interpolation_error=max(inner_gaps),
        edge_interpolation_error=max(edge_gaps),
        rows=tuple(rows),
    )


def _smooth_step(x: FloatArray) -> FloatArray:
    """0 below 0, 1 above 1, twice continuously differentiable."""
    c = clipped(x, 0.0, 1.0)
    return np.asarray(c**3 * (10 - 15 * c + 6 * c**2), dtype=np.float64)


def rotation_table_covers(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> BoolArray:
    """True where the table of laminar friction ratios holds: Kl <= 1e7 and R <= 1e5."""
    rotation = np.asarray(rotation_reynolds, dtype=np.float64)
    kl = rotation * np.asarray(reynolds, dtype=np.float64)
    return np.asarray((kl <= KL_LIMIT) & (rotation <= ROTATION_LIMIT))


@dataclass(frozen=True, kw_only=True)
class _TablePoint:
    """Point of a table look-up: two coordinates in each rectangle, and the weight of the fast one."""

    slow: tuple[FloatArray, FloatArray]
    fast: tuple[FloatArray, FloatArray]
    kl: FloatArray
    weight: FloatArray


def _table_point(re: FloatArray, rotation: FloatArray) -> _TablePoint:
    kl, turns = rotation * re, rotation > 0.0
    share = rotation / np.where(rotation + re > 0.0, rotation + re, 1.0)
    # Without rotation 1/S is taken as 0, where F = 1 for any S.
    inverse = np.where(turns, re / np.where(turns, rotation, 1.0), 0.0)
    s = share / np.maximum(1 - share, 1e-300)
    return _TablePoint(
        slow=(slow_first(kl), share),
        fast=(fast_first(rotation), inverse * least_s(rotation)),
        kl=kl,
        weight=_smooth_step(np.log(np.maximum(s, 1e-300) / _JOIN[0]) / np.log(_JOIN[1] / _JOIN[0])),
    )


def _checked(reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    re, rotation = np.broadcast_arrays(
        *(np.asarray(v, dtype=np.float64) for v in (reynolds, rotation_reynolds))
    )
    if not (np.all(re >= 0.0) and np.all(rotation >= 0.0) and np.all(np.isfinite(re + rotation))):
        raise ValueError("reynolds and rotation_reynolds must be finite and not negative")
    return re, rotation


def laminar_ratio(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """Value of `rotating_friction_ratio` without its uncertainty, at half the cost."""
    re, rotation = _checked(reynolds, rotation_reynolds)
    return _ratio(_table_point(re, rotation), rotation)


def _ratio(at: _TablePoint, rotation: FloatArray) -> FloatArray:
    table = _friction_table()
    slow = np.exp(_logarithm(table.slow, *at.slow, where=at.weight < 1))
    fast = np.exp(_logarithm(table.fast, *at.fast, where=at.weight > 0))
    # Growth beyond the edge: by Ito and Nanbu, and by the limit of fast rotation.
    growth = _ito_nanbu_laminar(kl=np.maximum(at.kl, KL_LIMIT)) / _ito_nanbu_laminar(kl=KL_LIMIT)
    more = 0.07863 * (np.sqrt(np.maximum(rotation, ROTATION_LIMIT)) - np.sqrt(ROTATION_LIMIT))
    return np.asarray((1 - at.weight) * (slow * growth) + at.weight * (fast + more))


def rotating_friction_ratio(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> Estimate:
    """Laminar friction factor with rotation over the one without, F = f/(64/Re), developed flow.

    F depends on Kl = R Re and S = R/Re alone; its exact slow limit is 1 + R^2/9216 + Kl^2/16515072, its
    fast one (Re = 0) tends to 0.07863 sqrt(R).
    Returns: Estimate of F, of the broadcast shape; the uncertainty adds discretisation and interpolation. Its
        status says OUT_OF_RANGE when any point lies outside the table. Above Kl = 3e6, where flow may
        fluctuate, up to 30 % is added.
    Raises: ValueError: a negative or undefined argument.
    Range: steady, symmetric, developed laminar flow, Kl <= 1e7, R <= 1e5, any S.
    Source: finite elements, `rotating_section`; the limits are exact.
    """
    re, rotation = _checked(reynolds, rotation_reynolds)
    table, at = _friction_table(), _table_point(re, rotation)
    ratio, inside = _ratio(at, rotation), rotation_table_covers(reynolds=re, rotation_reynolds=rotation)
    # The measured interpolation error rises from its inner to its edge value over half a decade.
    near_edge = np.maximum(at.kl / 1e6, rotation / 1e4)
    weight = _smooth_step(np.log10(np.maximum(near_edge, 1e-300)) / 0.5)
    inner, edge = table.interpolation_error, max(table.edge_interpolation_error, table.interpolation_error)
    uncertainty_95 = (
        (1 - at.weight) * _discretisation(table.slow, *at.slow)
        + at.weight * _discretisation(table.fast, *at.fast)
        + ((1 - weight) * inner + weight * edge)
    )
    # Both vanish with the excess: without rotation F is 1 exactly.
    relative = uncertainty_95 * np.minimum((ratio - 1) / 0.05, 1.0)
    # Flow that fluctuates may need more than the steady solution.
    decades = np.log10(np.maximum(at.kl, _STEADY_KL) / _STEADY_KL)
    relative += np.where(
        rotation > ROTATION_LIMIT, _OUTSIDE_UNCERTAINTY, np.minimum(_UNSTEADY * decades, _OUTSIDE_UNCERTAINTY)
    )
    status = Status()
    if not np.all(inside):
        text = (
            f"outside the table (R Re <= {KL_LIMIT:.0e} and R <= {ROTATION_LIMIT:.0e}), carried on from its "
            "edge: use a smaller bore or a more viscous liquid, or allow for the wide uncertainty"
        )
        status = Status(code=StatusCode.OUT_OF_RANGE, text=text)
    return Estimate(value=ratio, uncertainty=np.asarray(ratio * relative), status=status)


def _ito_nanbu_laminar(*, kl: npt.ArrayLike) -> FloatArray:
    """Ito and Nanbu's laminar friction ratio, 0.0883 Kl^(1/4) (1 + 11.2 Kl^-0.325), for comparison.

    Range: stated for 220 < Kl < 1e7 and S = R/Re < 0.5.
    Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383, doi 10.1115/1.3425260, as recalled.
    """
    k = np.asarray(kl, dtype=np.float64)
    return np.asarray(0.0883 * k**0.25 * (1 + 11.2 * k**-0.325), dtype=np.float64)
