"""Pressures at the tube's ends and at its siphon crest, and the flow regime that follows from them.

All conditions under which the tube is blocked, runs as a full siphon or as a separated column stand here.
They are written for one direction of flow: upstream is the chamber that gives liquid, downstream the one that
receives it; `TubeEnds.reversed` changes the direction.  Pressures are gauge, Pa; a hydrostatic pressure is
that of a chamber's liquid at the outer wall, rho omega^2 (R2^2 - a^2)/2, without its gas.  The functions take
numbers and arrays of one shape, and compiled code calls the same ones with numbers: there the path is the
record of a plant, with equal field names, and the ends are four numbers in the order of `TubeEnds`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Generic, NamedTuple, TypeAlias, TypeVar

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, plain
from ringbalance.scene.platform.both_ways import both_ways, chosen
from ringbalance.scene.typed_record import NotNegative, Positive

CLEARING: Final = (0.6, 1.1)
"""Froude numbers u/sqrt(g_c d), g_c = omega^2 r_m, below which gas stays over the crest, and above which the
flow carries it out: the span measured on air pockets in pipes that slope down.

Source: May, Allen and Nelson, "Hydraulic Investigation of Air in Small Diameter Pipes", Int. J. Hydraul. Eng.
7 (2018) 51, doi:10.5923/j.ijhe.20180703.02; Pothof, "Co-current air-water flow in downward sloping pipes",
thesis, Delft (2011), ISBN 978-90-8957-018-5.
"""
CLEARING_UNCERTAINTY: Final = (CLEARING[1] - CLEARING[0]) / (CLEARING[1] + CLEARING[0])
"""Relative expanded uncertainty (95 %) of the middle Froude number: the span of `CLEARING`."""
RELEASED: Final = 0.5
"""Position of the cavity's pressure from vapour pressure, 0, to downstream gas pressure, 1, with dissolved
gas: the middle; the uncertainty covers both ends.

A siphon of untreated water (1.5 m high, a height recalled) choked with bubbles at 37.6 kPa, where vapour
pressure alone allows 17 kPa; raised slowly, so that gas could leave, it ran free of bubbles down to 23.8 kPa
(Hughes and Gurung, Sci. Rep. 4 (2014) 4741, doi:10.1038/srep04741).
"""

Truth: TypeAlias = bool | BoolArray
Pressure = TypeVar("Pressure", float, FloatArray)


class TubeEnds(NamedTuple):
    """Pressures on the two ends of the tube, Pa; numbers or arrays."""

    upstream_gas: Any
    """p_A."""
    downstream_gas: Any
    """p_C."""
    upstream_hydrostatic: Any
    """P_A."""
    downstream_hydrostatic: Any
    """P_C."""

    def reversed(self) -> TubeEnds:
        """Ends for flow in the other direction."""
        return TubeEnds(self[1], self[0], self[3], self[2])

    def upstream_pressure(self) -> Any:
        """Pressure of gas and liquid at the upstream outer wall, p_A + P_A, Pa."""
        return self.upstream_gas + self.upstream_hydrostatic

    def downstream_pressure(self) -> Any:
        """Pressure of gas and liquid at the downstream outer wall, p_C + P_C, Pa."""
        return self.downstream_gas + self.downstream_hydrostatic


@dataclass(frozen=True, kw_only=True)
class TubePath:
    """The tube's fixed radii, as pressures of a column that reaches from there to the outer wall."""

    density: Positive
    """rho, kg/m^3."""
    port_pressure: float
    """D_p = rho omega^2 (R2^2 - r_p^2)/2, Pa."""
    hump_pressure: float | None
    """D_m = rho omega^2 (R2^2 - r_m^2)/2, Pa; None: no crest, the tube stays at the port's radius, under the
    levels of both chambers, and is full whether the gas is on or off."""
    trapped: bool
    """True if the gas over the siphon crest must be displaced through the downstream port."""
    vapour_pressure: float
    """Gauge, Pa."""
    released: NotNegative
    """Position of the cavity's pressure from the vapour pressure, 0, to the downstream gas, 1;
    `RELEASED` with dissolved gas."""
    froude_velocity: NotNegative
    """sqrt(g_c d) = sqrt(omega^2 r_m d), m/s; zero: gas over the crest leaves as soon as liquid flows."""

    @property
    def crest(self) -> bool:
        """True if the tube has a siphon crest."""
        return self.hump_pressure is not None

    @property
    def column_pressure(self) -> Any:
        """D_m, Pa; zero without a crest."""
        return 0.0 if self.hump_pressure is None else self.hump_pressure

    @property
    def return_pressure(self) -> float:
        """Hydrostatic pressure of a vented chamber above which liquid leaves it against a vented one, Pa.

        D_m + p_c, with the pressure p_c of a cavity: below it a full column separates at the crest.
        Without a crest nothing separates, and the chambers level out.
        """
        if not self.crest:
            return 0.0
        highest: float = plain(-crest_margins(self, TubeEnds(0.0, 0.0, 0.0, self.port_pressure))[0])
        return highest

    def holds(self, level: float) -> bool | None:
        """True if a correction with a chamber of that hydrostatic pressure, Pa, lasts with the gas off.

        None: likely; it lasts at the cavity pressure over the crest that runs assume, but not at every one.
        """
        if not self.crest or level > self.return_pressure:
            return False
        return True if self.column_pressure >= self.holding_pressure(level) else None

    def holding_pressure(self, level: float) -> float:
        """Smallest D_m at which a correction lasts whatever the pressure of a cavity over the crest, Pa."""
        return level - min(self.vapour_pressure, 0.0)


