"""The command `ringbalance tune`."""

from __future__ import annotations

import json as json_format
import math
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ringbalance.controller.tuning.eccentric import (
    eccentric_tuning_document,
    show_eccentric_tuning,
    tune_eccentric,
)
from ringbalance.controller.tuning.tune import Tuning, tuning_document
from ringbalance.controller.tuning.tune import tune as tune_scene
from ringbalance.reduced_model.calibration import law_by_name
from ringbalance.reduced_model.gas_line import line_text, line_warning
from ringbalance.reduced_model.terms import neglected_in_injections
from ringbalance.results.render import two_columns
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import Models, checked_law, with_tolerance
from ringbalance.scene.platform.terminal import activity, results_console

TUNED = 0
NOT_TUNED = 1
_UM = 1e6


def tune(
    scene: Path,
    *,
    law: str = "calibrated",
    json: bool = False,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Recommend the controller's gain, with its margins and the settling times under it.

    Args:
        scene: the scene file.
        law: "calibrated", "paper", or a file written by `ringbalance calibrate --save`; eccentric masses have
            none.
        json: print one JSON document instead of tables.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code: 0 what is recommended settles 95 % of the runs; 1 otherwise; the result is printed either
        way.

    Raises:
        SceneError: a scene or a law that cannot be used.
    """
    given = with_tolerance(load_scene(scene), tolerance=tolerance, models=models)
    checked_law(given, law)
    if isinstance(given, EccentricScene):
        return _eccentric_masses(given, json=json)
    with activity("tune", f"flow law: {law} ...") as shown:
        found = tune_scene(given, law_by_name(given, law), progress=shown.show)
    if json:
        print(json_format.dumps(tuning_document(found), allow_nan=False))
    else:
        _show(found, results_console())
    return TUNED if found.succeeded else NOT_TUNED


def _eccentric_masses(scene: EccentricScene, *, json: bool) -> int:
    with activity("tune", "runs ...") as shown:
        found = tune_eccentric(scene, told=shown.show)
    if json:
        print(json_format.dumps(eccentric_tuning_document(found), allow_nan=False))
    else:
        show_eccentric_tuning(found, results_console())
    return TUNED if found.succeeded else NOT_TUNED


def _show(tuning: Tuning, console: Console) -> None:
    console.print(Text(tuning.status, style=f"bold {'green' if tuning.succeeded else 'yellow'}"))
    warning = line_warning(tuning.gas_line)
    # Runs that settle with the scene's own line have shown what its smallest correction left open.
    if warning and not tuning.reachable:
        console.print(Text(warning, style="yellow"))
    console.print(two_columns(_rows(tuning).items()))
    parts = Table(title="uncertainty of the loop factor (95 %)", title_justify="left")
    for name in ("part", "relative", "from"):
        parts.add_column(name)
    for part in tuning.contributions:
        parts.add_row(part.name, f"{100 * part.uncertainty:.2g} %", part.source)
    console.print(parts)


def _rows(tuning: Tuning) -> dict[str, str]:
    settings, loop, margins = tuning.scene.controller, tuning.loop, tuning.margins
    rows = {"flow law": tuning.law, "algorithm": settings.kind.replace("_", " ")}
    if tuning.gain is not None:
        rows["recommended gain"] = f"{tuning.gain / _UM:.4g} s/um (controller.proportional)"
    if loop.value is not None:
        rows["loop factor"] = f"{loop.value:.3g} of at most {loop.limit:.3g}"
    if tuning.present.value is not None:
        rows["loop factor of the scene"] = f"{tuning.present.value:.3g}"
    if loop.deviation is not None:
        rows["noise leaves"] = f"{loop.deviation * _UM:.4g} um, limit {settings.limit * _UM:.4g} um"
    if margins is not None:
        rows["margins"] = (
            f"gain x {margins.gain_factor:.3g}, phase {math.degrees(margins.phase):.3g} deg; together (disk) "
            f"gain x {margins.disk_gain_factor:.3g}, phase {math.degrees(margins.disk_phase):.3g} deg"
        )
        rows["left at the edge of the uncertainty"] = (
            f"gain x {margins.left_gain_factor:.3g}, phase {math.degrees(margins.left_phase):.3g} deg"
        )
    if tuning.first_gas_time is not None and tuning.last_gas_time is not None:
        rows["valve-open times"] = (
            f"{tuning.first_gas_time:.3g} s at first, {tuning.last_gas_time * 1e3:.3g} ms at the limit; the "
            f"valve's shortest is {settings.minimum_gas_time * 1e3:.3g} ms"
        )
    if tuning.change:
        rows["recommended beside the gain"] = tuning.change
    if tuning.dead_times:
        low, high = min(tuning.dead_times), max(tuning.dead_times)
        rows["dead time of the valves"] = (
            f"{low * 1e3:.3g} to {high * 1e3:.3g} ms; no injection moves liquid up to "
            f"{tuning.dead_zone * _UM:.3g} um"
        )
    rows["smallest correction, ideal valve"] = f"{tuning.smallest_correction * _UM:.4g} um"
    rows["gas line"] = line_text(tuning.gas_line)
    rows["neglected"] = neglected_in_injections(tuning.models_used).text
    return rows | _settling(tuning) | _tried(tuning)


def _tried(tuning: Tuning) -> dict[str, str]:
    rows = tuning.search.tried if tuning.search else ()
    return {
        f"tried {place}": f"{row.change}: {round(row.settled * row.runs)} of {row.runs} runs"
        for place, row in enumerate(rows, start=1)
    }


def _settling(tuning: Tuning) -> dict[str, str]:
    return {} if tuning.settling is None else tuning.settling.rows(tuning.scene.run.time_limit)
