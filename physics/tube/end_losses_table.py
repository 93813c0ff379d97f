"""Laminar losses of a tube's sharp-edged ends from the table of finite-element solutions."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

import numpy as np
import numpy.typing as npt

from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.physics.splines import CubicSpline
from ringbalance.scene.arrays import FloatArray

_SCALE, _LIMIT = 5.0, 2000.0
_DOMAIN = 1e-3
"""Relative: reservoir and tube are cut off at a distance, the edge is resolved down to 1e-4 of the bore."""
_OUTSIDE = 0.3
"""Expanded uncertainty (95 %) of K added above the table, where steady laminar flow is not to be expected."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _EndTable:
    """Interpolants of one end over a = ln(1 + Re/5)."""

    scaled: CubicSpline
    """Spline of K Re/(1 + Re/5)^n, n = 1 for the entrance, 0 for the exit: slowly varying."""
    numerical: FloatArray
    """Discretisation uncertainty of K Re at the nodes."""
    nodes: FloatArray
    power: int
    interpolation_error: float
    """Largest gap of K Re to the points solved between nodes, over 1 + Re/5."""
    rows: tuple[Mapping[str, str], ...]


@lru_cache(maxsize=2)
def end_table(end: str) -> _EndTable:
    """The table of the "entrance" or the "exit", as it comes with the package."""
    path = resources.files("ringbalance.physics") / "data" / "end_losses.csv"
    lines = [x for x in path.read_text(encoding="utf-8").splitlines() if not x.startswith("#")]
    rows = [row for row in csv.DictReader(lines) if row["end"] == end]
    power = 1 if end == "entrance" else 0
    nodes = [row for row in rows if row["kind"] == "node"]
    a, y = (np.array([float(row[name]) for row in nodes]) for name in ("a", "fine"))
    spline = CubicSpline.through(a, y * np.exp(-power * a))
    checks = [row for row in rows if row["kind"] == "check"]
    at, solved = (np.array([float(row[name]) for row in checks]) for name in ("a", "fine"))
    gaps = np.abs(spline(at) * np.exp(power * at) - solved) * np.exp(-at)
    return _EndTable(
        scaled=spline,
        numerical=np.array([float(row["uncertainty"]) for row in nodes]),
        nodes=a,
        power=power,
        interpolation_error=float(gaps.max()),
        rows=tuple(rows),
    )


def _end_loss(end: str, reynolds: npt.ArrayLike) -> Estimate:
    re = np.asarray(reynolds, dtype=np.float64)
    if not (np.all(re > 0.0) and np.all(np.isfinite(re))):
        raise ValueError("reynolds must be finite and above zero")
    table = end_table(end)
    inside = np.minimum(re, _LIMIT)
    a = np.log1p(inside / _SCALE)
    value = table.scaled(a) * np.exp(table.power * a) / inside
    uncertainty_95 = np.interp(a, table.nodes, table.numerical) + table.interpolation_error * np.exp(a)
    beyond = re > _LIMIT
    status = Status()
    if np.any(beyond):
        text = (
            f"above Re = {_LIMIT:.0f} the value there is kept; use the turbulent loss where flow is turbulent"
        )
        status = Status(code=StatusCode.OUT_OF_RANGE, text=text)
    return Estimate(
        value=np.asarray(value, dtype=np.float64),
        uncertainty=np.asarray(
            uncertainty_95 / inside + _DOMAIN * np.abs(value) + np.where(beyond, _OUTSIDE, 0.0),
            dtype=np.float64,
        ),
        status=status,
    )


def laminar_entrance_loss(*, reynolds: npt.ArrayLike) -> Estimate:
    """Loss of a sharp-edged entrance from a large reservoir, laminar.

    K_ent = 2 (p_reservoir - p_tube)/(rho U^2) with the developed line of p carried back to the entrance; it
    contains the developed stream's kinetic factor 2.  Creeping: 0.986 * 6 pi/Re.
    Returns: Estimate of K_ent, the same shape; OUT_OF_RANGE above Re = 2000.
    Raises: ValueError: a Reynolds number that is not finite and above zero.
    Range: 0 < Re <= 2000, tube long enough for flow to develop.
    Source: finite elements, `end_losses`.
    """
    return _end_loss("entrance", reynolds)


def laminar_exit_loss(*, reynolds: npt.ArrayLike) -> Estimate:
    """Loss of a sharp-edged exit into a large reservoir, laminar and developed; otherwise as the entrance.

    K_exit = 2 (p_mouth - p_reservoir)/(rho U^2) with the developed line of p carried on to the mouth; about
    zero at high Re, where the stream leaves with the pressure of the reservoir.
    """
    return _end_loss("exit", reynolds)