@both_ways
def back_pressure(path: Any, ends: Any) -> Any:
    """Hydrostatic pressure that the tube discharges against, max(P_C, D_p), Pa."""
    return np.maximum(ends[3], path.port_pressure)


@both_ways
def driving_pressure(path: Any, ends: Any) -> Any:
    """Pressure that drives a full siphon, p_A - p_C + P_A - max(P_C, D_p), Pa.

    Source: Eqs. 13 to 16 of the liquid-ring paper.
    """
    return ends[0] - ends[1] + ends[2] - back_pressure(path, ends)


@both_ways
def stall_pressure(path: Any, ends: Any) -> Any:
    """Difference of the gas pressures at which a full siphon stalls, max(P_C, D_p) - P_A, Pa."""
    return back_pressure(path, ends) - ends[2]


@both_ways
def covered(path: Any, ends: Any) -> Any:
    """True where the upstream liquid covers the port; otherwise only gas can leave."""
    return ends[2] >= path.port_pressure


@both_ways
def discharges_openly(path: Any, ends: Any) -> Any:
    """True where the downstream liquid leaves the port open to the gas."""
    return ends[3] < path.port_pressure


@both_ways
def cavity_bounds(path: Any, ends: Any) -> Any:
    """Lowest and highest pressure of a cavity in a primed tube, Pa.

    Vapour pressure and, with dissolved gas, the downstream gas pressure, at which gas leaves through there;
    with an open downstream port both are the downstream gas pressure.
    """
    low = chosen(discharges_openly(path, ends), ends[1], path.vapour_pressure)
    return low, chosen(path.released == 0.0, low, np.maximum(ends[1], low))


@both_ways
def cavity_pressure(path: Any, ends: Any) -> Any:
    """Pressure of a cavity in a primed tube, Pa; with an open downstream port that of the downstream gas."""
    low, high = cavity_bounds(path, ends)
    return low + path.released * (high - low)


@both_ways
def resting_pressure(path: Any, ends: Any) -> Any:
    """Crest pressure of a column at rest, p_A + P_A - D_m, Pa."""
    return ends[0] + ends[2] - path.column_pressure


@both_ways
def gas_over_crest(path: Any, ends: Any) -> Any:
    """Pressure of gas left over the crest, Pa: p_C, plus P_C - D_p if trapped behind a covered port."""
    return ends[1] + chosen(path.trapped, np.maximum(ends[3] - path.port_pressure, 0.0), 0.0)


@both_ways
def crest_margins(path: Any, ends: Any) -> Any:
    """Crest pressure at rest less that of a primed tube's cavity, and less that of gas over the crest, Pa.

    The former drives a separated column in a primed tube, the latter in an unprimed one, if positive.
    """
    resting, cavity = resting_pressure(path, ends), cavity_pressure(path, ends)
    return resting - cavity, resting - np.maximum(gas_over_crest(path, ends), cavity)


