"""What stands behind each quantity: from the cases, and from nothing else."""

from __future__ import annotations

from typing import Any

from ringbalance.reduced_model.budget import UNITS
from ringbalance.verification.catalogue import load_cases
from ringbalance.verification.standing import NO_DATA, SUBJECTS, budget_standing, standing_rows


def _case(**changes: Any) -> dict[str, Any]:
    numbers = {"points": 1536.0, "share_within": 0.968, "bias": -0.0162, "standard_deviation": 0.05}
    case = {"id": "measured_tubes", "kind": "validation", "about": ["friction"], "verdict": "confirmed"}
    return {**case, "cost": "light", "numbers": numbers, **changes}


def _cell(*cases: dict[str, Any], subject: str = "friction", column: int = 1) -> str:
    return standing_rows(cases)[list(SUBJECTS).index(subject)][column]


def test_measurements_show_their_points_and_what_was_found() -> None:
    assert _cell(_case()) == "tubes: 1536 points, 96.8 % within, bias -1.6 %, scatter 5.0 %"
    assert _cell(_case(verdict="refuted")).endswith("(refuted)")
    assert _cell(_case(verdict="not run", cost="heavy", numbers={})) == "tubes: not run (a heavy case)"
    assert _cell(_case(), subject="crest") == NO_DATA
    wide = {**_case()["numbers"], "share_within": 1.0, "width_needed": 0.77}
    assert "100.0 % within (77 % of its width would hold 95 %), bias" in _cell(_case(numbers=wide))


def test_verification_is_no_validation() -> None:
    solver = _case(id="manufactured_2d", kind="code_verification", numbers={})
    assert _cell(solver) == NO_DATA
    assert _cell(solver, column=2) == "manufactured 2d"
    assert _cell(_case(), column=2) == "by tests alone"


def test_a_budget_says_which_of_its_models_have_no_data() -> None:
    assert (
        budget_standing([_case()], "velocity") == "friction: 1,536 points; rotation, fittings, crest: no data"
    )
    fittings = _case(about=["fittings"], numbers={"points": 42.0, "laminar_points": 42.0})
    assert budget_standing([_case(), fittings], "velocity").startswith(
        "friction: 1,536 points; fittings: 42 points, all laminar;"
    )
    assert budget_standing([], "usable_moment") == "residual: no data"
    assert budget_standing([_case(kind="code_verification")], "drag_coefficient").endswith("no data")


def test_every_budget_rests_on_a_subject_and_every_subject_of_a_budget_exists() -> None:
    named = {quantity for subject in SUBJECTS.values() for quantity in subject.budgets}
    assert named == set(UNITS)


def test_every_case_that_is_no_claim_is_evidence_for_something() -> None:
    for case in load_cases():
        assert bool(case.about) == (case.kind != "claim"), case.id
