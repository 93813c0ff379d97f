"""Flow of the tube in one direction with its uncertainty, for arrays of conditions.

The pressures and the regime are those of `tube_regime`, the velocities those of the tube's tabulated loss.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ringbalance.reduced_model.tables import HermiteTable
from ringbalance.reduced_model.tube.heads import TubeHeads, velocity_of
from ringbalance.reduced_model.tube.regime import (
    ColumnFlow,
    Truth,
    TubeEnds,
    TubePath,
    back_pressure,
    cavity_pressure,
    column_flow,
    driving_pressure,
    gas_over_crest,
    possible_cavity,
    resting_pressure,
    stall_pressure,
)
from ringbalance.scene.arrays import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True)
class DriveUncertainty:
    """Expanded uncertainties (95 %) of what drives the flow."""

    relative_density: float = 0.0
    relative_speed: float = 0.0
    relative_gas_pressure: float = 0.0
    hump_pressure: float = 0.0
    """Pa."""
    vapour_pressure: float = 0.0
    """Pa."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What acts on the tube in one direction; arrays of one shape."""

    ends: TubeEnds
    """Pressures at the tube's ends."""
    upstream_uncertainty: FloatArray | float
    """Expanded uncertainty (95 %) of the upstream hydrostatic pressure, Pa."""
    downstream_uncertainty: FloatArray | float
    """The same downstream."""
    primed: BoolArray
    """Whether the tube holds a continuous column beforehand."""


@dataclass(frozen=True, kw_only=True)
class DirectedFlow:
    """Flow in one direction; arrays of one shape."""

    velocity: FloatArray
    """m/s, zero where nothing flows."""
    separated: BoolArray
    """Whether the column is separated at the siphon crest."""
    undecided: BoolArray
    """Whether the uncertainty of the separation allows both."""
    primed: BoolArray
    """Whether the tube holds a continuous column afterwards."""
    half_width: FloatArray
    """Expanded uncertainty (95 %) of the velocity, m/s."""
    margin: FloatArray
    """`siphon_margin` of a full siphon, Pa; zero without a crest."""
    margin_half_width: FloatArray
    """Its expanded uncertainty (95 %), Pa."""

    def widened(self, low: Sequence[DirectedFlow], high: Sequence[DirectedFlow]) -> DirectedFlow:
        """With what inputs add that move the flow to both sides along independent directions."""
        if not low:
            return self
        flows = self.velocity > 0
        both = list(zip(low, high, strict=True))
        speeds = np.sqrt(sum(((b.velocity - a.velocity) / 2) ** 2 for a, b in both))
        margins = np.sqrt(sum(((b.margin - a.margin) / 2) ** 2 for a, b in both))
        open_by = np.hypot(self.margin_half_width, margins)
        return replace(
            self,
            half_width=np.hypot(self.half_width, np.where(flows, speeds, 0.0)),
            margin_half_width=open_by,
            undecided=flows & (np.abs(self.margin) < open_by),
        )

    @classmethod
    def of(
        cls,
        *,
        path: TubePath,
        heads: TubeHeads,
        hump_head: HermiteTable | None,
        inputs: DriveUncertainty,
        drive: Drive,
    ) -> DirectedFlow:
        """Flow from the upstream to the downstream chamber.

        Source: `column_flow`; half-widths by linear propagation.
        """

        def velocity(table: HermiteTable, pressure: FloatArray, where: Truth) -> FloatArray:
            return velocity_of(table=table, head=pressure / path.density, where=np.asarray(where))

        separation = partial(velocity, hump_head or heads.head)
        flow = column_flow(
            path,
            drive.ends,
            primed=drive.primed,
            siphon=partial(velocity, heads.head),
            separation=separation,
        )
        width = _siphon_width(path, heads, inputs, drive, flow.siphon_velocity)
        undecided = np.zeros_like(drive.primed)
        margin, open_by = np.zeros_like(flow.velocity), np.zeros_like(flow.velocity)
        if hump_head is not None:
            broken = _separated_width(path, hump_head, heads.hump_uncertainty, inputs, drive, flow)
            bounds = _separation_margins(path, drive.ends, primed=drive.primed, spill=flow.spill_velocity)
            flows, full = flow.velocity > 0, flow.siphon_velocity
            slowest, fastest = (separation(bound, flows & (bound > 0)) for bound in bounds)
            held = _head_at(hump_head, flow.separation_velocity) * path.density
            margin, open_by = siphon_margin(
                path=path,
                heads=heads,
                hump_head=hump_head,
                inputs=inputs,
                drive=drive,
                at_rest=held,
                spread=np.maximum(held - bounds[0], bounds[1] - held),
                velocity=full,
            )
            undecided = flows & (np.abs(margin) < open_by)
            spread = np.maximum(
                flow.velocity - np.minimum(slowest, full), np.minimum(fastest, full) - flow.velocity
            )
            width = np.hypot(np.where(flow.separated, broken, width), np.where(flows, spread, 0.0))
        return cls(
            velocity=flow.velocity,
            separated=np.asarray(flow.separated),
            undecided=undecided,
            primed=np.asarray(flow.primed),
            half_width=width,
            margin=margin,
            margin_half_width=open_by,
        )


