"""The plant: the liquid-ring disc with its pairs of chambers, advanced through open valves and waiting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.controller.formulas import NOTICEABLE
from ringbalance.controller.rotor import chamber_directions
from ringbalance.reduced_model.injection.dynamics import Dynamics, Event
from ringbalance.reduced_model.injection.pair import PairState, Record, opened, pass_time
from ringbalance.reduced_model.law.flow_law import BalancerModel, FlowLaw, Regime
from ringbalance.reduced_model.residual_liquid import stalled_fill_ratio
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Disc

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
