"""What unbalance the disc can cancel at all, and what gas pressure starts a flow at all."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.plant import DiscState, LiquidRing
from ringbalance.controller.rotor import chamber_directions
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.short_injection import least_pressure
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.loop_models import Rotor

_MAX_DOUBLINGS: Final = 40
_REFINEMENTS: Final = 6
_FILLS: Final = 513
"""At which a stall is looked for."""
NEARLY_EMPTY: Final = 1e-6
"""Fill ratio at which a chamber's last liquid is looked at."""
LEAST_PRESSURE: Final = 1.0
"""Gauge, Pa, at which the search for a pressure that starts a flow begins without one."""
BEYOND_CAPACITY: Final = (
    "balance the rotor first, use a denser liquid, or a larger or differently clocked disc"
)
"""What to do about an unbalance that the disc cannot cancel."""
RUNS_BACK: Final = "raise rotor.speed or lower tube.hump_radius so that the column breaks, or vent the tube"
"""What to do about a full tube that lets liquid run back while the gas is off."""


def largest_pair_moment(*, plant: LiquidRing, state: DiscState) -> complex:
    """Moment of a pair with its usable liquid moved to one side, along and across, kg m; for all the same.

    Source: Eq. 7 of the liquid-ring paper for a pair, by the model's own moment curve.
    """
    total = state.pairs[0].total
    highest = min(total - min(plant.residual_fill, total / 2), plant.model.flow.max_fill_ratio)
    moment = plant.model.moment.pair_vector(fill_ratio=highest, opposite_fill_ratio=total - highest)
    return complex(moment)


def _unreachable_moment(*, plant: LiquidRing, state: DiscState, wanted: complex) -> float:
    """Distance of a moment from the nearest one that the disc can form, kg m; zero within reach.

    The moments within reach fill a polygon whose corners have every pair fully to one side or the other.
    Source: Eq. 8 of the liquid-ring paper, in every direction and for any number of chambers.
    """
    n = plant.chambers
    axes = chamber_directions(n)[: n // 2]
    seen_from = np.exp(1j * np.pi * (2 * np.arange(n) + 1) / n + 0.5j * np.pi)
    signs = np.sign((axes[None, :] * seen_from[:, None].conj()).real)
    corners = largest_pair_moment(plant=plant, state=state) * (signs @ axes)
    edges = np.roll(corners, -1) - corners
    offset = wanted - corners
    if n > 2 and np.all((edges.conj() * offset).imag >= 0):
        return 0.0
    along = np.clip((edges.conj() * offset).real / np.maximum(np.abs(edges) ** 2, 1e-300), 0.0, 1.0)
    return float(np.min(np.abs(offset - along * edges)))


def unreachable_vibration(*, plant: LiquidRing, state: DiscState, rotor: Rotor) -> float:
    """Vibration that remains with the liquid at its best, m; zero within capacity."""
    wanted = -rotor.initial_unbalance
    return _unreachable_moment(plant=plant, state=state, wanted=wanted) * rotor.influence_coefficient


def least_driven_fill(*, law: FlowLaw, total: float, gas_pressure: float) -> float:
    """Smallest fill ratio to which gas drives a chamber from equal fills; total/2 where it drives nothing."""
    fills = np.linspace(total / 2, max(0.0, total - law.max_fill_ratio), _FILLS)
    rest = law.evaluate(fill_ratio=fills, opposite_fill_ratio=total - fills, gas_pressure=0.0, primed=True)
    flow = law.evaluate(
        fill_ratio=fills,
        opposite_fill_ratio=total - fills,
        gas_pressure=gas_pressure,
        primed=rest.primed,
    )
    stopped = np.flatnonzero(flow.velocity <= 0)
    return float(fills[stopped[0]] if stopped.size else fills[-1])


def starting_pressure(
    *, law: FlowLaw, fill: float, opposite_fill: float, primed: bool, above: float
) -> float | None:
    """Smallest gauge pressure at which liquid leaves a chamber, Pa, to 12 digits, searched from `above` on.

    None when no pressure found does.
    """

    def flows(pressure: FloatArray) -> BoolArray:
        one = np.ones_like(pressure)
        flow = law.evaluate(
            fill_ratio=fill * one,
            opposite_fill_ratio=opposite_fill * one,
            gas_pressure=pressure,
            primed=primed,
        )
        return flow.velocity > 0

    if flows(np.array([above]))[0]:
        return above
    for doubled in range(_MAX_DOUBLINGS):
        low = above * 2.0**doubled
        found = least_pressure(flows, low, 2.0 * low, refinements=_REFINEMENTS)
        if found is not None:
            return found
    return None
