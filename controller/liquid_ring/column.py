"""The liquid column in the tube of one pair: the forces on it, with gas in either chamber.

Chambers are numbered 0 (the positive side of the pair's axis) and 1; "direction" is +1 for flow out of
chamber 0 and -1 for flow out of chamber 1.  Pressures are gauge, and named as in `reduced_model.tube_regime`.

A full column of length L moves by
    rho L du/dt = p_d - (k + 1) rho u^2/2,
p_d the driving pressure, and its crest pressure is
    p_m = p_A + P_A - D_m - (alpha + k_up) rho u^2/2 - rho L_up du/dt.
Where that would fall below the cavity pressure p_c the column separates there, and only the liquid upstream
of the crest, of length L_up, is accelerated by the upstream chamber:
    rho L_up du/dt = p_A - p_c + P_A - D_m - (alpha + k_up) rho u^2/2.
With a_f and a_s for the two accelerations, p_m - p_c = rho L_up (a_s - a_f): the column is full exactly where
a_f is the smaller one, so du/dt = min(a_f, a_s).  It is continuous across the change, and where it vanishes
u is the smaller of the quasi-steady velocities, as in the flow law.  The cavity is taken to open and close at
once; its liquid belongs to the term "liquid held in the tube".
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.tables.hermite import HermiteTable
from ringbalance.reduced_model.tube.path import crest_span
from ringbalance.reduced_model.tube.regime import SiphonCrest, Truth, TubeEnds, column_flow
from ringbalance.scene.models import Tube

_SLOWEST: Final = 1e-150
"""m/s, below which the tube's loss is neglected."""
_NEWTON_STEPS: Final = 5


class _ScalarTable:
    """A `HermiteTable` read one number at a time, without arrays; it continues straight beyond its ends."""

    def __init__(self, table: HermiteTable) -> None:
        """Work the pieces' coefficients out once."""
        self.start = float(table.start)
        self.step = float(table.step)
        self.values: list[float] = table.value.tolist()
        pieces = table.coefficients
        self.cells: list[tuple[float, ...]] = list(zip(*(c.tolist() for c in pieces), strict=True))

    def __call__(self, x: float) -> float:
        """Value at any x."""
        place = (x - self.start) / self.step
        cell = min(max(int(place), 0), len(self.cells) - 1)
        t = place - cell
        c0, c1, c2, c3, c4, c5 = self.cells[cell]
        if 0.0 <= t <= 1.0:
            return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
        held = 0.0 if t < 0.0 else 1.0
        slope = c1 + held * (2 * c2 + held * (3 * c3 + held * (4 * c4 + held * 5 * c5)))
        inside = c0 + held * (c1 + held * (c2 + held * (c3 + held * (c4 + held * c5))))
        return inside + (t - held) * slope

    def inverse(self, y: float) -> float:
        """The x of a value, to round-off, for a table that grows from node to node."""
        cell = min(max(bisect_left(self.values, y) - 1, 0), len(self.cells) - 1)
        c0, c1, c2, c3, c4, c5 = self.cells[cell]
        low = self.values[cell]
        t = min(max((y - low) / (self.values[cell + 1] - low), 0.0), 1.0)
        found, slope = c0, c1
        for step in range(_NEWTON_STEPS + 1):
            found = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
            slope = c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5)))
            if step < _NEWTON_STEPS:
                t = min(max(t + (y - found) / slope, 0.0), 1.0)
        return self.start + self.step * (cell + t + (y - found) / slope)


