"""What the program's own algorithms share: settings as a record, memory in a run, one compiled step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.algorithms.algorithm import Command, Measurement, ValveCommand
from ringbalance.controller.formulas import valve_time
from ringbalance.controller.loop_records import LOOP, NO_PHASE, RUN, TOO_SHORT, UNUSABLE, USABLE, Record
from ringbalance.reduced_model.injection.dynamics import MOTION
from ringbalance.scene.platform.compiled import in_place

NO_SAMPLE: Final = "no usable sample"
"""Reason that every algorithm gives for doing nothing on a dropped sample or a NaN."""
BELOW_MINIMUM: Final = "the valve-open time is below the minimum"
REASONS: Final = {0: "", UNUSABLE: NO_SAMPLE, TOO_SHORT: BELOW_MINIMUM}
_valve_time: Final = in_place(valve_time)


@dataclass(frozen=True, eq=False)
class Memory:
    """State of an algorithm of the program between two samples; arrays of one element, never changed."""

    run: npt.NDArray[np.void]
    """What it remembers, type `RUN`."""
    liquid: npt.NDArray[np.void]
    """Of the law-based algorithm: the pairs as it believes them to be, type `MOTION`; empty for others."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Memory) and all(
            mine.tobytes() == yours.tobytes()
            for mine, yours in ((self.run, other.run), (self.liquid, other.liquid))
        )

    __hash__ = None  # type: ignore[assignment]


class BuiltIn:
    """An algorithm of the program: frozen settings, with its step compiled.

    `simulate` runs that step within the compiled loop; `start` and `step` are the same for one sample, so
    that an algorithm of a user's own can build on it.
    """

    needs: ClassVar[int] = USABLE
    """What it reads of a sample."""

    @property
    def rises_tolerated(self) -> int:
        """As `Controller` has it."""
        raise NotImplementedError

    def fill(self, loop: Record, run: Record) -> None:
        """Write the settings into an element of type `LOOP`, and the first memory into one of type `RUN`."""
        raise NotImplementedError

    def liquid(self) -> npt.NDArray[np.void]:
        """The pairs as the algorithm believes them to be at the start; empty where it has no belief."""
        return np.zeros(0, dtype=MOTION)

    def react(self, loop: Record, memory: Memory) -> None:
        """Call the compiled step on a memory that shows a usable sample."""
        raise NotImplementedError

    @cached_property
    def _filled(self) -> tuple[npt.NDArray[np.void], npt.NDArray[np.void]]:
        """Settings and first memory, shape (1,) each."""
        loop, run = np.zeros(1, dtype=LOOP), np.zeros(1, dtype=RUN)
        self.fill(loop[0], run[0])
        return loop, run

    def start(self) -> Memory:
        """The state before the first sample."""
        return Memory(self._filled[1], self.liquid())

    def step(self, state: Memory, measurement: Measurement | None) -> tuple[Memory, Command]:
        """Next state and command after one sample (None: dropped); a pure function."""
        seen = state.run.copy()
        show(seen[0], measurement)
        if measurement is None or seen["usable"][0] < self.needs:
            return state, Command(reason=NO_SAMPLE)
        seen["time"], seen["asked"], seen["resting"], seen["reason"] = measurement.time, 0.0, 0, 0
        seen["at_residual"][0, : len(measurement.at_residual)] = measurement.at_residual
        after = Memory(seen, state.liquid.copy())
        self.react(self._filled[0][0], after)
        seen["reason"] = 0 if seen["resting"][0] or np.any(seen["asked"]) else TOO_SHORT
        return after, command_of(seen[0], int(self._filled[0]["chambers"][0]))


@in_place
def open_valve(loop: Record, run: Record, chamber: int, share: float, offset: float) -> None:
    """Command gas into a chamber for a share and its offset, s, unless the share is below the minimum."""
    time = _valve_time(share, offset, loop.minimum_gas_time, loop.maximum_gas_time)
    if time > 0.0:
        half = loop.chambers // 2
        run.asked[chamber % half], run.side[chamber % half] = time, chamber // half


def show(run: Record, measurement: Measurement | None) -> None:
    """Write what a sensor gave into an element of type `RUN`."""
    run["usable"] = 0
    if measurement is not None:
        run["seen_amplitude"], run["seen_phase"] = measurement.amplitude, measurement.phase
        if measurement.usable(needs_phase=False):
            run["usable"] = USABLE if math.isfinite(measurement.phase) else NO_PHASE


def command_of(sample: Record, chambers: int) -> Command:
    """The command in an element of type `RUN` or `SAMPLE`."""
    half = chambers // 2
    asked = np.flatnonzero(sample["asked"])
    opened = sorted((int(sample["side"][p]) * half + int(p), float(sample["asked"][p])) for p in asked)
    valves = tuple(ValveCommand(chamber=chamber, duration=duration) for chamber, duration in opened)
    return Command(valves=valves, resting=bool(sample["resting"]), reason=REASONS[int(sample["reason"])])
