"""Many designs, for Python and as the command `sweep`: a sweep, and one design as a function to optimise."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import Executor
from json import dumps
from os import PathLike
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ringbalance.design.axes import plan_of, plan_of_file, plan_of_texts
from ringbalance.design.static import EMPTY, REFUSED, static_rows
from ringbalance.design.sweep import STORE, Sweep, check_rows, run_sweep
from ringbalance.design.work import Progress
from ringbalance.interface import check_counts, checked, opened, print_result
from ringbalance.scene import AnyScene
from ringbalance.scene.changes import file_text
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.narrowing import read_tolerance
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import activity, print_message
from ringbalance.scene.registry import registered


@checked
def sweep(
    scene: AnyScene,
    vary: Mapping[Any, Any],
    *,
    sample: str = "",
    runs: int = 0,
    intervals: bool = True,
    check: int = 0,
    executor: Executor | None = None,
    workers: int = 1,
    store: str | PathLike[str] | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Answer every point of a grid, or of a sample, of changed scenes.

    Args: `vary`: by path such as "tube.bore", an array in SI, a list of values as a scene file has them, or
        a text such as "0.5mm:2mm:30"; by a tuple of k paths that move together, one of these for each, or
        an array of shape (points, k), a row for each point, as packages for the design of experiments have
        it; by the name of a table, a list of mappings from its keys, or a CSV file. `sample`: "sobol:1024" or
        "latin:1024" instead of every combination; ranges are "0.5mm:2mm" then. `runs`: largest number
        of drawn devices of each point, fewer where they decide. `intervals`: True to propagate uncertain
        inputs, which takes most of the time of static answers. `check`: number of
        rows of a liquid ring to compare with full calibrations, by default none (the command takes three).
        `executor`: any `concurrent.futures.Executor`; its answers are those of this process to
        the last bit. `workers`: number of processes if there is no executor. `store`: folder of
        the answers, from which an interrupted sweep resumes. `progress`: called with the progress so far.
    Raises: SceneError: a scene or an axis that cannot be used; a point that is refused is a row with its
        finding.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> table = rb.sweep(scene, {"tube.bore": [1e-3, 1.5e-3], "gas.pressure": "0.6MPa:0.8MPa:3"})
        >>> len(table.points)
        6
        >>> import numpy as np
        >>> points = np.array([[1e-3, 0.6e6], [1.2e-3, 0.7e6], [1.5e-3, 0.65e6]])
        >>> table = rb.sweep(scene, {("tube.bore", "gas.pressure"): points})
        >>> table.points[1]
        {'tube.bore': 0.0012, 'gas.pressure': 700000.0}
    """
    if not isinstance(vary, Mapping):
        raise TypeError(f'`vary` maps keys to values, such as {{"tube.bore": [1e-3, 2e-3]}}: {vary!r}')
    if executor is not None and not hasattr(executor, "submit"):
        raise TypeError(f"`executor` is none of concurrent.futures: {executor!r}")
    check_counts("sweep", runs=runs, check=check, workers=workers)
    try:
        return run_sweep(
            scene,
            plan_of(scene, vary, sample=sample),
            runs=runs,
            intervals=intervals,
            check=check,
            store=None if store is None else Path(store),
            executor=executor,
            workers=workers,
            progress=progress,
        )
    except SceneError as error:
        raise error.as_keys_of("rb.sweep") from None


@checked
def objective(scene: AnyScene, changes: Mapping[str, Any], *, runs: int = 0) -> dict[str, Any]:
    """Answer one changed scene with plain numbers, for an optimiser: the same changes give the same answer.

    Args: `changes`: values in SI, or texts as in a scene file, by path such as "tube.bore". `runs`: largest
        number of drawn devices; 0: static answers alone.
    Returns: The columns of a sweep's row in SI, None where not known: of a liquid ring `lambda`, `moment`,
        `velocity`, `usable_moment` and others; with runs `fraction` of the devices that meets all that the
        scene requires, its bounds `low` and `high` (95 %), and `settling_time`. `status` is "ok", "blocked"
        (no flow) or "point_refused", `verdict` with runs "met", "not met" or "undecided", else the status,
        `finding` says why there is no answer. A refused value raises nothing, so that a search can continue.
    Raises: SceneError: a path that is no key of the scene.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> answer = rb.objective(scene, {"tube.bore": "1.2 mm"})
        >>> answer["status"], answer["velocity"] > 10
        ('ok', True)
    """
    check_counts("sweep", runs=runs)
    (row,) = static_rows(scene, [dict(changes)], intervals=False)
    if row["status"] == REFUSED:
        schema = scene_kind(scene.balancer).schema
        paths = [path.split(".") for path in changes]
        if not all(tables and key in schema.keys_in(tables) for *tables, key in paths):
            scene.with_values(changes)  # Names the path that is no key.
    driven = runs and row["sha256"]
    run = registered("function", "run_row")(scene, dict(changes), runs) if driven else EMPTY
    finding = row["finding"] or run["finding"]
    return {
        **{name: value for name, (value, _) in row["values"].items()},
        **{name: value for name, value in run.items() if name not in ("ended", "finding")},
        "status": row["status"],
        "verdict": run["verdict"] if driven else row["status"],
        "finding": finding["values"]["text"] if finding else "",
    }


def sweep_file(options: SimpleNamespace) -> int:
    """Run the command `sweep`: write the table, its document, figures and the scenes of some rows."""
    scene = opened(options.scene, None, options.seed)
    if options.tolerance is not None:
        scene = scene.with_values({"accuracy.tolerance": read_tolerance(options.tolerance)})
    if options.plan is None:
        points = plan_of_texts(scene, options.vary or [], sample=options.sample)
    elif options.vary or options.sample:
        problem, allowed = "the plan has axes and sample", "either of them"
        raise SceneError.of_option(option="--plan", value=str(options.plan), problem=problem, allowed=allowed)
    else:
        points = plan_of_file(scene, options.plan)
    if options.write:
        check_rows(options.write, len(points.points()))
    table, summary = options.out / "table.csv", options.out / "sweep.json"
    for file in (table, summary):
        check_file(file)
    with activity("sweep", "points ...") as shown:
        result = run_sweep(
            scene,
            points,
            runs=options.runs,
            intervals=not options.no_intervals,
            check=options.check,
            store=options.out / STORE,
            workers=options.workers or os.cpu_count() or 1,
            progress=lambda done: shown.show(done.text, done=done.points, total=done.total),
        )
    write_whole(table, result.to_csv())
    write_whole(summary, dumps(result.to_dict(), allow_nan=False) + "\n")
    if not options.no_figures:
        result.plot(options.out / "figures")
    print_result(result, json=options.json)
    if not options.json:
        print_message(f"written to {options.out}")
    folder, errors = options.out / "scenes", list[Fault]()
    for row in options.write or ():
        try:
            write_whole(folder / f"row-{row}.toml", file_text(result.point_scene(row), to=folder))
        except SceneError as error:
            problem = f"this row has no scene: {error}"
            of_row = SceneError.of_option(option="--write", value=row, problem=problem, allowed="other rows")
            errors += of_row.faults
    if errors:
        raise SceneError(errors)
    return 0
