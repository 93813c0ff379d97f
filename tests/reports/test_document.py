"""Document data, symbols and tables beside the report are those of the evidence and of the glossary."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
from pathlib import Path
from typing import Any

import pytest

from ringbalance.reports.page import render
from ringbalance.reports.pages.cases import MAX_PAGE_ROWS, is_long, table_file
from ringbalance.reports.pages.standing import _symbols_and_sources, evidence_text
from ringbalance.reports.report import _csv_tables
from ringbalance.reports.saved import provenance

Record = dict[str, Any]
GLOSSARY = Path(__file__).resolve().parents[2] / "docs" / "glossary.md"


def facts(evidence: Record) -> dict[str, str]:
    page = render(evidence)["report.html"]
    values = re.findall(r'<dt>([^<]+)</dt><dd class="hash">(.*?)</dd>', page, flags=re.DOTALL)
    return {label: re.sub(r"<[^>]+>", "", text) for label, text in values}


def test_symbols_are_those_of_the_glossary() -> None:
    rows = [
        tuple(cell.strip() for cell in line.split("|")[1:4])
        for line in GLOSSARY.read_text(encoding="utf-8").splitlines()
        if line.startswith("|")
    ]
    for balancer in ("liquid_ring", "eccentric_mass"):
        symbols = _symbols_and_sources()[balancer]["symbols"]
        assert len(symbols) > 5
        assert [entry for entry in symbols if (entry[2], entry[0], entry[1]) not in rows] == []


@pytest.mark.usefixtures("unwritten")
def test_the_document_names_what_it_was_made_of(evidence: Record) -> None:
    shown = facts(evidence)
    assert shown["Commit"] == "0123456789ab"
    assert shown["Command"] == "ringbalance report sample.toml"
    assert hashlib.sha256(evidence_text(evidence).encode()).hexdigest() in shown["evidence.json"]
    assert json.loads(evidence_text(evidence)) == evidence
    evidence["provenance"]["dirty"] = True
    assert facts(evidence)["Commit"].endswith("with local changes")


@pytest.mark.usefixtures("unwritten")
def test_kept_evidence_is_named_with_its_date_and_scene(evidence: Record) -> None:
    assert facts(evidence)["Kept evidence"].startswith("none")
    case = evidence["verification"][-1]
    case.update(date="2029-02-03", scene_sha256="cd" * 32)
    assert facts(evidence)["Kept evidence"] == f"{case['id']} of 2029-02-03, values cdcdcdcdcdcd"


def test_provenance_names_neither_folder_nor_machine() -> None:
    values = provenance()
    assert len(values["lock_sha256"]) == 64
    assert "/" not in values["command"]
    assert set(values) == {"commit", "dirty", "lock_sha256", "command", "machine"}


def test_long_tables_become_files_with_every_row(evidence: Record) -> None:
    length = MAX_PAGE_ROWS + 1
    table: Record = {
        "name": "Settled after, by period",
        "columns": {"period": [0.1 * i for i in range(length)], "ending": ["settled"] * length},
        "units": {"period": "s"},
    }
    short = {"name": "short", "columns": {"a": [1.0]}, "units": {}}
    case = evidence["verification"][0]
    case["tables"] = [table, short]
    assert (is_long(table), is_long(short)) == (True, False)
    values = _csv_tables(evidence)
    assert table_file(case, table) == "claim_01_settled_after__by_period.csv"
    rows = list(csv.reader(io.StringIO(values[table_file(case, table)])))
    assert rows[0] == ["period [s]", "ending [1]"]
    assert [float(row[0]) for row in rows[1:]] == table["columns"]["period"]
    assert {"loop_calibrated.csv", "loop_paper.csv"} <= set(values)
    assert not any("short" in name for name in values)
