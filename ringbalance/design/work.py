"""Distribution of tasks: results are read from the store, or computed here or by an executor, and stored.

The result of a task depends on the task only, not on the process or on other tasks.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from ringbalance.design.store import Store, key_of
from ringbalance.scene.platform.processes import beside, dealt

CALL_TIME_S: Final = 5e-3
"""Upper bound of the overhead of one call of an executor."""
_BUNDLE_TIME_S: Final = 0.5
"""Duration of one call, if there is enough work for all workers."""
_IDLE_FRACTION: Final = 0.05
"""Largest fraction of time that workers wait for the process that distributes the bundles."""
_START_WORK_S: Final = 4.0
"""Remaining work beyond which processes are started; each start takes one second."""
_BUNDLES_PER_WORKER: Final = 8
"""Smallest number of bundles for each worker, so that all end at about the same time; one if there are so
many workers that the overhead of calls dominates."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """Call whose result, plain data, can be stored."""

    call: partial[Any]
    """Picklable call with a scene and one or several of its points."""
    content: Mapping[str, Any]
    """Content of the scene that determines its results, plain data."""

    @property
    def weight(self) -> int:
        """Number of points of the call."""
        points = self.call.args[1]
        return 1 if isinstance(points, Mapping) else len(points)

    @property
    def key(self) -> str:
        """Key of the stored result, from everything that determines it."""
        name, (_, points) = self.call.func.__name__, self.call.args
        return key_of({"call": name, "scene": self.content, "points": points, "options": self.call.keywords})


def tasks_of(content: Mapping[str, Any], calls: Sequence[partial[Any]]) -> list[Task]:
    """Make a task of each call. Args: `content`: content of the scene, the first argument of each call."""
    return [Task(call=call, content=content) for call in calls]


@dataclass(frozen=True, kw_only=True)
class Done:
    """Progress of the work."""

    what: str
    points: int
    total: int
    computed: int
    """Number of points computed in this run, without those stored by an earlier one."""
    seconds: float

    @property
    def rate(self) -> float:
        """Points computed per second."""
        return self.computed / max(self.seconds, 1e-9)

    @property
    def left(self) -> float:
        """Expected time for the remaining points, s."""
        return (self.total - self.points) / self.rate if self.computed else math.inf

    @property
    def text(self) -> str:
        """Progress as a terminal shows it."""
        share = f"{self.what}: {self.points} of {self.total} points ({self.points / self.total:.0%})"
        return f"{share}, {self.rate:.3g} a second, {self.left:.0f} s left" if self.computed else share


Progress = Callable[[Done], None]


def answers(
    what: str,
    tasks: Sequence[Task],
    *,
    store: Store | None,
    executor: Executor | None,
    workers: int = 1,
    progress: Progress | None = None,
) -> list[Any]:
    """Results of the tasks, in their order.

    Args: `executor`: any executor; default this process, and `workers` further processes if the work takes
        longer than their start.
    """
    results = [store.get(task.key) if store else None for task in tasks]
    start, total, computed = time.perf_counter(), sum(task.weight for task in tasks), 0

    def report() -> None:
        points = sum(task.weight for task, each in zip(tasks, results, strict=True) if each is not None)
        seconds = time.perf_counter() - start
        if progress is not None:
            progress(Done(what=what, points=points, total=total, computed=computed, seconds=seconds))

    report()
    missing = [i for i, each in enumerate(results) if each is None]
    for numbers, payloads in _computed(tasks, missing, executor, workers):
        for i, payload in zip(numbers, payloads, strict=True):
            if store is not None:
                store.put(tasks[i].key, payload)
            results[i] = payload
            computed += tasks[i].weight
        report()
    return results


def _computed(
    tasks: Sequence[Task], missing: Sequence[int], executor: Executor | None, workers: int
) -> Iterator[tuple[Sequence[int], list[Any]]]:
    """Yield numbers and payloads of tasks as they are completed.

    This process computes the first two; the time of the second, without compilation, sizes the bundles.
    """
    seconds = 0.0
    for i in missing[:2]:
        start = time.perf_counter()
        payload = tasks[i].call()
        seconds = time.perf_counter() - start
        yield [i], [payload]
    rest = missing[2:]
    own_pool = executor is None and workers > 1 and seconds * len(rest) > _START_WORK_S
    # This process computes nothing more, so that results are stored as soon as they arrive.
    with beside(workers + 1 if own_pool else 1) as pool:
        crew = executor or pool
        if crew is None or not rest:
            for i in rest:
                yield [i], [tasks[i].call()]
            return
        size = bundle_size(seconds, count=len(rest), workers=workers)
        bundles = [rest[start : start + size] for start in range(0, len(rest), size)]
        calls = [partial(_bundle, [tasks[i].call for i in bundle]) for bundle in bundles]
        for number, payloads in dealt(crew, calls):
            yield bundles[number], payloads


def bundle_size(seconds: float, *, count: int, workers: int) -> int:
    """Number of tasks in one call of an executor: large enough for little overhead and no waiting workers,
    small enough that all workers end together.

    Args: `seconds`: processor time of one task. `count`: number of remaining tasks.
    """
    busy = CALL_TIME_S * workers / (1 - _IDLE_FRACTION)
    enough = math.ceil(max(_BUNDLE_TIME_S, busy) / max(seconds, 1e-6))
    bundles = _BUNDLES_PER_WORKER if busy <= _BUNDLE_TIME_S else 1
    return max(1, min(enough, math.ceil(count / (bundles * workers))))


def _bundle(calls: Sequence[Callable[[], Any]]) -> list[Any]:
    return [call() for call in calls]