@dataclass(frozen=True, kw_only=True)
class Steady:
    """Quasi-steady flow at given fills and pressures."""

    velocity: float
    """m/s, positive out of chamber 0."""
    separated: bool
    primed: bool
    """Whether the tube holds a continuous column afterwards."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """Forces on the liquid in one tube, number by number, from a law's own tables."""

    density: float
    """rho, kg/m^3."""
    length: float
    """L, m."""
    crest_ends: tuple[float, float]
    """Fraction of the path to the end of the crest's arc, for flow out of chamber 0 and out of chamber 1."""
    hydrostatic: Callable[[float], float]
    """P(x), Pa."""
    head: _ScalarTable
    """ln((k + 1) u^2/2) over ln u."""
    hump_heads: tuple[_ScalarTable, _ScalarTable] | None
    """ln((alpha + k_up) u^2/2) over ln u for flow out of chamber 0 and out of chamber 1; None: no crest."""
    port_pressure: float
    """D_p, Pa."""
    crest: SiphonCrest[float] | None
    """None together with `hump_heads`."""
    one_way: bool
    """Whether liquid leaves only a chamber that has gas, as in the paper's Eq. 19."""
    gas_off: float
    """Gauge, Pa, at or below which a chamber counts as without gas in a tube without a crest."""
    gas_factor: float = 1.0
    """Gas pressure on the liquid over the one at the place of measurement, which all arguments are."""

    def steady(self, fills: tuple[float, float], gases: tuple[float, float], *, primed: bool) -> Steady:
        """Velocity without inertia, from fill ratios and gauge pressures (Pa) of chambers 0 and 1."""
        ends = self._ends(fills, gases)
        forward = self._directed(ends, 1, primed)
        if forward.velocity > 0:
            return forward
        backward = self._directed(ends.reversed(), -1, primed)
        if backward.velocity > 0:
            return Steady(velocity=-backward.velocity, separated=backward.separated, primed=backward.primed)
        return forward

    def _ends(
        self, fills: tuple[float, float], gases: tuple[float, float], direction: int = 1
    ) -> TubeEnds[float]:
        ends = TubeEnds(
            upstream_gas=self.gas_factor * gases[0],
            downstream_gas=self.gas_factor * gases[1],
            upstream_hydrostatic=self.hydrostatic(fills[0]),
            downstream_hydrostatic=self.hydrostatic(fills[1]),
            port_pressure=self.port_pressure,
        )
        return ends if direction > 0 else ends.reversed()

    def _directed(self, ends: TubeEnds[float], direction: int, primed: bool) -> Steady:
        flow = column_flow(
            ends=ends,
            crest=self.crest,
            primed=primed and not self.one_way,
            allowed=self._allowed(ends, primed),
            siphon=partial(self._velocity, self.head),
            separation=partial(self._velocity, self._separation_head(direction)),
        )
        return Steady(velocity=flow.velocity, separated=bool(flow.separated), primed=bool(flow.primed))

    def _separation_head(self, direction: int) -> _ScalarTable:
        return self.head if self.hump_heads is None else self.hump_heads[direction < 0]

    def _allowed(self, ends: TubeEnds[float], primed: bool) -> bool:
        """Without a crest liquid flows only while there is gas; back against it only in a primed tube."""
        if self.one_way:
            return ends.upstream_gas > self.gas_off
        against = ends.downstream_gas > self.gas_off and primed
        return self.crest is not None or ends.upstream_gas > self.gas_off or against

    def _velocity(self, table: _ScalarTable, pressure: float, where: Truth) -> float:
        return math.exp(table.inverse(math.log(pressure / self.density))) if where else 0.0

    def acceleration(
        self, fills: tuple[float, float], gases: tuple[float, float], *, speed: float, direction: int
    ) -> float:
        """Acceleration of a moving column along its own direction, min(a_f, a_s), m/s^2; `speed` >= 0."""
        return min(self._accelerations(self._ends(fills, gases, direction), speed, direction))

    def _accelerations(self, ends: TubeEnds[float], speed: float, direction: int) -> tuple[float, float]:
        """Of the full column and of the separated one."""
        slow = speed < _SLOWEST
        log_speed = 0.0 if slow else math.log(speed)
        loss = 0.0 if slow else math.exp(self.head(log_speed))
        full = (ends.driving_pressure() / self.density - loss) / self.length
        if self.crest is None:
            return full, math.inf
        fraction = self.crest_ends[direction < 0]
        loss = 0.0 if slow else math.exp(self._separation_head(direction)(log_speed))
        margin = self.crest.separation_margin(ends)
        return full, (margin / self.density - loss) / (fraction * self.length)

    def separated(
        self, fills: tuple[float, float], gases: tuple[float, float], *, speed: float, direction: int
    ) -> bool:
        """Whether a moving column is separated at the crest, a_s < a_f; `speed` >= 0."""
        full, separated = self._accelerations(self._ends(fills, gases, direction), speed, direction)
        return separated < full

    def open_to_gas(self, fills: tuple[float, float], gases: tuple[float, float], *, direction: int) -> bool:
        """Whether its liquid leaves the upstream chamber's port open, or flow is ruled out without gas."""
        ends = self._ends(fills, gases, direction)
        return not (ends.upstream_covered() and self._allowed(ends, True))


def column_of(*, law: FlowLaw, tube: Tube, gas_off: float = 0.0) -> Column | None:
    """The column that a flow law describes; None for a law that gives velocities and no forces."""
    if isinstance(law, CalibratedLaw):
        return _calibrated(law, tube, gas_off)
    return _paper(law, tube, gas_off) if isinstance(law, PaperLaw) else None


def _calibrated(law: CalibratedLaw, tube: Tube, gas_off: float) -> Column:
    ahead, back = law.heads.hump_head, law.heads.return_hump_head
    tables = (_ScalarTable(ahead), _ScalarTable(back)) if ahead and back and law.path.crest else None
    hydrostatic = _ScalarTable(law.wall_pressure)
    return Column(
        density=law.density,
        length=tube.length,
        crest_ends=(crest_span(tube)[1], 1 - crest_span(tube)[0]),
        hydrostatic=lambda x: max(hydrostatic(x), 0.0),
        head=_ScalarTable(law.heads.head),
        hump_heads=tables,
        port_pressure=law.path.port_pressure,
        crest=law.path.crest if tables else None,
        one_way=False,
        gas_off=gas_off,
        gas_factor=law.gas_factor,
    )


def _paper(law: PaperLaw, tube: Tube, gas_off: float) -> Column:
    return Column(
        density=law.density,
        length=tube.length,
        crest_ends=(1.0, 1.0),
        hydrostatic=lambda x: law.pressure_per_fill_difference * x,
        head=_constant_drag(law.drag_coefficient),
        hump_heads=None,
        port_pressure=0.0,
        crest=None,
        one_way=True,
        gas_off=gas_off,
    )


def _constant_drag(drag_coefficient: float) -> _ScalarTable:
    """ln((k + 1) u^2/2), straight in ln u."""
    value = np.log((drag_coefficient + 1) / 2) + 2 * np.array([-1.0, 1.0])
    straight = HermiteTable(start=-1.0, step=2.0, value=value, slope=np.full(2, 2.0), curvature=np.zeros(2))
    return _ScalarTable(straight)
