"""Residual liquid: what a chamber keeps when gas is drawn into its port, and what a pair can use."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.tube.ends import DRAW_DOWN_UNCERTAINTY, draw_down_depth
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

_SAMPLES: Final = 201
"""Fills at which gas in the port is looked for before the root is refined."""
_PIECES: Final = 32
"""Of an interval that holds the root, per refinement."""
_FACTORS: Final = 201
"""Nodes of a table over factors of the velocity."""
_REFINEMENTS: Final = 2
"""Leave 2e-6 of the range, within which a straight line is good to 1e-9."""
_NOTHING: Final = 1e-9
"""Below this a fill ratio is not told from zero."""


@dataclass(frozen=True, kw_only=True)
class ResidualLiquid:
    """Limits of a pair's transfer under the scene's gas pressure; uncertainties are expanded (95 %)."""

    fill_ratio: float
    """Of the driven chamber, at which gas enters its port."""
    fill_ratio_uncertainty: float
    depth: float
    """Of the liquid over the port then, m."""
    depth_uncertainty: float
    flow_rate: float
    """Through the tube then, m^3/s."""
    largest_fill_ratio: float
    """That the opposite chamber reaches then."""
    usable_volume: float
    """That a pair can move from one chamber to the other, m^3."""
    usable_volume_uncertainty: float
    pair_moment: float
    """Largest moment of a pair with one chamber empty, by geometry, kg m."""
    usable_pair_moment: float
    """Largest moment of a pair that no gas passes through, kg m."""
    usable_pair_moment_uncertainty: float

    @classmethod
    def of(cls, scene: Scene, *, law: CalibratedLaw) -> ResidualLiquid:
        """Residual fill with its uncertainty, and the volume and the moment that it leaves to a pair.

        Uncertainty: that of the depth's correlation, and of the velocity to the power 2/5.
        """
        x, top = residual_fill_ratio(scene, law=law), scene.disc.max_fill_ratio
        rate, width = _flow_rate(scene, law, np.array([x]))
        relative = _depth_uncertainty(rate, width)
        change = min(relative, 0.99)
        low, high = (float(v) for v in _residual(scene, law, np.array([1 - change, 1 + change])))
        volume = chamber_volume(disc=scene.disc)

        def moment(fill: float) -> float:
            return float(law.moment.pair_moment(fill_ratio=max(top - fill, fill), opposite_fill_ratio=fill))

        ends = law.moment.half_width(np.array([x, top - x]))
        half = min(x, top / 2)
        depth = float(draw_down_depth(flow_rate=rate[0], acceleration=_acceleration(scene)))
        return cls(
            fill_ratio=x,
            fill_ratio_uncertainty=(high - low) / 2,
            depth=depth,
            depth_uncertainty=relative * depth,
            flow_rate=float(rate[0]),
            largest_fill_ratio=top - half,
            usable_volume=(top - 2 * half) * volume,
            usable_volume_uncertainty=(high - low) * volume,
            pair_moment=moment(0.0),
            usable_pair_moment=moment(half),
            usable_pair_moment_uncertainty=math.hypot(
                (moment(min(low, top / 2)) - moment(min(high, top / 2))) / 2, *ends
            ),
        )

    def usable_moment_uncertainty(self, scene: Scene, *, law: CalibratedLaw) -> float:
        """Of the usable pair moment, with the law's own uncertainties in place of those it was found with."""
        top, x = scene.disc.max_fill_ratio, self.fill_ratio
        ends = np.hypot(*law.moment.half_width(np.array([x, top - x])))
        if self.depth_uncertainty == 0:
            return float(ends)
        relative = _depth_uncertainty(*_flow_rate(scene, law, np.array([x])))
        by_depth = math.sqrt(max(self.usable_pair_moment_uncertainty**2 - ends**2, 0.0))
        return math.hypot(by_depth * relative * self.depth / self.depth_uncertainty, ends)


def residual_fill_ratio(scene: Scene, *, law: FlowLaw) -> float:
    """Fill ratio below which gas enters the port of the driven chamber under the scene's gas pressure.

    The depth over the port, r_p - a(x), equals that of `draw_down_depth` for the flow Q = S u(x) of the law's
    running tube, g_c = omega^2 r_p; the largest such x counts, because a chamber empties from above.
    Returns: x from 0 (no gas before the chamber is empty, or no flow) to max_fill_ratio (gas at any fill).
    Raises: ValueError: a disc at rest.
    """
    return float(_residual(scene, law, np.ones(1))[0])


def residual_by_velocity(scene: Scene, *, law: FlowLaw) -> tuple[FloatArray, FloatArray]:
    """Factors of a law's velocity from 0 to 2, and the same with each: the depth goes with its power 2/5."""
    factors = np.linspace(0.0, 2.0, _FACTORS)
    return factors, _residual(scene, law, factors**0.4)


def _depth_uncertainty(rate: FloatArray, width: FloatArray) -> float:
    """Relative: that of the correlation, and of the flow to the power 2/5."""
    by_flow = 0.4 * float(width[0] / rate[0]) if rate[0] > 0 else 0.0
    return math.hypot(DRAW_DOWN_UNCERTAINTY, by_flow)


def _acceleration(scene: Scene) -> float:
    return scene.rotor.speed**2 * scene.tube.port_radius


def _flow_rate(scene: Scene, law: FlowLaw, fills: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Q of the running tube and its expanded uncertainty, m^3/s."""
    flow = law.evaluate(fill_ratio=fills, gas_pressure=scene.gas.pressure, primed=True)
    return scene.tube.area * np.maximum(flow.velocity, 0.0), scene.tube.area * flow.uncertainty


def _residual(scene: Scene, law: FlowLaw, factors: FloatArray) -> FloatArray:
    """Largest fills at which `factors` times the draw-down depth reach the liquid's depth over the port."""
    fills = np.linspace(0.0, scene.disc.max_fill_ratio, _SAMPLES)
    needed, depth = _depths(scene, law, fills)
    gas = factors[:, None] * needed - depth > 0
    last = _SAMPLES - 1 - np.argmax(gas[:, ::-1], axis=1)
    found = np.where(np.any(gas, axis=1), fills[last], 0.0)
    inside = np.any(gas, axis=1) & (last < _SAMPLES - 1)
    if not np.any(inside):
        return found
    low, step, held = fills[last[inside]], fills[1] - fills[0], factors[inside, None]
    for _ in range(_REFINEMENTS):
        places = low[:, None] + step * np.linspace(0.0, 1.0, _PIECES + 1)
        needed, depth = _depths(scene, law, np.minimum(places, fills[-1]))
        excess = held * needed - depth
        rows = np.arange(low.size)
        cell = _PIECES - 1 - np.argmax((excess > 0)[:, -2::-1], axis=1)
        above, below = excess[rows, cell], excess[rows, cell + 1]
        low, step = places[rows, cell], step / _PIECES
    found[inside] = low + step * np.where(above > below, above / (above - below), 0.0)
    # Where nothing flows, what rounding leaves over a port on the wall of a mesh is no residual.
    return np.where(found > _NOTHING, found, 0.0)


def _depths(scene: Scene, law: FlowLaw, fills: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Draw-down depth, and depth of the liquid over the port, m."""
    needed = draw_down_depth(flow_rate=_flow_rate(scene, law, fills)[0], acceleration=_acceleration(scene))
    level = surface_radius(disc=scene.disc, fill_ratio=fills)
    return needed, np.asarray(scene.tube.port_radius - level)
