"""One pair of chambers with moving liquid, filling gas and late valves: its state and what moves it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from ringbalance.controller.liquid_ring.column import Column
from ringbalance.controller.liquid_ring.transfer import Event
from ringbalance.physics.gas.supply import GasLine
from ringbalance.reduced_model.law.flow_law import Regime

Two = tuple[float, float]

LEAST_GAS: Final = 1e-3
"""Share of a chamber that liquid never takes from its gas."""


@dataclass(frozen=True, kw_only=True)
class Switch:
    """A valve that has been commanded to move and has not moved yet."""

    after: float
    """s from now."""
    chamber: int
    """0 or 1."""
    opens: bool


@dataclass(frozen=True, kw_only=True)
class Record:
    """What the last command to a pair has done so far."""

    chamber: int = 0
    """0 or 1: the driven one."""
    fill: float = 0.0
    """x of the driven chamber at the command."""
    work: float = 0.0
    """Of the driven chamber's gas, integral of (p - ambient) dV, J."""
    regime_start: Regime = Regime.BLOCKED
    regime_end: Regime = Regime.BLOCKED
    event: Event = Event.BLOCKED
    closing_pressure: float = 0.0
    """Gauge, of the driven chamber's gas when its valve closed, Pa."""
    run_dry: float = 0.0
    """Time for which the valve stayed open to an empty chamber, s."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What a pair is about besides its fills."""

    velocity: float = 0.0
    """In the tube, m/s, positive out of chamber 0."""
    gases: Two = (0.0, 0.0)
    """Gauge pressure in chambers 0 and 1, Pa."""
    contents: Two | None = None
    """m R = p V/T of the gas in chambers 0 and 1, J/K; None: at ambient pressure and temperature."""
    valves: tuple[bool, bool] = (False, False)
    """Which valves are open."""
    pending: tuple[Switch, ...] = ()
    """In the order of time."""
    record: Record = field(default_factory=Record)

    @property
    def rests(self) -> bool:
        """Whether nothing moves, no gas is under pressure, and no valve is about to move."""
        return self.velocity == 0 and self.gases == (0.0, 0.0) and not any(self.valves) and not self.pending


@dataclass(frozen=True, kw_only=True, eq=False)
class Dynamics:
    """The terms of a plant that its flow law does not know."""

    column: Column
    inertia: bool
    """Whether the liquid in the tube has mass."""
    line: GasLine | None
    """Valve and line of each chamber; None: gas fills and vents at once."""
    valve_lag: float
    """s."""
    gas_pressure: float
    """Of the supply, gauge, Pa."""
    ambient_pressure: float
    """Absolute, Pa."""
    dead_volume: float
    """Between each valve and its chamber, m^3."""
    tube_area: float
    """S, m^2."""
    chamber_volume: float
    """V, m^3."""
    max_fill_ratio: float
    """Largest x of a chamber."""

    def gas_volume(self, fill: float) -> float:
        """Volume of the gas that belongs to one chamber.

        Args: `fill`: x.
        Returns: (1 - x) V, at least a thousandth of V, and the dead volume, m^3.
        """
        return max(1 - fill, LEAST_GAS) * self.chamber_volume + self.dead_volume
