"""The second balancer, two eccentric masses: its paper's claims, and both balancers on one rotor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from typing import Any, Final

from ringbalance.controller.compare import compare, comparison_document
from ringbalance.reports import summary
from ringbalance.reports.numbers import MISSING, percent, shown
from ringbalance.reports.pages.cases import case_view
from ringbalance.reports.prose import typeset
from ringbalance.reports.section import Record, Section, Work
from ringbalance.scene import SceneError, bundled_scene, load_scene

PAPER: Final = "eccentric_mass"
RIVAL: Final = "driven_masses_small"
"""Masses of a size for the liquid-ring paper's rotor."""
_NAMES: Final = {"liquid_ring": "liquid ring", "eccentric_mass": "two eccentric masses"}


def collect(work: Work) -> Record:
    """Both balancers on the scene's rotor."""
    rival = load_scene(bundled_scene(RIVAL))
    try:
        found = compare(work.scene, rival, model_of=lambda _: work.calibration.model)
    except SceneError as error:
        # Without folders: the evidence is the same wherever the files stand.
        faults = (replace(fault, file=PurePath(fault.file).name) for fault in error.faults)
        return {"compared": None, "text": "\n".join(map(str, faults))}
    return {"compared": comparison_document(found), "text": ""}


def view(evidence: Record) -> Record | None:
    """Claims, their counts, and the comparison as a table.

    Returns: `claims`, `lead`, `compared` and `text`; None without claims of that paper.
    """
    cases = summary.claims(evidence, paper=PAPER)
    if not cases:
        return None
    found = evidence.get("driven") or {"compared": None, "text": ""}
    return {
        "claims": [{**case_view(case), "elsewhere": False} for case in cases],
        "lead": _lead(cases),
        "compared": None if found["compared"] is None else _table(found["compared"]),
        "status": [] if found["compared"] is None else _statuses(found["compared"]),
        "text": typeset(found["text"]),
    }


def _lead(cases: list[Record]) -> str:
    counts = summary.verdict_counts(cases, summary.CLAIM_VERDICTS)
    parts = ", ".join(f"{item.count} {'is' if item.count == 1 else 'are'} {item.verdict}" for item in counts)
    return f"Of {len(cases)} claims of the eccentric-mass paper {parts}."


def _table(found: Record) -> Record:
    def row(label: str, values: list[Any], text: Any) -> Record:
        return {"label": label, "cells": [MISSING if value is None else text(value) for value in values]}

    return {
        "heads": [_NAMES.get(name, name) for name in found["balancer"]],
        "rows": [
            row("below the limit, and staying, after", found["time_s"], lambda v: shown(v, "s", digits=3)),
            row("vibration left", found["residual_ratio"], lambda v: percent(v, digits=2)),
            row("largest on the way", found["worst_amplitude_m"], lambda v: shown(v, "m", digits=3)),
            row("energy taken", found["energy_J"], lambda v: shown(v, "J", digits=2)),
        ],
    }


def _statuses(found: Record) -> list[str]:
    names = [_NAMES.get(name, name) for name in found["balancer"]]
    return [
        f"{name[0].upper()}{name[1:]}: {typeset(text)}."
        for name, text in zip(names, found["status"], strict=True)
    ]


SECTION: Final = Section(name="driven", title="The second balancer", collect=collect, last=True, view=view)
