"""Flow of the tube in one direction: what starts it, what holds the column together, how fast it runs.

Everything is written for the giving and the receiving chamber; forward flow gives from the driven chamber,
reverse flow from the opposite one.  Pressures are gauge; a chamber's "level" is its liquid's pressure at the
outer wall, rho omega^2 (R2^2 - a^2)/2, which stands for its free-surface radius a.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.hermite import HermiteTable
from ringbalance.reduced_model.tube_heads import TubeHeads, velocity_of

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class TubePath:
    """The tube's fixed radii, as pressures of a column that reaches from there to the outer wall."""

    density: float
    """rho, kg/m^3."""
    port_pressure: float
    """rho omega^2 (R2^2 - r_p^2)/2, Pa."""
    hump_pressure: float | None
    """rho omega^2 (R2^2 - r_m^2)/2, Pa; None: always a full siphon while the gas is on."""
    trapped: bool
    """Whether the gas over the hump must be pushed out at the receiving port."""
    vapour_pressure: float
    """Gauge, Pa."""


@dataclass(frozen=True, kw_only=True)
class InputSpread:
    """95 % half-widths of what drives the flow."""

    relative_density: float
    relative_speed: float
    relative_gas_pressure: float
    hump_pressure: float
    """Pa."""
    vapour_pressure: float
    """Pa."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Giving and receiving chamber; arrays of one shape."""

    gas: FloatArray
    """In the giving chamber, gauge, Pa."""
    back_gas: FloatArray
    """In the receiving chamber, gauge, Pa."""
    level: FloatArray
    """Of the giving chamber, Pa."""
    back_level: FloatArray
    """Of the receiving chamber, Pa."""
    level_spread: FloatArray
    """95 % half-width of both levels together, Pa."""
    primed: BoolArray
    """Whether the tube holds a continuous column beforehand."""
    allowed: BoolArray
    """False where flow in this direction is ruled out from the start."""


@dataclass(frozen=True, kw_only=True)
class DirectedFlow:
    """Flow in one direction; arrays of one shape."""

    velocity: FloatArray
    """m/s, zero where nothing flows."""
    separated: BoolArray
    """Whether the column is torn at the hump."""
    primed: BoolArray
    """Whether the tube holds a continuous column afterwards."""
    half_width: FloatArray
    """95 % half-width of the velocity, m/s."""


def directed_flow(
    *,
    path: TubePath,
    heads: TubeHeads,
    hump_head: HermiteTable | None,
    inputs: InputSpread,
    drive: Drive,
) -> DirectedFlow:
    """Flow from the giving to the receiving chamber, the smaller of siphon and separated velocity.

    siphon: (k + 1) rho u^2/2 = p_A - p_C + P_A - max(P_C, D_p), with D for "port" or "hump pressure";
    separated: (alpha + k_up) rho u^2/2 = p_A - p_c + P_A - D_m, p_c the vapour pressure, or the receiving
    chamber's gas pressure once its level has left the port.  Where the siphon's velocity is the smaller one
    its hump pressure is above p_c, so the smaller of the two is continuous across the change.  An empty tube
    starts when p_A - p_C > D_m - P_A, plus P_C - D_p when the gas over the hump is trapped.

    Args:
        path: the tube's radii.
        heads: the tube's heads and their half-widths.
        hump_head: the one of its hump heads that belongs to this direction; None without a hump.
        inputs: half-widths of what drives the flow.
        drive: the two chambers.

    Returns:
        DirectedFlow, of the drive's shape.

    Source: Eqs. 13 to 18 of the liquid-ring paper, extended to the tube's hump.
    """
    back = np.maximum(drive.back_level, path.port_pressure)
    surplus = drive.gas - drive.back_gas + drive.level - back
    flows = drive.allowed & (drive.level >= path.port_pressure) & (surplus > 0)
    if path.hump_pressure is None or hump_head is None:
        u = velocity_of(table=heads.head, head=surplus / path.density, where=flows)
        torn, column = np.zeros_like(flows), flows | (drive.primed & drive.allowed)
        width = _siphon_width(heads, inputs, drive, surplus, drive.level - back, u)
        return DirectedFlow(velocity=u, separated=torn, primed=column, half_width=width)
    open_port = drive.back_level < path.port_pressure
    cavity = np.where(open_port, drive.back_gas, path.vapour_pressure)
    margin = drive.gas - cavity + drive.level - path.hump_pressure
    push = np.maximum(drive.back_level - path.port_pressure, 0.0) if path.trapped else 0.0
    starts = drive.gas - drive.back_gas + drive.level - path.hump_pressure - push > 0
    flows &= (drive.primed | starts) & (margin > 0)
    siphon = velocity_of(table=heads.head, head=surplus / path.density, where=flows)
    torn_speed = velocity_of(table=hump_head, head=margin / path.density, where=flows)
    torn = torn_speed < siphon
    widths = (
        _siphon_width(heads, inputs, drive, surplus, drive.level - back, siphon),
        _torn_width(
            hump_head, heads.hump_spread, inputs, drive, margin, cavity, path.hump_pressure, torn_speed
        ),
    )
    # At exact balance nothing flows, yet a column that holds is still there.
    rests = drive.primed & (surplus == 0) & (margin > 0) & (drive.level >= path.port_pressure)
    return DirectedFlow(
        velocity=np.where(torn, torn_speed, siphon),
        separated=torn,
        primed=np.asarray((flows & ~(torn & open_port)) | rests),
        half_width=np.where(torn, widths[1], widths[0]),
    )


def _siphon_width(
    heads: TubeHeads,
    inputs: InputSpread,
    drive: Drive,
    surplus: FloatArray,
    levels: FloatArray,
    velocity: FloatArray,
) -> FloatArray:
    """Half-width from the tube's loss and all that drives it; the density matters where gas pushes."""
    parts = (
        drive.level_spread,
        inputs.relative_density * (drive.gas - drive.back_gas),
        inputs.relative_speed * 2 * levels,
        inputs.relative_gas_pressure * (drive.gas - drive.back_gas),
    )
    return _width(heads.head, heads.spread, surplus, parts, velocity)


def _torn_width(
    head: HermiteTable,
    spread: HermiteTable,
    inputs: InputSpread,
    drive: Drive,
    margin: FloatArray,
    cavity: FloatArray,
    hump_pressure: float,
    velocity: FloatArray,
) -> FloatArray:
    parts = (
        drive.level_spread,
        inputs.relative_density * (drive.gas - cavity),
        inputs.relative_speed * 2 * (drive.level - hump_pressure),
        inputs.relative_gas_pressure * drive.gas,
        np.full_like(margin, np.hypot(inputs.hump_pressure, inputs.vapour_pressure)),
    )
    return _width(head, spread, margin, parts, velocity)


def _width(
    head: HermiteTable,
    spread: HermiteTable,
    pressure: FloatArray,
    parts: tuple[FloatArray, ...],
    velocity: FloatArray,
) -> FloatArray:
    """du = u/s sqrt(spread^2 + sum (part/pressure)^2) with s = d ln(head)/d ln u."""
    flows = velocity > 0
    log_u = np.log(np.where(flows, velocity, 1.0))
    slope = head.with_slope(log_u)[1]
    # A floor against overflow only: towards a stall u/pressure tends to a constant.
    driven = np.where(flows, np.maximum(pressure, 1e-100), 1.0)
    squares = np.maximum(spread(log_u), 0.0) ** 2 + sum((p / driven) ** 2 for p in parts)
    return np.where(flows, velocity / slope * np.sqrt(squares), 0.0)
