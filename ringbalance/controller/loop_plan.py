"""The closed loop of a scene, ready to run: once with its trace, or for many settings and devices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.algorithms.algorithm import Controller
from ringbalance.controller.algorithms.built_in import BuiltIn
from ringbalance.controller.algorithms.law_based import LawBased
from ringbalance.controller.balancer import WATCH_TIME_S
from ringbalance.controller.compiled_loop import continue_runs
from ringbalance.controller.loop_records import (
    GAS_POINTS,
    INJECTION,
    LOOP,
    NONE,
    NOTES,
    OWN,
    RUN,
    SAMPLE,
    TAIL_POINTS,
)
from ringbalance.controller.rotor import chamber_directions
from ringbalance.reduced_model.injection.dynamics import MOTION, WORKSPACE
from ringbalance.reduced_model.injection.march import SPARE
from ringbalance.scene.arrays import FloatArray, Records
from ringbalance.scene.models import Scene

SAMPLES_AT_FIRST: Final = 256
"""Number of samples to which runs are continued first; doubled each time."""
ALLOWED: Final = 0.01
"""Fraction of the samples in the watch time that may be above the limit."""
IDLE_OPERATIONS: Final = 3
"""Last commands without movement, beyond one for each chamber, with which a run out of time is idle."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """Samples, injections and instants of one run."""

    instants: FloatArray
    """Time, s, and the fill of every pair's positive chamber, shape (m, 1 + pairs)."""
    injections: Records
    """Type `INJECTION`."""
    samples: Records
    """Type `SAMPLE`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopPlan:
    """Settings of one kind of algorithm, ready for compiled code."""

    loops: Records
    """Type `LOOP`, one for each choice of settings."""
    starts: Records
    """Type `RUN`, with the memory of the algorithm at the start."""
    assumed: Records | None
    """Type `PLANT`, shape (1,): device that the law-based algorithm assumes; None: another algorithm."""
    liquid: Records
    """Type `MOTION`: the pairs as the law-based algorithm estimates them, and a spare one; else empty."""

    @classmethod
    def of(
        cls,
        scenes: Sequence[Scene],
        controllers: Sequence[Controller[Any] | BuiltIn],
        *,
        most_samples: int,
        sensed: bool = False,
        to_time_limit: bool = False,
        watch_time: float = WATCH_TIME_S,
    ) -> LoopPlan:
        """Prepare runs of scenes that differ in settings of the controller alone.

        Args:
            controllers: of each; those of the law-based algorithm assume the same device.
            most_samples: number of samples after which a run ends undecided.
            sensed: true if the caller's sensor writes its samples into the run.
            to_time_limit: true if a settled run continues.
            watch_time: time for which a run is watched after it has held its limit, s.
        """
        loops, starts = np.zeros(len(scenes), dtype=LOOP), np.zeros(len(scenes), dtype=RUN)
        starts["loop"], starts["speed"] = np.arange(len(scenes)), 1.0
        loops["algorithm"] = OWN
        for scene, controller, loop, start in zip(scenes, controllers, loops, starts, strict=True):
            if isinstance(controller, BuiltIn):
                controller.fill(loop, start)
            settings, sensor = scene.controller, scene.sensor
            loop["chambers"], loop["limit"] = scene.disc.chambers, settings.limit
            loop["period"], loop["hold_time"] = settings.period, settings.hold_time
            loop["time_limit"], loop["watch_time"] = scene.run.time_limit, watch_time
            loop["allowed"] = ALLOWED * watch_time / settings.period
            loop["amplitude_noise"], loop["phase_noise"] = sensor.amplitude_noise, sensor.phase_noise
            loop["exact"] = sensor.amplitude_noise == sensor.phase_noise == 0
            loop["idle_tolerated"] = IDLE_OPERATIONS + scene.disc.chambers
            loop["rises_tolerated"] = controller.rises_tolerated
        first, chambers = controllers[0], scenes[0].disc.chambers
        loops["axis"][:, : chambers // 2] = chamber_directions(chambers)[: chambers // 2]
        loops["sensed"] = sensed or not isinstance(first, BuiltIn)
        loops["exact"] &= not sensed
        loops["most_samples"], loops["to_time_limit"] = most_samples, to_time_limit
        return cls(
            loops=loops,
            starts=starts,
            assumed=first.plant if isinstance(first, LawBased) else None,
            liquid=first.liquid() if isinstance(first, BuiltIn) else np.zeros(0, dtype=MOTION),
        )

    def runs(self, devices: int, **values: npt.ArrayLike) -> Records:
        """Runs, type `RUN`: every device under the first settings, then under the next.

        Args: `values`: of each device, by field.
        """
        runs = np.repeat(self.starts, devices)
        for name, value in values.items():
            runs[name] = np.tile(np.broadcast_to(value, devices), self.loops.size)
        return runs

    def carry(
        self,
        runs: Records,
        plants: Records,
        noise: Callable[[int], FloatArray],
        *,
        traced: bool = False,
        watch: Callable[[], None] | None = None,
    ) -> Trace:
        """Carry runs to their ends.

        Args:
            plants: of the devices, type `PLANT`.
            noise: function of a number of samples that gives `noise` of `continue_runs` for at least as many.
            traced: true if the trace is kept, of a single run.
            watch: called before each sample, as it may write into the run.
        Returns: that trace; else an empty one.
        """
        pairs, most = int(self.loops["chambers"][0]) // 2, int(self.loops["most_samples"][0]) if traced else 0
        motions = np.zeros((runs.size, 2 * pairs + SPARE), dtype=MOTION)
        liquid = np.tile(self.liquid, (runs.size, 1))
        trace = Trace(
            instants=np.empty(((GAS_POINTS + TAIL_POINTS + pairs) * most + (1 if traced else 0), 1 + pairs)),
            injections=np.zeros(pairs * most, dtype=INJECTION),
            samples=np.zeros(most, dtype=SAMPLE),
        )
        assumed = plants if self.assumed is None else self.assumed
        notes, workspace = np.zeros(NOTES), np.zeros(WORKSPACE)

        def go_on(until: int) -> None:
            continue_runs(
                self.loops,
                plants,
                assumed[0],
                runs,
                motions,
                liquid,
                noise(until),
                until,
                trace.instants,
                trace.injections,
                trace.samples,
                notes,
                workspace,
            )

        until = 0
        go_on(until)
        while np.any(runs["cause"] == NONE):
            if watch is not None:
                watch()
            until = max(2 * until, SAMPLES_AT_FIRST) if watch is None else until + 1
            go_on(until)
        run = runs[0]
        return Trace(
            instants=trace.instants[: run["instants"]].copy(),
            injections=trace.injections[: run["injections"]].copy(),
            samples=trace.samples[: run["samples"]].copy(),
        )
