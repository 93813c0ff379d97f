"""Flow of the tube in one direction with its uncertainty, for arrays of conditions.

The pressures and the regime are those of `tube_regime`, the velocities those of the tube's tabulated loss.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ringbalance.reduced_model.tables.hermite import HermiteTable
from ringbalance.reduced_model.tube.heads import TubeHeads, velocity_of
from ringbalance.reduced_model.tube.regime import SiphonCrest, Truth, TubeEnds, TubePath, column_flow
from ringbalance.scene.arrays import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True)
class DriveUncertainty:
    """Expanded uncertainties (95 %) of what drives the flow."""

    relative_density: float
    relative_speed: float
    relative_gas_pressure: float
    hump_pressure: float
    """Pa."""
    vapour_pressure: float
    """Pa."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What acts on the tube in one direction; arrays of one shape."""

    ends: TubeEnds[FloatArray]
    """Pressures at the tube's ends."""
    wall_pressure_uncertainty: FloatArray
    """Expanded uncertainty (95 %) of both hydrostatic pressures together, Pa."""
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
    """Whether the column is separated at the siphon crest."""
    primed: BoolArray
    """Whether the tube holds a continuous column afterwards."""
    half_width: FloatArray
    """Expanded uncertainty (95 %) of the velocity, m/s."""


def directed_flow(
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

    crest = path.crest if hump_head is not None else None
    flow = column_flow(
        ends=drive.ends,
        crest=crest,
        primed=drive.primed,
        allowed=drive.allowed,
        siphon=partial(velocity, heads.head),
        separation=partial(velocity, hump_head or heads.head),
    )
    width = _siphon_width(heads, inputs, drive, flow.siphon_velocity)
    if crest is not None and hump_head is not None:
        separated_width = _separated_width(
            hump_head, heads.hump_uncertainty, inputs, drive, crest, flow.separation_velocity
        )
        width = np.where(flow.separated, separated_width, width)
    return DirectedFlow(
        velocity=flow.velocity,
        separated=np.asarray(flow.separated),
        primed=np.asarray(flow.primed),
        half_width=width,
    )


def _siphon_width(
    heads: TubeHeads, inputs: DriveUncertainty, drive: Drive, velocity: FloatArray
) -> FloatArray:
    """Half-width from the tube's loss and all that drives it; the density matters where gas drives."""
    ends = drive.ends
    gas = ends.upstream_gas - ends.downstream_gas
    parts = (
        drive.wall_pressure_uncertainty,
        inputs.relative_density * gas,
        inputs.relative_speed * 2 * (ends.upstream_hydrostatic - ends.back_pressure()),
        inputs.relative_gas_pressure * gas,
    )
    return _width(heads.head, heads.uncertainty, ends.driving_pressure(), parts, velocity)


def _separated_width(
    head: HermiteTable,
    uncertainty_95: HermiteTable,
    inputs: DriveUncertainty,
    drive: Drive,
    crest: SiphonCrest[FloatArray],
    velocity: FloatArray,
) -> FloatArray:
    ends = drive.ends
    margin = crest.separation_margin(ends)
    parts = (
        drive.wall_pressure_uncertainty,
        inputs.relative_density * (ends.upstream_gas - crest.cavity_pressure(ends)),
        inputs.relative_speed * 2 * (ends.upstream_hydrostatic - crest.column_pressure),
        inputs.relative_gas_pressure * ends.upstream_gas,
        np.full_like(margin, np.hypot(inputs.hump_pressure, inputs.vapour_pressure)),
    )
    return _width(head, uncertainty_95, margin, parts, velocity)


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