def _siphon_width(
    path: TubePath, heads: TubeHeads, inputs: DriveUncertainty, drive: Drive, velocity: FloatArray
) -> FloatArray:
    """Half-width from the tube's loss and all that drives it; the density matters where gas drives."""
    ends = drive.ends
    gas = ends.upstream_gas - ends.downstream_gas
    parts = (
        np.hypot(drive.upstream_uncertainty, drive.downstream_uncertainty),
        inputs.relative_density * gas,
        inputs.relative_speed * 2 * (ends.upstream_hydrostatic - back_pressure(path, ends)),
        inputs.relative_gas_pressure * gas,
    )
    return _width(heads.head, heads.uncertainty, driving_pressure(path, ends), parts, velocity)


def _separated_width(
    path: TubePath,
    head: HermiteTable,
    uncertainty_95: HermiteTable,
    inputs: DriveUncertainty,
    drive: Drive,
    flow: ColumnFlow[FloatArray],
) -> FloatArray:
    """Half-width at the pressure taken over the crest; what else that may be is not in it."""
    ends, velocity = drive.ends, flow.separation_velocity
    margin = _head_at(head, velocity) * path.density
    parts = (
        np.hypot(drive.upstream_uncertainty, drive.downstream_uncertainty),
        inputs.relative_density * (ends.upstream_gas - cavity_pressure(path, ends)),
        inputs.relative_speed * 2 * (ends.upstream_hydrostatic - path.column_pressure),
        inputs.relative_gas_pressure * ends.upstream_gas,
        np.full_like(margin, np.hypot(inputs.hump_pressure, inputs.vapour_pressure)),
    )
    return _width(head, uncertainty_95, margin, parts, velocity)


def _head_at(head: HermiteTable, velocity: FloatArray) -> FloatArray:
    """m^2/s^2; anything where nothing flows."""
    return np.exp(head(np.log(np.where(velocity > 0, velocity, 1.0))))


def siphon_margin(
    *,
    path: TubePath,
    heads: TubeHeads,
    hump_head: HermiteTable,
    inputs: DriveUncertainty,
    drive: Drive,
    at_rest: FloatArray,
    spread: FloatArray,
    velocity: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Lowest pressure of a full siphon less what lies over the crest, with its expanded uncertainty, Pa.

    p_m - p_c = p_A - p_c + P_A - D_m - R p_d,  R = (alpha + k_up)/(k + 1), p_d the driving pressure; R = 0 at
    rest.
    Args: `at_rest`: p_A - p_c + P_A - D_m, Pa. `spread`: by how much p_c may be off, Pa. `velocity`: of the
        full siphon, m/s.
    Source: energy balance from the upstream chamber to the crest; inputs by sensitivity, ASME V&V 20.
    """
    ends, flows = drive.ends, velocity > 0
    log_u = np.log(np.where(flows, velocity, 1.0))
    driving = np.where(flows, driving_pressure(path, ends), 0.0)
    fraction = np.where(flows, np.exp(hump_head(log_u) - heads.head(log_u)), 0.0)
    liquid = ends.upstream_hydrostatic - path.column_pressure + fraction * stall_pressure(path, ends)
    parts = (
        heads.fraction_uncertainty(log_u) * driving,
        (1 - fraction) * drive.upstream_uncertainty,
        fraction * drive.downstream_uncertainty,
        (1 - fraction) * inputs.relative_gas_pressure * ends.upstream_gas,
        inputs.relative_density * liquid,
        2 * inputs.relative_speed * liquid,
        inputs.hump_pressure,
        inputs.vapour_pressure,
        spread,
    )
    return at_rest - fraction * driving, np.sqrt(np.asarray(sum(p**2 for p in parts), dtype=np.float64))


def _width(
    head: HermiteTable,
    uncertainty_95: HermiteTable,
    pressure: FloatArray,
    parts: tuple[FloatArray, ...],
    velocity: FloatArray,
) -> FloatArray:
    """du = u/s sqrt(uncertainty_95^2 + sum (part/pressure)^2) with s = d ln(head)/d ln u."""
    flows = velocity > 0
    log_u = np.log(np.where(flows, velocity, 1.0))
    slope = head.with_slope(log_u)[1]
    # A lower bound against overflow only: towards a stall u/pressure tends to a constant.
    driven = np.where(flows, np.maximum(pressure, 1e-100), 1.0)
    squares = np.maximum(uncertainty_95(log_u), 0.0) ** 2 + sum((p / driven) ** 2 for p in parts)
    return np.where(flows, velocity / slope * np.sqrt(squares), 0.0)


def _separation_margins(
    path: TubePath, ends: TubeEnds, *, primed: BoolArray, spill: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest separation margin that the cavity's pressure and the gas over the crest allow, Pa.

    Args: `spill`: `ColumnFlow.spill_velocity`; between `clearing_velocities` the gas may be there or gone.
    """
    low, high = possible_cavity(path, ends)
    gas = np.maximum(gas_over_crest(path, ends), high)
    slowest, fastest = path.clearing_velocities
    rest = resting_pressure(path, ends)
    highest = np.where(~primed & (spill < fastest), gas, high)
    lowest = np.where(~primed & (spill < slowest), gas, low)
    return rest - highest, rest - lowest
