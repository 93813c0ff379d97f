"""One operation of many pairs at once: the closed form where the law has it, else exact paths as tables.

All members share the law, the gas pressure and the liquid of a pair; a member whose flow is faster or slower
by a factor passes through the same states earlier or later.  Compiled is one pair's operation in plain
numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, cast

import numpy as np
import numpy.typing as npt

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.ensemble.compiled_records import DRY, OFF, OFF_DRY, ON, PATH_NODES, SHARED, Record
from ringbalance.controller.formulas import linear_course, piece_part, piece_rise
from ringbalance.controller.liquid_ring.integrators import LinearSquaredVelocity, closed_form, integrator_of
from ringbalance.controller.liquid_ring.motion import Dynamics
from ringbalance.controller.liquid_ring.pair_path import FlowPaths, UntabulatedError
from ringbalance.controller.liquid_ring.records import PLANT
from ringbalance.controller.liquid_ring.transfer import Drive, Event, floods
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.arrays import FloatArray

RELATIVE_ERROR: Final = 1e-4
"""Allowed to one step of a member's states: an injection then ends within 1e-6 in fill of a single run's, and
within 3e-5 without inertia."""
MOST_CHANGES: Final = 64
"""Of a law's regime, so that the table of its flows stays short."""
T: Final = 0
"""Column of a node: time."""
X: Final = 1
"""Fill."""
_linear_course: Final = compiled(linear_course)
_piece_part: Final = compiled(piece_part)
_piece_rise: Final = compiled(piece_rise)


@dataclass(frozen=True, kw_only=True, eq=False)
class PairTransfer:
    """What the valves and the tube do to one pair of chambers."""

    shared: npt.NDArray[np.void]
    """Type `SHARED`, shape (1,), with what concerns a pair filled in; for compiled code."""
    plant: npt.NDArray[np.void]
    """Type `PLANT`, shape (1,): terms beyond the flow law; empty numbers where there are none."""

    def after(self, fill: FloatArray, time: FloatArray) -> FloatArray:
        """Fill of the driven chamber after a time of gas, s, on a full tube; arguments broadcast."""
        x, t = np.broadcast_arrays(np.asarray(fill, dtype=np.float64), np.asarray(time, dtype=np.float64))
        return _fills_after(self.shared[0], x.flatten(), t.flatten()).reshape(x.shape)

    @classmethod
    def of(
        cls, *, model: BalancerModel, total: float, gas_pressure: float, dynamics: Dynamics | None = None
    ) -> PairTransfer:
        """Closed form of a pair when the law has one, else the paths of every flow, exact to 1e-11.

        `total` is the sum of the two fill ratios, the gas pressure is gauge. With `dynamics` every pair moves
        by them, each step to `RELATIVE_ERROR`, and nothing is tabulated.
        Raises: ValueError: a law whose regimes change more often than can be tabled.
        """
        drive = Drive(
            law=model.flow,
            fill=total / 2,
            total=total,
            exchange_rate=model.tube_area / model.chamber_volume,
            gas_pressure=gas_pressure,
            primed=True,
        )
        shared = np.zeros(1, dtype=SHARED)
        for name in ("gas_pressure", "exchange_rate", "total", "lowest", "highest"):
            shared[name] = getattr(drive, name)
        shared["floods"] = floods(model.flow, total=total)
        shared["lowest_empties"] = drive.boundary_event(drive.lowest) is Event.EMPTY
        shared["highest_empties"] = drive.boundary_event(drive.highest) is Event.EMPTY
        if dynamics is not None:
            shared["moving"] = True
            return cls(shared=shared, plant=dynamics.plant(total=total, relative_error=RELATIVE_ERROR))
        if integrator_of(model.flow) is closed_form:
            law = cast(LinearSquaredVelocity, model.flow)
            shared["linear"] = True
            shared["squared_per_pressure"] = law.velocity_squared_per_pressure
            shared["pressure_per_fill"] = law.pressure_per_fill_difference
        else:
            _fill_tables(drive, shared[0])
        return cls(shared=shared, plant=np.zeros(1, dtype=PLANT))


def _fill_tables(drive: Drive, shared: np.void) -> None:
    """The flows with gas and a full tube, with gas and an empty one, and without gas, in a row.

    Without gas an empty tube has flows only where it `floods`.
    """
    interval, node, flows = 0, 0, [(drive.gas_pressure, True), (drive.gas_pressure, False), (0.0, True)]
    if shared["floods"]:
        flows.append((0.0, False))
    for flow, (pressure, primed) in enumerate(flows):
        paths = FlowPaths.of(replace(drive, gas_pressure=pressure), primed=primed, most_changes=MOST_CHANGES)
        nodes, rows = paths.nodes.shape[1], slice(interval, interval + paths.sense.size)
        if node + nodes > PATH_NODES:
            raise UntabulatedError
        shared["edge"][rows] = np.append(-np.inf, paths.edges)
        shared["sense"][rows], shared["holds"][rows] = paths.sense, paths.holds
        shared["first"][rows] = node + paths.begin[paths.path]
        shared["last"][rows] = node + paths.begin[paths.path + 1] - 1
        shared["node"][node : node + nodes] = paths.nodes.T
        interval, node = rows.stop, node + nodes
        shared["begin"][flow + 1] = interval


