"""Pressures at the tube's ends and at its siphon crest, and the flow regime that follows from them.

The one place for the conditions under which the tube is blocked, runs as a full siphon or as a separated
column.  Everything is written for one direction of flow: upstream is the chamber that gives liquid,
downstream the one that receives it; `TubeEnds.reversed` changes the direction.  Pressures are gauge, Pa; a
hydrostatic pressure is that of a chamber's liquid at the outer wall, rho omega^2 (R2^2 - a^2)/2, without its
gas.  The functions accept plain numbers and arrays of one shape.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Generic, TypeAlias, TypeVar

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, plain

CLEARING: Final = (0.6, 1.1)
"""Froude numbers u/sqrt(g_c d), g_c = omega^2 r_m, below which gas stays over the crest, and above which the
flow carries it out: the span of what is measured on air pockets in pipes that slope down.

Source: May, Allen and Nelson, "Hydraulic Investigation of Air in Small Diameter Pipes", Int. J. Hydraul. Eng.
7 (2018) 51, doi:10.5923/j.ijhe.20180703.02; Pothof, "Co-current air-water flow in downward sloping pipes",
thesis, Delft (2011), ISBN 978-90-8957-018-5.
"""
CLEARING_UNCERTAINTY: Final = (CLEARING[1] - CLEARING[0]) / (CLEARING[1] + CLEARING[0])
"""Relative, of the Froude number in the middle: that span (95 %)."""
RELEASED: Final = 0.5
"""Where between vapour pressure and the downstream gas the cavity is taken to lie with dissolved gas: the
middle, with both ends in the uncertainty.

