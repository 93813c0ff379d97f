"""A made-up case, whole, that tests change one thing at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import pytest

from ringbalance.scene.models import Scene
from ringbalance.verification.case import CaseDefinition
from ringbalance.verification.evidence import Evidence, Found, Level

CLAIM = """
id = "made_up"
number = 1
kind = "claim"
title = "A made-up claim"
claim = "The answer is ten."
protects = "the tests"
assumes = ["nothing"]
does_not_cover = ["everything else"]
explanation = "It is {answer} against {answer_reference}, {answer_relative:%:.1f} off."
equations = ["x = 10"]

[consequence]
refuted = "Use {answer:1:.1f}."
default = "Use ten."

[reference]
kind = "printed number"
source = "a paper"
uncertainty = "rounding"
doubts = ["It may be {doubt:mm:.1f}."]

[[quantity]]
name = "answer"
title = "the answer"
unit = "1"
basis = "ratio"
metric = "validation"
limit = 0.05
why = "because"

[[must_fail]]
id = "off_by_one"
what = "one is added"
expect = "refuted"

[[must_fail]]
id = "thicker"
what = "the plates are thicker"
expect = "refuted"
scene = { "disc.plate_thickness" = 0.004 }
"""

VERIFICATION = (
    CLAIM.replace("number = 1\n", 'order = 10\nabout = ["ring"]\n')
    .replace('kind = "claim"', 'kind = "code_verification"', 1)
    .replace('metric = "validation"', 'metric = "relative"')
    .replace('expect = "refuted"', 'expect = "failed"')
    .replace('refuted = "Use', 'failed = "Use')
)


@dataclass(frozen=True, kw_only=True)
class MadeUpCode:
    """Code of the made-up case: ten, unless a defect is built in, with further fields of its evidence."""

    number: Found = field(default_factory=lambda: Found(value=10.0))
    defect: Callable[[Found, str | None, Scene], Found] = lambda number, defect, _: (
        Found(value=number.value + 1) if defect == "off_by_one" else number
    )

    evidence: Mapping[str, Any] = field(default_factory=dict)

    def compute(self, scene: Scene, level: Level, defect: str | None = None) -> Evidence:  # noqa: ARG002
        thicker = scene.disc.plate_thickness == 0.004
        number = Found(value=20.0) if thicker else self.defect(self.number, defect, scene)
        evidence = Evidence(quantities={"answer": number.against(10.0)}, numbers={"doubt": 0.0123})
        return replace(evidence, **self.evidence)


@pytest.fixture
def claim() -> CaseDefinition:
    return CaseDefinition.parse(CLAIM, source="made_up/case.toml")


@pytest.fixture
def verification() -> CaseDefinition:
    return CaseDefinition.parse(VERIFICATION, source="made_up/case.toml")


@pytest.fixture
def claim_text() -> str:
    return CLAIM


@pytest.fixture
def made_up_code() -> type[MadeUpCode]:
    return MadeUpCode
