"""The command `ringbalance simulate`."""

from __future__ import annotations

import json as json_format
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ringbalance.controller.document import show, simulation_document, simulation_history
from ringbalance.controller.eccentric_mass.document import (
    eccentric_document,
    eccentric_history,
    show_eccentric,
)
from ringbalance.controller.eccentric_mass.run import locked_run, simulate_eccentric
from ringbalance.controller.line_runs import command_document, line_runs, line_runs_text
from ringbalance.controller.loop import simulate as run_loop
from ringbalance.reduced_model.calibration import law_by_name
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene, Models, checked_law, with_tolerance
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import Activity, activity, results_console

SETTLED: Final = 0
NOT_SETTLED: Final = 1
_LARGEST_SEED: Final = 2**63 - 1


@dataclass(frozen=True, kw_only=True)
class _Outputs:
    """Where a run goes."""

    json: bool
    csv: Path | None
    plot: Path | None


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
        law: "calibrated", "paper", or a file written by `ringbalance calibrate --save`; eccentric masses have
            none.
        json: print one JSON document instead of tables.
        csv: also write every instant of the run to this file, a column for each quantity with its unit.
        plot: also draw the run's figures on one sheet, an SVG file.
        seed: of all random numbers, in place of the scene's.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code: 0 settled, 1 not settled; the result is printed either way.

    Raises:
        SceneError: a scene, a law or an option that cannot be used.
        OSError: a file that cannot be written.
    """
    check_output("--csv", csv, ".csv")
    check_output("--plot", plot, ".svg")
    told = _with_seed(with_tolerance(load_scene(scene), tolerance=tolerance, models=models), seed)
    checked_law(told, law)
    outputs = _Outputs(json=json, csv=csv, plot=plot)
    settled = (
        _eccentric_masses(told, outputs) if isinstance(told, EccentricScene) else _ring(told, law, outputs)
    )
    return SETTLED if settled else NOT_SETTLED


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


def _ring(scene: Scene, law: str, outputs: _Outputs) -> bool:
    with activity("simulate", f"flow law: {law} (the first run compiles) ...") as shown:
        model = law_by_name(scene, law)
        found = run_loop(scene, model, progress=_clock(shown))
        at_ends = line_runs(scene, model)
    if outputs.csv is not None:
        write_whole(outputs.csv, _csv_text(simulation_history(found)))
    if outputs.plot is not None:
        _draw(outputs.plot, simulation_document(found))
    if outputs.json:
        print(json_format.dumps(command_document(found, at_ends), allow_nan=False))
    else:
        show(found, console=results_console())
        if at_ends:
            results_console().print(line_runs_text(at_ends), highlight=False, markup=False)
    return found.settled


def _eccentric_masses(scene: EccentricScene, outputs: _Outputs) -> bool:
    # The first run on a machine compiles for about half a minute; later ones take the code that is kept.
    with activity("simulate", "closed loop (the first run compiles)") as shown:
        found = simulate_eccentric(scene, progress=_clock(shown))
        locked = None if outputs.plot is None else locked_run(scene, progress=_clock(shown))
    if outputs.csv is not None:
        write_whole(outputs.csv, _csv_text(eccentric_history(found)))
    if outputs.plot is not None and locked is not None:
        runs = eccentric_document(found), eccentric_document(locked)
        _draw(outputs.plot, *runs, scene=scene)
    if outputs.json:
        print(json_format.dumps(eccentric_document(found), allow_nan=False))
    else:
        show_eccentric(found, console=results_console())
    return found.settled


def _draw(path: Path, *runs: dict[str, Any], scene: EccentricScene | None = None) -> None:
    # Loading what draws takes as long as a short run.
    from ringbalance.reports.figures.eccentric import eccentric_figures  # noqa: PLC0415
    from ringbalance.reports.figures.loop import run_figures  # noqa: PLC0415
    from ringbalance.reports.figures.sheet import sheet  # noqa: PLC0415

    write_whole(path, sheet(run_figures(*runs) if scene is None else eccentric_figures(scene, *runs)))


def _clock(shown: Activity) -> Callable[[float, float], None]:
    """Shows the simulated time, s, of the time limit, s."""
    return lambda time, limit: shown.show(f"{time:.1f} s of {limit:g} s simulated", done=time, total=limit)


def _csv_text(columns: Mapping[str, Sequence[Any]]) -> str:
    """Columns of one length as a table with its names in the first line; None is an empty cell."""
    texts = [["" if value is None else str(value) for value in values] for values in columns.values()]
    return "\n".join([",".join(columns), *map(",".join, zip(*texts, strict=True))]) + "\n"
