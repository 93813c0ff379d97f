"""Basis of each quantity: from the cases, and from nothing else."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import pytest

from ringbalance.physics.sloshing import FREQUENCY_UNCERTAINTY
from ringbalance.reduced_model.calibration_record import ANSWERED
from ringbalance.verification.runner import paper_scene, run_case
from ringbalance.verification.standing import HEADS, NO_DATA, SUBJECTS, budget_standing, standing_rows


def _case(**changes: Any) -> dict[str, Any]:
    numbers = {"points": 1536.0, "share_within": 0.968, "bias": -0.0162, "standard_deviation": 0.05}
    case = {"id": "measured_tubes", "kind": "validation", "about": ["friction"], "verdict": "confirmed"}
    return {**case, "cost": "light", "numbers": numbers, **changes}


def _cell(*cases: dict[str, Any], subject: str = "friction", head: str = "Validated by measurements") -> str:
    return standing_rows(cases)[list(SUBJECTS).index(subject)][HEADS.index(head)]


@lru_cache(maxsize=8)
def _measured(name: str) -> dict[str, Any]:
    return run_case(f"measured_{name}", scene=paper_scene()).to_dict()


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
    assert _cell(solver, head="Verified by cases") == "manufactured 2d"
    assert _cell(_case(), head="Verified by cases") == "by tests alone"


@pytest.mark.parametrize(
    ("name", "readings", "judged", "everything", "left_out"),
    [
        ("ducts", 125, "107 of 125 points, 97.2 % within", "of all 125: 89.6 %", "18 points of a flat duct"),
        ("laminar_tubes", 69, "42 of 63 points, 100.0 % within", "of all 63: 88.9 %", "6 points which gave"),
        ("rotor", 782, "318 points", "off by up to +4.0 %", "464 points with none"),
        ("smooth_tubes", 577, "536 of 577 points", "of all 577: 92.9 %", "30 points by McKeon"),
        ("waves", 52, "28 points, 100.0 % within", "bias", "24 points of four"),
    ],
)
def test_what_is_left_out_is_counted_and_what_taught_is_no_prediction(
    name: str, readings: int, judged: str, everything: str, left_out: str
) -> None:
    """Against the rows of the data files."""
    case = _measured(name)
    subject, numbers = case["about"][0], case["numbers"]
    assert judged in _cell(case, subject=subject)
    assert everything in _cell(case, subject=subject)
    assert left_out in _cell(case, subject=subject, head="Left out of that, and why")
    counted = sum(numbers[f"{each['name']}_points"] for each in case["left_out"])
    assert numbers["points"] + counted == readings


def test_the_stated_uncertainty_of_waves_follows_from_the_points_that_taught_it() -> None:
    case = _measured("waves")
    assert case["verdict"] == "confirmed"
    assert case["numbers"]["taught_width"] == pytest.approx(FREQUENCY_UNCERTAINTY, rel=0.085)
    (judged,) = (each for each in case["quantities"] if each["name"] == "calibration")
    assert judged["verdict"] == "confirmed"


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
    assert named == set(ANSWERED)
