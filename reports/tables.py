"""Raw data beside the report: long tables and maps as files of comma-separated values."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any, Final

from ringbalance.reports.section import Record

FOLDER: Final = "tables"
LONG: Final = 14
"""Rows above which a case's table is a file instead of a part of the page."""


def csv_tables(evidence: Record) -> dict[str, str]:
    """Contents of the files by name: tables of cases, the map of k, the operating map, the sampled loops.

    SI units, which stand in the heads. The same evidence gives the same bytes.
    """
    found = {
        table_file(case, table): _columns(
            [f"{name} [{table['units'].get(name, '1')}]" for name in table["columns"]],
            table["columns"].values(),
        )
        for case in evidence["verification"]
        for table in case.get("tables") or []
        if is_long(table)
    }
    for name, make in (("map_of_k.csv", _drag_map), ("operating_map.csv", _operating_map)):
        if (text := make(evidence)) is not None:
            found[name] = text
    for law, run in evidence["closed_loop"].items():
        found[f"loop_{law}.csv"] = _columns(
            ["time [s]", "amplitude [m]", "phase [rad]"],
            [run["time_s"], run["amplitude_m"], run.get("phase_rad") or [""] * len(run["time_s"])],
        )
    return found


def is_long(table: Record) -> bool:
    """Whether a case's table is a file of its own."""
    return any(len(values) > LONG for values in table["columns"].values())


def table_file(case: Record, table: Record) -> str:
    """Name of the file of a case's table."""
    stem = "".join(sign if sign.isalnum() else "_" for sign in table["name"].lower())
    return f"{case['id']}_{stem[:60].strip('_')}.csv"


def _columns(heads: Sequence[str], columns: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(zip(*columns, strict=True))
    return text.getvalue()


def _drag_map(evidence: Record) -> str | None:
    found = (evidence.get("fifty") or {}).get("map")
    if not found:
        return None
    bores, viscosities = found["bore_m"], found["kinematic_viscosity_m2_s"]
    places = list(product(range(len(bores)), range(len(viscosities))))
    return _columns(
        ["bore [m]", "kinematic viscosity [m^2/s]", "k [1]", "expanded uncertainty of k [1]"],
        [
            [bores[i] for i, _ in places],
            [viscosities[j] for _, j in places],
            [found["k"][i][j] for i, j in places],
            [found["k_uncertainty"][i][j] for i, j in places],
        ],
    )


def _operating_map(evidence: Record) -> str | None:
    found = evidence.get("operation")
    if not found:
        return None
    places = list(product(range(len(found["gas_pressure_Pa"])), range(len(found["fill_ratio"]))))
    return _columns(
        ["gas pressure [Pa]", "fill ratio [1]", "regime"],
        [
            [found["gas_pressure_Pa"][i] for i, _ in places],
            [found["fill_ratio"][j] for _, j in places],
            [found["regimes"][int(found["regime"][i][j])] for i, j in places],
        ],
    )
