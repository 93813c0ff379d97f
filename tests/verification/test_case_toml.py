"""A case.toml says everything before anything is computed, or is refused with all its faults."""

from __future__ import annotations

import pickle

import pytest

from ringbalance.verification.case import CaseDefinition, CaseError
from ringbalance.verification.catalogue import load_cases
from ringbalance.verification.verdicts import Verdict


def test_a_whole_case_is_read(claim: CaseDefinition, verification: CaseDefinition) -> None:
    assert claim.number == 1
    assert claim.judged_on == "scene"
    assert claim.quantity[0].limit == 0.05
    assert claim.must_fail[1].scene == {"disc.plate_thickness": 0.004}
    assert claim.consequence_of(Verdict.REFUTED).startswith("Use {answer")
    assert claim.consequence_of(Verdict.CONFIRMED) == "Use ten."
    assert verification.number is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("number = 1\n", "", "a claim has a number"),
        ('kind = "claim"', 'kind = "opinion"', "kind"),
        ("number = 1\n", "number = 1\norder = 10\n", "order"),
        ("limit = 0.05", "limit = 0.0", "limit must be positive"),
        ('why = "because"', "", "why"),
        ('claim = "The answer is ten."', "", "claim"),
        ('metric = "validation"', 'metric = "by_eye"', "metric"),
        ('basis = "ratio"', 'basis = "per acre"', "basis"),
        ('name = "answer"', 'name = "The answer"', "name"),
        ("{answer_relative:%:.1f}", "{answer:furlong}", "unknown unit"),
        ("Use ten.", "Use {ten.", "no placeholder"),
        ('refuted = "Use', 'failed = "Use', "no verdict of a claim"),
        ('default = "Use ten."', "", "nothing for"),
        ('expect = "refuted"\n\n', 'expect = "failed"\n\n', "cannot come out"),
        ('expect = "refuted"\n\n', 'expect = "not run"\n\n', "cannot come out"),
        ('id = "thicker"', 'id = "off_by_one"', "stands twice"),
        ('protects = "the tests"', 'protects = "the tests"\nsurprise = 1', "surprise"),
        ('source = "a paper"', "", "source"),
        ('id = "made_up"', "id = made_up", "Invalid value"),
    ],
)
def test_what_is_no_case_is_refused(claim_text: str, old: str, new: str, message: str) -> None:
    assert old in claim_text
    with pytest.raises(CaseError, match=message):
        CaseDefinition.parse(claim_text.replace(old, new, 1), source="made_up/case.toml")


def test_a_case_without_mutations_is_refused(claim_text: str) -> None:
    with pytest.raises(CaseError, match="must_fail"):
        CaseDefinition.parse(claim_text.split("[[must_fail]]")[0], source="made_up/case.toml")


def test_all_faults_are_named_at_once(claim_text: str) -> None:
    broken = claim_text.replace('title = "A made-up claim"', "").replace('why = "because"', "")
    with pytest.raises(CaseError) as caught:
        CaseDefinition.parse(broken, source="made_up/case.toml")
    lines = str(caught.value).splitlines()
    assert [line for line in lines if "title" in line]
    assert [line for line in lines if "[quantity.0] why" in line]
    assert all(line.startswith("made_up/case.toml: ") for line in lines)


def test_a_verification_must_fail_with_a_defect(claim_text: str) -> None:
    text = claim_text.replace("number = 1\n", 'order = 10\nabout = ["ring"]\n').replace(
        'kind = "claim"', 'kind = "code_verification"', 1
    )
    with pytest.raises(CaseError, match=r"metric|come out"):
        CaseDefinition.parse(text, source="made_up/case.toml")


def test_the_program_s_cases_say_all_that_a_report_shows() -> None:
    """An own case may leave out its place and its texts for the report."""
    for case in load_cases():
        assert case.explanation, case.id
        assert case.consequence, case.id
        assert (case.kind == "claim") != (case.order is not None and bool(case.about)), case.id


def test_a_case_goes_from_process_to_process() -> None:
    for case in load_cases():
        assert pickle.loads(pickle.dumps(case)) == case
