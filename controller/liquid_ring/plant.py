"""The plant: the liquid-ring disc with its pairs of chambers, advanced through open valves and waiting."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from scipy.optimize import brentq

from ringbalance.controller.formulas import NOTICEABLE
from ringbalance.controller.liquid_ring.reach import NEAR_RESIDUAL
from ringbalance.controller.rotor import chamber_directions, disc_unbalance
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.injection.pair import (
    PairState,
    Passage,
    Record,
    longest_opening,
    opened,
    pass_time,
)
from ringbalance.reduced_model.injection.records import Event
from ringbalance.reduced_model.law.flow_law import FlowLaw, Regime
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.operating.residual import stalled_fill_ratio
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Disc, Scene

_SCAN: Final = 33
"""Instants at which a fill is looked for before its time is found."""
_TIME_ERROR: Final = 1e-13
"""Of a valve-open time, relative to the longest."""


@dataclass(frozen=True, kw_only=True)
class DiscState:
    """All pairs of the disc, in the order of their first chamber."""

    pairs: tuple[PairState, ...]

    def fills(self) -> tuple[float, ...]:
        """x of all chambers in the order of the letters."""
        first = tuple(pair.fill for pair in self.pairs)
        return first + tuple(pair.opposite_fill for pair in self.pairs)

    @property
    def rests(self) -> bool:
        """Whether no liquid can move until a valve is commanded to open."""
        return not any(pair.primed for pair in self.pairs) and all(p.motion.rests for p in self.pairs)

    @classmethod
    def initial(cls, *, disc: Disc) -> DiscState:
        """All chambers at the scene's initial fill, no tube primed."""
        pair = PairState(fill=disc.initial_fill, total=2 * disc.initial_fill)
        return cls(pairs=(pair,) * (disc.chambers // 2))


@dataclass(frozen=True, kw_only=True)
class Operation:
    """What one command to one valve did, by the next sample."""

    chamber: int
    """Index of the driven chamber."""
    duration: float
    """Commanded, s."""
    fill_before: float
    """x of the driven chamber at the command."""
    fill_after: float
    """x of the driven chamber at the next sample."""
    regime_start: Regime
    regime_end: Regime
    event: Event
    energy: float
    """Work of the driven chamber's gas against the surroundings, integral of (p - ambient) dV, J."""
    closing_pressure: float
    """Gauge, of the driven chamber's gas when its valve closed, Pa."""
    run_dry: float
    """Time for which the valve stayed open to an empty chamber, s."""

    @property
    def moved(self) -> bool:
        """Whether any liquid passed."""
        return abs(self.fill_after - self.fill_before) > NOTICEABLE


@dataclass(frozen=True, kw_only=True)
class Advance:
    """The disc over one stretch of time."""

    instants: FloatArray
    """s from the start of the stretch, shape (m,), ascending, the last one its end."""
    fill_ratio: FloatArray
    """x of every chamber, shape (n, m)."""
    state: DiscState
    """At the end."""
    operations: tuple[Operation, ...]
    drift: float
    """Largest change of a fill ratio while a pair's gas was off."""
    runs_back: tuple[bool, ...]
    """Whether liquid of each pair still ran back, with its gas off, as the stretch ended."""


@dataclass(frozen=True, kw_only=True)
class LiquidRing:
    """The disc's flow law and moments, with what moves its liquid."""

    model: BalancerModel
    chambers: int
    """n, even."""
    dynamics: Dynamics

    @property
    def gas_pressure(self) -> float:
        """Of the supply, gauge, Pa."""
        return self.dynamics.gas_pressure

    @property
    def residual_fill(self) -> float:
        """Of a driven chamber, below which gas would enter its port; `permitted` keeps to it."""
        return self.dynamics.residual

    @cached_property
    def floods(self) -> bool:
        """Whether liquid runs back with the gas off though its tube is not primed."""
        return floods(self.model.flow, total=self.model.flow.max_fill_ratio)

    def permitted(self, state: DiscState, *, gas_times: Mapping[int, float]) -> dict[int, float]:
        """Valve-open times, s, shortened so that no driven chamber falls below its residual fill.

        A chamber that is already there is left out.
        """
        half = self.chambers // 2
        found = {i: self._permitted(state.pairs[i % half], i < half, time) for i, time in gas_times.items()}
        return {chamber: time for chamber, time in found.items() if time > 0}

    def _permitted(self, pair: PairState, first: bool, duration: float) -> float:
        if self.residual_fill <= 0:
            return duration
        if (pair.fill if first else pair.opposite_fill) <= self.residual_fill + NEAR_RESIDUAL:
            return 0.0
        return longest_opening(self.dynamics, pair, chamber=0 if first else 1, duration=duration)

    def advance(
        self, state: DiscState, *, gas_times: Mapping[int, float], duration: float, points: int
    ) -> Advance:
        """Let time pass with some valves open from its start, all pairs in parallel.

        Args:
            gas_times: s for each driven chamber's index, at most `duration`; empty while waiting.
            points: equally spaced instants to record beside the closing of each valve, at least 1.
        Raises: ValueError: gas into both chambers of a pair at once.
        """
        instants = duration * np.arange(1, points + 1) / points
        if gas_times:
            instants = np.unique(np.concatenate([instants, list(gas_times.values())]))
        half = self.chambers // 2
        paths = [
            self._pair(pair, index, _open_valve(gas_times, index, index + half), instants)
            for index, pair in enumerate(state.pairs)
        ]
        operations = [path.operation for path in paths if path.operation is not None]
        first = np.array([path.fill for path in paths])
        totals = np.array([[pair.total] for pair in state.pairs])
        return Advance(
            instants=instants,
            fill_ratio=np.concatenate([first, totals - first]),
            state=DiscState(pairs=tuple(path.state for path in paths)),
            operations=tuple(sorted(operations, key=lambda operation: operation.chamber)),
            drift=max(path.drift for path in paths),
            runs_back=tuple(path.runs_back for path in paths),
        )

    def _pair(self, pair: PairState, index: int, valve: _Valve | None, instants: FloatArray) -> _Path:
        """Fill, velocity, gas and valves as one system; a command is added to what is under way."""
        begun = pair if valve is None else self._commanded(pair, valve, index)
        passage = pass_time(self.dynamics, begun, instants=instants)
        after = replace(begun, fill=passage.fill, primed=passage.primed, motion=passage.motion)
        operation = None if valve is None else self._operation(after, valve)
        moves = passage.primed or passage.motion.velocity != 0 or (self.floods and not self.dynamics.inertia)
        return _Path(
            state=after,
            fill=passage.fills,
            operation=operation,
            drift=passage.ran_back,
            runs_back=moves and passage.ran_back > NOTICEABLE,
        )

    def _commanded(self, pair: PairState, valve: _Valve, index: int) -> PairState:
        """The valve opens and closes a lag after its command."""
        side = int(valve.chamber != index)
        switches = opened(self.dynamics, chamber=side, duration=valve.duration)
        motion = replace(
            pair.motion,
            pending=tuple(sorted((*pair.motion.pending, *switches), key=lambda switch: switch.after)),
            record=Record(chamber=side, fill=pair.opposite_fill if side else pair.fill),
        )
        return replace(pair, motion=motion, driven_first=side == 0)

    def _operation(self, pair: PairState, valve: _Valve) -> Operation:
        record = pair.motion.record
        return Operation(
            chamber=valve.chamber,
            duration=valve.duration,
            fill_before=record.fill,
            fill_after=pair.opposite_fill if record.chamber else pair.fill,
            regime_start=record.regime_start,
            regime_end=record.regime_end,
            event=record.event,
            energy=record.work,
            closing_pressure=record.closing_pressure,
            run_dry=record.run_dry,
        )

    def concluded(self, state: DiscState, operation: Operation) -> Operation:
        """What a pair's last command, as first returned, has done by now, its tail included."""
        pair = state.pairs[operation.chamber % (self.chambers // 2)]
        return self._operation(pair, _Valve(chamber=operation.chamber, duration=operation.duration))

    def gas_time(self, pair: PairState, *, first: bool, fill: float, longest: float) -> float:
        """Valve-open time, s, that lowers the driven chamber of a pair at rest to a fill ratio.

        Args: `first`: whether the chamber on the positive side is driven. `longest`: s, that it keeps to.
        Returns: Zero when the fill is not below the present one or nothing flows; the time of the stall when
            the flow stalls before; below the smallest possible fill the last velocity is kept.
        """
        instants = np.linspace(0.0, longest, _SCAN)
        driven = self._commanded(pair, _Valve(chamber=0 if first else 1, duration=2.0 * longest), 0)

        def above(at: FloatArray) -> tuple[Passage, FloatArray]:
            passage = pass_time(self.dynamics, driven, instants=at)
            fills = passage.fills if first else pair.total - passage.fills
            return passage, np.asarray(fills - fill, dtype=np.float64)

        path, left = above(instants)
        event = path.motion.record.event
        if (pair.fill if first else pair.opposite_fill) <= fill or event is Event.BLOCKED:
            return 0.0
        if left[-1] > 0:
            more = float(left[-1]) / self._last_rate(pair) if event in {Event.EMPTY, Event.FULL} else 0.0
            return min(path.ended + more, longest) if path.ended > 0 else longest
        place = int(np.argmax(left <= 0))
        before, after = float(instants[place - 1]), float(instants[place])
        after = path.ended if before < path.ended < after else after
        if above(np.array([after]))[1][0] >= 0:
            return after
        return float(
            brentq(lambda time: above(np.array([time]))[1][0], before, after, xtol=_TIME_ERROR * longest)
        )

    def _last_rate(self, pair: PairState) -> float:
        """Fill ratio that leaves a driven chamber per second as its flow ends at a limit, 1/s."""
        largest = self.model.flow.max_fill_ratio
        fill = max(0.0, pair.total - largest)
        flow = self.model.flow.evaluate(
            fill_ratio=fill,
            opposite_fill_ratio=min(pair.total - fill, largest),
            gas_pressure=self.gas_pressure,
            primed=True,
        )
        rate = float(flow.velocity) * self.model.tube_area / self.model.chamber_volume
        return rate if rate > 0 else math.inf

    def least_fill(self, *, state: DiscState) -> float:
        """Fill to which injections can bring a chamber: the residual one, or that at which the gas stalls."""
        total = state.pairs[0].total
        stalled = stalled_fill_ratio(law=self.model.flow, total=total, gas_pressure=self.gas_pressure)
        return min(max(self.residual_fill, stalled), total / 2)

    def largest_pair_moment(self, *, state: DiscState, least_fill: float | None = None) -> complex:
        """Moment of a pair with its usable liquid moved to one side, along and across, kg m.

        Args: `least_fill`: to which a chamber is emptied; default `LiquidRing.least_fill`.
        Source: Eq. 7 of the liquid-ring paper for a pair, by the model's own moment curve.
        """
        total = state.pairs[0].total
        least = self.least_fill(state=state) if least_fill is None else min(least_fill, total / 2)
        highest = min(total - least, self.model.flow.max_fill_ratio)
        moment = self.model.moment.pair_vector(fill_ratio=highest, opposite_fill_ratio=total - highest)
        return complex(moment)

    def drains(self, state: DiscState, runs_back: Sequence[bool], scene: Scene) -> bool:
        """Whether the vibration would be above the limit, were the pairs level that still run back."""
        if not any(runs_back):
            return False
        pairs = [
            replace(pair, fill=pair.total / 2) if back else pair
            for pair, back in zip(state.pairs, runs_back, strict=True)
        ]
        moment = disc_unbalance(moment=self.model.moment, fill_ratio=DiscState(pairs=tuple(pairs)).fills())
        return abs(complex(scene.rotor.vibration(moment))) > scene.controller.limit

    def unreachable_vibration(
        self, *, state: DiscState, rotor: Rotor, least_fill: float | None = None
    ) -> float:
        """Vibration that remains with the liquid at its best, m; zero within capacity.

        It follows from the distance between the moment that is wanted and the nearest that the disc can form.
        Those fill a polygon whose corners have every pair fully to one side or the other.
        Args: `least_fill`: as `largest_pair_moment`.
        Source: Eq. 8 of the liquid-ring paper, in every direction and for any number of chambers.
        """
        n = self.chambers
        axes = chamber_directions(n)[: n // 2]
        seen_from = np.exp(1j * np.pi * (2 * np.arange(n) + 1) / n + 0.5j * np.pi)
        signs = np.sign((axes[None, :] * seen_from[:, None].conj()).real)
        corners = self.largest_pair_moment(state=state, least_fill=least_fill) * (signs @ axes)
        edges = np.roll(corners, -1) - corners
        offset = -rotor.initial_unbalance - corners
        if n > 2 and np.all((edges.conj() * offset).imag >= 0):
            return 0.0
        along = np.clip((edges.conj() * offset).real / np.maximum(np.abs(edges) ** 2, 1e-300), 0.0, 1.0)
        return float(np.min(np.abs(offset - along * edges))) * rotor.influence_coefficient


@dataclass(frozen=True, kw_only=True)
class _Valve:
    chamber: int
    duration: float


@dataclass(frozen=True, kw_only=True)
class _Path:
    """One pair over one stretch of time."""

    state: PairState
    fill: FloatArray
    operation: Operation | None = None
    drift: float = 0.0
    runs_back: bool = False


def _open_valve(gas_times: Mapping[int, float], first: int, opposite: int) -> _Valve | None:
    asked = [_Valve(chamber=i, duration=gas_times[i]) for i in (first, opposite) if i in gas_times]
    if len(asked) > 1:
        raise ValueError(f"gas into chambers {first} and {opposite} of one pair at once")
    return asked[0] if asked else None


def floods(law: FlowLaw, *, total: float) -> bool:
    """Whether liquid of a pair leaves its fullest chamber through an unprimed tube with the gas off.

    So it does where the crest lies outside that chamber's level, and without a crest.
    """
    lowest = max(0.0, total - law.max_fill_ratio)
    flow = law.evaluate(fill_ratio=lowest, opposite_fill_ratio=total - lowest, gas_pressure=0.0)
    return float(flow.velocity) != 0.0
