"""A pair of chambers through an interval of time with moving liquid, filling gas and late valves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.controller.liquid_ring.compiled_lift import stands
from ringbalance.controller.liquid_ring.compiled_march import advance, opening_within
from ringbalance.controller.liquid_ring.motion import Dynamics, Motion, packed, unpacked
from ringbalance.controller.liquid_ring.records import WORKSPACE
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class Passage:
    """A pair after an interval of time."""

    fills: FloatArray
    """x of chamber 0 at the given instants, shape (m,)."""
    fill: float
    """x of chamber 0 at the end."""
    primed: bool
    motion: Motion
    """At the end; its record's event is UNFINISHED when the bound on the number of steps was reached."""
    ran_back: float
    """Change of x by flow out of the chamber that was not driven last, with both valves closed."""


def pass_time(
    dynamics: Dynamics, *, fill: float, total: float, primed: bool, motion: Motion, instants: FloatArray
) -> Passage:
    """Let time pass for one pair.

    Args:
        fill: x of chamber 0.
        total: sum of the two fill ratios.
        primed: whether the tube holds a continuous column.
        instants: s from now, ascending, the last one the end.
    """
    plant = dynamics.kept_plant(total=total)
    state = packed(plant, fill=fill, primed=primed, motion=motion)
    notes = np.stack([instants, instants])
    advance(plant[0], state[0], float(instants[-1]), notes, 1, instants.size, np.zeros(WORKSPACE))
    lowest, highest = max(0.0, total - dynamics.max_fill_ratio), min(total, dynamics.max_fill_ratio)
    return Passage(
        fills=np.clip(notes[1], lowest, highest),
        fill=stands(plant[0], state[0])[1],
        primed=bool(state["primed"][0]),
        motion=unpacked(plant, state),
        ran_back=float(state["ran_back"][0]),
    )


def longest_opening(
    dynamics: Dynamics,
    *,
    fill: float,
    total: float,
    primed: bool,
    motion: Motion,
    chamber: int,
    duration: float,
) -> float:
    """Longest valve-open time, at most `duration`, s, whose injection and tail leave the residual fill."""
    plant = dynamics.kept_plant(total=total)
    states = np.concatenate([packed(plant, fill=fill, primed=primed, motion=motion)] * 2)
    return opening_within(plant[0], states, 0, 1, chamber, duration, np.zeros(WORKSPACE))
