"""Fill ratios at which injections end: where the flow stalls, and where gas enters a port.

For many plants at once; `residual_liquid` treats one law.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.fill_limits import NEARLY_EMPTY, drawn_fill, first_gas
from ringbalance.reduced_model.injection.column import holds, steady
from ringbalance.reduced_model.injection.dynamics import Lift, Record
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.platform.compiled import in_place

_PLACES: Final = 256
"""Number of steps of fill from equal fills to an empty chamber."""
_HALVINGS: Final = 24
"""Halvings of the step in which the flow stops: 2e-10 of a fill is left."""


def residual_fills(plants: npt.NDArray[np.void], designs: Designs) -> FloatArray:
    """Fill ratio of each plant at which gas enters the port of a driven chamber, as `residual_fill_ratio`."""
    scene = designs.scene

    def entrainment_fill(rows: IntArray, fills: FloatArray) -> FloatArray:
        velocity, some = np.empty(rows.size), scene
        running_velocities(plants, rows, fills, velocity)
        if rows.size < designs.size:
            some = designs.take(rows).scene
        return drawn_fill(some, flow_rate=some.tube.area * velocity)

    return first_gas(scene, entrainment_fill, top=np.full(designs.size, scene.disc.max_fill_ratio))


def hold_liquid(plants: npt.NDArray[np.void], designs: Designs) -> None:
    """Set plants with a crest to fill the tube up to it before liquid passes."""
    if not np.any(plants["crest"]):
        return
    rows, velocity = np.arange(designs.size), np.empty(designs.size)
    running_velocities(plants, rows, plants["max_fill_ratio"] / 2, velocity)
    lift = Lift.at(designs.scene, velocity)
    plants["lifts"], plants["lift_straight"], plants["lift_entrance"] = True, lift.straight, lift.entrance


@in_place
def stalled_fills(plants: Record, fills: FloatArray) -> None:
    """Fill ratio of each plant at which an injection moves no liquid, into an array of shape (n,).

    As `residual_liquid.stalled_fill_ratio`, from the liquid that the tube holds while the gas is off.
    """
    for i in range(plants.size):
        fills[i] = _stalled_fill(plants[i])


@in_place
def _stalled_fill(plant: Record) -> float:
    start, lowest = plant.total / 2.0, max(0.0, plant.total - plant.max_fill_ratio)
    step = (max(lowest, NEARLY_EMPTY * plant.total) - start) / _PLACES
    for k in range(_PLACES + 1):
        if not _moves(plant, start + k * step):
            return _between(plant, start + (k - 1) * step, start + k * step) if k > 0 else float(start)
    return float(lowest)


@in_place
def _between(plant: Record, moving: float, stalled: float) -> float:
    for _ in range(_HALVINGS):
        middle = (moving + stalled) / 2.0
        if _moves(plant, middle):
            moving = middle
        else:
            stalled = middle
    return stalled


@in_place
def _moves(plant: Record, fill: float) -> bool:
    opposite = plant.total - fill
    held = holds(plant, fill, opposite, 0.0, 0.0, True, 0.0)
    return bool(steady(plant, fill, opposite, plant.gas_pressure, 0.0, held, 0.0)[0] > 0.0)


@in_place
def running_velocities(plants: Record, rows: IntArray, fills: FloatArray, velocities: FloatArray) -> None:
    """Velocity out of a driven chamber through a tube that is full, m/s, zero where none leaves it.

    Args: `rows`: indices of the plants. `fills`: fill ratios of their driven chambers; the opposite ones have
        the rest of the largest fill. `velocities`: array for the result.
    """
    for i in range(rows.size):
        plant, fill = plants[rows[i]], fills[i]
        speed = steady(plant, fill, plant.max_fill_ratio - fill, plant.gas_pressure, 0.0, True, 0.0)[0]
        velocities[i] = max(speed, 0.0)
