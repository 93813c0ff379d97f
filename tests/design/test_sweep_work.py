"""Answers of a sweep: any executor, stored ones, and the work of many workers."""

from __future__ import annotations

import os
import shutil
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sweep import on_paper

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.design.store import Store
from ringbalance.design.work import bundle_size
from ringbalance.scene.models import Scene

VARY = {"tube.bore": "0.6mm:2mm:4:log", "gas.pressure": np.linspace(0.3e6, 0.9e6, 3)}


class Lost(Executor):
    """Workers that the system ends: at work, or before, as a pool that is broken already says at once."""

    def __init__(self, *, before: bool = False) -> None:
        self.before = before

    def submit(self, _function: Any, /, *_: Any, **_named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.before:
            raise BrokenProcessPool("ended before")
        future.set_exception(BrokenProcessPool("ended"))
        return future


def test_a_store_says_what_it_answered(paper_scene: Scene, tmp_path: Path) -> None:
    few, more = ({"tube.bore": [1e-3 * bore for bore in bores]} for bores in ([1.0, 1.2], [1.0, 1.2, 1.4]))
    first = rb.sweep(paper_scene, few, runs=1, intervals=False, store=tmp_path)
    assert first.resumed == {}
    again = rb.sweep(paper_scene, more, runs=1, intervals=False, store=tmp_path)
    assert again.to_dict()["resumed"] == {"runs": 2}
    (finding,) = (each for each in again.rows().findings if each.code == "sweep_resumed")
    assert finding.values == {"count": 2, "what": "runs"}
    assert again.driven[:2] == first.driven


def test_any_executor_gives_the_same_table(paper_scene: Scene, caplog: pytest.LogCaptureFixture) -> None:
    pressures = {"gas.pressure": np.linspace(0.4e6, 0.8e6, 5)}
    serial = rb.sweep(paper_scene, pressures, runs=2).to_csv()
    with ThreadPoolExecutor(2) as threads:
        assert rb.sweep(paper_scene, pressures, runs=2, executor=threads).to_csv() == serial
    for lost in (Lost(), Lost(before=True)):
        caplog.clear()
        assert rb.sweep(paper_scene, pressures, runs=2, executor=lost).to_csv() == serial
        assert sum("its work is done again in this process" in each for each in caplog.messages) == 1


def test_kept_answers_are_found_by_content_and_damaged_ones_made_again(
    paper_scene: Scene, tmp_path: Path
) -> None:
    done: list[int] = []

    def sweep(**options: Any) -> str:
        done.clear()

        def report(progress: Any) -> None:
            done.append(progress.computed)

        return rb.sweep(paper_scene, VARY, store=tmp_path, progress=report, **options).to_csv()

    first = sweep()
    assert done[-1] == 12
    assert sweep() == first
    assert done[-1] == 0
    (entry,) = (path for path in tmp_path.rglob("*") if path.is_file())
    content = bytearray(entry.read_bytes())
    content[len(content) // 2] ^= 4
    entry.write_bytes(bytes(content))
    assert Store(folder=tmp_path).get(entry.name) is None
    assert sweep() == first
    assert done[-1] == 12
    for spoil in (
        partial(entry.symlink_to, "/dev/zero"),
        partial(os.mkfifo, entry),
        partial((entry / "more").mkdir, parents=True),
    ):
        entry.unlink()
        spoil()
        assert sweep() == first
        assert done[-1] == 12
        assert entry.is_file()
    shutil.rmtree(entry.parent)
    entry.parent.touch()
    assert sweep() == first
    assert entry.is_file()
    sweep(intervals=False)
    assert done[-1] == 12


def test_bundles_hide_what_a_call_costs_and_leave_work_for_all() -> None:
    """At 5 ms a call and 5 % of it: at least 100 ms of work, except where workers would be idle."""
    for seconds in (1e-4, 1e-2, 0.3, 10.0):
        size = bundle_size(seconds, count=100_000, workers=4)
        assert size * seconds >= 0.1
    assert bundle_size(1e-3, count=64, workers=4) == 2


@pytest.mark.parametrize(("workers", "least"), [(10, 0.95), (100, 0.95), (1000, 0.8)])
def test_many_workers_wait_little_for_the_process_that_serves_them(workers: int, least: float) -> None:
    """On paper: 100,000 designs of 0.25 s, 5 ms a call."""
    assert on_paper(workers, designs=100_000, each=0.25) > least


def test_rows_to_write_are_looked_at_first_and_refused_ones_cost_no_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, out = str(rb.bundled_scene("liquid_ring_paper")), tmp_path / "out"
    options = ["--vary", "tube.hump_radius=30mm,500mm", "--out", str(out), "--no-figures", "--check", "0"]
    assert main(["sweep", scene, *options, "--write", "2"]) == 2
    assert not out.exists()
    assert main(["sweep", scene, *options, "--write", "0", "1"]) == 2
    assert "--write = 1: this row has no scene" in capsys.readouterr().err
    assert [file.name for file in (out / "scenes").iterdir()] == ["row-0.toml"]
    assert (out / "table.csv").exists()