@compiled
def linear_fill(
    fill: float,
    time: float,
    squared_per_pressure: float,
    pressure_per_fill: float,
    gas_pressure: float,
    exchange_rate: float,
    total: float,
    lowest: float,
) -> float:
    """Fill of a driven chamber after a time of gas, by `closed_form`, for u^2 = a (p + b (x_A - x_C)), SI."""
    u0, slowing, end, stalls = _linear_course(
        fill, squared_per_pressure, pressure_per_fill, gas_pressure, exchange_rate, total, lowest
    )
    if u0 == 0.0:
        return fill
    if time >= end and not stalls:
        return lowest
    flowing = min(time, end)
    return max(fill - exchange_rate * flowing * (u0 - slowing * flowing / 2.0), lowest)


@compiled
def _interval(shared: Record, flow: int, fill: float) -> int:
    """The interval that holds a fill."""
    low, high = shared.begin[flow], shared.begin[flow + 1] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if shared.edge[middle] <= fill:
            low = middle
        else:
            high = middle - 1
    return int(low)


@compiled
def _follow(shared: Record, interval: int, fill: float, time: float) -> tuple[float, float]:
    """Fill after a time on the path of an interval, and the time left at its end."""
    node, sign = shared.node, -float(shared.sense[interval])
    first, last = shared.first[interval], shared.last[interval]
    piece = _piece(shared, first, last, X, sign, sign * fill)
    span, rise, d0, d1 = _cubic(shared, piece)
    clock = node[piece, T] + _piece_part(fill - node[piece, X], rise, d0, d1) * span + time
    if clock >= node[last, T]:
        return float(node[last, X]), float(clock - node[last, T])
    piece = _piece(shared, piece, last, T, 1.0, clock)
    span, rise, d0, d1 = _cubic(shared, piece)
    after = node[piece, X] + _piece_rise((clock - node[piece, T]) / span, rise, d0, d1)
    return float(max(after, fill) if sign > 0.0 else min(after, fill)), 0.0


@compiled
def _cubic(shared: Record, piece: int) -> tuple[float, float, float, float]:
    """Duration of the piece after a node, its rise, and the slopes at its ends times its duration."""
    node = shared.node
    span = node[piece + 1, T] - node[piece, T]
    return span, node[piece + 1, X] - node[piece, X], node[piece, 2] * span, node[piece + 1, 3] * span


@compiled
def _piece(shared: Record, first: int, last: int, column: int, sign: float, wanted: float) -> int:
    """The node, before the last, from which on sign * value is not above what is wanted."""
    low, high = first, last
    while high - low > 1:
        middle = (low + high) // 2
        if sign * shared.node[middle, column] <= wanted:
            low = middle
        else:
            high = middle
    return int(low)


@compiled
def gas_on(shared: Record, fill: float, wet: bool, time: float) -> tuple[float, bool]:
    """Fill of a driven chamber after a time of gas, s, and whether the tube then holds a column."""
    if shared.linear:
        after = linear_fill(
            fill,
            time,
            shared.squared_per_pressure,
            shared.pressure_per_fill,
            shared.gas_pressure,
            shared.exchange_rate,
            shared.total,
            shared.lowest,
        )
        # Whatever it holds, this law's tube is empty once the gas is off.
        return after, False
    if wet:
        return _flow(shared, ON, fill, time)
    return _spill(shared, DRY, ON, fill, time)


@compiled
def gas_off(shared: Record, fill: float, wet: bool, time: float) -> tuple[float, bool]:
    """The same without gas; `fill` is of the chamber that was driven last."""
    if shared.linear or not (wet or shared.floods):
        return fill, False
    if wet:
        return _flow(shared, OFF, fill, time)
    return _spill(shared, OFF_DRY, OFF, fill, time)


@compiled
def _spill(shared: Record, dry: int, primed: int, fill: float, time: float) -> tuple[float, bool]:
    """An unprimed tube spills by one flow until it is primed, and goes on by another."""
    start = _interval(shared, dry, fill)
    if shared.sense[start] == 0:
        return fill, shared.holds[start] > 0
    if shared.holds[start] > 0:
        return _flow(shared, primed, fill, time)
    after, left = _follow(shared, start, fill, time)
    end = _interval(shared, dry, after)
    if left > 0.0 and shared.sense[end] != 0 and shared.holds[end] > 0:
        return _flow(shared, primed, after, left)
    return after, False


@compiled
def _flow(shared: Record, flow: int, fill: float, time: float) -> tuple[float, bool]:
    interval = _interval(shared, flow, fill)
    sense = shared.sense[interval]
    if sense == 0:
        return fill, shared.holds[interval] > 0
    after, _ = _follow(shared, interval, fill, time)
    if sense > 0 and shared.lowest_empties and after <= shared.lowest:
        return after, False
    if sense < 0 and shared.highest_empties and after >= shared.highest:
        return after, False
    return after, shared.holds[_interval(shared, flow, after)] > 0


@compiled
def _fills_after(shared: Record, fill: FloatArray, time: FloatArray) -> FloatArray:
    """Fills of driven chambers after times of gas, s, on a full tube."""
    found = np.empty(fill.size)
    for i in range(fill.size):
        found[i] = gas_on(shared, fill[i], True, time[i])[0]
    return found
