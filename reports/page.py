"""What the page shows, from the evidence alone: texts, tables and figures, each made once."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ringbalance.reports import summary
from ringbalance.reports.equations import equation_svg, equations
from ringbalance.reports.figures.sections import page_figures
from ringbalance.reports.figures.style import Drawing
from ringbalance.reports.pages.cases import case_view
from ringbalance.reports.pages.tables import (
    chamber_table,
    drag_table,
    loop_notes,
    mesh_facts,
    model_row,
    operation_tables,
    scene_groups,
    version_facts,
)
from ringbalance.reports.sections import drawings_in, viewed

Record = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class PageContent:
    """Everything that the templates need."""

    context: Record
    drawings: tuple[Drawing, ...]
    """Every figure on the page, for files of their own."""


def page_content(evidence: Record, *, pictures: Mapping[str, bytes] | None = None) -> PageContent:
    """Turn the evidence into texts, tables and figures.

    Args: `evidence`: the document of `collect_evidence`. `pictures`: PNG bytes by the file names that the
        evidence lists; a picture that is missing is left out.
    Raises: KeyError: an evidence document that lacks a part.
    """
    claims = [
        {**case_view(case), "elsewhere": summary.elsewhere(case, evidence)}
        for case in summary.claims(evidence)
    ]
    checks = [case_view(case) for case in summary.checks(evidence)]
    figures = page_figures(evidence)
    sections = viewed(evidence)
    calibration, runs = evidence["calibration"], evidence["closed_loop"]
    context = {
        "scene": evidence["scene"],
        "sections": sections,
        "stamp": _stamp(evidence),
        "summary": _summary(evidence, claims),
        "equations": _equations(),
        "figures": figures,
        "pictures": _pictures(evidence["pictures"], pictures or {}),
        "chamber": chamber_table(calibration["chamber"]),
        "drag_at": drag_table(calibration["tube"], evidence["operating_point"]),
        "injections": operation_tables(runs.get("calibrated")),
        "loop_notes": loop_notes(runs),
        "claims": claims,
        "checks": checks,
        "order_plots": [case["order_plot"] for case in checks if case["order_plot"]],
        "models": [model_row(row) for row in calibration["models_used"]],
        "scene_groups": scene_groups(evidence["scene"]["table"]),
        "mesh_facts": mesh_facts(evidence),
        "version_facts": version_facts(evidence),
        "product": f"ringbalance {evidence['versions']['ringbalance']}",
    }
    drawings = drawings_in([figures, sections, *(_own_drawings(case) for case in (*claims, *checks))])
    return PageContent(context=context, drawings=tuple(drawings))


def _own_drawings(case: Record) -> list[Record]:
    return [case["order_plot"], *case["drawings"]]


def _stamp(evidence: Record) -> list[Record]:
    entries = (
        ("Scene", evidence["scene"]["file"]),
        ("Hash", evidence["scene"]["sha256"][:12]),
        ("Level", evidence["level"]),
        ("Date", evidence["times"]["date"]),
        ("ringbalance", evidence["versions"]["ringbalance"]),
    )
    return [{"label": label, "text": text} for label, text in entries]


def _summary(evidence: Record, claims: list[Record]) -> Record:
    chosen = {case["id"] for case in summary.headlines(evidence)}
    return {
        "lead": summary.lead_sentence(evidence),
        "claims": summary.verdict_counts(summary.claims(evidence), summary.CLAIM_VERDICTS),
        "checks": summary.verdict_counts(summary.checks(evidence), summary.CHECK_VERDICTS),
        "numbers": summary.key_numbers(evidence),
        "headlines": [case for case in claims if case["id"] in chosen],
        "loop_sentence": summary.loop_sentence(evidence),
        "loop": summary.loop_rows(evidence),
    }


def _equations() -> Record:
    return {
        name: {"svg": equation_svg(item.latex, item.words, f"eq-{name}"), "source": item.source}
        for name, item in equations().items()
    }


def _data_address(content: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(content).decode("ascii")


def _pictures(record: Record, contents: Mapping[str, bytes]) -> Record:
    """Pictures by name, with their bytes; one that lacks a variant is left out."""
    shown_pictures: Record = {"text": record["text"], "disc": None, "pressure": None, "tube": None}
    for item in record["files"]:
        if item["light"] in contents and item["dark"] in contents:
            variants = {key: _data_address(contents[item[key]]) for key in ("light", "dark")}
            shown_pictures[item["name"]] = {**item, **variants}
    return shown_pictures
