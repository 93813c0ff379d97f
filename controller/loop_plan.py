"""The closed loop of a scene, ready to run: once with its trace, or for many draws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.algorithm import Controller
from ringbalance.controller.algorithms.built_in import BuiltIn
from ringbalance.controller.algorithms.law_based import LawBased
from ringbalance.controller.balancer import FURTHER
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
    MomentTable,
)
from ringbalance.controller.rotor import chamber_directions
from ringbalance.controller.simulation import noise_floor
from ringbalance.reduced_model.injection.dynamics import MOTION, WORKSPACE
from ringbalance.reduced_model.injection.march import SPARE
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.arrays import FloatArray, Records
from ringbalance.scene.models import Scene

CHUNK: Final = 128
"""Samples for which runs are continued at once."""
ALLOWED: Final = 0.01
"""Fraction of the samples in that time that may be above the limit."""
IDLE_OPERATIONS: Final = 3
"""Commands in a row, beyond one for each chamber, from which on a run that ends is said to move nothing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """What happened in one run, or in a part of it."""

    instants: FloatArray
    """Time, s, and the fill of every pair's positive chamber, shape (m, 1 + pairs)."""
    injections: Records
    """Type `INJECTION`."""
    samples: Records
    """Type `SAMPLE`."""

    @classmethod
    def room(cls, samples: int, pairs: int) -> Trace:
        """For some samples; for none: none is kept."""
        rows = (GAS_POINTS + TAIL_POINTS + pairs) * samples + (1 if samples else 0)
        return cls(
            instants=np.empty((rows, 1 + pairs)),
            injections=np.zeros(pairs * samples, dtype=INJECTION),
            samples=np.zeros(samples, dtype=SAMPLE),
        )

    @classmethod
    def joined(cls, parts: Sequence[Trace]) -> Trace:
        """Parts of one run, one after the other."""
        return cls(
            instants=np.concatenate([part.instants for part in parts]),
            injections=np.concatenate([part.injections for part in parts]),
            samples=np.concatenate([part.samples for part in parts]),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopPlan:
    """What all runs of a scene share, ready for compiled code."""

    loop: Records
    """Type `LOOP`, shape (1,)."""
    plant: Records
    """Type `PLANT`, shape (1,)."""
    assumed: Records
    """The same as the law-based algorithm has it; the others do not look at it."""
    memory: Records
    """Type `RUN`, shape (1,), with what the algorithm remembers at the start."""
    liquid: Records
    """Type `MOTION`: the pairs as the law-based algorithm believes them to be, and one more; else empty."""

    @classmethod
    def of(
        cls,
        *,
        scene: Scene,
        model: BalancerModel,
        plant: Records,
        controller: Controller[Any] | BuiltIn,
        most_samples: int,
        sensed: bool = False,
        to_time_limit: bool = False,
        further: float = FURTHER,
        moments: MomentTable | None = None,
    ) -> LoopPlan:
        """Prepare the runs of a scene.

        Args:
            plant: what moves its liquid, type `PLANT`, shape (1,).
            most_samples: after which a run ends undecided.
            sensed: whether the caller's sensor writes its samples into the run.
            to_time_limit: whether a settled run continues.
            further: s, for which a run is watched after it has held its limit.
            moments: those of the model, where they are known.
        """
        loop, memory = np.zeros(1, dtype=LOOP), np.zeros(1, dtype=RUN)
        total, chambers = 2 * scene.disc.initial_fill, scene.disc.chambers
        built_in = isinstance(controller, BuiltIn)
        loop["algorithm"] = OWN
        if isinstance(controller, BuiltIn):
            controller.fill(loop[0], memory[0])
        for name, value in _settings(scene, further).items():
            loop[name] = value
        table = moments or MomentTable.of(model=model, total=total)
        loop["lowest"], loop["moment_step"], loop["moment"][0] = table
        loop["axis"][0, : chambers // 2] = chamber_directions(chambers)[: chambers // 2]
        loop["rises_tolerated"], loop["most_samples"] = controller.rises_tolerated, most_samples
        loop["sensed"], loop["to_time_limit"] = sensed or not built_in, to_time_limit
        loop["exact"] = not sensed and scene.sensor.amplitude_noise == scene.sensor.phase_noise == 0
        assumed = controller.plant if isinstance(controller, LawBased) else plant
        liquid = controller.liquid() if isinstance(controller, BuiltIn) else np.zeros(0, dtype=MOTION)
        return cls(loop=loop, plant=plant, assumed=assumed, memory=memory, liquid=liquid)

    @property
    def pairs(self) -> int:
        """Number of pairs of chambers."""
        return int(self.loop["chambers"][0]) // 2

    def runs(self, size: int) -> Records:
        """Runs with the law's own velocity, to be given the rest; type `RUN`."""
        runs = np.repeat(self.memory, size)
        runs["speed"] = 1.0
        return runs

    def carry(
        self,
        runs: Records,
        random: Sequence[np.random.Generator],
        *,
        traced: bool = False,
        watch: Callable[[], None] | None = None,
    ) -> Trace:
        """Carry runs to their ends.

        Args: `random`: numbers of each run's sensor; empty for an exact one. `traced`: whether the trace of
            the first run is kept. `watch`: called before each sample, as it may write into the run.
        Returns: that trace; an empty one where none is asked for.
        """
        shape = (runs.size, CHUNK if watch is None else 1, 2)
        motions = np.zeros((runs.size, 2 * self.pairs + SPARE), dtype=MOTION)
        liquid = np.tile(self.liquid, (runs.size, 1))
        room = np.zeros(NOTES), np.zeros(WORKSPACE)
        noise, parts = np.zeros(shape), []
        parts.append(self._continued(runs, motions, liquid, noise[:, :0], *room, traced=traced))
        while np.any(running := runs["cause"] == NONE):
            if watch is not None:
                watch()
            for i in np.flatnonzero(running).tolist() if random else ():
                noise[i] = random[i].standard_normal(shape[1:])
            parts.append(self._continued(runs, motions, liquid, noise, *room, traced=traced))
        return Trace.joined(parts)

    def _continued(
        self,
        runs: Records,
        motions: Records,
        liquid: Records,
        noise: FloatArray,
        notes: FloatArray,
        workspace: FloatArray,
        *,
        traced: bool,
    ) -> Trace:
        """By as many samples as there is noise for; without any the runs begin. Returns: what happened in the
        first run."""
        run, trace = runs[0], Trace.room(noise.shape[1] + 1 if traced else 0, self.pairs)
        run["instants"], run["injections"], run["samples_before"] = 0, 0, run["samples"]
        continue_runs(
            self.loop[0],
            self.plant[0],
            self.assumed[0],
            runs,
            motions,
            liquid,
            noise,
            trace.instants,
            trace.injections,
            trace.samples,
            notes,
            workspace,
        )
        return Trace(
            instants=trace.instants[: run["instants"]],
            injections=trace.injections[: run["injections"]],
            samples=trace.samples[: run["samples"] - run["samples_before"]],
        )


def _settings(scene: Scene, further: float) -> dict[str, Any]:
    """Rotor, sensor, clock and bounds."""
    settings, sensor = scene.controller, scene.sensor
    return {
        "chambers": scene.disc.chambers,
        "total": 2 * scene.disc.initial_fill,
        "initial_fill": scene.disc.initial_fill,
        "start": scene.rotor.initial_vibration,
        "limit": settings.limit,
        "period": settings.period,
        "hold_time": settings.hold_time,
        "time_limit": scene.run.time_limit,
        "further": further,
        "allowed": ALLOWED * further / settings.period,
        "amplitude_noise": sensor.amplitude_noise,
        "phase_noise": sensor.phase_noise,
        "noise_floor": noise_floor(scene),
        "idle_tolerated": IDLE_OPERATIONS + scene.disc.chambers,
    }
