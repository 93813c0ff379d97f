"""A tuning of a liquid ring for a person."""

from __future__ import annotations

import math

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ringbalance.controller.tuning.tune import Tuning
from ringbalance.reduced_model.gas_line import line_text, line_warning
from ringbalance.reduced_model.terms import neglected_in_injections
from ringbalance.results.render import two_columns

_UM = 1e6


def show_tuning(tuning: Tuning, console: Console) -> None:
    """Print what is recommended, the margins and the settling times."""
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
