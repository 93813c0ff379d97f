"""One operation of many pairs at once: the closed form where the law has it, else exact paths as tables.

All members share the law, the gas pressure and the liquid of a pair; a member whose flow is faster or slower
by a factor lives through the same paths in another time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ringbalance.controller.closed_form import LinearSquaredVelocity, boundary_event
from ringbalance.controller.compiled_records import SHARED, TABLE_SIZE
from ringbalance.controller.compiled_transfer import fills_after
from ringbalance.controller.pair_path import flat_paths, flow_paths
from ringbalance.controller.transfer import Drive, Event
from ringbalance.reduced_model.model import BalancerModel

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class PairTransfer:
    """What the valves and the tube do to one pair of chambers."""

    shared: npt.NDArray[np.void]
    """Type `SHARED`, shape (1,), with what concerns a pair filled in; for compiled code."""
    size: int
    """How much of its table the flows take."""

    def after(self, fill: FloatArray, time: FloatArray) -> FloatArray:
        """Fill of the driven chamber after a time of gas on a full tube.

        Args:
            fill: x at the start, any shape.
            time: s, broadcast with `fill`.

        Returns:
            x, of the broadcast shape.
        """
        x, t = np.broadcast_arrays(np.asarray(fill, dtype=np.float64), np.asarray(time, dtype=np.float64))
        return fills_after(self.shared[0], x.flatten(), t.flatten()).reshape(x.shape)


def pair_transfer(*, model: BalancerModel, total: float, gas_pressure: float) -> PairTransfer:
    """Prepare the operations of a balancer.

    Args:
        model: the balancer.
        total: sum of the two fill ratios of a pair.
        gas_pressure: gauge, Pa, in a driven chamber.

    Returns:
        PairTransfer: the closed form when the law has one, else the paths of every flow, exact to 1e-11.

    Raises:
        ValueError: a law whose regimes change more often than can be tabled.
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
    if isinstance(model.flow, LinearSquaredVelocity):
        shared["linear"] = True
        shared["squared_per_pressure"] = model.flow.velocity_squared_per_pressure
        shared["pressure_per_fill"] = model.flow.pressure_per_fill_difference
        return PairTransfer(shared=shared, size=0)
    return PairTransfer(shared=shared, size=_tabled(drive, shared))


def _tabled(drive: Drive, shared: npt.NDArray[np.void]) -> int:
    """The flows with gas and a full tube, with gas and an empty one, and without gas, in a row."""
    size = 0
    for name, pressure, primed in (
        ("on", drive.gas_pressure, True),
        ("dry", drive.gas_pressure, False),
        ("off", 0.0, True),
    ):
        paths = flow_paths(replace(drive, gas_pressure=pressure), primed=primed)
        flat = flat_paths(paths, at=size)
        shared[name], size = size, put(shared, flat, at=size)
    return size


def put(shared: npt.NDArray[np.void], values: FloatArray, *, at: int) -> int:
    """Write into the table of shared numbers.

    Args:
        shared: type `SHARED`, shape (1,), changed.
        values: what to write.
        at: index of the first.

    Returns:
        Index behind the last.

    Raises:
        ValueError: the table is full.
    """
    end = at + values.size
    if end > TABLE_SIZE:
        raise ValueError("this law cannot be tabled for an ensemble: run the members one by one")
    shared["table"][0, at:end] = values
    return end
