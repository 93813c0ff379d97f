"""One pair of chambers: at rest, through an interval of time, and under a single injection.

**Shortest injection.**  Nothing flows before the gas has filled the chamber up to the pressure that starts
the flow and lifted the liquid to the crest, and until the tube is primed liquid at most spills.  A valve that
shuts then leaves a primed column, which runs until the chamber has vented: this amount is the smallest that
can be relied upon; what spills before is less, and depends on every millisecond.

**Dead time.**  Valve-open time that an injection loses against the steady velocity: T - s/u0 where an opening
T moves the column by s.  A controller that counts on the steady velocity adds it to every valve-open time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from ringbalance.reduced_model.injection.dynamics import EVENTS, MOTION, WORKSPACE, Dynamics, Event, Record
from ringbalance.reduced_model.injection.events import command
from ringbalance.reduced_model.injection.lift import stands
from ringbalance.reduced_model.injection.march import advance
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.arrays import FloatArray


def at_rest(plant: npt.NDArray[np.void], *, fill: float) -> npt.NDArray[np.void]:
    """Record of type `MOTION`, shape (1,), of a pair with vented chambers and a tube that is not primed.

    Args: `fill`: x of chamber 0.
    """
    constants, state = plant[0], np.zeros(1, dtype=MOTION)
    ambient, total = constants["ambient_pressure"], constants["total"]
    volumes = [
        max(1 - x, 1e-3) * constants["chamber_volume"] + constants["dead_volume"]
        for x in (fill, total - fill)
    ]
    contents = [ambient * volume / constants["temperature"] for volume in volumes]
    state["state"][0, :6] = fill, 0.0, ambient, ambient, *contents
    state["opens"], state["closes"] = math.inf, math.inf
    state["length"], state["residual"] = constants["first_step"], constants["residual"]
    state["started"], state["least_fill"] = fill, fill
    state["filled"], state["event"] = -1.0, EVENTS.index(Event.BLOCKED)
    return state


def fills_at(plant: npt.NDArray[np.void], state: npt.NDArray[np.void], instants: FloatArray) -> FloatArray:
    """Let time pass for one pair, whose record is changed.

    Args: `instants`: s from now, ascending, the last one the end.
    Returns: x of chamber 0 then, shape (m,).
    """
    notes = np.stack([instants, instants])
    advance(plant[0], state[0], float(instants[-1]), notes, 1, instants.size, np.zeros(WORKSPACE))
    total, largest = float(plant["total"][0]), float(plant["max_fill_ratio"][0])
    return np.asarray(np.clip(notes[1], max(0.0, total - largest), min(total, largest)))


_RELATIVE_ERROR: Final = 1e-7
"""Relative error allowed to one step: a moved amount is then accurate to 1e-5 of itself."""
_TAIL: Final = 10.0
"""Seconds from the closing of a valve until the gas has vented and the liquid rests."""
_TIME_ERROR_S: Final = 1e-6
"""Error of a valve-open time, s."""
_DOUBLINGS: Final = 12
"""Doublings of the time by which an opening may exceed that at the steady velocity."""
_RUN_BACK: Final = 0.01
"""Fraction of the amount moved by an injection that may run back as its column swings out."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Injections:
    """Injections into one chamber of a pair at rest, its tube not primed, timed from the valve's opening."""

    dynamics: Dynamics
    fill: float
    """x of the driven chamber."""
    total: float
    """Sum of both fill ratios."""
    chamber: int
    """0 or 1: the driven one."""
    steady: float
    """Fill ratio per second that leaves the driven chamber by a primed column under supply pressure, 1/s."""

    @classmethod
    def of(
        cls, dynamics: Dynamics, model: BalancerModel, *, fill: float, total: float, chamber: int = 0
    ) -> Injections:
        """Make injections into one chamber of a pair, from its fill ratio."""
        flow = model.flow.evaluate(
            fill_ratio=fill, opposite_fill_ratio=total - fill, gas_pressure=dynamics.gas_pressure, primed=True
        )
        return cls(
            dynamics=replace(dynamics, valve_lag=0.0, relative_error=_RELATIVE_ERROR),
            fill=fill,
            total=total,
            chamber=chamber,
            steady=float(flow.velocity) * model.tube_area / model.chamber_volume,
        )

    def _passed(self, opening: float, until: float) -> tuple[Record, float, float]:
        """Record of the pair at `until`, s from the command to open; fraction of the path up to which liquid
        stands in the tube; fill ratio that has left the driven chamber."""
        plant, before = self.dynamics.kept_plant(total=self.total), self.fill
        if self.chamber:
            before = self.total - self.fill
        state = at_rest(plant, fill=before)
        command(plant[0], state[0], self.chamber, opening)
        fills_at(plant, state, np.array([until]))
        front, fill = stands(plant[0], state[0])
        return state[0], front, fill - before if self.chamber else before - fill

    @cached_property
    def shortest(self) -> float | None:
        """Valve-open time that just primes the tube, s; None where the gas starts no flow.

        Where the tube is never primed, the time in which the chamber fills and liquid has passed the crest.
        """
        end, _, moved = self._passed(2 * _TAIL, _TAIL)
        if EVENTS[int(end["event"])] is Event.BLOCKED or moved == 0 or self.steady <= 0:
            return None
        if end["filled"] >= 0:
            # If it closed at exactly this instant, round-off would decide whether the tube is primed.
            return float(end["filled"]) + _TIME_ERROR_S
        return max(self._filling_time, self._arrival)

    @property
    def _filling_time(self) -> float:
        """Filling time of the driven chamber without flow, s."""
        line, supply = self.dynamics.line, self.dynamics.gas_pressure + self.dynamics.ambient_pressure
        volume = (1 - self.fill) * self.dynamics.chamber_volume + self.dynamics.dead_volume
        return 0.0 if line is None else float(line.filling_time(supply, volume=volume))

    @property
    def _arrival(self) -> float:
        """Time at which lifted liquid reaches the end of the crest under a valve that stays open, s."""
        if self.dynamics.lift is None:
            return 0.0
        plant, early, late = self.dynamics.kept_plant(total=self.total)[0], 0.0, _TAIL
        crest_end = plant["return_crest_end" if self.chamber else "crest_end"]
        while late - early > _TIME_ERROR_S:
            middle = (early + late) / 2
            end, front, _ = self._passed(2 * _TAIL, middle)
            if end["side"] != 0 and front >= crest_end:
                late = middle
            else:
                early = middle
        return late

    def moved(self, opening: float) -> float:
        """Fill ratio that has left the driven chamber when all is at rest after an opening, s."""
        return self._passed(opening, opening + _TAIL)[2]

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
        return float(
            brentq(lambda time: self.moved(time) - amount, least, longest + more, xtol=_TIME_ERROR_S)
        )

    def dead_time(self, amount: float) -> float | None:
        """Dead time of the injection that moves a fill ratio, or of the shortest if that moves more, s.

        Zero where the gas cannot move so much; None where the moved liquid runs back with the valves closed.
        """
        if self.shortest is None:
            return 0.0
        opening = self.opening(amount, least=self.shortest)
        held = opening if np.isfinite(opening) else self.shortest
        end, _, moved = self._passed(held, held + _TAIL)
        back = float(end["ran_back"])
        if back > _RUN_BACK * (abs(moved) + back):
            return None
        return opening - moved / self.steady if np.isfinite(opening) else 0.0
