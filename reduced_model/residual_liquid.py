"""What keeps a chamber from being emptied, gas in its port or too little, and whether a full one holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.tube.draw_down import port_depth
from ringbalance.reduced_model.fill_limits import NEARLY_EMPTY, drawn_fill, first_gas, first_stalled
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.tube.flow import column_pressure, tube_path
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import half_widths

FACTOR: Final = "draw_down_factor"
"""The scene's factor on the depth of `port_depth`, an uncertain input as any other."""
_PLACES: Final = 257
"""Of a scan of a single row, for which a long one costs little."""


@dataclass(frozen=True, kw_only=True)
class ResidualLiquid:
    """Limits of a pair's transfer under the scene's gas pressure; uncertainties are expanded (95 %).

    Those of the least fill, and of what follows from it, stand in the calibration's budgets.
    """

    fill_ratio: float
    """Of the driven chamber, at which gas enters its port."""
    fill_ratio_uncertainty: float
    depth: float
    """Of the liquid over the port then, m."""
    depth_uncertainty: float
    flow_rate: float
    """Through the tube then, m^3/s."""
    stalled_fill_ratio: float
    """Of the driven chamber, at which an injection moves no liquid any more."""
    least_fill_ratio: float
    """To which injections can bring a chamber: the larger one of both, at most equal fills."""
    largest_fill_ratio: float
    """That the opposite chamber reaches then."""
    usable_volume: float
    """That a pair can move from one chamber to the other, m^3."""
    pair_moment: float
    """Largest moment of a pair with one chamber empty, by geometry, kg m."""
    usable_pair_moment: float
    """Largest moment of a pair to which injections can bring it, kg m."""
    reach: float
    """Largest unbalance that all pairs together cancel in whatever direction it lies, kg m."""
    reach_share: float
    """The same over the usable moment of a pair."""

    @property
    def limited_by(self) -> Literal["draw_down", "gas_pressure", "nothing"]:
        """What keeps a chamber from being emptied: gas in its port, or gas that drives no liquid any more."""
        if self.least_fill_ratio == 0:
            return "nothing"
        return "gas_pressure" if self.stalled_fill_ratio > self.fill_ratio else "draw_down"

    @classmethod
    def of(cls, scene: Scene, *, law: CalibratedLaw) -> ResidualLiquid:
        """Residual fill with its uncertainty, stall, and the volume and the moments that both leave.

        Uncertainty of the residual fill: that of the depth, and of the velocity through it.
        """
        top, x = scene.disc.max_fill_ratio, residual_fill_ratio(scene, law=law)
        rate, width = (float(v[0]) for v in _flow_rate(scene, law, np.array([x])))
        stated = half_widths(scene).get(FACTOR, 0.0) / scene.tube.draw_down_factor
        relative = math.hypot(stated, _by_flow(scene, rate, width))
        change = min(relative, 0.99)
        low, high = _residual_fills(scene, law, [1 - change, 1 + change]).tolist()
        stalled = stalled_fill_ratio(law=law, total=top, gas_pressure=scene.gas.pressure)
        least = min(max(x, stalled), top / 2)
        usable, share = (
            _pair_moment(law, top, least),
            reach_share(scene.disc.chambers),
        )
        depth = float(port_depth(scene, flow_rate=rate))
        return cls(
            fill_ratio=x,
            fill_ratio_uncertainty=(high - low) / 2,
            depth=depth,
            depth_uncertainty=relative * depth,
            flow_rate=rate,
            stalled_fill_ratio=stalled,
            least_fill_ratio=least,
            largest_fill_ratio=top - least,
            usable_volume=(top - 2 * least) * chamber_volume(disc=scene.disc),
            pair_moment=_pair_moment(law, top, 0.0),
            usable_pair_moment=usable,
            reach=share * usable,
            reach_share=share,
        )


def reach_share(chambers: int) -> float:
    """Smallest radius of what n pairs cancel together, over what one does along its axis: cot(pi/(2 n)).

    Each of n pairs, pi/n apart, gives a moment between -U and U along its axis: together a regular polygon of
    2 n sides, U/sin(pi/(2 n)) to its corners and U cot(pi/(2 n)) to its sides: U with four chambers,
    1.73 U with six, as a chamber that has nothing to give leaves its share to other pairs.
    Source: elementary geometry (a sum of segments is a zonotope).
    """
    return 1 / math.tan(math.pi / chambers)


def residual_fill_ratio(scene: Scene, *, law: FlowLaw) -> float:
    """Fill ratio below which gas enters the port of the driven chamber under the scene's gas pressure.

    Raises: ValueError: a disc at rest.
    """
    return float(_residual_fills(scene, law, [1.0])[0])


def _residual_fills(scene: Scene, law: FlowLaw, depths: Sequence[float]) -> FloatArray:
    """The same with factors of the draw-down depth, shape (n,)."""
    factor = np.asarray(depths)

    def drawn(rows: IntArray, fills: FloatArray) -> FloatArray:
        rate = _flow_rate(scene, law, fills)[0]
        return drawn_fill(scene, flow_rate=rate, factor=factor[rows])

    return first_gas(scene, drawn, top=np.full(factor.shape, scene.disc.max_fill_ratio))


