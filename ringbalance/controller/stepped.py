"""An algorithm of the program, stepped from Python by one sample at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.controller.algorithms.algorithm import Command, Measurement
from ringbalance.controller.algorithms.built_in import NO_SAMPLE, BuiltIn, command_of, show
from ringbalance.controller.algorithms.law_based import LawBased, controller_of
from ringbalance.controller.compiled_loop import decide
from ringbalance.controller.loop_records import LOOP, RUN
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.reduced_model.injection.dynamics import WORKSPACE, empty_plants
from ringbalance.reduced_model.law.flow_law import BalancerModel, CompleteLaw
from ringbalance.scene.arrays import Records
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import scene_as


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
    """`Controller` that steps an algorithm of the program."""

    def __init__(self, algorithm: BuiltIn) -> None:
        self.algorithm, self.rises_tolerated = algorithm, algorithm.rises_tolerated
        self._loop, self._run = np.zeros(1, dtype=LOOP), np.zeros(1, dtype=RUN)
        algorithm.fill(self._loop[0], self._run[0])
        self._plant = algorithm.plant if isinstance(algorithm, LawBased) else empty_plants(1)

    def start(self) -> Memory:
        """State before the first sample."""
        return Memory(self._run, self.algorithm.liquid())

    def step(self, state: Memory, measurement: Measurement | None) -> tuple[Memory, Command]:
        """Next state and command after one sample (None: dropped)."""
        run, liquid = state.run.copy(), state.liquid.copy()
        show(run[0], measurement)
        if measurement is not None:
            run["time"] = measurement.time
            run["at_residual"][0, : len(measurement.at_residual)] = measurement.at_residual
        decide(self._loop[0], self._plant[0], run[0], liquid, np.zeros((2, 1)), np.zeros(WORKSPACE))
        command = command_of(run[0], int(self._loop["chambers"][0]))
        return (state, command) if command.reason == NO_SAMPLE else (Memory(run, liquid), command)


def scene_controller(scene: Scene, *, flow_law: CompleteLaw | None = None) -> Stepped:
    """The algorithm of a scene with its settings, to use within an algorithm of your own.

    Args: `flow_law`: law that the law-based algorithm assumes; default the calibrated law.
    Raises: SceneError: another balancer.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> inner = rb.scene_controller(scene)
        >>> measurement = rb.Measurement(time=0.0, amplitude=1e-5, phase=0.0)
        >>> state, command = inner.step(inner.start(), measurement)
        >>> [valve.chamber for valve in command.valves]
        [0, 1]
    """
    scene = scene_as(Scene, scene)
    model = BalancerModel.of(flow_law or chamber_and_law(scene)[1])
    return Stepped(controller_of(scene, model))
