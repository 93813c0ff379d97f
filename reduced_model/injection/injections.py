"""One injection into a pair at rest, by the march: the shortest that is sure, and one that moves an amount.

**Shortest.**  Nothing flows before the gas has filled the chamber up to the pressure that starts the flow and
lifted the liquid to the crest, and until the tube is primed liquid at most spills.  A valve that shuts then
leaves a primed column, which runs until the chamber has vented: this amount is the smallest that can be
relied upon; what spills before is less, and depends on every millisecond.

**Dead time.**  Valve-open time that an injection loses against the steady velocity: T - s/u0 where an opening
T moves the column by s.  A controller that counts on the steady velocity adds it to every valve-open time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from scipy.optimize import brentq

from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.injection.pair import Motion, PairState, Passage, opened, pass_time
from ringbalance.reduced_model.injection.records import Event
from ringbalance.reduced_model.law.model import BalancerModel

_RELATIVE_ERROR: Final = 1e-7
"""Allowed to one step: an amount is then right to 1e-5 of it."""
_TAIL: Final = 10.0
"""s after a valve has closed: the gas has vented and the liquid rests."""
_TIME_ERROR: Final = 1e-6
"""s, of a valve-open time."""
_DOUBLINGS: Final = 12
"""Of the time by which an opening may be longer than the steady velocity has it."""
_RUN_BACK: Final = 0.01
"""Part of what an injection has moved that may run back as its column swings out."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Injections:
    """Injections into one chamber of a pair at rest, its tube not primed, timed from the valve's opening."""

    dynamics: Dynamics
    pair: PairState
    chamber: int
    """0 or 1: the driven one."""
    steady: float
    """Fill ratio that leaves the driven chamber per second by a primed column under the supply's gas, 1/s."""

    @classmethod
    def of(
        cls, dynamics: Dynamics, model: BalancerModel, *, fill: float, total: float, chamber: int = 0
    ) -> Injections:
        """Into the chamber of a pair that has a fill ratio."""
        flow = model.flow.evaluate(
            fill_ratio=fill,
            opposite_fill_ratio=total - fill,
            gas_pressure=dynamics.gas_pressure,
            primed=True,
        )
        return cls(
            dynamics=replace(dynamics, valve_lag=0.0, relative_error=_RELATIVE_ERROR),
            pair=PairState(fill=total - fill if chamber else fill, total=total),
            chamber=chamber,
            steady=float(flow.velocity) * model.tube_area / model.chamber_volume,
        )

    def _passed(self, opening: float, until: float) -> Passage:
        valve = opened(self.dynamics, chamber=self.chamber, duration=opening)
        return pass_time(
            self.dynamics,
            replace(self.pair, motion=Motion(pending=valve)),
            instants=np.array([until]),
        )

    @cached_property
    def shortest(self) -> float | None:
        """Valve-open time that just primes the tube, s; None where the gas starts no flow.

        Where the tube is never primed, the time in which the chamber fills and liquid has passed the crest.
        """
        path = self._passed(2 * _TAIL, _TAIL)
        blocked = path.motion.record.event is Event.BLOCKED or path.fill == self.pair.fill
        if blocked or self.steady <= 0:
            return None
        if path.filled is not None:
            return path.filled
        return max(self._filling_time, self._arrival)

    @property
    def _filling_time(self) -> float:
        """Of the driven chamber without flow, s."""
        line, supply = self.dynamics.line, self.dynamics.gas_pressure + self.dynamics.ambient_pressure
        fill = self.pair.opposite_fill if self.chamber else self.pair.fill
        volume = (1 - fill) * self.dynamics.chamber_volume + self.dynamics.dead_volume
        return 0.0 if line is None else float(line.filling_time(supply, volume=volume))

    @property
    def _arrival(self) -> float:
        """When lifted liquid reaches the end of the crest under a valve that stays open, s."""
        if self.dynamics.lift is None:
            return 0.0
        early, late = 0.0, _TAIL
        while late - early > _TIME_ERROR:
            middle = (early + late) / 2
            _, place, side = self._passed(2 * _TAIL, middle).motion.lifted
            if side != 0 and place >= self.dynamics.column.crest_ends[self.chamber]:
                late = middle
            else:
                early = middle
        return late

    def moved(self, opening: float) -> float:
        """Fill ratio that has left the driven chamber when all is at rest after an opening, s."""
        end = self._passed(opening, opening + _TAIL)
        return end.fill - self.pair.fill if self.chamber else self.pair.fill - end.fill

    def opening(self, amount: float, *, least: float) -> float:
        """Valve-open time, s, that moves a fill ratio; at least `least`, infinite where none does."""
        if self.moved(least) >= amount:
            return least
        longest, more = least + amount / self.steady, 0.05
        for _ in range(_DOUBLINGS):
            if self.moved(longest + more) >= amount:
                break
            more *= 2.0
        else:
            return np.inf
        return float(brentq(lambda time: self.moved(time) - amount, least, longest + more, xtol=_TIME_ERROR))

    def dead_time(self, amount: float) -> float | None:
        """Of the injection that moves a fill ratio, or of the shortest sure one that moves more, s.

        Zero where the gas cannot move so much; None where what it has moved runs back with the valves shut.
        """
        if self.shortest is None:
            return 0.0
        opening = self.opening(amount, least=self.shortest)
        held = opening if np.isfinite(opening) else self.shortest
        moved, back = self.moved(held), self._passed(held, held + _TAIL).ran_back
        if back > _RUN_BACK * (abs(moved) + back):
            return None
        return opening - moved / self.steady if np.isfinite(opening) else 0.0