def stalled_fill_ratio(*, law: FlowLaw, total: float, gas_pressure: float, runs: bool = False) -> float:
    """Fill ratio at which an injection moves no liquid any more; total/2 where it moves none at equal fills.

    An injection starts with what the tube holds while the gas is off. Over a crest where no column holds
    that is p_gas = rho omega^2 (a^2 - r_m^2)/2 with vented gas, of a full siphon that of `stall_pressure`. A
    long injection whose flow has carried the gas off the crest goes on to a lower fill, from which no
    injection could correct any further.
    Args: `runs`: of that flow instead.
    """

    def moves(_: IntArray, fills: FloatArray) -> BoolArray:
        opposite = total - fills
        rest = law.evaluate(fill_ratio=fills, opposite_fill_ratio=opposite, gas_pressure=0.0, primed=True)
        flow = law.evaluate(
            fill_ratio=fills,
            opposite_fill_ratio=opposite,
            gas_pressure=gas_pressure,
            primed=runs or rest.primed,
        )
        return flow.velocity > 0

    lowest = max(0.0, total - law.max_fill_ratio)
    end = np.array([max(lowest, NEARLY_EMPTY * total)])
    stalled = float(first_stalled(moves, start=np.array([total / 2]), end=end, places=_PLACES)[0])
    return lowest if math.isnan(stalled) else stalled


def _pair_moment(law: CalibratedLaw, total: float, fill: float) -> float:
    return float(law.moment.pair_moment(fill_ratio=max(total - fill, fill), opposite_fill_ratio=fill))


def _by_flow(scene: Scene, rate: float, width: float) -> float:
    """Relative change of the depth over the port by a half-width of the flow."""
    low, here, high = port_depth(scene, flow_rate=np.array([max(rate - width, 0.0), rate, rate + width]))
    return float((high - low) / (2 * here)) if rate > 0 else 0.0


def _flow_rate(scene: Scene, law: FlowLaw, fills: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Q of the running tube and its expanded uncertainty, m^3/s."""
    flow = law.evaluate(fill_ratio=fills, gas_pressure=scene.gas.pressure, primed=True)
    return scene.tube.area * np.maximum(flow.velocity, 0.0), scene.tube.area * flow.uncertainty


@dataclass(frozen=True, kw_only=True)
class Holding:
    """What becomes of the fullest chamber's liquid with the gas off, by the pressure of a cavity over the
    crest: vapour alone is sure to be reached, and runs of nominal parts take `TubePath.released`.
    """

    sure_speed: float | None
    """Lowest speed at which it stays whatever that pressure, rad/s; None: not even at the scene's."""
    likely_speed: float | None
    """Lowest speed at which it stays under the pressure that runs take, likewise."""
    hump_radius: float | None
    """Of the scene's crest, m; None without one."""
    largest_hump_radius: float | None
    """Of a crest that holds it whatever the pressure of a cavity there, m; None: no crest does."""

    @classmethod
    def of(cls, scene: Scene, *, fill_ratio: float) -> Holding:
        """By hydrostatics, gravity left out. Args: `fill_ratio`: the largest that runs reach."""
        path, wall, speed = tube_path(scene), scene.disc.outer_radius, scene.rotor.speed
        fullest = float(
            surface_radius(disc=scene.disc, fill_ratio=min(fill_ratio, scene.disc.max_fill_ratio))
        )
        level = column_pressure(scene=scene, radius=fullest)
        pull = scene.liquid.density * speed**2 / 2
        sure = path.holding_pressure(level) - level
        square = wall**2 - (level + sure) / pull if pull > 0 else 0.0

        def lowest(tension: float) -> float | None:
            """The column parts under a tension D_m - P, and D_m - P grows with the square of the speed."""
            here = path.column_pressure - level
            if not path.crest or here < tension:
                return None
            return speed * math.sqrt(tension / here) if tension > 0 else 0.0

        return cls(
            sure_speed=lowest(sure),
            likely_speed=lowest(path.column_pressure - path.return_pressure),
            hump_radius=scene.tube.hump_radius,
            largest_hump_radius=math.sqrt(square) if square > 0 else None,
        )

    @property
    def holds(self) -> bool:
        """Whether it is sure to stay there."""
        return self.sure_speed is not None

    @property
    def finding(self) -> Finding | None:
        """That a correction does not or may not last, and the crest that holds it; None where it is sure."""
        if self.holds:
            return None
        if self.largest_hump_radius is None:
            return Finding(code="no_crest_holds")
        # Rounded down to a tenth of a millimetre: a crest there holds.
        crest = math.floor(1e4 * self.largest_hump_radius * (1 + 1e-12)) / 1e4
        code = "no_crest" if self.hump_radius is None else "crest_too_low"
        return Finding(
            code="crest_undecided" if self.likely_speed is not None else code,
            values={"crest_radius": self.hump_radius, "largest_crest_radius": crest},
            change={"tube.hump_radius": crest},
        )
