"""The section on the second balancer."""

from __future__ import annotations

from typing import Any

from ringbalance.reports import summary
from ringbalance.reports.pages import eccentric_mass as driven

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


def evidence(compared: Record | None = None, text: str = "") -> Record:
    cases = [
        case("liquid_ring", "confirmed", 1),
        case("eccentric_mass", "refuted", 2),
        case("eccentric_mass", "confirmed", 1),
    ]
    return {"verification": cases, "driven": {"compared": compared, "text": text}}


def test_each_paper_has_its_own_claims() -> None:
    assert [c["number"] for c in summary.claims(evidence())] == [1]
    assert [c["number"] for c in summary.claims(evidence(), paper="eccentric_mass")] == [1, 2]


def test_verdicts_are_counted() -> None:
    view = driven.SECTION.view(evidence())
    assert view is not None
    assert view["lead"] == "Of 2 claims of the eccentric-mass paper 1 is confirmed, 1 is refuted."


def test_a_balancer_that_does_not_settle_has_no_time() -> None:
    compared = {
        "balancer": ["liquid_ring", "eccentric_mass"],
        "time_s": [None, 3.5],
        "residual_ratio": [0.004, 0.001],
        "worst_amplitude_m": [1e-5, 1e-5],
        "energy_J": [90.2, 6.9],
        "status": ["not settled", "settled"],
    }
    view = driven.SECTION.view(evidence(compared))
    assert view is not None
    assert view["compared"].heads == ("", "liquid ring", "two eccentric masses")
    assert view["compared"].rows[0][1] == "–"
    assert view["status"][1] == "Two eccentric masses: settled."


def test_what_cannot_be_compared_is_said() -> None:
    view = driven.SECTION.view(evidence(text="the rotor stands still"))
    assert view is not None
    assert view["compared"] is None
    assert view["text"] == "the rotor stands still"


def test_no_claims_no_section() -> None:
    assert driven.SECTION.view({"verification": []}) is None