@both_ways
def cleared(path: Any, velocity: Any) -> Any:
    """Position of the crest pressure from gas, 0, to cavity, 1, by the spilling liquid's velocity.

    Zero below and one above `CLEARING`; smooth between, where it is unknown which of the two acts.
    """
    froude = velocity / chosen(path.froude_velocity == 0.0, 1.0, path.froude_velocity)
    part = np.minimum(np.maximum((froude - CLEARING[0]) / (CLEARING[1] - CLEARING[0]), 0.0), 1.0)
    return chosen(path.froude_velocity == 0.0, 1.0, part * part * (3.0 - 2.0 * part))


@both_ways
def can_flow(path: Any, ends: Any, primed: Any) -> Any:
    """True where liquid flows: port covered, driving pressure positive, crest passed."""
    flows = covered(path, ends) & (driving_pressure(path, ends) > 0.0)
    if not path.crest:
        return flows
    over_cavity, over_gas = crest_margins(path, ends)
    return flows & (chosen(primed, over_cavity, over_gas) > 0.0)


@both_ways
def holds_at_rest(path: Any, ends: Any, primed: Any) -> Any:
    """True where a primed column at rest stays: no crest, or balanced and above the cavity pressure there."""
    held = primed & covered(path, ends)
    if not path.crest:
        return held
    return held & (driving_pressure(path, ends) == 0.0) & (crest_margins(path, ends)[0] > 0.0)


def priming_pressure(path: TubePath, ends: TubeEnds) -> Any:
    """Difference of the gas pressures that lifts liquid over the crest of an unprimed tube, Pa.

    Returns: D_m - P_A, and P_C - D_p more where trapped gas is displaced through a covered port.
    """
    return path.column_pressure - ends.upstream_hydrostatic + gas_over_crest(path, ends) - ends.downstream_gas


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ColumnFlow(Generic[Pressure]):
    """Quasi-steady flow in one direction."""

    velocity: Pressure
    """Velocity, m/s, the smaller of the two below; zero where nothing flows."""
    siphon_velocity: Pressure
    """Velocity of a full siphon, m/s."""
    separation_velocity: Pressure
    """Velocity of a column that is separated at the crest, m/s; without a crest that of the siphon."""
    separated: Truth
    """True where the column is separated."""
    primed: Truth
    """True where the tube holds a continuous column afterwards."""


def column_flow(
    path: TubePath,
    ends: TubeEnds,
    *,
    primed: Truth,
    siphon: Callable[[Any, Any], Any],
    separation: Callable[[Any, Any], Any],
) -> ColumnFlow[Any]:
    """Regime and velocity of the quasi-steady column, the smaller of siphon and separation velocity.

    siphon: (k + 1) rho u^2/2 = driving pressure; separated: (alpha + k_up) rho u^2/2 = separation margin.
    An unprimed tube spills over a crest with gas on it, from zero at the priming pressure; the flow carries
    the gas out as its Froude number passes `CLEARING`, and the pressure there falls to the cavity's.
    Where the siphon's velocity is the smaller one its crest pressure is above the cavity pressure, so the
    smaller of the two is continuous across the change.
    Args:
        primed: whether the tube holds a continuous column beforehand.
        siphon: velocity of the full siphon under a pressure, zero where the second argument is false.
        separation: of the separated column, likewise; not called without a crest.
    Source: Eqs. 13 to 18 of the liquid-ring paper, extended to the siphon crest.
    """
    driving, flows = driving_pressure(path, ends), can_flow(path, ends, primed)
    full = siphon(driving, flows)
    if not path.crest:
        return ColumnFlow(
            velocity=full,
            siphon_velocity=full,
            separation_velocity=full,
            separated=full < full,
            primed=flows | holds_at_rest(path, ends, primed),
        )
    over_cavity, over_gas = crest_margins(path, ends)
    margin = chosen(primed, over_cavity, over_gas)
    spill = separation(margin, flows)
    carried, broken = cleared(path, spill), spill
    if primed is not True:
        more = carried * np.maximum(over_cavity - margin, 0.0)
        margin = chosen(primed, margin, margin + more)
        broken = chosen(primed, spill, separation(margin, flows))
    separated = broken < full
    # In an unprimed tube gas stays over the crest until the flow carries it out.
    swept = (carried > 0.5) & (cleared(path, full) > 0.5)
    keeps = (primed | swept) & ((broken >= full) | (ends.downstream_hydrostatic >= path.port_pressure))
    return ColumnFlow(
        velocity=chosen(separated, broken, full),
        siphon_velocity=full,
        separation_velocity=broken,
        separated=separated,
        primed=(flows & keeps) | holds_at_rest(path, ends, primed),
    )
