"""The loop and its tuning: one run under each law and gain, and how likely each is to settle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from ringbalance.reports.figures.operation import residual_polar, settling_histogram
from ringbalance.reports.numbers import MISSING, given, number, shown
from ringbalance.reports.pages.first_page import chance, retuned
from ringbalance.reports.section import Cells, Record, Section, Table, Work

_MICROMETRE: Final = 1e6
_GAINS: Final = {1: "with the scene’s gain", 2: "with the recommended settings"}
"""Titles of the calibrated law's ensembles, by their place in the evidence."""


def _reach(work: Work) -> Record:
    """What a pair cancels at the most, as a vibration; where the first pair's lies, by the sensor's phase."""
    scene, moment = work.scene, work.calibration.residual.usable_pair_moment
    return {
        "pairs": scene.disc.chambers // 2,
        "vibration_m": moment * scene.rotor.influence_coefficient,
        "direction_rad": -scene.rotor.lag_angle,
        "time_limit_s": scene.run.time_limit,
    }


def _view(found: Record, evidence: Record) -> Record:
    run = evidence["closed_loop"].get("calibrated")
    return {
        "chance": chance(evidence),
        "table": _loop_table(evidence),
        "polar": residual_polar(run, found) if run and found else None,
        "settling": settling_histogram(_samples(found, evidence)) if found else None,
    }


def _samples(found: Record, evidence: Record) -> list[Record]:
    ensembles = (evidence.get("consequences") or {}).get("ensembles", [])
    return [
        {
            "title": title,
            "edges_s": ensembles[place]["settling_time_s"]["edges"],
            "counts": ensembles[place]["settling_time_s"]["counts"],
            "runs": ensembles[place]["members"],
            "not_settled": ensembles[place]["probability"]["not_settled"]["value"],
            "time_limit_s": found["time_limit_s"],
        }
        for place, title in _GAINS.items()
        if place < len(ensembles)
    ]


def _loop_table(evidence: Record) -> Table:
    runs = evidence["closed_loop"]
    columns = {
        "Calibrated law,\nthe scene’s gain": runs.get("calibrated"),
        "Calibrated law,\nrecommended settings": retuned(evidence),
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


SECTION: Final = Section(
    name="loop", title="Loop and tuning", place="report", collect=_reach, show=_view, always=True
)
