"""Work dealt out: stored answers are taken, others computed here or by an executor, and stored.

A task's answer follows from the task alone, so that it is the same wherever and beside whatever it runs.
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
"""Longest time that a call of an executor costs besides its work."""
_BUNDLE_TIME_S: Final = 0.5
"""Work in one call, where there is enough for all workers."""
_IDLE_FRACTION: Final = 0.05
"""Fraction of their time that workers may wait for the process that sends and takes all bundles."""
_START_WORK_S: Final = 4.0
"""Work for which processes are started, which takes each a second."""
_BUNDLES_PER_WORKER: Final = 8
"""Least number of bundles for each worker, so that all end at about the same time; unless there are so many
workers that the calls themselves take longer."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """Call whose answer, plain data, can be stored."""

    call: partial[Any]
    """Call with a scene and one of its points, or several; it can be pickled."""
    content: Mapping[str, Any]
    """Content of the scene that decides its answers, plain data."""

    @property
    def weight(self) -> int:
        """Number of points that it answers."""
        points = self.call.args[1]
        return 1 if isinstance(points, Mapping) else len(points)

    @property
    def key(self) -> str:
        """Key of the stored answer: all that it follows from."""
        name, (_, points) = self.call.func.__name__, self.call.args
        return key_of({"call": name, "scene": self.content, "points": points, "options": self.call.keywords})


def tasks_of(content: Mapping[str, Any], calls: Sequence[partial[Any]]) -> list[Task]:
    """Make a task of each call. Args: `content`: of the scene that each begins with."""
    return [Task(call=call, content=content) for call in calls]


@dataclass(frozen=True, kw_only=True)
class Done:
    """Progress of the work."""

    what: str
    points: int
    total: int
    computed: int
    """Points of this run, not stored by an earlier one."""
    seconds: float

    @property
    def rate(self) -> float:
        """Points a second."""
        return self.computed / max(self.seconds, 1e-9)

    @property
    def left(self) -> float:
        """Time that the rest will take, s."""
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
    """Answer each task, in their order.

    Args: `executor`: any executor; default this process, and `workers` processes of its own where the work
        takes longer than their start.
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
    """Numbers and payloads of tasks as they come; the first is computed in this process, and timed.

    The time of the second one counts, since the first may compile.
    """
    seconds = 0.0
    for i in missing[:2]:
        start = time.perf_counter()
        payload = tasks[i].call()
        seconds = time.perf_counter() - start
        yield [i], [payload]
    rest = missing[2:]
    own_pool = executor is None and workers > 1 and seconds * len(rest) > _START_WORK_S
    # This process only waits, so that answers are stored as soon as they come.
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
    """Tasks in one call of an executor, so that calls cost little, none of many workers waits for the process
    that makes them, and workers end together.

    Args: `seconds`: processor time that each takes. `count`: of tasks that are left.
    """
    busy = CALL_TIME_S * workers / (1 - _IDLE_FRACTION)
    enough = math.ceil(max(_BUNDLE_TIME_S, busy) / max(seconds, 1e-6))
    bundles = _BUNDLES_PER_WORKER if busy <= _BUNDLE_TIME_S else 1
    return max(1, min(enough, math.ceil(count / (bundles * workers))))


def _bundle(calls: Sequence[Callable[[], Any]]) -> list[Any]:
    return [call() for call in calls]
