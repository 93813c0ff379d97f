"""The summary counts, chooses and compares; it never judges again."""

from __future__ import annotations

from typing import Any

from ringbalance.reports.page import terminal_lines
from ringbalance.reports.summary import (
    CHECK_VERDICTS,
    CLAIM_VERDICTS,
    checks,
    claims,
    common_causes,
    tone,
    verdict_counts,
)
from ringbalance.verification.verdicts import VOCABULARY

Record = dict[str, Any]


def test_every_verdict_has_a_colour_and_a_place() -> None:
    assert set(CLAIM_VERDICTS) == {verdict.value for verdict in VOCABULARY["claim"]}
    assert set(CHECK_VERDICTS) == {verdict.value for verdict in VOCABULARY["code_verification"]}
    assert {tone(verdict) for verdict in CLAIM_VERDICTS} == {"good", "fair", "bad", "open", "idle"}


def test_counts_add_up(evidence: Record) -> None:
    counts = verdict_counts(claims(evidence), CLAIM_VERDICTS)
    assert {item["verdict"]: item["count"] for item in counts} == {
        "confirmed": 1,
        "confirmed with correction": 1,
        "refuted": 2,
        "inconclusive": 1,
        "not run": 1,
    }
    assert len(claims(evidence)) + len(checks(evidence)) == len(evidence["verification"])


def test_the_lead_is_counted(evidence: Record) -> None:
    *_, lead = terminal_lines(evidence)
    assert (
        "Of 6 claims of the liquid-ring paper 1 is confirmed, 1 is confirmed with correction, 2 are" in lead
    )
    assert "refuted, 1 is inconclusive and 1 is not run." in lead
    evidence["verification"][6]["verdict"] = "failed"
    assert "1 checks of this program itself that were run, 0 passed." in terminal_lines(evidence)[-1]


def test_claims_stand_in_the_papers_order(evidence: Record) -> None:
    evidence["verification"].reverse()
    assert [case["number"] for case in claims(evidence)] == [1, 6, 9, 10, 11, 14]


def test_claims_are_grouped_by_what_they_have_in_common() -> None:
    def claim(number: int, verdict: str, cause: str, *paths: str) -> dict[str, Any]:
        rests = [{"path": path} for path in paths]
        return {"number": number, "verdict": verdict, "cause": cause, "rests_on": rests}

    cases = [
        claim(1, "confirmed", "", "disc.plate_thickness"),
        claim(2, "refuted", "the tube"),
        claim(3, "confirmed with correction", "plates left out", "disc.plate_thickness"),
        claim(4, "refuted", "plates left out"),
        claim(5, "not run", ""),
    ]
    more = [claim(number, "refuted", "the settings") for number in (6, 7, 8)]
    assert common_causes([*cases, *more]) == [
        {"cause": "the settings", "numbers": [6, 7, 8]},
        {"cause": "plates left out", "numbers": [3, 4]},
    ]
