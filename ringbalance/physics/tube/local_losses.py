"""Local losses of the tube, at its ends and its bends, by finite elements where flow is laminar.

**Ends**: their losses are those beyond the kinetic energy that the "+1" in k + 1 already counts.

**Bends**, smooth ones: by correlation where flow is turbulent. What a laminar bend costs beyond the friction
of its own arc was computed for r = 2 d and 90 degrees at rest: 0.18, 0.55, 0.94 and 1.14 at Re 20, 50, 100
and 200 (`verification.reference.bent_tube`). K_0 De^2/(De^2 + De_0^2) with the Dean number De = Re
sqrt(d/2r) meets them within 0.05; other shapes are scaled by it and carry a wide half-width. In a tube that
turns, curvature acts as rotation, R' = R +- s with s = (4/3) Re d/2r (`verification.reference.bent_tube`):
the loss of a bend then depends on its sense of turning, which a scene does not give.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Final

import numpy as np
import numpy.typing as npt
from fluids.fittings import entrance_distance, entrance_rounded, entrance_sharp
from scipy.interpolate import CubicSpline

from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.physics.tube.friction import turbulent_share
from ringbalance.physics.tube.rotation_table import laminar_ratio
from ringbalance.scene.arrays import BoolArray, FloatArray, clipped, plain
from ringbalance.scene.models import Bend, Tube
from ringbalance.scene.platform.files import packaged_rows

LAMINAR_ENTRY_LENGTH: Final = 0.056
"""Entry length of laminar flow in diameters per Re."""
ROTATING_PROFILE_UNCERTAINTY: Final = 0.15
"""Expanded uncertainty (95 %) of the kinetic-energy factor of laminar flow in rotation."""
_TURBULENT_KINETIC_FACTOR: Final = 1.06
"""alpha of the 1/7-power profile."""
_CREEPING: Final = 6 * np.pi
_OTHER_ENTRANCE: Final = 0.15
"""Spread of the laminar loss of an entrance that is not sharp: published excesses run from 0.2 to 0.33."""
_REYNOLDS_SCALE, _LARGEST_REYNOLDS = 5.0, 2000.0
_DOMAIN_ERROR = 1e-3
"""Relative error of K: reservoir and tube are cut off at a distance, the edge is resolved to 1e-4 d."""
_BEYOND_TABLE = 0.3
"""Expanded uncertainty (95 %) of K added above the table, where steady laminar flow is not to be expected."""
_FULL_REYNOLDS: Final = 2500.0
"""Re at which that addition is complete, rising from the end of the table on: errors of k do not step."""


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
def _end_table(end: str) -> _EndTable:
    """Packaged table of the "entrance" or the "exit"."""
    rows = [r for r in packaged_rows("ringbalance.physics", "data", "end_losses.csv") if r["end"] == end]
    power = 1 if end == "entrance" else 0
    nodes = [row for row in rows if row["kind"] == "node"]
    a, y = (np.array([float(row[name]) for row in nodes]) for name in ("a", "fine"))
    spline = CubicSpline(a, y * np.exp(-power * a))
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


def _end_value(end: str, reynolds: npt.ArrayLike) -> FloatArray:
    """Value of `_end_loss` without its uncertainty, at half the cost."""
    re = np.asarray(reynolds, dtype=np.float64)
    if not (np.all(re > 0.0) and np.all(np.isfinite(re))):
        raise ValueError("reynolds must be finite and above zero")
    table, inside = _end_table(end), np.minimum(re, _LARGEST_REYNOLDS)
    grown = 1 + inside / _REYNOLDS_SCALE
    return np.asarray(table.scaled(np.log(grown)) * grown**table.power / inside)


def _end_loss(end: str, reynolds: npt.ArrayLike) -> Estimate:
    """Loss of a sharp-edged "entrance" from, or "exit" into, a large reservoir, laminar.

    K_ent = 2 (p_reservoir - p_tube)/(rho U^2) and K_exit = 2 (p_mouth - p_reservoir)/(rho U^2), with the
    developed line of p extrapolated to the end. K_ent contains the developed stream's kinetic factor 2;
    creeping, it is 0.986 * 6 pi/Re. K_exit is about zero at high Re, where the stream leaves with the
    pressure of the reservoir.
    Returns: Estimate of K, the same shape; OUT_OF_RANGE above Re = 2000.
    Raises: ValueError: a Reynolds number that is not finite and above zero.
    Range: 0 < Re <= 2000, tube long enough for flow to develop.
    Source: finite elements, `end_losses`.
    """
    re, value, table = np.asarray(reynolds, dtype=np.float64), _end_value(end, reynolds), _end_table(end)
    inside = np.minimum(re, _LARGEST_REYNOLDS)
    a = np.log1p(inside / _REYNOLDS_SCALE)
    uncertainty_95 = np.interp(a, table.nodes, table.numerical) + table.interpolation_error * np.exp(a)
    beyond, risen = (
        re > _LARGEST_REYNOLDS,
        clipped((re - _LARGEST_REYNOLDS) / (_FULL_REYNOLDS - _LARGEST_REYNOLDS), 0.0, 1.0),
    )
    status = Status()
    if np.any(beyond):
        text = (
            f"above Re = {_LARGEST_REYNOLDS:.0f} the value there is kept; use the turbulent loss where flow "
            "is turbulent"
        )
        status = Status(code=StatusCode.OUT_OF_RANGE, text=text)
    return Estimate(
        value=value,
        uncertainty=np.asarray(
            uncertainty_95 / inside
            + _DOMAIN_ERROR * np.abs(value)
            + _BEYOND_TABLE * risen**2 * (3 - 2 * risen),
            dtype=np.float64,
        ),
        status=status,
    )


def kinetic_factor(
    *, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0, friction_ratio: npt.ArrayLike = 1.0
) -> FloatArray:
    """Kinetic-energy factor alpha of the developed profile: laminar 2, less in rotation; turbulent 1.06.

    Laminar alpha = 1.2 + 0.8/F^1.5, smooth between laminar and turbulent: Coriolis forces blunt the profile,
    down to u ~ (depth along the axis of rotation)^1.5 in fast rotation, which has alpha = 1.199.
    Args: `critical_ratio`: critical Re over the straight tube's, broadcasts. `friction_ratio`: F of developed
        laminar flow, broadcasts.
    Range: laminar within `ROTATING_PROFILE_UNCERTAINTY` of finite-element solutions for R Re up to 3e5.
    Source: integral of (w/u)^3 over the bore: exact for Poiseuille flow and for fast rotation without
        inertia, our interpolation between; 1/7-power profile.
    """
    turned = turbulent_share(reynolds=reynolds, critical_ratio=critical_ratio)
    laminar = _laminar_kinetic_factor(np.asarray(friction_ratio, dtype=np.float64))
    return np.asarray((1 - turned) * laminar + _TURBULENT_KINETIC_FACTOR * turned, dtype=np.float64)


def _laminar_kinetic_factor(friction_ratio: FloatArray) -> FloatArray:
    return np.asarray(1.2 + 0.8 * friction_ratio**-1.5)


_ROUNDED_ENTRANCE: Final = np.vectorize(partial(entrance_rounded, method="Rennels"), otypes=[np.float64])


def _turbulent_entrance_loss(*, tube: Tube) -> tuple[float, float]:
    """Loss coefficient of the entrance at high Re, and its expanded uncertainty (95 %).

    Args: `tube`: the tube; `entrance` is "sharp", "rounded" (with `entrance_radius`) or "projecting".
    Returns: K and its half-width: the spread of the published methods, 0.5 to 0.57 for a sharp edge and,
        because the wall thickness of a projecting tube is not known, 0.5 to 1.1 there.
    Source: Rennels and Hudson, Pipe Flow (2012), for sharp and rounded, Crane TP-410 for projecting, through
        `fluids.fittings`.
    """
    if tube.entrance == "sharp":
        return float(entrance_sharp(method="Rennels")), 0.08
    if tube.entrance == "rounded":
        loss: float = plain(_ROUNDED_ENTRANCE(tube.bore, tube.entrance_radius))
        return loss, 0.03 + 0.2 * loss
    return float(entrance_distance(Di=tube.bore, method="Crane")), 0.3


def entrance_loss(*, tube: Tube, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0) -> FloatArray:
    """Entrance loss beyond the profile's kinetic energy, (p_reservoir - p_tube) 2/(rho u^2) - f L/d - alpha.

    Laminar: K_ent - 2 of a sharp entrance by finite elements, turbulent: the entrance's K, blended over the
    transition.
    Args: `critical_ratio`: critical Re over the straight tube's, broadcasts.
    Source: `_end_loss`; an entrance that is not sharp has the same laminar value with a
        wider half-width.
    """
    turned = turbulent_share(reynolds=reynolds, critical_ratio=critical_ratio)
    turbulent, _ = _turbulent_entrance_loss(tube=tube)
    return np.asarray((1 - turned) * (_end_value("entrance", reynolds) - 2) + turned * turbulent)


def entrance_uncertainty(
    *, tube: Tube, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0
) -> FloatArray:
    """Expanded uncertainty (95 %) of `entrance_loss`."""
    re = np.asarray(reynolds, dtype=np.float64)
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio)
    turbulent, half_width = _turbulent_entrance_loss(tube=tube)
    table = _end_loss("entrance", re)
    unlike = 0.0 if tube.entrance == "sharp" else _OTHER_ENTRANCE + 0.2 * _CREEPING / re
    uncertainty_95 = (1 - turned) * (table.uncertainty + unlike) + turned * half_width
    return np.hypot(uncertainty_95, 2 * turned * (1 - turned) * (table.value - 2 - turbulent))


def exit_loss(
    *, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0, friction_ratio: npt.ArrayLike = 1.0
) -> FloatArray:
    """Addition of a laminar exit to the "+1": alpha - 1 + K_exit, as the stream carries alpha u^2/2 away.

    In turbulent flow it is zero, because there the "+1" is the whole exit loss.
    Args: `critical_ratio`: critical Re over the straight tube's, broadcasts. `friction_ratio`: F of developed
        laminar flow, broadcasts.
    Source: alpha of `kinetic_factor`; K_exit from `_end_loss`, which is for the profile
        without rotation.
    """
    turned = turbulent_share(reynolds=reynolds, critical_ratio=critical_ratio)
    carried = _laminar_kinetic_factor(np.asarray(friction_ratio, dtype=np.float64)) - 1
    return np.asarray((1 - turned) * (carried + _end_value("exit", reynolds)))


def exit_uncertainty(
    *,
    tube: Tube,
    reynolds: npt.ArrayLike,
    critical_ratio: npt.ArrayLike = 1.0,
    friction_ratio: npt.ArrayLike = 1.0,
) -> FloatArray:
    """Expanded uncertainty (95 %) of `exit_loss`; a tube too short for a developed profile widens it."""
    re, ratio = (np.asarray(v, dtype=np.float64) for v in (reynolds, friction_ratio))
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio)
    undeveloped = np.minimum(1.0, LAMINAR_ENTRY_LENGTH * re * tube.bore / tube.length)
    blunted = ROTATING_PROFILE_UNCERTAINTY * np.minimum(1.0, (ratio - 1) / 0.1)
    laminar = _end_loss("exit", re).uncertainty + 0.3 * undeveloped + blunted
    return np.hypot((1 - turned) * laminar + 0.06 * turned, 2 * turned * (1 - turned))


_BEND_UNCERTAINTY: Final = 0.25
"""Expanded uncertainty (95 %) of a turbulent bend's loss, relative: the spread of the published methods."""
_LAMINAR_BEND_UNCERTAINTY: Final = 0.6
"""Expanded uncertainty (95 %) of a laminar bend's excess loss at rest, relative: one shape was computed."""
_LARGEST_EXCESS: Final = 1.25
"""Largest laminar excess K_0 of a bend, for 90 degrees and r = 2 d."""
_HALF_WAY_DEAN: Final = 28.0
"""Dean number De_0 at which half of K_0 is reached."""
MOMENTUM_FACTOR: Final = 4 / 3
"""Mean of u^2 over U^2 in Poiseuille flow."""