A siphon of untreated water (1.5 m high, a height recalled) choked with bubbles at 37.6 kPa, where vapour
pressure alone allows 17 kPa; raised slowly, so that gas could leave, it ran free of bubbles down to 23.8 kPa
(Hughes and Gurung, Sci. Rep. 4 (2014) 4741, doi:10.1038/srep04741).
"""

Truth: TypeAlias = bool | BoolArray
Pressure = TypeVar("Pressure", float, FloatArray)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TubeEnds(Generic[Pressure]):
    """What acts on the two ends of the tube."""

    upstream_gas: Pressure
    """p_A, Pa."""
    downstream_gas: Pressure
    """p_C, Pa."""
    upstream_hydrostatic: Pressure
    """P_A, Pa."""
    downstream_hydrostatic: Pressure
    """P_C, Pa."""
    port_pressure: Pressure | float
    """D_p = rho omega^2 (R2^2 - r_p^2)/2, of a column from the port to the outer wall, Pa."""

    def reversed(self) -> TubeEnds[Pressure]:
        """The same ends for flow in the other direction."""
        return TubeEnds(
            upstream_gas=self.downstream_gas,
            downstream_gas=self.upstream_gas,
            upstream_hydrostatic=self.downstream_hydrostatic,
            downstream_hydrostatic=self.upstream_hydrostatic,
            port_pressure=self.port_pressure,
        )

    def upstream_covered(self) -> Truth:
        """Whether the upstream liquid covers the port; otherwise only gas can leave."""
        return self.upstream_hydrostatic >= self.port_pressure

    def downstream_open(self) -> Truth:
        """Whether the downstream liquid leaves the port open to the gas."""
        return self.downstream_hydrostatic < self.port_pressure

    def upstream_pressure(self) -> Pressure:
        """At the upstream outer wall, gas and liquid, p_A + P_A, Pa."""
        return self.upstream_gas + self.upstream_hydrostatic

    def downstream_pressure(self) -> Pressure:
        """At the downstream outer wall, gas and liquid, p_C + P_C, Pa."""
        return self.downstream_gas + self.downstream_hydrostatic

    def back_pressure(self) -> Pressure:
        """Hydrostatic pressure that the tube discharges against, max(P_C, D_p), Pa."""
        return _larger(self.downstream_hydrostatic, self.port_pressure)

    def driving_pressure(self) -> Pressure:
        """Pressure that drives a full siphon, p_A - p_C + P_A - max(P_C, D_p), Pa.

        Source: Eqs. 13 to 16 of the liquid-ring paper.
        """
        return self.upstream_gas - self.downstream_gas + self.upstream_hydrostatic - self.back_pressure()

    def stall_pressure(self) -> Pressure:
        """Difference of the gas pressures at which a full siphon stalls, max(P_C, D_p) - P_A, Pa."""
        return self.back_pressure() - self.upstream_hydrostatic


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SiphonCrest(Generic[Pressure]):
    """The innermost point of the tube's path, where the column must be primed and may separate."""

    column_pressure: Pressure | float
    """D_m = rho omega^2 (R2^2 - r_m^2)/2, of a column from the crest to the outer wall, Pa."""
    vapour_pressure: Pressure | float
    """Pa, gauge."""
    trapped: bool
    """Whether the gas over the crest must be displaced through the downstream port."""
    released: float = 0.0
    """Where between the vapour pressure, 0, and the downstream gas, 1, the cavity's pressure is taken;
    `RELEASED` with dissolved gas."""
    froude_velocity: float = 0.0
    """sqrt(g_c d), m/s; zero: gas over the crest leaves as soon as liquid flows."""
    cavity_fitted: bool = False
    """Whether what the cavity's pressure may be is among the inputs that were fitted together."""
    clearing_fitted: bool = False
    """Whether the Froude number that clears the crest is."""

    @property
    def clearing_velocities(self) -> tuple[float, float]:
        """Between which the gas over the crest may be there or gone, m/s; fitted, both in their middle."""
        low, high = (sum(CLEARING) / 2,) * 2 if self.clearing_fitted else CLEARING
        return low * self.froude_velocity, high * self.froude_velocity

    def possible_cavity(self, ends: TubeEnds[Pressure]) -> tuple[Pressure, Pressure]:
        """Between which a cavity's pressure lies, Pa; fitted, twice what is taken."""
        if self.cavity_fitted:
            return self.cavity_pressure(ends), self.cavity_pressure(ends)
        return self.cavity_bounds(ends)

    def cavity_pressure(self, ends: TubeEnds[Pressure]) -> Pressure:
        """Pressure of a cavity in a primed tube, Pa; over an open downstream port that of the gas there."""
        low, high = self.cavity_bounds(ends)
        return low + self.released * (high - low)

    def cavity_bounds(self, ends: TubeEnds[Pressure]) -> tuple[Pressure, Pressure]:
        """Lowest and highest pressure of a cavity in a primed tube, Pa.

        Vapour alone, and, with dissolved gas, the downstream chamber's gas: more would leave into it.
        """
        gas = ends.downstream_gas
        low = _choose(ends.downstream_open(), gas, self.vapour_pressure)
        return low, low if np.all(np.asarray(self.released) == 0) else _larger(gas, low)

    def resting_pressure(self, ends: TubeEnds[Pressure]) -> Pressure:
        """Crest pressure of a column at rest, p_A + P_A - D_m, Pa."""
        return ends.upstream_gas + ends.upstream_hydrostatic - self.column_pressure

    def gas_pressure(self, ends: TubeEnds[Pressure]) -> Pressure:
        """Pressure of gas not carried out, Pa: the downstream chamber's; trapped, what displaces it."""
        if not self.trapped:
            return ends.downstream_gas
        return ends.downstream_gas + _larger(ends.downstream_hydrostatic - ends.port_pressure, 0.0)

    def separation_margin(self, ends: TubeEnds[Pressure]) -> Pressure:
        """Crest pressure of a column at rest less the cavity pressure, p_A - p_c + P_A - D_m, Pa.

        Returns: What drives a separated column of a primed tube; where it is not positive, no column holds.
        """
        return self.resting_pressure(ends) - self.cavity_pressure(ends)

    def cleared(self, velocity: Pressure) -> Pressure:
        """Fraction of the way from gas to cavity pressure over the crest, by the spilling liquid's velocity.

        Zero below and one above `CLEARING`, smooth between: which of both holds there is not known.
        """
        if np.all(np.asarray(self.froude_velocity) == 0):
            return velocity * 0 + 1
        low, high = CLEARING
        part = (velocity / self.froude_velocity - low) / (high - low)
        part = _larger(-_larger(-part, -1.0), 0.0)
        return part * part * (3 - 2 * part)

    def priming_pressure(self, ends: TubeEnds[Pressure]) -> Pressure:
        """Difference of the gas pressures that lifts liquid over the crest of an unprimed tube, Pa.

        Returns: D_m - P_A, and P_C - D_p more where trapped gas is displaced through a covered port.
        """
        lift = self.column_pressure - ends.upstream_hydrostatic
        return lift + (self.gas_pressure(ends) - ends.downstream_gas)

    def primes(self, ends: TubeEnds[Pressure]) -> Truth:
        """Whether the gas lifts liquid over the crest of an unprimed tube."""
        return self.resting_pressure(ends) > self.gas_pressure(ends)


