"""The loop and its tuning: one run under each law and gain, and how likely each is to settle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from ringbalance.reports.numbers import MISSING, given, number, shown
from ringbalance.reports.pages.first_page import chance, retuned
from ringbalance.reports.section import Cells, Record, Section, Table

_MICROMETRE: Final = 1e6


def _view(_own: Record, evidence: Record) -> Record:
    return {"chance": chance(evidence), "table": _loop_table(evidence)}


def _loop_table(evidence: Record) -> Table:
    runs = evidence["closed_loop"]
    columns = {
        "Calibrated law,\nthe scene’s gain": runs.get("calibrated"),
        "Calibrated law,\nrecommended gain": retuned(evidence),
        "The paper’s law,\nthe scene’s gain": runs.get("paper"),
    }

    def row(label: str, read: Callable[[Record], str]) -> Cells:
        return label, *(MISSING if run is None else read(run) for run in columns.values())

    def factor(run: Record) -> str:
        return number(run.get("loop_factor"), digits=3)

    def gas(key: str, text: Callable[[Any], str]) -> Callable[[Record], str]:
        return lambda run: text(run["gas"][key]) if run.get("gas") else MISSING

    def length(key: str) -> Callable[[Record], str]:
        return lambda run: number(run[key] * _MICROMETRE, digits=2) if run.get(key) else MISSING

    rows = [
        row("Verdict", lambda run: run.get("verdict") or MISSING),
        row("Loop factor h, unstable from 2", factor),
        row("Within the limit from", lambda run: shown(run["settling_time_s"], "s", digits=3)),
        row("Standard deviation that noise keeps up, µm", length("stationary_deviation_m")),
        row("Injections", lambda run: str(_injections(run))),
        row("Gas consumed, normal litres", gas("normal_litres", lambda v: number(v, digits=2))),
        row("Energy to compress it", gas("compression_energy_J", lambda v: shown(v, "J", digits=2))),
        row("Injections that run a chamber dry", gas("injections_run_dry", str)),
        row("Overshoots", lambda run: str(run["overshoots"])),
        row("Misadjustments", lambda run: str(run["misadjustments"])),
    ]
    shown_rows = [cells for cells in rows if any(cell != MISSING for cell in cells[1:])]
    return Table(
        caption=f"One run each, with the scene’s noise; the limit is {given(evidence['limit_m'], 'm')}.",
        heads=("", *columns),
        rows=shown_rows,
    )


def _injections(run: Record) -> int:
    return run["injections"] if isinstance(run["injections"], int) else len(run["injections"])


SECTION: Final = Section(name="loop", title="Loop and tuning", place="report", show=_view)
