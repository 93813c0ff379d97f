"""The section on the second balancer."""

from __future__ import annotations

from typing import Any

from ringbalance.reports import summary
from ringbalance.reports.pages import eccentric as driven

Record = dict[str, Any]


def case(paper: str, verdict: str, number: int) -> Record:
    return {
        "id": f"{paper}_{number}",
        "kind": "claim",
        "paper": paper,
        "number": number,
        "title": "A claim",
        "claim": "It is so.",
        "verdict": verdict,
        "quantities": [],
    }


def evidence() -> Record:
    cases = [
        case("liquid_ring", "confirmed", 1),
        case("eccentric_mass", "refuted", 2),
        case("eccentric_mass", "confirmed", 1),
    ]
    return {"verification": cases}


def test_each_paper_has_its_own_claims() -> None:
    assert [c["number"] for c in summary.claims(evidence())] == [1]
    assert [c["number"] for c in summary.claims(evidence(), paper="eccentric_mass")] == [1, 2]


def test_verdicts_are_counted() -> None:
    view = driven.SECOND_BALANCER.view(evidence())
    assert view is not None
    assert view["counts"] == ["1 is confirmed", "1 is refuted"]


def test_no_claims_no_section() -> None:
    assert driven.SECOND_BALANCER.view({"verification": []}) is None