@dataclass(frozen=True, kw_only=True)
class TubePath:
    """The tube's fixed radii, as pressures of a column that reaches from there to the outer wall."""

    density: float
    """rho, kg/m^3."""
    port_pressure: float
    """rho omega^2 (R2^2 - r_p^2)/2, Pa."""
    hump_pressure: float | None
    """rho omega^2 (R2^2 - r_m^2)/2, Pa; None: no crest, the tube stays at the port's radius, under the levels
    of both chambers, and is full whether the gas is on or off."""
    trapped: bool
    """Whether the gas over the siphon crest must be displaced through the downstream port."""
    vapour_pressure: float
    """Gauge, Pa."""
    released: float
    """As in `SiphonCrest`."""
    froude_velocity: float
    """sqrt(omega^2 r_m d), m/s; zero without a crest."""
    cavity_fitted: bool = False
    """As in `SiphonCrest`."""
    clearing_fitted: bool = False
    """As in `SiphonCrest`."""

    @property
    def crest(self) -> SiphonCrest[Any] | None:
        """The siphon crest, None without one."""
        if self.hump_pressure is None:
            return None
        return SiphonCrest(
            column_pressure=self.hump_pressure,
            vapour_pressure=self.vapour_pressure,
            trapped=self.trapped,
            released=self.released,
            froude_velocity=self.froude_velocity,
            cavity_fitted=self.cavity_fitted,
            clearing_fitted=self.clearing_fitted,
        )

    @property
    def return_pressure(self) -> float:
        """Hydrostatic pressure of a vented chamber above which liquid leaves it against a vented one, Pa.

        D_m + p_c, with the pressure p_c of a cavity: below, a full column over the crest parts.  Without a
        crest nothing parts, and the chambers level out.
        """
        if self.crest is None:
            return 0.0
        still = TubeEnds(
            upstream_gas=0.0,
            downstream_gas=0.0,
            upstream_hydrostatic=0.0,
            downstream_hydrostatic=self.port_pressure,
            port_pressure=self.port_pressure,
        )
        highest: float = plain(-self.crest.separation_margin(still))
        return highest

    def holds(self, level: float) -> bool:
        """Whether a correction with a chamber of that hydrostatic pressure, Pa, lasts with the gas off."""
        return self.crest is not None and level <= self.return_pressure

    def holding_pressure(self, level: float) -> float:
        """D_m of a crest from which on it lasts whatever the pressure of a cavity over the crest, Pa."""
        return level - min(self.vapour_pressure, 0.0)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ColumnFlow(Generic[Pressure]):
    """Quasi-steady flow in one direction."""

    velocity: Pressure
    """m/s, the smaller of the two below; zero where nothing flows."""
    siphon_velocity: Pressure
    """Of a full siphon, m/s."""
    separation_velocity: Pressure
    """Of a column that is separated at the crest, m/s; without a crest that of the siphon."""
    spill_velocity: Pressure
    """Of a column separated by what lay over the crest beforehand: gas in an unprimed tube, m/s."""
    separated: Truth
    """Whether the column is separated."""
    primed: Truth
    """Whether the tube holds a continuous column afterwards."""


