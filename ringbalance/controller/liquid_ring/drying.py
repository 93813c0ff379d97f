"""Liquid that gas takes from the chambers while a run holds the balance, and how long the capacity lasts."""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

from ringbalance.controller.simulation import GasUse, Simulation
from ringbalance.physics.evaporation import carried_off

_HOUR_S: Final = 3600.0
_HALVINGS: Final = 20
"""Halvings of the part of the liquid that may be lost: 1e-6 of it."""


class Drying(NamedTuple):
    """Loss of liquid with the gas of holding, at most; None: not known. Gas that leaks passes no liquid."""

    per_hour: float | None = None
    """kg an hour."""
    part_per_hour: float | None = None
    """Part of all liquid of the disc an hour."""
    holding_time: float | None = None
    """Time, s, until the disc lacks the lost liquid to cancel the scene's initial unbalance to the limit."""


def drying(run: Simulation, held: GasUse | None, *, span: float) -> Drying:
    """Loss of liquid. Args: `held`: gas of the part of a run, `span` long, s, that holds the balance."""
    each = carried_off(run.scene)
    if each is None or held is None:
        return Drying()
    per_hour = each * (held.normal_volume - held.leaked) / span * _HOUR_S
    volume = run.plant.total * run.model.chamber_volume * run.scene.disc.chambers / 2
    part = per_hour / (run.scene.liquid.density * volume)
    return Drying(per_hour, part, _spare_part(run) / part * _HOUR_S if part > 0 else None)


def _spare_part(run: Simulation) -> float:
    """Largest part of its liquid without which the disc cancels the initial unbalance to the limit."""

    def cancels(lost: float) -> bool:
        plant = replace(run.plant, total=(1.0 - lost) * run.plant.total)
        return plant.unreachable_vibration(rotor=run.scene.rotor_as_read) <= run.limit

    low, high = 0.0, 1.0
    if not cancels(low):
        return 0.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if cancels(middle) else (low, middle)
    return low
