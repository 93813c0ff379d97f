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
    return {
        "law": law,
        "drag_coefficient": k,
        "velocity_m_s": 5.0,
        "moment_per_transferred_mass_m": 0.073,
        "slope_m_per_s": 7.5e-6,
        "gain_per_operation": share,
    }


def test_both_laws_stand_beside_each_other(evidence: Record, said: Said) -> None:
    judged = {
        **evidence["summary"]["own"],
        "fraction": {"value": 0.97, "low": 0.9, "high": 0.99, "count": 62, "of": 64},
    }
    gains = [_gain("paper", 50.0, 0.6), _gain("calibrated", 3.5, 1.94)]
    text = said({**evidence, "consequences": {"gain": gains, "paper": judged}}, "consequences")
    assert re.search(r"the paper’s law \| 50.0 \|.*60.0 % \| 97 % of drawn", text, re.IGNORECASE)
    assert re.search(r"the calibrated law \| 3.50 \|.*194 % \| 84 % of drawn", text, re.IGNORECASE)


@pytest.mark.usefixtures("unwritten")
def test_the_page_has_the_section_only_with_its_evidence(evidence: Record) -> None:
    without = {key: value for key, value in evidence.items() if key != "consequences"}
    assert "consequences-title" not in render(without)["annex.html"]
    assert CONSEQUENCES.view({}) is None


@pytest.mark.usefixtures("unwritten")
def test_claims_judged_on_another_disc_are_distinguished(evidence: Record) -> None:
    changed = copy.deepcopy(evidence)
    for case in changed["verification"]:
        case["scene_sha256"] = changed["scene"]["values_sha256"]
    assert summary.tallies(changed)["claims_elsewhere"] == 0
    marked = summary.claims(changed)[0]
    marked["scene_sha256"] = "0" * 64
    assert summary.elsewhere(marked, changed)
    assert summary.tallies(changed)["claims_elsewhere"] == 1
    assert "1 of them hold for the paper’s own disc alone" in "".join(render(changed).values())
    assert "Judged on the paper’s disc" in render(changed)["annex.html"]
