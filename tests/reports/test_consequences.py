"""The section on what a wrong k costs says what the evidence says, and stays away where there is none."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from typing import Any

import pytest

from ringbalance.reports import summary
from ringbalance.reports.page import render
from ringbalance.reports.pages.loop import CONSEQUENCES

Record = dict[str, Any]
Said = Callable[[Record, str], str]


def _gain(law: str, k: float, share: float) -> Record:
    values = [k / 2, k, 2 * k]
    return {
        "law": law,
        "drag_coefficient": k,
        "velocity_m_s": 5.0,
        "moment_per_transferred_mass_m": 0.073,
        "slope_m_per_s": 7.5e-6,
        "gain_per_operation": share,
        "proportional_s_per_m": 0.08e6,
        "overshoot_proportional_s_per_m": 0.08e6 / share,
        "instability_proportional_s_per_m": 0.16e6 / share,
        "over_drag_coefficient": {
            "values": values,
            "overshoot_gain": [0.03e6, 0.04e6, 0.05e6],
            "instability_gain": [0.06e6, 0.08e6, 0.10e6],
        },
    }


def _ensemble(share: float) -> Record:
    chance = {"value": share, "low": share / 2, "high": min(1.0, 2 * share)}
    return {
        "members": 500,
        "probability": dict.fromkeys(("not_settled", "overshoot", "misadjustment"), chance),
        "settling_time_s": {"quantiles": {"0.05": 3.1, "0.5": 4.2, "0.95": 5.3}},
    }


def _consequences() -> Record:
    run = {
        "title": "the calibrated law, same controller",
        "proportional_s_per_m": 0.08e6,
        "settled": False,
        "verdict": "hovering",
        "settling_time_s": None,
        "injections": 115,
        "overshoots": 96,
        "misadjustments": 2,
    }
    return {
        "findings": ["one", "two", "three", "four"],
        "notes": ["a note"],
        "gain": [_gain("paper", 50.0, 0.6), _gain("calibrated", 3.5, 1.94)],
        "runs": [run],
        "ensembles": [_ensemble(0.1), _ensemble(0.4)],
    }


def test_every_number_is_the_evidences_own(evidence: Record, said: Said) -> None:
    text = said({**evidence, "consequences": _consequences()}, "consequences")
    assert "| the paper’s law | the calibrated law |" in text
    assert "| share that one operation takes away | 60.0 % | 194 % |" in text
    assert re.search(r"same controller \| 0.0800 s/µm \| hovering \| 115 \| 96 \| 2 \|", text)
    assert "| half of all runs settled by (5 %; 95 %) | 4.20 s (3.10 s; 5.30 s)" in text
    assert "four" not in text.split("A1")[-1]


@pytest.mark.usefixtures("unwritten")
def test_the_page_has_the_section_only_with_its_evidence(evidence: Record) -> None:
    without = render({key: value for key, value in evidence.items() if key != "consequences"})["annex.html"]
    assert "consequences-title" not in without
    assert 'href="#consequences"' not in without
    page = render({**evidence, "consequences": _consequences()})["annex.html"]
    assert page.count('href="#consequences"') == 1
    assert "hovering" in page
    assert "gain-margin" in page


def test_a_law_that_does_not_flow_leaves_its_tables_out(evidence: Record, said: Said) -> None:
    text = said(
        {**evidence, "consequences": {**_consequences(), "gain": [], "ensembles": []}}, "consequences"
    )
    assert "Table A1. One run each" in text
    assert "Table A2" not in text
    assert "Figure" not in text
    assert CONSEQUENCES.view({}) is None


@pytest.mark.usefixtures("unwritten")
def test_claims_judged_on_another_disc_are_distinguished(evidence: Record) -> None:
    changed = copy.deepcopy(evidence)
    for case in changed["verification"]:
        case["scene_sha256"] = changed["scene"]["values_sha256"]
    assert "judged on it, not on this one" not in summary.lead_sentence(changed)
    marked = summary.claims(changed)[0]
    marked["scene_sha256"] = "0" * 64
    assert summary.elsewhere(marked, changed)
    assert "1 of them" in summary.lead_sentence(changed)
    assert "Judged on the paper’s disc" in render(changed)["annex.html"]
