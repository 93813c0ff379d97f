"""The JSON of a case: what scripts rely on, clean at any state of the case."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from ringbalance.scene.models import Scene
from ringbalance.verification.case import CaseDefinition
from ringbalance.verification.evidence import FigureCurve, Found, NotRunError, figure
from ringbalance.verification.result import QuantityResult, definition_document, merge_saved
from ringbalance.verification.runner import run_definition

PROMISED = {"id", "kind", "verdict", "quantities"}
PROMISED_OF_QUANTITY = {"name", "unit", "value", "reference", "error", "uncertainty", "limit", "verdict"}


def test_what_is_promised_is_there(claim: CaseDefinition, made_up_code: Any, paper_scene: Scene) -> None:
    code = made_up_code(number=Found(value=10.2, input=0.05))
    document = run_definition(claim, code, scene=paper_scene).to_dict()
    assert set(document) >= PROMISED
    (quantity,) = document["quantities"]
    assert set(quantity) >= PROMISED_OF_QUANTITY
    assert quantity["error"] == pytest.approx(0.2)
    assert quantity["uncertainty"] == pytest.approx(0.1)
    assert quantity["verdict"] == document["verdict"] == "refuted"
    assert document["consequence"] == "Use 10.2."
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_a_case_that_was_not_run_is_still_listed(
    claim: CaseDefinition, made_up_code: Any, paper_scene: Scene
) -> None:
    def refuse(*_: object) -> Found:
        raise NotRunError("there is no disc")

    document = run_definition(claim, made_up_code(defect=refuse), scene=paper_scene).to_dict()
    assert document["verdict"] == "not run"
    assert document["cause"] == ""
    assert document["status"] == "there is no disc"
    assert document["consequence"] == document["explanation"] == ""
    assert document["quantities"][0]["value"] is None
    json.dumps(document, allow_nan=False)


def test_a_bound_without_uncertainty_has_none(claim_text: str, made_up_code: Any, paper_scene: Scene) -> None:
    text = claim_text.replace('metric = "validation"', 'metric = "at_most"')
    bound = CaseDefinition.parse(text, source="x")
    document = run_definition(bound, made_up_code(), scene=paper_scene).to_dict()
    assert document["quantities"][0]["uncertainty"] == 0.0


@pytest.mark.parametrize(
    ("numerical", "known", "reach"),
    [(0.1, 0.0, (0.0, 0.0)), (0.1, 0.2, (0.0, 0.0)), (0.1, 0.2, (-0.3, 0.5)), (0.0, 0.0, (-1.0, 0.2))],
)
def test_no_part_of_an_uncertainty_exceeds_the_whole(
    claim: CaseDefinition, numerical: float, known: float, reach: tuple[float, float]
) -> None:
    number = Found(value=10.0, numerical=numerical, input=known).against(10.0).moved(*reach)
    document = QuantityResult.of("claim", claim.quantity[0], number).to_dict()
    whole = document["value_uncertainty"]
    parts = document["numerical_uncertainty"], document["input_uncertainty"]
    assert max(parts) <= whole <= sum(parts)
    # The range of assumed inputs is added whole, not as the standard deviation of V&V 20.
    assert whole == pytest.approx(2 * math.hypot(numerical, known) + max(-reach[0], reach[1]))
    assert document["value_high"] - document["value_low"] <= 2 * whole * (1 + 1e-12)


def test_gaps_in_a_curve_become_null(claim: CaseDefinition, made_up_code: Any, paper_scene: Scene) -> None:
    curve = FigureCurve(name="c", unit="m", values=np.array([1.0, np.nan]), uncertainty=np.zeros(2))
    code = made_up_code(evidence={"series": (figure("s", ("x", "s", [0.0, 1.0]), curve),)})
    document = run_definition(claim, code, scene=paper_scene).to_dict()
    (series,) = document["series"]
    assert series["y"][0]["values"] == [1.0, None]
    assert series["x"] == {"name": "x", "unit": "s", "values": [0.0, 1.0]}
    json.dumps(document, allow_nan=False)


def heavy(verdict: str, *, sha: str = "aa", cost: str = "heavy") -> dict[str, Any]:
    return {"id": "coverage", "about": ["range"], "verdict": verdict, "cost": cost, "scene_sha256": sha}


@pytest.mark.parametrize(
    ("now", "saved", "expected"),
    [
        (heavy("not run"), heavy("passed"), "passed"),
        (heavy("not run"), heavy("passed", sha="bb"), "not run"),
        (heavy("failed"), heavy("passed"), "failed"),
        (heavy("not run", cost="light"), heavy("passed"), "not run"),
        (heavy("not run"), heavy("not run"), "not run"),
    ],
)
def test_heavy_results_are_kept_for_the_same_scene_only(
    now: dict[str, Any], saved: dict[str, Any], expected: str
) -> None:
    (merged,) = merge_saved([now], [saved | {"date": "2025-01-31"}])
    assert merged["verdict"] == expected
    assert ("2025-01-31" in merged.get("status", "")) == (expected == "passed")


def test_a_list_names_claim_and_mutations(claim: CaseDefinition) -> None:
    listed = definition_document(claim)
    assert listed["claim"] == "The answer is ten."
    assert listed["mutations"] == ["off_by_one", "thicker"]
