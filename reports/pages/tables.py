"""The report's tables from the evidence: every cell already text, in the units of its head."""

from __future__ import annotations

import math
from itertools import groupby
from typing import Any, Final

from ringbalance.reports.numbers import MISSING, fixed, measured, number, percent, short
from ringbalance.reports.prose import typeset
from ringbalance.reports.units import display_unit, shown

Record = dict[str, Any]

FIRST_OPERATIONS: Final = 12
"""Gas operations that are listed without being asked for."""


def _column(values: list[float], unit: str, *, digits: int = 6) -> list[str]:
    """One column in one unit and to one decimal place, that of its largest value's last digit."""
    display = display_unit(unit, *values)
    largest = max(abs(value) for value in values) * display.factor
    decimals = max(digits - 1 - math.floor(math.log10(largest)), 0) if largest else 0
    return [fixed(value * display.factor, decimals) for value in values]


def _relative(values: list[float], reference: list[float]) -> list[float | None]:
    return [value / base if base else None for value, base in zip(values, reference, strict=True)]


def chamber_table(chamber: Record) -> Record:
    """The chamber over its fill: heads carry the units, so that the cells are bare numbers.

    Args: `chamber`: the calibration's `chamber`, SI.
    Returns: `units` of the heads, and `rows` of texts.
    """
    pressure, moment = chamber["wall_pressure_Pa"], chamber["moment_kg_m"]
    paper, paper_moment = chamber["wall_pressure_paper_Pa"], chamber["moment_paper_kg_m"]
    errors = [
        [None if ratio is None else ratio - 1 for ratio in _relative(*pair)]
        for pair in ((paper, pressure), (paper_moment, moment))
    ]
    columns = [
        [short(fill) for fill in chamber["fill_ratio"]],
        _column(chamber["free_surface_radius_m"], "m", digits=5),
        _column(pressure, "Pa"),
        [number(u, digits=1) for u in _relative(chamber["wall_pressure_uncertainty"], pressure)],
        _column(paper, "Pa", digits=4),
        [percent(error, signed=True) for error in errors[0]],
        _column(moment, "kg m"),
        [number(u, digits=1) for u in _relative(chamber["moment_uncertainty"], moment)],
        _column(paper_moment, "kg m", digits=4),
        [percent(error, signed=True) for error in errors[1]],
    ]
    units = {"pressure": display_unit("Pa", *pressure).symbol, "moment": display_unit("kg m", *moment).symbol}
    return {"units": units, "rows": [list(row) for row in zip(*columns, strict=True)]}


def drag_table(tube: Record, point: Record) -> Record:
    """The terms of k at the tabulated velocity nearest to the operating point.

    Args: `tube`: the calibration's `tube`, SI. `point`: the evidence's `operating_point`, SI.
    Returns: `caption`, and `rows` of texts.
    """
    wanted = point["k_at_velocity_m_s"] or tube["velocity_m_s"][-1]
    nearest = min(range(len(tube["k"])), key=lambda i: abs(math.log(tube["velocity_m_s"][i] / wanted)))
    rows = [
        {"term": name.replace("_", " "), "value": number(values[nearest], digits=3)}
        for name, values in tube["terms"].items()
    ]
    rows.append({"term": "k", "value": measured(tube["k"][nearest], tube["k_uncertainty"][nearest])})
    speed = shown(tube["velocity_m_s"][nearest], "m/s", digits=3)
    reynolds = number(tube["reynolds"][nearest], digits=3)
    state = tube["flow_state"][nearest]
    return {"caption": f"Terms of k at {speed}, Re {reynolds}, {state}.", "rows": rows}


def operation_tables(run: Record | None) -> Record:
    """The operations of a run: the first ones, and the rest for whoever wants them.

    Args: `run`: a simulation document; None when it was not run.
    Returns: `first` and `rest`, rows of texts.
    """
    rows = [_injection(row) for row in (run or {"injections": []})["injections"]]
    return {"first": rows[:FIRST_OPERATIONS], "rest": rows[FIRST_OPERATIONS:]}


def _injection(row: Record) -> Record:
    regimes = dict.fromkeys((row["regime"], row.get("regime_end") or row["regime"]))
    return {
        "time": shown(row["time_s"], "s", digits=3),
        "chamber": row["chamber"],
        "duration": shown(row["duration_s"], "s", digits=3),
        "regime": " to ".join(regimes),
        "before": fixed(row["fill_before"], 4),
        "after": fixed(row["fill_after"], 4),
    }


def loop_notes(runs: Record) -> list[Record]:
    """How each run ended, in its own words.

    Args: `runs`: simulation documents by law.
    Returns: Law and text.
    """
    names = {"calibrated": "Calibrated law", "paper": "The paper’s law"}
    return [{"law": names[law], "text": typeset(runs[law]["status"])} for law in names if law in runs]


def model_row(row: Record) -> Record:
    """One line of the models that were used.

    Args: `row`: of the calibration's `models_used`.
    Returns: Texts.
    """
    estimate = row.get("estimated_contribution")
    texts = {key: typeset(row[key]) for key in ("term", "model", "why")}
    return {**texts, "contribution": MISSING if estimate is None else percent(estimate)}


def scene_groups(rows: list[Record]) -> list[Record]:
    """The scene's table in its groups.

    Args: `rows`: of the evidence's `scene.table`.
    Returns: `name` and `rows` of each group.
    """
    texts = [{key: typeset(text) for key, text in row.items()} for row in rows]
    return [
        {"name": name, "rows": list(members)}
        for name, members in groupby(texts, key=lambda row: row["group"])
    ]


def mesh_facts(evidence: Record) -> list[Record]:
    """Sizes and quality of the pressure mesh.

    Args: `evidence`: the document.
    Returns: Label and text.
    """
    mesh = evidence["pressure"]["mesh"]
    entries = (
        ("Cells of the 3-D pressure mesh", " × ".join(str(count) for count in mesh["cells"])),
        ("Unknowns", number(mesh["unknowns"], digits=6)),
        ("Smallest scaled Jacobian", number(mesh["minimum_scaled_jacobian"], digits=3)),
        ("Largest aspect ratio", number(mesh["largest_aspect"], digits=3)),
        ("Solver", mesh["status"]),
    )
    return [{"label": label, "text": text} for label, text in entries]


def version_facts(evidence: Record) -> list[Record]:
    """Hash of the scene, seeds and versions.

    Args: `evidence`: the document.
    Returns: Label and text.
    """
    seeds = ", ".join(f"{name} {value}" for name, value in evidence["seeds"].items())
    entries = [
        ("Scene hash (SHA-256)", evidence["scene"]["sha256"]),
        ("Seeds", seeds),
        *evidence["versions"].items(),
    ]
    return [{"label": label, "text": text} for label, text in entries]
