"""A list of jobs: answers that others need, the process that does each, and what happens when one is lost."""

from __future__ import annotations

import os
import signal
import time
from concurrent.futures import Future
from functools import partial

import pytest

from ringbalance.scene.platform.jobs import Job, answers_of
from ringbalance.scene.platform.processes import Workers


def slow(seconds: float) -> int:
    """The process that slept."""
    time.sleep(seconds)
    return os.getpid()


def named(*answers: object) -> tuple[tuple[object, ...], int]:
    """What was needed, and the process."""
    return answers, os.getpid()


def killed(here: int) -> str:
    """Ends a worker as the system does for want of memory."""
    if os.getpid() != here:
        os.kill(os.getpid(), signal.SIGKILL)
    return "done"


CHAIN = (
    Job(name="sum", do=lambda a, b: a + b, needs=("one", "two")),
    Job(name="one", do=lambda: 1),
    Job(name="two", do=lambda one: one + 1, needs=("one",), title="Two"),
)


def test_a_job_takes_the_answers_that_it_needs() -> None:
    told: list[str] = []
    assert list(answers_of(CHAIN, None, told.append)) == [("one", 1), ("two", 2), ("sum", 3)]
    assert told == ["1 of 3: one", "2 of 3: Two", "3 of 3: sum"]


def test_a_need_that_nothing_gives_is_named() -> None:
    with pytest.raises(ValueError, match="no job gives what sum needs: one, two"):
        list(answers_of(CHAIN[:1], None))


def test_this_process_does_what_no_worker_has_begun() -> None:
    jobs = [
        Job(name="long", do=partial(slow, 3.0)),
        *(Job(name=f"short {n}", do=partial(slow, 0.01)) for n in range(8)),
        Job(name="last", do=named, needs=("long", "short 7")),
    ]
    with Workers(1) as pool:
        assert pool.submit(os.getpid).result() != os.getpid()
        answers = dict(answers_of(jobs, pool))
    answered, _ = answers.pop("last")
    assert answered == (answers["long"], answers["short 7"])
    assert os.getpid() in answers.values()
    assert len(set(answers.values())) == 2


def test_what_a_lost_worker_had_begun_is_done_here_and_said_once(caplog: pytest.LogCaptureFixture) -> None:
    jobs = [
        Job(name="lost", do=partial(killed, os.getpid())),
        *(Job(name=f"other {n}", do=partial(slow, 0.2)) for n in range(4)),
        Job(name="last", do=named, needs=("lost",)),
    ]
    with Workers(1) as pool:
        answers = dict(answers_of(jobs, pool))
    assert answers["lost"] == "done"
    assert answers["last"] == (("done",), os.getpid())
    assert caplog.text.count("a worker process was ended by the system") == 1


def test_who_leaves_early_wants_nothing_of_the_rest() -> None:
    begun: list[Future[object]] = []

    class Idle(Workers):
        def submit(self, *_: object, **__: object) -> Future[object]:  # type: ignore[override]
            begun.append(Future())
            return begun[-1]

    def interrupted() -> None:
        raise KeyboardInterrupt

    jobs = [Job(name="stopped", do=interrupted), Job(name="never", do=slow)]
    with pytest.raises(KeyboardInterrupt), Idle(1) as pool:
        list(answers_of(jobs, pool))
    assert all(future.cancelled() for future in begun)
    assert len(begun) == 2
