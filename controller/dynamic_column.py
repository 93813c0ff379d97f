"""The liquid column in the tube of one pair: the forces on it, with gas in either chamber.

Chambers are numbered 0 (the positive side of the pair's axis) and 1; "direction" is +1 for flow out of
chamber 0 and -1 for flow out of chamber 1.  Pressures are gauge; a chamber's "level" is its liquid's pressure
at the outer wall.

A full column of length L moves by
    rho L du/dt = p_A - p_C + P_A - max(P_C, D_p) - (k + 1) rho u^2/2,
and the pressure over the hump is p_m = p_A + P_A - D_m - (alpha + k_up) rho u^2/2 - rho L_up du/dt.  Where
that would fall below the cavity pressure p_c the column tears there, and only the liquid upstream of the
hump, of length L_up, is pushed by the giving chamber:
    rho L_up du/dt = p_A - p_c + P_A - D_m - (alpha + k_up) rho u^2/2.
With a_f and a_s for the two accelerations, p_m - p_c = rho L_up (a_s - a_f): the column is full exactly where
a_f is the smaller one, so du/dt = min(a_f, a_s).  It is continuous across the change, and where it vanishes
u is the smaller of the quasi-steady velocities, as in the flow law.  The cavity is taken to open and close at
once; its liquid belongs to the term "liquid held in the tube".
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ringbalance.controller.dynamic_table import ScalarTable, line
from ringbalance.reduced_model.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.flow_law import FlowLaw
from ringbalance.reduced_model.hermite import HermiteTable
from ringbalance.reduced_model.paper_law import PaperLaw
from ringbalance.scene.models import Tube

SLOWEST = 1e-150
"""m/s, below which the tube's loss is nothing."""


@dataclass(frozen=True, kw_only=True)
class Steady:
    """What the flow law says of given fills and pressures."""

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
    hump_position: float
    """Share of the path, from chamber 0, at which the hump lies."""
    level: Callable[[float], float]
    """P(x), Pa."""
    head: ScalarTable
    """ln((k + 1) u^2/2) over ln u."""
    hump_heads: tuple[ScalarTable, ScalarTable] | None
    """ln((alpha + k_up) u^2/2) over ln u for flow out of chamber 0 and out of chamber 1; None: no hump."""
    port_pressure: float
    """D_p, Pa."""
    hump_pressure: float
    """D_m, Pa; not read without a hump."""
    vapour_pressure: float
    """Gauge, Pa."""
    trapped: bool
    """Whether the gas over the hump must be pushed out at the receiving port."""
    one_way: bool
    """Whether liquid leaves only a chamber that has gas, as in the paper's Eq. 19."""
    gas_off: float
    """Gauge, Pa, at or below which a chamber counts as without gas in a tube without a hump."""

    def steady(self, fills: tuple[float, float], gases: tuple[float, float], *, primed: bool) -> Steady:
        """Velocity without inertia.

        Args:
            fills: x of chambers 0 and 1.
            gases: gauge, Pa, in chambers 0 and 1.
            primed: whether the tube holds a continuous column beforehand.

        Returns:
            Steady.

        Source: `ringbalance.reduced_model.directed_flow`, with gas in both chambers.
        """
        forward = self._directed(fills, gases, 1, primed)
        if forward.velocity > 0:
            return forward
        backward = self._directed(fills[::-1], gases[::-1], -1, primed)
        if backward.velocity > 0:
            return Steady(velocity=-backward.velocity, separated=backward.separated, primed=backward.primed)
        return forward

    def _directed(
        self, fills: tuple[float, float], gases: tuple[float, float], direction: int, primed: bool
    ) -> Steady:
        surplus, margin, level, back_level = self._pressures(fills, gases)
        allowed = self._allowed(gases, primed)
        flows = allowed and level >= self.port_pressure and surplus > 0
        if self.hump_heads is None:
            u = self._velocity(self.head, surplus) if flows else 0.0
            return Steady(
                velocity=u, separated=False, primed=flows or (primed and allowed and not self.one_way)
            )
        push = max(back_level - self.port_pressure, 0.0) if self.trapped else 0.0
        starts = gases[0] - gases[1] + level - self.hump_pressure - push > 0
        rests = primed and surplus == 0 and margin > 0 and level >= self.port_pressure
        if not (flows and (primed or starts) and margin > 0):
            return Steady(velocity=0.0, separated=False, primed=rests)
        siphon = self._velocity(self.head, surplus)
        torn = self._velocity(self.hump_heads[direction < 0], margin)
        separated = torn < siphon
        column = not (separated and back_level < self.port_pressure)
        return Steady(velocity=min(siphon, torn), separated=separated, primed=column)

    def _allowed(self, gases: tuple[float, float], primed: bool) -> bool:
        """Without a hump liquid flows only while there is gas; back against it only in a full tube."""
        if self.one_way:
            return gases[0] > self.gas_off
        return self.hump_heads is not None or gases[0] > self.gas_off or (gases[1] > self.gas_off and primed)

    def _pressures(
        self, fills: tuple[float, float], gases: tuple[float, float]
    ) -> tuple[float, float, float, float]:
        """Surplus of the full column, margin over the hump, level and back level; Pa."""
        level, back_level = self.level(fills[0]), self.level(fills[1])
        surplus = gases[0] - gases[1] + level - max(back_level, self.port_pressure)
        cavity = gases[1] if back_level < self.port_pressure else self.vapour_pressure
        return surplus, gases[0] - cavity + level - self.hump_pressure, level, back_level

    def _velocity(self, table: ScalarTable, pressure: float) -> float:
        return math.exp(table.inverse(math.log(pressure / self.density)))

    def acceleration(
        self, fills: tuple[float, float], gases: tuple[float, float], *, speed: float, direction: int
    ) -> float:
        """Acceleration of a moving column along its own direction, min(a_f, a_s).

        Args:
            fills: x of chambers 0 and 1.
            gases: gauge, Pa, in chambers 0 and 1.
            speed: u along the direction, m/s, at least zero.
            direction: +1 or -1.

        Returns:
            m/s^2.

        Source: momentum of the column, full or torn at the hump; the module's text.
        """
        if direction < 0:
            fills, gases = fills[::-1], gases[::-1]
        return min(self._accelerations(fills, gases, speed, direction))

    def _accelerations(
        self, fills: tuple[float, float], gases: tuple[float, float], speed: float, direction: int
    ) -> tuple[float, float]:
        """Of the full column and of the torn one; fills and gases of the giving chamber first."""
        surplus, margin, _, _ = self._pressures(fills, gases)
        slow = speed < SLOWEST
        log_speed = 0.0 if slow else math.log(speed)
        loss = 0.0 if slow else math.exp(self.head(log_speed))
        full = (surplus / self.density - loss) / self.length
        if self.hump_heads is None:
            return full, math.inf
        share = self.hump_position if direction > 0 else 1 - self.hump_position
        loss = 0.0 if slow else math.exp(self.hump_heads[direction < 0](log_speed))
        return full, (margin / self.density - loss) / (share * self.length)

    def separated(
        self, fills: tuple[float, float], gases: tuple[float, float], *, speed: float, direction: int
    ) -> bool:
        """Whether a moving column is torn at the hump.

        Args:
            fills: x of chambers 0 and 1.
            gases: gauge, Pa, in chambers 0 and 1.
            speed: u along the direction, m/s, at least zero.
            direction: +1 or -1.

        Returns:
            True where a_s < a_f.
        """
        if direction < 0:
            fills, gases = fills[::-1], gases[::-1]
        full, torn = self._accelerations(fills, gases, speed, direction)
        return torn < full

    def open_to_gas(self, fills: tuple[float, float], gases: tuple[float, float], *, direction: int) -> bool:
        """Whether nothing but gas can leave the giving chamber.

        Args:
            fills: x of chambers 0 and 1.
            gases: gauge, Pa, in chambers 0 and 1.
            direction: +1 or -1.

        Returns:
            True when its level has left the port, or flow is ruled out without gas.
        """
        if direction < 0:
            fills, gases = fills[::-1], gases[::-1]
        return self.level(fills[0]) < self.port_pressure or not self._allowed(gases, True)


