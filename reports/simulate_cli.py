"""The command `ringbalance simulate`."""

from __future__ import annotations

import json as json_format
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from ringbalance.controller.balancer import AS_GIVEN, Run, balancer_under
from ringbalance.results.result import csv_text, print_rows
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import AnyScene, Models, with_tolerance
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import Activity, activity

SETTLED: Final = 0
NOT_SETTLED: Final = 1
_LARGEST_SEED: Final = 2**63 - 1


def simulate(
    scene: Path,
    *,
    law: str = "calibrated",
    json: bool = False,
    csv: Path | None = None,
    plot: Path | None = None,
    seed: int | None = None,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Run one closed-loop balancing of a scene.

    Args:
        scene: the scene file.
        law: of a liquid ring: "calibrated", "paper", or a file written by `ringbalance calibrate --save`.
        json: print one JSON document instead of tables.
        csv: also write every instant of the run to this file, a column for each quantity with its unit.
        plot: also draw the run's figures on one sheet, an SVG file.
        seed: of all random numbers, in place of the scene's.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code: 0 settled, with all that the scene requires; 1 otherwise; the result is printed either way.

    Raises:
        SceneError: a scene, a law or an option that cannot be used.
        OSError: a file that cannot be written.
    """
    check_output("--csv", csv, ".csv")
    check_output("--plot", plot, ".svg")
    told = _with_seed(with_tolerance(load_scene(scene), tolerance=tolerance, models=models), seed)
    balancer = balancer_under(law, told)
    with activity("simulate", "closed loop ...") as shown:
        outcomes = balancer.run({}, AS_GIVEN, trace=True, progress=_clock(shown))
        run, met = outcomes.traced[0].run, all(each.met(outcomes).all() for each in balancer.demands())
        document = run.to_dict() if json else {}
        drawing = None if plot is None else _sheet(told, run)
    if csv is not None:
        write_whole(csv, csv_text(balancer.history(run)))
    if plot is not None and drawing is not None:
        write_whole(plot, drawing)
    if json:
        print(json_format.dumps(document, allow_nan=False))
    else:
        print_rows(balancer.rows(run))
    return SETTLED if run.settled and met else NOT_SETTLED


def check_output(option: str, path: Path | None, ending: str) -> None:
    """Raises: SceneError: a file name with another ending. OSError: the file cannot be written."""
    if path is None:
        return
    if path.suffix.lower() != ending:
        problem = "this name does not say what is written"
        raise SceneError.of_option(
            option=option, value=str(path), problem=problem, allowed=f"a file name that ends in {ending}"
        )
    check_file(path)


def _with_seed(scene: AnyScene, seed: int | None) -> AnyScene:
    if seed is None:
        return scene
    if not 0 <= seed <= _LARGEST_SEED:
        raise SceneError.of_option(
            option="--seed", value=seed, problem="out of range", allowed="a whole number from 0 to 2^63 - 1"
        )
    return replace(scene, run=replace(scene.run, seed=seed))


def _sheet(scene: AnyScene, run: Run) -> str:
    # Loading what draws takes as long as a short run.
    from ringbalance.reports.figure import sheet  # noqa: PLC0415
    from ringbalance.reports.run_figures import figures_of  # noqa: PLC0415

    return sheet(figures_of(scene, run))


def _clock(shown: Activity) -> Callable[[float, float], None]:
    """Shows the simulated time, s, of the time limit, s."""
    return lambda time, limit: shown.show(f"{time:.1f} s of {limit:g} s simulated", done=time, total=limit)
