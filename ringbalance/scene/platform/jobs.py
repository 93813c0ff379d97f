"""Work as a list of jobs: each begins, in a free process, once the results that it needs are available."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from functools import partial
from typing import Any

from ringbalance.scene.platform.processes import Workers


@dataclass(frozen=True, kw_only=True, eq=False)
class Job:
    """A piece of work with a name."""

    name: str
    do: Callable[..., Any]
    """A function of an importable module; takes the results of `needs` in their order."""
    needs: tuple[str, ...] = ()
    """Names of the jobs whose results it takes."""
    title: str = ""
    """Text for the progress; empty: the name."""


def answers_of(
    jobs: Sequence[Job], pool: Workers | None, progress: Callable[[str], None] = lambda _: None
) -> Iterator[tuple[str, Any]]:
    """Names and results of jobs as they finish, by a pool and this process: the first ready job begins first.

    Jobs of a lost worker are repeated in this process. Leaving early cancels jobs that have not begun.
    Args: `pool`: None: this process does all jobs. `progress`: takes the title of each job of this process.
    """
    waiting, answers = list(jobs), dict[str, Any]()
    under_way: dict[Job, tuple[Callable[[], Any], Future[Any]]] = {}
    try:
        while waiting or under_way:
            for job in [each for each in waiting if answers.keys() >= {*each.needs}]:
                waiting.remove(job)
                call = partial(job.do, *(answers[name] for name in job.needs))
                under_way[job] = call, pool.submit(call) if pool else Future()
            if not under_way:
                raise ValueError(f"no job gives what {waiting[0].name} needs: {', '.join(waiting[0].needs)}")
            ended = [job for job, (_, future) in under_way.items() if future.done()]
            if not ended:
                # This process does a job that no worker has begun.
                free = next((job for job in filter(under_way.get, jobs) if under_way[job][1].cancel()), None)
                if free is None:
                    wait([future for _, future in under_way.values()], return_when=FIRST_COMPLETED)
                else:
                    progress(f"{len(answers) + 1} of {len(jobs)}: {free.title or free.name}")
                    ended = [free]
            for job in ended:
                do, future = under_way.pop(job)
                answers[job.name] = do() if pool is None or future.cancelled() else pool.result(future, do)
                yield job.name, answers[job.name]
    finally:
        for _, future in under_way.values():
            future.cancel()
