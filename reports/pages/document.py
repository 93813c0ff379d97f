"""Document data: what the report was made of, who signs it, symbols and sources."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections import Counter
from functools import cache
from importlib.resources import files
from typing import Final

from ringbalance.reports.section import Record, Section


@cache
def symbols_and_sources() -> Record:
    """Symbols with unit and term of the glossary, and sources, by kind of balancer."""
    path = files("ringbalance.reports").joinpath("templates", "document.toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))


def evidence_text(evidence: Record) -> str:
    """The evidence as its file holds it."""
    return json.dumps(evidence, allow_nan=False, indent=1, ensure_ascii=False) + "\n"


def _view(_own: Record, evidence: Record) -> Record:
    listed = symbols_and_sources()
    balancer = listed[evidence.get("balancer", "liquid_ring")]
    return {
        "evidence_sha256": hashlib.sha256(evidence_text(evidence).encode()).hexdigest(),
        "kept": [case for case in evidence["verification"] if case.get("date")],
        "kept_by_date": Counter(evidence["times"].get("kept_cases", {}).values()),
        "symbols": balancer["symbols"],
        "sources": balancer["sources"] + listed["every"]["sources"],
    }


SECTION: Final = Section(
    name="document", title="Document data, symbols and sources", place="report", show=_view
)
