"""Liquid that gas takes from the chambers while a run holds the balance, and how long the capacity lasts."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.liquid_ring.plant import corners_of, largest_pair_moments, unreachable_moment
from ringbalance.controller.simulation import GasUse, Simulation
from ringbalance.physics.evaporation import carried_off
from ringbalance.physics.gas import normal_volume
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import stalled_fill_ratios
from ringbalance.scene.models import Scene

_HOUR_S: Final = 3600.0
_DIVISIONS: Final = 32
_ROUNDS: Final = 4
"""Rounds that each divide the part of the liquid that may be lost: to 32^-4, 1e-6 of it."""


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
    part = per_hour / _liquid(run.scene, run.model)
    return Drying(per_hour, part, _spare_part(run) / part * _HOUR_S if part > 0 else None)


def part_per_gas(scene: Scene, model: BalancerModel) -> float:
    """Part of all liquid that gas carries off at most, over the p V (Pa m^3) of the gas let off; NaN: not
    known, or the scene states no humidity."""
    each = None if scene.gas.relative_humidity is None else carried_off(scene)
    if each is None:
        return math.nan
    volume = normal_volume(pressure_volume=1.0, temperature=scene.gas.temperature)
    return each * volume / _liquid(scene, model)


def _liquid(scene: Scene, model: BalancerModel) -> float:
    """Mass of all liquid of the disc, kg."""
    volume = scene.disc.initial_fill * model.chamber_volume * scene.disc.chambers
    return scene.liquid.density * volume


def _spare_part(run: Simulation) -> float:
    """Largest part of its liquid without which the disc cancels the initial unbalance to the limit."""
    plant, rotor, low, width = run.plant, run.scene.rotor_as_read, 0.0, 1.0
    required = np.asarray(-rotor.initial_unbalance)
    for _ in range(_ROUNDS):
        width /= _DIVISIONS
        totals = (1.0 - (low + width * np.arange(_DIVISIONS, dtype=np.float64))) * plant.total
        stalled = stalled_fill_ratios(law=plant.model.flow, totals=totals, gas_pressure=plant.gas_pressure)
        least = np.minimum(np.maximum(plant.residual_fill, stalled), totals / 2)
        moments = largest_pair_moments(plant.model, total=totals, least_fill=least)
        left = unreachable_moment(corners_of(moments, plant.chambers), required)
        cancels = np.append(left * rotor.influence_coefficient <= run.limit, False)
        if not cancels[0]:
            return 0.0
        low += width * (int(np.argmin(cancels)) - 1)
    return low
