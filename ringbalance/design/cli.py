"""The command `ringbalance sweep`."""

from __future__ import annotations

import json as json_format
import os
from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from ringbalance.design.axes import Plan, plan_of_file, plan_of_texts
from ringbalance.design.sweep import STORE, Sweep, check_rows, run_sweep
from ringbalance.results.result import print_rows
from ringbalance.scene.changes import file_text
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import read_tolerance
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.processes import checked_workers
from ringbalance.scene.platform.terminal import activity, print_message

TABLE: Final = "table.csv"
SUMMARY: Final = "sweep.json"


def sweep(
    scene: Path,
    *,
    out: Path,
    vary: Annotated[list[str] | None, Parameter(consume_multiple=1)] = None,
    plan: Path | None = None,
    sample: str = "",
    runs: int = 0,
    no_intervals: bool = False,
    check: int = 3,
    workers: int | None = None,
    no_figures: bool = False,
    write: Annotated[list[int] | None, Parameter(consume_multiple=1)] = None,
    tolerance: str | None = None,
    json: bool = False,
) -> int:
    """Answer every point of a grid or a sample of designs; an interrupted sweep goes on where it was.

    Args:
        scene: the scene file.
        out: folder for table.csv, sweep.json, figures, and the answers that are kept.
        vary: axes, such as tube.bore=0.5mm:2mm:30, gas.pressure=0.4MPa,0.7MPa or gas=valves.csv.
        plan: a TOML file with vary and sample instead.
        sample: sobol:N or latin:N points of the axes' ranges instead of every combination.
        runs: drawn devices that every point is run as in closed loop at most, fewer where they decide; 0
            for static answers alone.
        no_intervals: leave out what the uncertain inputs do to static answers: most of their time.
        check: rows of a liquid ring to calibrate, which measures what the array core leaves out.
        workers: processes; default one for each processor.
        no_figures: draw none.
        write: rows whose scenes to write.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005: rows that err by more are named.
        json: print one JSON document instead of tables.

    Returns:
        Exit code 0; a point that has no answer is a row with its finding.

    Raises:
        SceneError: a scene or an axis that cannot be used.
        OSError: a file that cannot be written.
    """
    _check_count("--runs", runs)
    _check_count("--check", check)
    workers = checked_workers((os.cpu_count() or 1) if workers is None else workers)
    told = load_scene(scene)
    if tolerance is not None:
        told = told.with_values({"accuracy.tolerance": read_tolerance(tolerance)})
    planned = _plan(told, vary or [], plan, sample)
    if write:
        check_rows(write, len(planned.points()))
    for name in (TABLE, SUMMARY):
        check_file(out / name)
    with activity("sweep", "points ...") as shown:
        found = run_sweep(
            told,
            planned,
            runs=runs,
            intervals=not no_intervals,
            check=check,
            store=out / STORE,
            workers=workers,
            progress=lambda done: shown.show(done.text, done=done.points, total=done.total),
        )
    text = json_format.dumps(found.to_dict(), allow_nan=False)
    _write(found, out, text, figures=not no_figures)
    if json:
        print(text)
    else:
        print_rows(found.rows())
        print_message(f"written to {out}")
    _write_scenes(found, out / "scenes", write or [])
    return 0


def _check_count(option: str, count: int) -> None:
    if count < 0:
        allowed = "0 or more"
        raise SceneError.of_option(option=option, value=count, problem="it is negative", allowed=allowed)


def _plan(scene: SceneFile, vary: list[str], file: Path | None, sample: str) -> Plan:
    if file is None:
        return plan_of_texts(scene, vary, sample=sample)
    if vary or sample:
        problem = "the plan has axes and sample"
        raise SceneError.of_option(
            option="--plan", value=str(file), problem=problem, allowed="either of them"
        )
    return plan_of_file(scene, file)


def _write(found: Sweep, out: Path, text: str, *, figures: bool) -> None:
    write_whole(out / TABLE, found.to_csv())
    write_whole(out / SUMMARY, text + "\n")
    if figures:
        found.plot(out / "figures")


def _write_scenes(found: Sweep, folder: Path, rows: list[int]) -> None:
    """Raises: SceneError: rows that have no scene, after those of the others are written."""
    faults: list[Fault] = []
    for row in rows:
        try:
            write_whole(folder / f"row-{row}.toml", file_text(found.point_scene(row), to=folder))
        except SceneError as error:
            problem = f"this row has no scene: {error}"
            of_row = SceneError.of_option(option="--write", value=row, problem=problem, allowed="other rows")
            faults += of_row.faults
    if faults:
        raise SceneError(faults)
