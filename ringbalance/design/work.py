"""Work dealt out: what is kept is taken, the rest computed here or by an executor, and kept as it comes.

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

CALL: Final = 5e-3
"""s, that a call of an executor costs there and back, at most."""
_BUNDLE: Final = 0.5
"""s of work in one call, where there is enough for all workers."""
_IDLE: Final = 0.05
"""Share of their time that workers may wait for the process that sends and takes all bundles."""
_WORTH: Final = 4.0
"""s of work for which processes are started, which takes each a second."""
_SHARES: Final = 8
"""Bundles for each worker at least, so that all end at about the same time; unless there are so many workers
that the calls themselves take longer."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One answer, plain data."""

    call: partial[Any]
    """Of a scene and one of its points, or several; it can be pickled."""
    content: Mapping[str, Any]
    """All that decides the scene's answers, plain data."""

    @property
    def weight(self) -> int:
        """Points that it answers."""
        points = self.call.args[1]
        return 1 if isinstance(points, Mapping) else len(points)

    @property
    def key(self) -> str:
        """Under which it is kept: all that its answer follows from."""
        name, (_, points) = self.call.func.__name__, self.call.args
        return key_of({"call": name, "scene": self.content, "points": points, "options": self.call.keywords})


def tasks_of(content: Mapping[str, Any], calls: Sequence[partial[Any]]) -> list[Task]:
    """Args: `content`: of the scene that each call begins with."""
    return [Task(call=call, content=content) for call in calls]


@dataclass(frozen=True, kw_only=True)
class Done:
    """Progress of the work."""

    what: str
    points: int
    total: int
    computed: int
    """Points of this run, not kept from an earlier one."""
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
        """For a terminal."""
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
    """The answer of each task, in their order.

    Args: `executor`: who computes; default this process, and `workers` processes of its own where the work
        is worth their start.
    """
    found = [store.get(task.key) if store else None for task in tasks]
    start, total, computed = time.perf_counter(), sum(task.weight for task in tasks), 0

    def show() -> None:
        points = sum(task.weight for task, each in zip(tasks, found, strict=True) if each is not None)
        seconds = time.perf_counter() - start
        if progress is not None:
            progress(Done(what=what, points=points, total=total, computed=computed, seconds=seconds))

    show()
    missing = [place for place, each in enumerate(found) if each is None]
    for places, payloads in _computed(tasks, missing, executor, workers):
        for place, payload in zip(places, payloads, strict=True):
            if store is not None:
                store.put(tasks[place].key, payload)
            found[place] = payload
            computed += tasks[place].weight
        show()
    return found


def _computed(
    tasks: Sequence[Task], missing: Sequence[int], executor: Executor | None, workers: int
) -> Iterator[tuple[Sequence[int], list[Any]]]:
    """Places and payloads as they come; the first is computed here, and tells what the others cost.

    The second one is taken for it, since the first may compile.
    """
    seconds = 0.0
    for place in missing[:2]:
        start = time.perf_counter()
        payload = _bundle([tasks[place].call])
        seconds = time.perf_counter() - start
        yield [place], payload
    rest = missing[2:]
    if executor is not None and rest:
        yield from _dealt(tasks, rest, executor, seconds, workers)
        return
    worth = workers > 1 and seconds * len(rest) > _WORTH
    # This process only waits, so that answers are kept as soon as they come.
    with beside(workers + 1 if worth else 1) as pool:
        if pool is not None:
            yield from _dealt(tasks, rest, pool, seconds, workers)
            return
        for place in rest:
            yield [place], _bundle([tasks[place].call])


def _dealt(
    tasks: Sequence[Task], places: Sequence[int], executor: Executor, seconds: float, workers: int
) -> Iterator[tuple[Sequence[int], list[Any]]]:
    size = bundle_size(seconds, count=len(places), workers=workers)
    bundles = [places[start : start + size] for start in range(0, len(places), size)]
    calls = [partial(_bundle, [tasks[place].call for place in bundle]) for bundle in bundles]
    for number, payloads in dealt(executor, calls):
        yield bundles[number], payloads


def bundle_size(seconds: float, *, count: int, workers: int) -> int:
    """Tasks in one call of an executor, so that calls cost little, none of many workers waits for the process
    that makes them, and workers end together.

    Args: `seconds`: processor time that each takes. `count`: of tasks that are left.
    """
    busy = CALL * workers / (1 - _IDLE)
    enough = math.ceil(max(_BUNDLE, busy) / max(seconds, 1e-6))
    shares = _SHARES if busy <= _BUNDLE else 1
    return max(1, min(enough, math.ceil(count / (shares * workers))))


def _bundle(calls: Sequence[Callable[[], Any]]) -> list[Any]:
    return [call() for call in calls]
