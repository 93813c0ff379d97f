"""Largest moments of a disc's liquid, and the pressure that starts a flow."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.rotor import chamber_directions
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.flow_law import BalancerModel, FlowLaw
from ringbalance.reduced_model.residual_liquid import stalled_fill_ratio
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray
from ringbalance.scene.loop_models import Rotor

NEAR_RESIDUAL: Final = 1e-6
"""Fill ratio above the residual fill up to which a chamber counts as at it, in runs and ensembles; too small
to change a vibration."""
_MAX_DOUBLINGS: Final = 40
_REFINEMENTS: Final = 6
"""Number of refinements; each leaves a 256th of the range."""
_PRESSURES: Final = 257
"""Number of pressures in a call of the law: few calls with many pressures cost least."""
NEARLY_EMPTY: Final = 1e-6
"""Fill ratio above the lowest one of a chamber that counts as nearly empty."""
LEAST_PRESSURE_PA: Final = 1.0
"""Lowest gauge pressure at which the search for a pressure that starts a flow begins, Pa."""


@dataclass(frozen=True, kw_only=True)
class LiquidRing:
    """Flow law and moments of the disc, and dynamics of its liquid."""

    model: BalancerModel
    chambers: int
    dynamics: Dynamics
    total: float
    """Sum of the two fill ratios of a pair."""

    @property
    def gas_pressure(self) -> float:
        """Pressure of a chamber under gas over that of a vented one, Pa."""
        return self.dynamics.gas_pressure

    @property
    def residual_fill(self) -> float:
        """Residual fill of a driven chamber, below which gas would enter its port."""
        return self.dynamics.residual

    @property
    def least_fill(self) -> float:
        """Fill to which injections can bring a chamber: the residual one, or that at which the gas stalls."""
        stalled = stalled_fill_ratio(law=self.model.flow, total=self.total, gas_pressure=self.gas_pressure)
        return min(max(self.residual_fill, stalled), self.total / 2)

    def largest_pair_moment(self, *, least_fill: float | None = None) -> complex:
        """Moment of a pair with its usable liquid moved to one side, along and across, kg m.

        Args: `least_fill`: to which a chamber is emptied; default `LiquidRing.least_fill`.
        """
        least = np.asarray(self.least_fill if least_fill is None else least_fill)
        return complex(largest_pair_moments(self.model, total=self.total, least_fill=least))

    def unreachable_vibration(self, *, rotor: Rotor, least_fill: float | None = None) -> float:
        """Vibration that remains with the best fills, m; zero within capacity.

        Args: `least_fill`: as in `largest_pair_moment`.
        """
        corners = corners_of(self.largest_pair_moment(least_fill=least_fill), self.chambers)
        left = unreachable_moment(corners, np.asarray(-rotor.initial_unbalance))
        return float(left) * rotor.influence_coefficient

    def moment_towards(self, direction: complex, *, least_fill: float | None = None) -> float:
        """Largest moment that the disc forms in a direction, kg m.

        Args: `least_fill`: as in `largest_pair_moment`.
        """
        corners = corners_of(self.largest_pair_moment(least_fill=least_fill), self.chambers)
        return float(moment_towards(corners, np.asarray(direction / abs(direction) if direction else 1.0)))


def largest_pair_moments(
    model: BalancerModel, *, total: float | FloatArray, least_fill: FloatArray
) -> ComplexArray:
    """Moments of a pair whose usable liquid is moved to one side, along and across, kg m.

    Source: Eq. 7 of the liquid-ring paper for a pair, by the model's own moment curve.
    """
    highest = np.minimum(total - np.minimum(least_fill, total / 2), model.flow.max_fill_ratio)
    return model.moment.pair_vector(fill_ratio=highest, opposite_fill_ratio=total - highest)


def corners_of(pair_moment: npt.ArrayLike, chambers: int) -> ComplexArray:
    """Corners of the moments that discs form: every pair fully to one side or the other, shape (..., n)."""
    return np.asarray(np.asarray(pair_moment)[..., None] * _corner_directions(chambers))


def unreachable_moment(corners: ComplexArray, required: ComplexArray) -> FloatArray:
    """Distance between the moment required of each disc and the nearest that it can form, kg m.

    Source: Eq. 8 of the liquid-ring paper, in every direction and for any number of chambers.
    """
    edges = np.roll(corners, -1, axis=-1) - corners
    offset = required[..., None] - corners
    fraction = np.clip((edges.conj() * offset).real / np.maximum(np.abs(edges) ** 2, 1e-300), 0.0, 1.0)
    inside = np.all((edges.conj() * offset).imag > 0, axis=-1)
    return np.where(inside, 0.0, np.min(np.abs(offset - fraction * edges), axis=-1))


def moment_towards(corners: ComplexArray, towards: ComplexArray) -> FloatArray:
    """Largest moment that each disc forms in a direction of length one, kg m."""
    edges = np.roll(corners, -1, axis=-1) - corners
    # On the line of an edge: Im(edge* (t direction - corner)) = 0.
    crossed = (edges.conj() * towards[..., None]).imag
    reached = (edges.conj() * corners).imag / np.where(crossed < 0, crossed, -np.inf)
    nearest = np.min(np.where(crossed < 0, reached, np.inf), axis=-1)
    # No edge is crossed if nothing moves, or if two chambers lie along the direction.
    return np.asarray(np.where(np.any(crossed < 0, axis=-1), nearest, np.max(np.abs(corners), axis=-1)))


@cache
def _corner_directions(chambers: int) -> ComplexArray:
    """Directions of the corners of the moments that a disc can form, for a pair's moment of one."""
    axes = chamber_directions(chambers)[: chambers // 2]
    seen_from = np.exp(1j * np.pi * (2 * np.arange(chambers) + 1) / chambers + 0.5j * np.pi)
    signs = np.sign((axes[None, :] * seen_from[:, None].conj()).real)
    return np.asarray(signs @ axes)


def starting_pressure(*, law: FlowLaw, fill: float, opposite_fill: float, above: float) -> float | None:
    """Smallest gauge pressure at which liquid leaves a chamber, Pa, to 12 digits, searched from `above` on.

    The crest is empty.  None when no pressure does.
    """

    def flows(pressure: FloatArray) -> BoolArray:
        ones = np.ones_like(pressure)
        flow = law.evaluate(
            fill_ratio=fill * ones,
            opposite_fill_ratio=opposite_fill * ones,
            gas_pressure=pressure,
            primed=False,
        )
        return flow.velocity > 0

    if flows(np.array([above]))[0]:
        return above
    for doubled in range(_MAX_DOUBLINGS):
        low, high = above * 2.0**doubled, 2.0 * (above * 2.0**doubled)
        for _ in range(_REFINEMENTS):
            p = np.linspace(low, high, _PRESSURES)
            dry = np.flatnonzero(~flows(p))
            if dry.size == 0:
                return low
            if dry[-1] == p.size - 1:
                # Nothing flows at the highest pressure.
                break
            low, high = float(p[dry[-1]]), float(p[dry[-1] + 1])
        else:
            return high
    return None
