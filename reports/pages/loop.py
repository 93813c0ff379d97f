"""The loop and its tuning: one run under each law and gain, and how likely each is to settle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from ringbalance.reports.figures.operation import residual_polar, settling_histogram
from ringbalance.reports.pages.first_page import RETUNED, place_of_run
from ringbalance.reports.prose import found_at, traced
from ringbalance.reports.section import Cells, Record, Section, Table, Work
from ringbalance.reports.summary import runs_settled
from ringbalance.results.numbers import MISSING, given, number, percent, shown

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
        "chance": _chance(evidence),
        "table": _loop_table(evidence),
        "polar": residual_polar(run, found) if run and found else None,
        "settling": settling_histogram(_samples(found, evidence)) if found else None,
    }


def _chance(evidence: Record) -> list[str]:
    """Fractions of the ensembles that have settled by the end, with the scene's gain and the recommended."""
    ensembles = (evidence.get("consequences") or {}).get("ensembles", [])
    found = evidence.get("summary")
    if len(ensembles) < 3 or not found:
        return []
    members, until = ensembles[1]["members"], given(found["time_limit_s"], "s")
    own, tuned = (percent(1 - e["probability"]["not_settled"]["value"]) for e in ensembles[1:])
    line = evidence["calibration"].get("gas_line") or {"given": True}
    return [
        f"{'With' if line['given'] else 'For a valve that acts at once: with'} the scene’s gain {own} of "
        f"{members} runs over the stated uncertainties and the noise have settled by {until}, with the "
        f"recommended settings {tuned}. {_tuned(found['tuning'])}"
    ]


def _tuned(tuning: Record) -> str:
    reached = (tuning["settling_time_s"] or {}).get("p95")
    if reached is None:
        return f"{tuning['status'][0].upper()}{tuning['status'][1:]}."
    return (
        f"With every term of an injection modelled, {runs_settled(tuning)} settle with the "
        f"recommended settings, {percent(0.95)} of all within {shown(reached, 's', digits=2)}."
    )


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
    columns = {
        "Calibrated law,\nthe scene’s gain": "closed_loop.calibrated",
        "Calibrated law,\nrecommended settings": f"consequences.runs.{place_of_run(evidence, RETUNED)}",
        "The paper’s law,\nthe scene’s gain": "closed_loop.paper",
    }
    runs = [(path, found_at(evidence, path)) for path in columns.values()]

    def row(label: str, key: str, text: Callable[[Any], str]) -> Cells:
        def cell(path: str, run: Record | None) -> str:
            value = found_at(run, key)
            return MISSING if value is None else traced(text(value), f"{path}.{key}")

        return label, *(cell(path, run) for path, run in runs)

    rows = [
        ("Verdict", *((run or {}).get("verdict") or MISSING for _, run in runs)),
        row("Loop factor h, unstable from 2", "loop_factor", lambda v: number(v, digits=3)),
        row("Within the limit from", "settling_time_s", lambda v: shown(v, "s", digits=3)),
        row(
            "Standard deviation that noise keeps up, µm",
            "stationary_deviation_m",
            lambda v: number(v * _MICROMETRE, digits=2),
        ),
        ("Injections", *(MISSING if run is None else str(_injections(run)) for _, run in runs)),
        row("Gas consumed, normal litres", "gas.normal_litres", lambda v: number(v, digits=2)),
        row("Energy to compress it", "gas.compression_energy_J", lambda v: shown(v, "J", digits=2)),
        row("Injections that run a chamber dry", "gas.injections_run_dry", str),
        row("Overshoots", "overshoots", str),
        row("Misadjustments", "misadjustments", str),
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
