"""Running a case: judging, mutations, break-downs, changed scenes, several processes."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest
from block_discs import imported

from ringbalance.physics.results import Status, StatusCode
from ringbalance.scene.models import Scene
from ringbalance.verification.assumptions import overridden
from ringbalance.verification.case import CaseDefinition
from ringbalance.verification.evidence import Found, NotRunError
from ringbalance.verification.runner import case_jobs, run_case, run_cases, run_definition
from ringbalance.verification.verdicts import Verdict

QUICK = ("gci_celik2008", "claim_02_ring_radius", "claim_12_correction_mass")


def test_a_claim_is_confirmed(claim: CaseDefinition, made_up_code: Any, paper_scene: Scene) -> None:
    result = run_definition(claim, made_up_code(), scene=paper_scene)
    assert result.verdict is Verdict.CONFIRMED
    assert result.status == "solved"
    assert result.filled(claim.explanation) == "It is 10.00 against 10.00, 0.0\u00a0% off."
    assert result.filled(claim.reference.doubts[0]) == "It may be 12.3\u00a0mm."


def test_every_mutation_is_run_and_caught(
    claim: CaseDefinition, verification: CaseDefinition, made_up_code: Any, paper_scene: Scene
) -> None:
    for definition in (claim, verification):
        result = run_definition(definition, made_up_code(), scene=paper_scene, mutations=True)
        mutations = result.mutations
        assert [each.mutation.id for each in mutations] == ["off_by_one", "thicker"]
        assert all(mutation.caught for mutation in mutations)


def test_a_case_that_misses_a_defect_is_broken(
    claim: CaseDefinition, made_up_code: Any, paper_scene: Scene
) -> None:
    blind = made_up_code(defect=lambda number, _, __: number)
    result = run_definition(claim, blind, scene=paper_scene, mutations=True)
    assert [mutation.caught for mutation in result.mutations] == [False, True]
    assert result.broken
    assert not dataclasses.replace(result, mutations=()).broken
    (missed,) = (finding for finding in result.rows().findings if finding.code == "mutation_missed")
    assert missed.severity == "error"


def test_a_mutation_that_only_breaks_down_is_not_caught(
    verification: CaseDefinition, made_up_code: Any, paper_scene: Scene
) -> None:
    def stumble(_: Found, defect: str | None, __: Scene) -> Found:
        if defect is None:
            return Found(value=10.0)
        raise ValueError("stumbled")

    code = made_up_code(defect=stumble)
    first, _ = run_definition(verification, code, scene=paper_scene, mutations=True).mutations
    assert first.verdict is Verdict.FAILED
    assert "stumbled" in first.status
    assert not first.caught


@pytest.mark.parametrize(
    ("error", "claimed", "verified"),
    [
        (ValueError("no"), Verdict.INCONCLUSIVE, Verdict.FAILED),
        (ZeroDivisionError("no"), Verdict.INCONCLUSIVE, Verdict.FAILED),
        (NotRunError("no"), Verdict.NOT_RUN, Verdict.NOT_RUN),
    ],
)
def test_a_break_down_is_a_verdict_with_its_reason(
    claim: CaseDefinition,
    verification: CaseDefinition,
    made_up_code: Any,
    paper_scene: Scene,
    error: Exception,
    claimed: Verdict,
    verified: Verdict,
) -> None:
    def stumble(*_: object) -> Found:
        raise error

    code = made_up_code(defect=stumble)
    for definition, expected in ((claim, claimed), (verification, verified)):
        result = run_definition(definition, code, scene=paper_scene)
        assert result.verdict is expected
        assert result.status.endswith("no")
        assert [quantity.verdict for quantity in result.quantities] == [expected]
        assert result.filled(definition.explanation) == ""


def test_a_programming_error_is_not_swallowed(
    claim: CaseDefinition, made_up_code: Any, paper_scene: Scene
) -> None:
    def stumble(*_: object) -> Found:
        raise TypeError("a fault of the program")

    with pytest.raises(TypeError, match="a fault of the program"):
        run_definition(claim, made_up_code(defect=stumble), scene=paper_scene)


def test_a_solve_that_did_not_succeed_cannot_confirm(
    claim: CaseDefinition, made_up_code: Any, paper_scene: Scene
) -> None:
    status = Status(code=StatusCode.NOT_CONVERGED, text="refine the mesh")
    result = run_definition(claim, made_up_code(evidence={"status": status}), scene=paper_scene)
    assert result.verdict is Verdict.INCONCLUSIVE
    assert result.status == "refine the mesh"


def test_evidence_must_name_what_is_judged(
    claim: CaseDefinition, made_up_code: Any, paper_scene: Scene
) -> None:
    code = made_up_code(evidence={"quantities": {"another": Found(value=1.0)}})
    result = run_definition(claim, code, scene=paper_scene)
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "judged are ['answer'], found ['another']" in result.status


def test_a_heavy_case_waits_for_its_level(claim_text: str, made_up_code: Any, paper_scene: Scene) -> None:
    heavy = CaseDefinition.parse(
        claim_text.replace("[consequence]", 'cost = "heavy"\n[consequence]', 1), source="x"
    )
    code = made_up_code()
    waiting = run_definition(heavy, code, scene=paper_scene, mutations=True)
    assert (waiting.verdict, waiting.mutations) == (Verdict.NOT_RUN, ())
    assert run_definition(heavy, code, scene=paper_scene, level="heavy").verdict is Verdict.CONFIRMED


def test_a_scene_is_changed_by_name(paper_scene: Scene) -> None:
    changed = overridden(paper_scene, {"disc.plate_thickness": 0.0, "tube.hump_radius": "absent"})
    assert changed.disc.plate_thickness == 0.0
    assert changed.tube.hump_radius is None
    assert paper_scene.disc.plate_thickness > 0
    with pytest.raises(ValueError, match="no quantity"):
        overridden(paper_scene, {"disc.colour": 1.0})


def test_a_claim_on_the_papers_numbers_ignores_the_scene_at_hand(paper_scene: Scene) -> None:
    other = overridden(paper_scene, {"disc.outer_radius": 0.06})
    result = run_case("claim_02_ring_radius", scene=other)
    assert result.scene_sha256 == paper_scene.values_sha256
    assert result.verdict is Verdict.CONFIRMED
    assert result.numbers["ring_radius"] == pytest.approx(34.9e-3, abs=0.05e-3)


def test_results_come_in_the_order_asked_for_with_progress(paper_scene: Scene) -> None:
    seen: list[str] = []
    results = run_cases(QUICK, scene=paper_scene, progress=lambda r: seen.append(r.definition.id))
    assert [result.definition.id for result in results] == list(QUICK)
    assert seen == list(QUICK)
    assert all(math.isfinite(result.time_s) for result in results)


def test_the_eccentric_masses_are_compiled_in_one_process(paper_scene: Scene) -> None:
    cases = ("claim_01_volume", "driven_bound", "driven_fig4_imbalance")
    options: dict[str, Any] = {"scene": paper_scene, "level": "light", "mutations": False}
    assert [job.name for job in case_jobs(cases, **options)] == ["case driven_bound", "case claim_01_volume"]
    assert [job.name for job in case_jobs(cases, **options, apart=True)] == [f"case {name}" for name in cases]


@pytest.mark.heavy
def test_processes_give_what_one_process_gives(paper_scene: Scene) -> None:
    alone = run_cases(QUICK, scene=paper_scene, mutations=True)
    spread = run_cases(QUICK, scene=paper_scene, mutations=True, workers=2)
    for single, other in zip(alone, spread, strict=True):
        assert (single.verdict, single.numbers, single.mutations) == (
            other.verdict,
            other.numbers,
            other.mutations,
        )


def test_a_case_about_a_sector_says_why_it_does_not_judge_an_imported_chamber(paper_scene: Scene) -> None:
    scene = dataclasses.replace(paper_scene, disc=imported(paper_scene.disc, cells=(1, 4, 1)))
    result = run_case("claim_20_rectangular_element", scene=scene)
    assert result.verdict is Verdict.NOT_RUN
    assert "imported" in result.status
    # On the paper's own disc, whatever scene is at hand.
    assert run_case("claim_02_ring_radius", scene=scene).verdict is not Verdict.NOT_RUN
