"""The report of any balancer that has no pages of its own: rows, findings, requirements and the run."""

from __future__ import annotations

import re
from collections import Counter
from typing import Final

from ringbalance.reports import summary
from ringbalance.reports.pages.requirements import requirement_bars
from ringbalance.reports.pages.standing import DOCUMENT
from ringbalance.reports.prose import input_name
from ringbalance.reports.run_figures import run_amplitude
from ringbalance.reports.section import Record, Section
from ringbalance.results.requirements import AT_LEAST, OPEN

_KEY: Final = re.compile(r"\b[a-z_]+\.[a-z_]+\b")
"""A key of the scene file, such as supervisor.limit."""
_CAUSES: Final = 2
"""Inputs that a row names as those it hangs on most."""
_DRAWN: Final = {"time_s", "amplitude_m", "limit_m"}
"""Keys of a run's document that its figure is made of."""


def requirements_view(evidence: Record) -> Record:
    """What a page shows of the requirements of any balancer (`Requirement.document`)."""
    rows = evidence["requirements"]
    return {
        "decision": summary.decided([(row["quantity"], row["verdict"]) for row in rows]),
        "causes": [_causes(row) for row in rows],
        "set_by": [_KEY.sub(lambda match: input_name(match[0]), row["set_by"]) for row in rows],
        "open": _open(rows),
        "bars": requirement_bars(map(_bar, rows)),
        "stated": any(row["achieved_interval"] for row in rows),
        "origins": Counter(row["origin"] for row in evidence["scene"]["table"]).most_common(),
    }


def _open(rows: list[Record]) -> list[tuple[str, list[str]]]:
    """Inputs to find out first, with the requirements that the stated uncertainties leave open."""
    found: dict[str, list[str]] = {}
    for row in rows:
        if row["verdict"] == OPEN and (paths := _causes(row)):
            found.setdefault(", ".join(sorted(map(input_name, paths))), []).append(row["quantity"])
    return list(found.items())


def _causes(row: Record) -> list[str]:
    """Paths of the inputs that a requirement hangs on most: those that lose it, then the largest effects."""
    effects = {path: max(both) for path, both in row["effects"].items()}
    largest = max(effects.values(), default=0.0)
    ranked = sorted(effects, key=lambda path: -effects[path])
    telling = [path for path in ranked if effects[path] > 0.1 * largest]
    return list(dict.fromkeys([*row["lost"], *telling]))[: max(_CAUSES, len(row["lost"]))]


def _bar(row: Record) -> Record:
    low, high = row["achieved_interval"] or (row["achieved"], row["achieved"])
    return {
        "label": row["quantity"],
        "required": row["required"],
        "reached": row["achieved"],
        "low": low,
        "high": high,
        "at_least": row["sense"] == AT_LEAST,
        "verdict": row["verdict"],
    }


def _summary(_own: Record, evidence: Record) -> Record:
    run = evidence["closed_loop"]["balanced"]
    return {
        **requirements_view(evidence),
        "amplitude": run_amplitude(run) if run.keys() >= _DRAWN else None,
    }


SECTIONS: Final = (
    Section(name="summary", title="Decision", place="report", show=_summary, template="plain_summary.html"),
    Section(name="parameters", title="Parameters and their origin", place="report"),
    DOCUMENT,
    Section(name="scene", title="Scene file"),
)