def can_flow(*, ends: TubeEnds[Pressure], crest: SiphonCrest[Pressure] | None, primed: Truth) -> Truth:
    """Whether liquid flows: port covered, driving pressure positive, crest passed."""
    return _flows(ends, ends.driving_pressure(), crest, primed)[0]


def _flows(
    ends: TubeEnds[Pressure], driving: Pressure, crest: SiphonCrest[Pressure] | None, primed: Truth
) -> tuple[Truth, Pressure]:
    """Whether liquid flows, and the crest pressure at rest less that of what lies over it beforehand.

    Without a crest the driving pressure stands in for the latter.
    """
    flows = ends.upstream_covered() & (driving > 0)
    if crest is None:
        return flows, driving
    cavity = crest.cavity_pressure(ends)
    margin = crest.resting_pressure(ends) - _choose(primed, cavity, _larger(crest.gas_pressure(ends), cavity))
    return flows & (margin > 0), margin


def column_flow(
    *,
    ends: TubeEnds[Pressure],
    crest: SiphonCrest[Pressure] | None,
    primed: Truth,
    siphon: Callable[[Pressure, Truth], Pressure],
    separation: Callable[[Pressure, Truth], Pressure],
) -> ColumnFlow[Pressure]:
    """Regime and velocity of the quasi-steady column, the smaller of siphon and separation velocity.

    siphon: (k + 1) rho u^2/2 = driving pressure; separated: (alpha + k_up) rho u^2/2 = separation margin.
    An unprimed tube spills over a crest with gas on it, from zero at the priming pressure; the flow carries
    the gas out as its Froude number passes `CLEARING`, and the pressure there falls to the cavity's.
    Where the siphon's velocity is the smaller one its crest pressure is above the cavity pressure, so the
    smaller of the two is continuous across the change.
    Args:
        ends: pressures at the tube's ends.
        crest: None without one.
        primed: whether the tube holds a continuous column beforehand.
        siphon: velocity of the full siphon under a pressure, zero where the second argument is false.
        separation: velocity of the separated column under a pressure, likewise; not called without a crest.
    Source: Eqs. 13 to 18 of the liquid-ring paper, extended to the siphon crest.
    """
    driving = ends.driving_pressure()
    flows, margin = _flows(ends, driving, crest, primed)
    full = siphon(driving, flows)
    if crest is None:
        return ColumnFlow(
            velocity=full,
            siphon_velocity=full,
            separation_velocity=full,
            spill_velocity=full,
            separated=full < full,
            primed=flows | (primed & ends.upstream_covered()),
        )
    spill = separation(margin, flows)
    cleared = crest.cleared(spill)
    broken = spill
    if primed is not True:
        gas = _larger(crest.separation_margin(ends) - margin, 0.0)
        broken = _choose(primed, spill, separation(margin + cleared * gas, flows))
    separated = broken < full
    # At exact balance nothing flows, yet a column that holds is still there.
    rests = primed & (driving == 0) & (margin > 0) & ends.upstream_covered()
    # Gas stays over the crest of a tube that was unprimed until what flows through it carries the gas out.
    swept = (cleared > 0.5) & (crest.cleared(full) > 0.5)
    keeps = (primed | swept) & ((broken >= full) | (ends.downstream_hydrostatic >= ends.port_pressure))
    return ColumnFlow(
        velocity=_choose(separated, broken, full),
        siphon_velocity=full,
        separation_velocity=broken,
        spill_velocity=spill,
        separated=separated,
        primed=(flows & keeps) | rests,
    )


def _larger(first: Pressure, second: Pressure | float) -> Pressure:
    """The larger of two, without the cost of an array for plain numbers."""
    if isinstance(first, float) and not isinstance(second, np.ndarray):
        return max(first, second)
    return np.asarray(np.maximum(first, second), dtype=np.float64)


def _choose(condition: Truth, first: Pressure | float, second: Pressure | float) -> Pressure:
    either: Any
    if isinstance(condition, np.ndarray):
        either = np.where(condition, first, second)
    else:
        either = first if condition else second
    chosen: Pressure = either
    return chosen
