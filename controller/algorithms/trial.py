"""The one-by-one trial algorithm: try chamber after chamber, keep the one that lowers the amplitude."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ringbalance.controller.algorithms.built_in import BuiltIn, Memory, open_valve
from ringbalance.controller.loop_records import NO_PHASE, TRIAL, Record
from ringbalance.scene.platform.compiled import in_place


@dataclass(frozen=True, kw_only=True)
class Trial(BuiltIn):
    """Gas into one chamber at a time, with a step that shrinks near the goal; the phase is not read.

    The first trial of a chamber is short.  If the amplitude falls, the chamber stays and the step is long
    while the amplitude is at or above `fine_below`, short below it; if it does not fall, the next chamber of
    the sequence gets its first trial.  Below `fine_below` a first trial is no longer than the short step.

    At or below `limit` the algorithm rests and keeps its chamber.  A dropped sample or a NaN amplitude
    changes nothing: no valve opens and the state is held; a NaN phase does not matter.
    Source: section 4.1 of the liquid-ring paper.
    """

    needs: ClassVar[int] = NO_PHASE
    chambers: int
    """n, even."""
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

    def fill(self, loop: Record, run: Record) -> None:
        """As `BuiltIn.fill`."""
        run["position"] = 0
        loop["algorithm"], loop["chambers"], loop["rest_limit"] = TRIAL, self.chambers, self.limit
        loop["trials"], loop["sequence"][: len(self.sequence)] = len(self.sequence), self.sequence
        for name in ("first_trial", "long_step", "short_step", "fine_below"):
            loop[name] = getattr(self, name)
        loop["minimum_gas_time"], loop["maximum_gas_time"] = self.minimum_gas_time, self.maximum_gas_time

    def react(self, loop: Record, memory: Memory) -> None:
        """As `BuiltIn.react`."""
        trial_step(loop, memory.run[0])


@in_place
def trial_step(loop: Record, run: Record) -> None:
    """One step of `Trial` on a usable sample."""
    amplitude = run.seen_amplitude
    if amplitude <= loop.rest_limit:
        run.resting, run.tried = 1, 0
        return
    fell = run.tried > 0 and amplitude < run.before_amplitude
    if run.tried > 0 and not fell:
        run.position = (run.position + 1) % loop.trials
    step = loop.long_step if fell else loop.first_trial
    if amplitude < loop.fine_below:
        step = loop.short_step if fell else min(step, loop.short_step)
    run.tried, run.before_amplitude = 1, amplitude
    open_valve(loop, run, loop.sequence[run.position], step, 0.0)
