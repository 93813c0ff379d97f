"""An algorithm of the program, stepped from outside the loop by one sample at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.controller.algorithms.algorithm import Command, Measurement
from ringbalance.controller.algorithms.built_in import NO_SAMPLE, BuiltIn, command_of, show
from ringbalance.controller.algorithms.law_based import LawBased
from ringbalance.controller.compiled_loop import _decide
from ringbalance.controller.loop_records import LOOP, RUN
from ringbalance.reduced_model.injection.dynamics import PLANT, WORKSPACE
from ringbalance.scene.arrays import Records


@dataclass(frozen=True, eq=False)
class Memory:
    """State between two samples; arrays of one element, never changed."""

    run: Records
    liquid: Records

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Memory) and all(
            mine.tobytes() == yours.tobytes()
            for mine, yours in ((self.run, other.run), (self.liquid, other.liquid))
        )

    __hash__ = None  # type: ignore[assignment]


class Stepped:
    """A controller as a user would write one, which does what an algorithm of the program does."""

    def __init__(self, algorithm: BuiltIn) -> None:
        self.algorithm, self.rises_tolerated = algorithm, algorithm.rises_tolerated
        self._loop, self._run = np.zeros(1, dtype=LOOP), np.zeros(1, dtype=RUN)
        algorithm.fill(self._loop[0], self._run[0])
        self._plant = algorithm.plant if isinstance(algorithm, LawBased) else np.zeros(1, dtype=PLANT)

    def start(self) -> Memory:
        return Memory(self._run, self.algorithm.liquid())

    def step(self, state: Memory, measurement: Measurement | None) -> tuple[Memory, Command]:
        run, liquid = state.run.copy(), state.liquid.copy()
        show(run[0], measurement)
        if measurement is not None:
            run["time"] = measurement.time
            run["at_residual"][0, : len(measurement.at_residual)] = measurement.at_residual
        _decide(self._loop[0], self._plant[0], run[0], liquid, np.zeros((2, 1)), np.zeros(WORKSPACE))
        command = command_of(run[0], int(self._loop["chambers"][0]))
        return (state, command) if command.reason == NO_SAMPLE else (Memory(run, liquid), command)
