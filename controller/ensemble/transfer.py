"""One operation of many pairs at once: the closed form where the law has it, else exact paths as tables.

All members share the law, the gas pressure and the liquid of a pair; a member whose flow is faster or slower
by a factor passes through the same states earlier or later.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.ensemble.compiled_records import DRY, OFF, ON, PATH_NODES, SHARED
from ringbalance.controller.ensemble.compiled_transfer import fills_after
from ringbalance.controller.liquid_ring.closed_form import LinearSquaredVelocity, boundary_event
from ringbalance.controller.liquid_ring.motion import Dynamics
from ringbalance.controller.liquid_ring.pair_path import UntabulatedError, flow_paths
from ringbalance.controller.liquid_ring.records import PLANT
from ringbalance.controller.liquid_ring.transfer import Drive, Event
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.arrays import FloatArray

RELATIVE_ERROR: Final = 1e-4
"""Allowed to one step of a member's states: an injection then ends within 1e-6 in fill of a single run's, and
within 3e-5 without inertia."""
MOST_CHANGES: Final = 64
"""Of a law's regime, so that the table of its flows stays short."""


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
        return fills_after(self.shared[0], x.flatten(), t.flatten()).reshape(x.shape)


def pair_transfer(
    *, model: BalancerModel, total: float, gas_pressure: float, dynamics: Dynamics | None = None
) -> PairTransfer:
    """Closed form of a pair when the law has one, else the paths of every flow, exact to 1e-11.

    `total` is the sum of the two fill ratios, the gas pressure is gauge. With `dynamics` every pair moves by
    them, each step to `RELATIVE_ERROR`, and nothing is tabulated.
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
    shared["lowest_empties"] = boundary_event(drive, drive.lowest) is Event.EMPTY
    shared["highest_empties"] = boundary_event(drive, drive.highest) is Event.EMPTY
    if dynamics is not None:
        shared["moving"] = True
        return PairTransfer(shared=shared, plant=dynamics.plant(total=total, relative_error=RELATIVE_ERROR))
    if isinstance(model.flow, LinearSquaredVelocity):
        shared["linear"] = True
        shared["squared_per_pressure"] = model.flow.velocity_squared_per_pressure
        shared["pressure_per_fill"] = model.flow.pressure_per_fill_difference
    else:
        _fill_tables(drive, shared[0])
    return PairTransfer(shared=shared, plant=np.zeros(1, dtype=PLANT))


def _fill_tables(drive: Drive, shared: np.void) -> None:
    """The flows with gas and a full tube, with gas and an empty one, and without gas, in a row."""
    interval = node = 0
    for flow, pressure, primed in (
        (ON, drive.gas_pressure, True),
        (DRY, drive.gas_pressure, False),
        (OFF, 0.0, True),
    ):
        paths = flow_paths(replace(drive, gas_pressure=pressure), primed=primed, most_changes=MOST_CHANGES)
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
