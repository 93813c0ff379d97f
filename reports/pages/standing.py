"""What the report rests on: numbers to use, evidence and credibility, document data, symbols, sources."""

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

_DRAWN: Final = {"velocity": "Velocity", "usable_moment": "Usable moment", "lambda": "Lever arm λ"}
_BARS: Final = 5
"""Inputs that a panel of the tornado shows."""


def _conditions(_own: Record, evidence: Record) -> Record:
    budgets = budgets_of(evidence)
    drawn = {_DRAWN[key]: budgets[key] for key in _DRAWN if key in budgets and budgets[key]["value"]}
    causes = {title: _causes(budget) for title, budget in drawn.items()}
    return {
        "behind": {name: budget_standing(evidence["verification"], name) for name in budgets},
        "tornado": _tornado(causes) if causes else None,
        "largest": {title: each[0][0] for title, each in causes.items()},
        "inputs": {
            key: max(inputs, key=inputs.__getitem__)
            for key, each in budgets.items()
            if (inputs := inputs_of(each))
        },
    }


def _causes(budget: Record) -> list[tuple[str, float]]:
    """What makes a result uncertain, with its part relative to the result, the largest first."""
    parts = {key_words(path): width for path, width in inputs_of(budget).items()}
    parts |= {"the model": budget["parts"]["model"], "numerics": budget["parts"]["numerical"]}
    return sorted(((name, abs(part / budget["value"])) for name, part in parts.items()), key=lambda c: -c[1])


def _tornado(causes: dict[str, list[tuple[str, float]]]) -> Drawing:
    """Contribution of each input, of the model and of the numerics to the main results' uncertainties."""
    columns = min(len(causes), 3)
    rows = -(-len(causes) // columns)
    side, room = 1 / columns, 1 / rows
    places = [divmod(place, columns) for place in range(len(causes))]

    def paint(axes: Axes) -> None:
        boxes = [((j + 0.47) * side, 1 - (i + 0.86) * room, 0.47 * side, 0.68 * room) for i, j in places]
        for bars, (title, parts) in zip(panels(axes, *boxes), causes.items(), strict=True):
            _panel(bars, title, parts[:_BARS])

    return draw("tornado", paint, columns=0, wide=True, height=0.35 + rows * (0.55 + 0.2 * (_BARS + 2)))


def _panel(bars: Axes, title: str, causes: list[tuple[str, float]]) -> None:
    for place, (name, share) in enumerate(causes):
        colour = {"the model": PAPER, "numerics": MUTED}.get(name, FOUND)
        bars.barh(place, 200 * share, left=-100 * share, height=0.62, color=colour, linewidth=0)
    limit = 115 * max(causes[0][1], 1e-9)
    bars.set(ylim=(len(causes) - 0.4, -0.6), xlim=(-limit, limit))
    bars.set_yticks(range(len(causes)), [name for name, _ in causes])
    bars.tick_params(axis="y", length=0)
    ticks = nice_span(limit)[:: len(nice_span(limit)) // 2]
    bars.set_xticks(ticks, [f"{plain_number(tick)} %" for tick in ticks])
    bars.set_title(title, loc="left", x=-0.9, fontsize="medium", weight="bold", color=INK)
    bars.grid(visible=False, axis="y")
    bars.spines["left"].set_visible(False)


CONDITIONS: Final = Section(
    name="conditions", title="Numbers to use, and their conditions", place="report", show=_conditions
)


_NOBODYS: Final = {"assumed": "are assumed", "default": "are defaults of the program"}


_MAIN_HEADS: Final = tuple(head for place, head in enumerate(HEADS) if place not in (2, 3))
"""What the report shows of the table that the annex has whole."""


def _credibility(_own: Record, evidence: Record) -> Record:
    checks, scene = summary.checks(evidence), evidence["scene"]
    origins: dict[str, str] = scene.get("origins") or {}
    counts = Counter(row["origin"] for row in scene.get("table") or [])
    return {
        "standing": _standing(evidence, _MAIN_HEADS),
        "documented": bool({"given", "measured"} & set(origins.values())),
        "checks": _outcome(checks),
        "failed": any(case["verdict"] == "failed" for case in checks),
        "validated": any(case["kind"] == "validation" for case in checks),
        "unsure": [f"{counts[origin]} {words}" for origin, words in _NOBODYS.items() if counts[origin]],
        "budgets": bool(budgets_of(evidence)),
        "drawn": "summary" in evidence,
    }


def _standing(evidence: Record, heads: Sequence[str] = HEADS) -> Table:
    rows = standing_rows(summary.checks(evidence), balancer=evidence["balancer"])
    return Table(
        caption="What stands behind each predicted quantity. Measurements are those of others on parts like "
        "the device’s; “within” is the share of the judged points that lie within both 95 % intervals, bias "
        "and scatter are those of predicted over measured values. Points that taught a coefficient are left "
        "out and not counted as predicted.",
        heads=heads,
        rows=[tuple(row[HEADS.index(head)].replace(" -", " −") for head in heads) for row in rows],
        style="dense",
    )


def _outcome(cases: Sequence[Record]) -> str:
    """Number of cases under each verdict; empty without cases."""
    counts = Counter(case["verdict"] for case in cases)
    return ", ".join(f"{count} {verdict}" for verdict, count in counts.items())


CREDIBILITY: Final = Section(
    name="credibility", title="What is validated, verified and assumed", place="report", show=_credibility
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
    """The evidence as its file holds it."""
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
    name="document", title="Document data, symbols and sources", place="report", show=_document
)