def column_of(*, law: FlowLaw, tube: Tube, gas_off: float = 0.0) -> Column | None:
    """The column that a flow law describes.

    Args:
        law: the law.
        tube: the scene's tube, for its length and the place of its hump.
        gas_off: gauge, Pa, at or below which a chamber counts as without gas; for a tube without a hump.

    Returns:
        Column; None for a law that gives velocities and no forces.
    """
    if isinstance(law, CalibratedLaw):
        return _calibrated(law, tube, gas_off)
    return _paper(law, tube, gas_off) if isinstance(law, PaperLaw) else None


def _calibrated(law: CalibratedLaw, tube: Tube, gas_off: float) -> Column:
    ahead, back = law.heads.hump_head, law.heads.return_hump_head
    humped = law.path.hump_pressure is not None and ahead is not None and back is not None
    level = ScalarTable(law.wall_pressure)
    return Column(
        density=law.density,
        length=tube.length,
        hump_position=tube.hump_position,
        level=lambda x: max(level(x), 0.0),
        head=ScalarTable(law.heads.head),
        hump_heads=(ScalarTable(ahead), ScalarTable(back)) if humped and ahead and back else None,
        port_pressure=law.path.port_pressure,
        hump_pressure=law.path.hump_pressure or 0.0,
        vapour_pressure=law.path.vapour_pressure,
        trapped=law.path.trapped,
        one_way=False,
        gas_off=gas_off,
    )


def _paper(law: PaperLaw, tube: Tube, gas_off: float) -> Column:
    return Column(
        density=law.density,
        length=tube.length,
        hump_position=tube.hump_position,
        level=line(at_zero=0.0, slope=law.pressure_per_fill_difference),
        head=_constant_drag(law.drag_coefficient),
        hump_heads=None,
        port_pressure=0.0,
        hump_pressure=0.0,
        vapour_pressure=0.0,
        trapped=False,
        one_way=True,
        gas_off=gas_off,
    )


def _constant_drag(drag_coefficient: float) -> ScalarTable:
    """ln((k + 1) u^2/2), straight in ln u."""
    value = np.log((drag_coefficient + 1) / 2) + 2 * np.array([-1.0, 1.0])
    straight = HermiteTable(start=-1.0, step=2.0, value=value, slope=np.full(2, 2.0), curvature=np.zeros(2))
    return ScalarTable(straight)
