"""Numbers to use, evidence and credibility, document data, symbols and sources."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections import Counter
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Final

from matplotlib.axes import Axes

from ringbalance.reports import summary
from ringbalance.reports.figure import (
    FOUND,
    INK,
    MUTED,
    PAPER,
    Drawing,
    draw,
    nice_span,
    panels,
    plain_number,
)
from ringbalance.reports.prose import key_words
from ringbalance.reports.section import Record, Section
from ringbalance.reports.traced import budgets_of, inputs_of
from ringbalance.results.result import Table
from ringbalance.verification.standing import HEADS, budget_standing, standing_rows

_TORNADO: Final = {"velocity": "Velocity", "usable_moment": "Usable moment", "lambda": "Lever arm λ"}
_MAX_BARS: Final = 5


def _conditions(_own: Record, evidence: Record) -> Record:
    budgets = budgets_of(evidence)
    causes: dict[str, list[tuple[str, float]]] = {}
    for key, title in _TORNADO.items():
        if key in budgets and (value := budgets[key]["value"]):
            # Causes with their parts relative to the result, the largest first.
            parts = {key_words(path): width for path, width in inputs_of(budgets[key]).items()}
            parts |= {
                "the model": budgets[key]["parts"]["model"],
                "numerics": budgets[key]["parts"]["numerical"],
            }
            shares = [(name, abs(part / value)) for name, part in parts.items()]
            causes[title] = sorted(shares, key=lambda cause: -cause[1])
    return {
        "behind": {name: budget_standing(evidence["verification"], name) for name in budgets},
        "tornado": _tornado(causes) if causes else None,
        "largest": {title: shares[0][0] for title, shares in causes.items()},
        "inputs": {
            key: max(inputs, key=inputs.__getitem__)
            for key, budget in budgets.items()
            if (inputs := inputs_of(budget))
        },
    }


def _tornado(causes: dict[str, list[tuple[str, float]]]) -> Drawing:
    """Contribution of each input, of the model and of the numerics to the main results' uncertainties."""
    columns = min(len(causes), 3)
    rows = -(-len(causes) // columns)
    side, room = 1 / columns, 1 / rows
    cells = [divmod(index, columns) for index in range(len(causes))]

    def paint(axes: Axes) -> None:
        boxes = [((j + 0.47) * side, 1 - (i + 0.86) * room, 0.47 * side, 0.68 * room) for i, j in cells]
        for bars, (title, shares) in zip(panels(axes, *boxes), causes.items(), strict=True):
            largest = shares[:_MAX_BARS]
            for index, (name, share) in enumerate(largest):
                colour = {"the model": PAPER, "numerics": MUTED}.get(name, FOUND)
                bars.barh(index, 200 * share, left=-100 * share, height=0.62, color=colour, linewidth=0)
            limit = 115 * max(largest[0][1], 1e-9)
            bars.set(ylim=(len(largest) - 0.4, -0.6), xlim=(-limit, limit))
            bars.set_yticks(range(len(largest)), [name for name, _ in largest])
            bars.tick_params(axis="y", length=0)
            ticks = nice_span(limit)[:: len(nice_span(limit)) // 2]
            bars.set_xticks(ticks, [f"{plain_number(tick)} %" for tick in ticks])
            bars.set_title(title, loc="left", x=-0.9, fontsize="medium", weight="bold", color=INK)
            bars.grid(visible=False, axis="y")
            bars.spines["left"].set_visible(False)

    return draw("tornado", paint, columns=0, wide=True, height=0.35 + rows * (0.55 + 0.2 * (_MAX_BARS + 2)))


CONDITIONS: Final = Section(
    name="conditions", title="Numbers to use, and their conditions", document="report", show=_conditions
)


_UNDOCUMENTED: Final = {"assumed": "are assumed", "default": "are defaults of the program"}
_MAIN_HEADS: Final = tuple(head for index, head in enumerate(HEADS) if index not in (2, 3))
"""Columns in the report; the annex shows all."""


def _credibility(_own: Record, evidence: Record) -> Record:
    checks, scene = summary.checks(evidence), evidence["scene"]
    origins: dict[str, str] = scene.get("origins") or {}
    counts = Counter(row["origin"] for row in scene.get("table") or [])
    verdicts = Counter(case["verdict"] for case in checks)
    return {
        "standing": _standing(evidence, _MAIN_HEADS),
        "documented": bool({"given", "measured"} & set(origins.values())),
        "checks": ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items()),
        "failed": verdicts["failed"] > 0,
        "validated": any(case["kind"] == "validation" for case in checks),
        "unsure": [f"{counts[origin]} {words}" for origin, words in _UNDOCUMENTED.items() if counts[origin]],
        "budgets": bool(budgets_of(evidence)),
        "drawn": "summary" in evidence,
    }


def _standing(evidence: Record, heads: Sequence[str] = HEADS) -> Table:
    rows = standing_rows(summary.checks(evidence), balancer=evidence["balancer"])
    return Table(
        caption="Evidence behind each predicted quantity. Measurements are those of others on parts like "
        "the device’s; “within” is the fraction of the judged points that lie within both 95 % intervals, "
        "bias and scatter are those of predicted over measured values. Points to which a coefficient was "
        "fitted are left out.",
        heads=heads,
        rows=[tuple(row[HEADS.index(head)].replace(" -", " −") for head in heads) for row in rows],
        style="dense",
    )


CREDIBILITY: Final = Section(
    name="credibility", title="What is validated, verified and assumed", document="report", show=_credibility
)


CASES: Final = Section(
    name="cases",
    title="Claims: evidence and doubts",
    show=lambda _own, evidence: {"standing": _standing(evidence)},
)


@cache
def _symbols_and_sources() -> Record:
    """Symbols with unit and term of the glossary, and sources, by kind of balancer."""
    path = files("ringbalance.reports").joinpath("templates", "document.toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))


def evidence_text(evidence: Record) -> str:
    """Text of the evidence file."""
    return json.dumps(evidence, allow_nan=False, indent=1, ensure_ascii=False) + "\n"


def _document(_own: Record, evidence: Record) -> Record:
    listed = _symbols_and_sources()
    balancer = listed.get(evidence["balancer"], {"symbols": [], "sources": []})
    return {
        "evidence_sha256": hashlib.sha256(evidence_text(evidence).encode()).hexdigest(),
        "kept": [case for case in evidence["verification"] if case.get("date")],
        "kept_by_date": Counter(evidence["times"].get("kept_cases", {}).values()),
        "symbols": balancer["symbols"],
        "sources": balancer["sources"] + listed["every"]["sources"],
    }


DOCUMENT: Final = Section(
    name="document", title="Document data, symbols and sources", document="report", show=_document
)
PARAMETERS: Final = Section(name="parameters", title="Parameters and their origin", document="report")
DEFAULTS: Final = Section(name="defaults", title="Defaults of the program", template="parameters.html")
