"""In words: what moment a disc cannot form, and what liquid its gas does not drive."""

from __future__ import annotations

from typing import Final

from ringbalance.controller.liquid_ring.plant import DiscState, LiquidRing
from ringbalance.controller.liquid_ring.reach import LEAST_PRESSURE, NEARLY_EMPTY, starting_pressure
from ringbalance.controller.simulation import Injection
from ringbalance.scene.loop_models import Rotor

_MICROMETRE: Final = 1e-6
_GRAM_MILLIMETRE: Final = 1e-6
_MEGAPASCAL: Final = 1e6


def moment_missing(plant: LiquidRing, state: DiscState, rotor: Rotor) -> str:
    """The unbalance, the usable moment of a pair under the scene's gas, and what is left at best."""
    needed = abs(rotor.initial_unbalance) / _GRAM_MILLIMETRE
    pair = abs(plant.largest_pair_moment(state=state)) / _GRAM_MILLIMETRE
    left = plant.unreachable_vibration(state=state, rotor=rotor) / _MICROMETRE
    return (
        f"the unbalance is {needed:.4g} g mm, one pair of chambers can form {pair:.4g} g mm along its axis, "
        f"so at best {left:.4g} um remain"
    )


def liquid_not_driven(plant: LiquidRing, state: DiscState, last: Injection | None) -> str:
    """Where the gas drives no liquid, and the pressures that would.

    Args: `last`: an injection that moved none; None: there was no such.
    """
    total = state.pairs[0].total
    lowest = max(0.0, total - plant.model.flow.max_fill_ratio)
    empty = f"to empty it: {_needed(plant, total, lowest + NEARLY_EMPTY)}"
    if last is None:
        fill = plant.least_fill(state=state)
        pressure = f"{plant.gas_pressure / _MEGAPASCAL:.4g} MPa"
        return f"{pressure} drives no chamber below a fill of {fill:.4g} ({empty})"
    fill = last.operation.fill_after
    return (
        f"{plant.gas_pressure / _MEGAPASCAL:.4g} MPa drives no liquid out of chamber {last.chamber} at fill "
        f"{fill:.4g} (to start there: {_needed(plant, total, fill)}; {empty})"
    )


def _needed(plant: LiquidRing, total: float, fill: float) -> str:
    """The pressure from which an injection begins at a fill, over an empty crest: short ones all do."""
    law = plant.model.flow
    found = starting_pressure(
        law=law,
        fill=fill,
        opposite_fill=min(total - fill, law.max_fill_ratio),
        primed=False,
        above=max(plant.gas_pressure, LEAST_PRESSURE),
    )
    return "no pressure: its liquid has left the port" if found is None else f"{found / _MEGAPASCAL:.4g} MPa"