def bend_loss(
    *,
    bend: Bend,
    bore: float,
    friction_factor: npt.ArrayLike,
    reynolds: npt.ArrayLike,
    rotation_reynolds: npt.ArrayLike = 0.0,
    critical_ratio: npt.ArrayLike = 1.0,
) -> FloatArray:
    """Loss coefficient of one bend, including the friction of its arc.

    K = f phi r/d + (1 - w) K_lam + w (K_tur - f phi r/d), w from laminar to turbulent;
    K_lam = K_0 (phi/90 deg) 2 sqrt(d/2r) De^2/(De^2 + De_0^2) s^2/(s^2 + R^2).
    Args:
        bend: angle phi and centre-line radius r.
        friction_factor: f (Darcy) of the straight tube at rest at the same Re, any shape.
        critical_ratio: critical Re over the straight tube's, broadcasts.
    Range: computed for r = 2 d and 90 degrees up to Re 200 at rest, and at Re 200, R 118; elsewhere scaled.
    Source: finite elements, see the head of this module; `_turbulent_bend_loss`.
    """
    f, re, rotation, turned = _broadcast(friction_factor, reynolds, rotation_reynolds, critical_ratio)
    arc = f * bend.angle * bend.radius / bore
    rest, shift = _laminar_excess(bend, bore, re)
    added = rest * shift**2 / (shift**2 + rotation**2)
    turbulent = _turbulent_bend_loss(bend=bend, bore=bore, friction_factor=f)
    return np.asarray(arc + (1 - turned) * added + turned * (turbulent - arc))


