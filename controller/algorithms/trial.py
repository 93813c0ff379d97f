"""The one-by-one trial algorithm: try chamber after chamber, keep the one that lowers the amplitude."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ringbalance.controller.algorithms.algorithm import Command, Measurement, opening


@dataclass(frozen=True, kw_only=True)
class _TrialState:
    """Everything that the algorithm remembers between samples."""

    position: int = 0
    """Index into the sequence of the chamber being tried."""
    previous: float | None = None
    """Amplitude at the last usable sample that led to a command, m; None before the first."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Gas into one chamber at a time, with a step that shrinks near the goal; the phase is not read.

    The first trial of a chamber is short.  If the amplitude falls, the chamber stays and the step is long
    while the amplitude is at or above `fine_below`, short below it; if it does not fall, the next chamber of
    the sequence gets its first trial.  Below `fine_below` a first trial is no longer than the short step.

    At or below `limit` the algorithm rests and keeps its chamber.  A dropped sample or a NaN amplitude
    changes nothing: no valve opens and the state is held; a NaN phase does not matter.
    Source: section 4.1 of the liquid-ring paper.
    """

    sequence: tuple[int, ...]
    """Chamber indices in the order of trial."""
    limit: float
    """m."""
    first_trial: float
    """s."""
    long_step: float
    """s."""
    short_step: float
    """s."""
    fine_below: float
    """m."""
    minimum_gas_time: float
    """s."""
    maximum_gas_time: float
    """s."""

    @property
    def rises_tolerated(self) -> int:
        """One round through the sequence: a rise is how this algorithm learns."""
        return len(self.sequence)

    def start(self) -> _TrialState:
        return _TrialState()

    def step(self, state: _TrialState, measurement: Measurement | None) -> tuple[_TrialState, Command]:
        if measurement is None or not measurement.usable(needs_phase=False):
            return state, Command(reason="no usable sample")
        amplitude = measurement.amplitude
        if amplitude <= self.limit:
            return _TrialState(position=state.position), Command(resting=True)
        fell = state.previous is not None and amplitude < state.previous
        rose = state.previous is not None and not fell
        position = (state.position + rose) % len(self.sequence)
        command = opening(
            ((self.sequence[position], self._gas_time(amplitude, first=not fell)),),
            minimum_gas_time=self.minimum_gas_time,
            maximum_gas_time=self.maximum_gas_time,
        )
        return _TrialState(position=position, previous=amplitude), command

    def _gas_time(self, amplitude: float, *, first: bool) -> float:
        fine = amplitude < self.fine_below
        longest = self.short_step if fine else math.inf
        return min(self.first_trial, longest) if first else (self.short_step if fine else self.long_step)
