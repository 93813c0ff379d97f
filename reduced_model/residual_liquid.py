"""Limits of emptying a chamber (gas in its port, or stalling) and of holding a full one with the gas off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model.fill_limits import NEARLY_EMPTY, drawn_fill, first_gas, first_stalled
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.tube.flow import column_pressure, tube_path
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.models import Scene

_SCAN_POINTS: Final = 257
"""Number of fills in the scan of a single row, which is cheap."""


def residual_fill_ratio(scene: Scene, *, law: FlowLaw) -> float:
    """Fill ratio below which gas enters the port of the driven chamber under the scene's gas pressure.

    Raises: ValueError: a disc at rest.
    """

    def draws_down_to(_: IntArray, fills: FloatArray) -> FloatArray:
        flow = law.evaluate(fill_ratio=fills, gas_pressure=applied_pressure(scene.gas), primed=True)
        return drawn_fill(scene, flow_rate=scene.tube.area * np.maximum(flow.velocity, 0.0))

    return float(first_gas(scene, draws_down_to, top=np.array([scene.disc.max_fill_ratio]))[0])


def stalled_fill_ratio(*, law: FlowLaw, total: float, gas_pressure: float, runs: bool = False) -> float:
    """Fill ratio at which an injection moves no liquid any more, of one pair: see `stalled_fill_ratios`."""
    totals = np.array([total])
    return float(stalled_fill_ratios(law=law, totals=totals, gas_pressure=gas_pressure, runs=runs)[0])


def stalled_fill_ratios(
    *, law: FlowLaw, totals: FloatArray, gas_pressure: float, runs: bool = False
) -> FloatArray:
    """Fill ratios at which an injection moves no liquid any more, for pairs with totals of shape (n,); half
    of the total where it moves none at equal fills.

    An injection starts with the liquid that the tube holds while the gas is off. Without a column over the
    crest the limit is p_gas = rho omega^2 (a^2 - r_m^2)/2 with vented gas; for a full siphon it is that of
    `stall_pressure`. A long injection whose flow has carried the gas off the crest reaches a lower fill, from
    which no injection could correct any further.
    Args: `runs`: true for the fill that such a long injection reaches.
    """

    def moves(rows: IntArray, fills: FloatArray) -> BoolArray:
        opposite = totals[rows] - fills
        rest = law.evaluate(fill_ratio=fills, opposite_fill_ratio=opposite, gas_pressure=0.0, primed=True)
        flow = law.evaluate(
            fill_ratio=fills,
            opposite_fill_ratio=opposite,
            gas_pressure=gas_pressure,
            primed=runs or rest.primed,
        )
        return flow.velocity > 0

    lowest = np.maximum(0.0, totals - law.max_fill_ratio)
    end = np.maximum(lowest, NEARLY_EMPTY * totals)
    stalled = first_stalled(moves, start=totals / 2, end=end, points=_SCAN_POINTS)
    return np.where(np.isnan(stalled), lowest, stalled)


@dataclass(frozen=True, kw_only=True)
class Holding:
    """Stability of the fullest chamber's liquid, gas off: it stays if the column over the crest parts.

    It parts for certain only where its pressure would fall below that of vapour alone; runs with nominal
    parts assume a cavity at the pressure by `TubePath.released`.
    """

    sure_speed: float | None
    """Lowest speed at which the liquid stays at any cavity pressure, rad/s; None: not even at the scene's."""
    likely_speed: float | None
    """Lowest speed at which the liquid stays at the cavity pressure of runs, rad/s; None: not even at the
    scene's."""
    hump_radius: float | None
    """Radius of the scene's crest, m; None without one."""
    largest_hump_radius: float | None
    """Largest crest radius that holds the liquid at any cavity pressure, m; None: no radius does."""

    @classmethod
    def of(cls, scene: Scene, *, fill_ratio: float) -> Holding:
        """Judge by hydrostatics without gravity. Args: `fill_ratio`: the largest that runs reach."""
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
            at_speed = path.column_pressure - level
            if not path.crest or at_speed < tension:
                return None
            return speed * math.sqrt(tension / at_speed) if tension > 0 else 0.0

        return cls(
            sure_speed=lowest(sure),
            likely_speed=lowest(path.column_pressure - path.return_pressure),
            hump_radius=scene.tube.hump_radius,
            largest_hump_radius=math.sqrt(square) if square > 0 else None,
        )

    @property
    def holds(self) -> bool:
        """True if the liquid is sure to stay in the fullest chamber."""
        return self.sure_speed is not None

    @property
    def finding(self) -> Finding | None:
        """Warning that a correction may not last, with the crest that holds it; None: it lasts."""
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