def bend_uncertainty(
    *,
    bend: Bend,
    bore: float,
    friction_factor: npt.ArrayLike,
    reynolds: npt.ArrayLike,
    rotation_reynolds: npt.ArrayLike = 0.0,
    critical_ratio: npt.ArrayLike = 1.0,
) -> FloatArray:
    """Expanded uncertainty (95 %) of `bend_loss`; the friction of the arc counts as known."""
    f, re, rotation, turned = _broadcast(friction_factor, reynolds, rotation_reynolds, critical_ratio)
    rest, shift = _laminar_excess(bend, bore, re)
    more, less = laminar_ratio(reynolds=re, rotation_reynolds=np.abs([rotation + shift, rotation - shift]))
    turning = 64 / re * bend.angle * bend.radius / bore * (more - less) / 2
    laminar = np.hypot(_LAMINAR_BEND_UNCERTAINTY * rest, turning)
    turbulent = _turbulent_bend_loss(bend=bend, bore=bore, friction_factor=f)
    return np.asarray((1 - turned) * laminar + turned * _BEND_UNCERTAINTY * turbulent)


def _broadcast(
    friction_factor: npt.ArrayLike,
    reynolds: npt.ArrayLike,
    rotation_reynolds: npt.ArrayLike,
    critical_ratio: npt.ArrayLike,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Friction factor, Re and R_Om in one shape, and the share of turbulent flow."""
    f, re, rotation = np.broadcast_arrays(
        *(np.asarray(v, dtype=np.float64) for v in (friction_factor, reynolds, rotation_reynolds))
    )
    return f, re, rotation, turbulent_share(reynolds=re, critical_ratio=critical_ratio)


def _laminar_excess(bend: Bend, bore: float, re: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Excess loss of a laminar bend at rest over its arc's friction, and s, its curvature as a rotation."""
    tight = bore / (2 * bend.radius)
    dean, shift = re * np.sqrt(tight), MOMENTUM_FACTOR * re * tight
    shape = bend.angle / (math.pi / 2) * np.sqrt(tight) / 0.5
    return _LARGEST_EXCESS * shape * dean**2 / (dean**2 + _HALF_WAY_DEAN**2), shift


def _turbulent_bend_loss(*, bend: Bend, bore: float, friction_factor: npt.ArrayLike) -> FloatArray:
    """Loss coefficient of one bend in turbulent flow, including the friction of its arc.

    K = f phi r/d + (0.10 + 2.4 f) sin(phi/2) + 6.6 f (sqrt(sin(phi/2)) + sin(phi/2)) (d/r)^(4 phi/pi)
    Beyond 180 degrees, where the sine would fall again, the part beyond the friction of the arc is that of
    180 degrees times phi/180 deg.
    Args: `bend`: angle phi and centre-line radius r. `friction_factor`: f (Darcy) of the straight tube at the
        same Re, any shape.
    Range: turbulent flow in smooth tubes, phi up to 180 degrees, r/d of at least 0.5.
    Source: Rennels and Hudson, Pipe Flow (2012), as in `fluids.fittings.bend_rounded`, which takes no arrays.
    """
    f, turned = np.asarray(friction_factor, dtype=np.float64), np.minimum(bend.angle, math.pi)
    sine, tight = np.sin(turned / 2), (bore / bend.radius) ** (4 * turned / math.pi)
    turning = (0.10 + 2.4 * f) * sine + 6.6 * f * (np.sqrt(sine) + sine) * tight
    turning = turning * bend.angle / turned
    return np.asarray(f * bend.angle * bend.radius / bore + turning, dtype=np.float64)


def bend_in_range(*, bend: Bend, bore: npt.ArrayLike) -> BoolArray:
    """True for a bend within the formula's range: an angle up to 180 degrees and r/d of at least 0.5."""
    return np.asarray((bend.angle <= math.pi * (1 + 1e-9)) & (bend.radius >= np.asarray(bore) / 2))


def straight_length(*, tube: Tube) -> float:
    """Length of the tube, m, without the arcs of its bends, whose friction their loss includes.

    Raises: ValueError: arcs longer than the tube.
    """
    straight = tube.length - sum(b.angle * b.radius for b in tube.bends)
    if np.any(straight < -1e-9 * tube.length):
        raise ValueError("the bends' arcs are longer than the tube: lengthen tube.length or take a bend away")
    longest: float = plain(np.maximum(straight, 0.0))
    return longest
