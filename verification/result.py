"""What running a case gives: each quantity judged, the case's verdict, the evidence, and its mutations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

from ringbalance.results.numbers import format_given
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity
from ringbalance.verification.assumptions import Assumption
from ringbalance.verification.case import CAUSES, NEEDS_REFERENCE, CaseDefinition, JudgedQuantity, fill
from ringbalance.verification.evidence import (
    COVERAGE_FACTOR,
    Deviation,
    Evidence,
    Found,
    Level,
    Reference,
    from_range,
)
from ringbalance.verification.typed_record import plain
from ringbalance.verification.verdicts import Kind, Verdict, judge_quantity

Document = dict[str, Any]
_LISTED: Final = {"id", "kind", "about", "paper", "number", "title", "claim", "cost"}
_DEPARTS: Final = {Verdict.CORRECTED, Verdict.REFUTED, Verdict.INCONCLUSIVE}
_AS_DEFINED: Final = _LISTED | {
    *("protects", "assumes", "does_not_cover", "equations", "headline", "judged_on", "left_out"),
}
"""What a record has as its case.toml has it."""
_CODES: Final = {
    Verdict.PASSED: "case_holds",
    Verdict.CONFIRMED: "case_holds",
    Verdict.FAILED: "case_failed",
    Verdict.NOT_RUN: "case_not_run",
}
"""Finding of a verdict; that of the others is "case_departs"."""
_DIGITS: Final = 6


@dataclass(frozen=True, kw_only=True)
class QuantityResult:
    """One judged quantity; its numbers are None when the case was not run."""

    quantity: JudgedQuantity
    verdict: Verdict
    number: Found | None = None
    comparison: Deviation | None = None

    @classmethod
    def of(cls, kind: Kind, quantity: JudgedQuantity, found: Found) -> Self:
        """Judge what a case found."""
        verdict, comparison = judge_quantity(
            kind=kind, metric=quantity.metric, limit=quantity.limit, number=found
        )
        return cls(quantity=quantity, verdict=verdict, number=found, comparison=comparison)

    @property
    def reference(self) -> Reference | None:
        """What the number is compared with, or beside which it is shown."""
        return None if self.number is None else self.number.reference

    @property
    def half_width(self) -> float | None:
        """Of the comparison that decided the quantity: 2 u_val, and as far as assumed inputs move it.

        Zero where nothing uncertain entered; None where the case was not run.
        """
        found, comparison = self.number, self.comparison
        if found is None or comparison is None:
            return None
        reach = max(map(abs, found.reach))
        certain = found.numerical == 0 and found.input == 0
        judged_alone = self.quantity.metric not in NEEDS_REFERENCE
        return reach if certain and judged_alone else comparison.half_width + reach

    def to_dict(self) -> Document:
        """The quantity as its case's JSON has it."""
        found, reference = self.number, self.reference
        return {
            **vars(self.quantity),
            "value": None if found is None else found.value,
            "reference": None if reference is None else reference.value,
            "uncertainty": self.half_width,
            "reference_uncertainty": None if reference is None else COVERAGE_FACTOR * reference.uncertainty,
            **_found(found),
            "verdict": self.verdict.value,
        }

    def row(self) -> Quantity:
        """The found number with its interval."""
        quantity, document = self.quantity, _found(self.number)
        exact = not document["value_uncertainty"]
        return Quantity(
            key=quantity.name,
            name=quantity.title,
            value=None if self.number is None else self.number.value,
            unit=quantity.unit,
            lower=None if exact else document["value_low"],
            upper=None if exact else document["value_high"],
            digits=_DIGITS,
        )

    def cells(self) -> tuple[str, ...]:
        """Title, number, what it is compared with, half-width of the comparison, and verdict."""
        quantity, unit = self.quantity, self.quantity.unit
        bound = {"at_most": "≤ ", "at_least": "≥ "}.get(quantity.metric)
        reference = None if self.reference is None else self.reference.value
        against = (
            format_given(reference, unit) if bound is None else bound + format_given(quantity.limit, unit)
        )
        width = format_given(self.half_width, unit, digits=2) if self.half_width else ""
        return quantity.title, self.row().text, against, width, self.verdict.value


@dataclass(frozen=True, kw_only=True)
class MutationResult:
    """What became of a case with a defect built in on purpose."""

    id: str
    what: str
    expect: Verdict
    verdict: Verdict
    status: str
    judged: bool
    """False when the run broke down before anything was judged."""

    @property
    def caught(self) -> bool:
        """Whether the case was judged with this defect, and came out as it must."""
        return self.judged and self.verdict is self.expect

    def to_dict(self) -> Document:
        """The mutation as its case's JSON has it."""
        return {
            "id": self.id,
            "must_fail": self.what,
            "expect": self.expect.value,
            "verdict": self.verdict.value,
            "failed": self.caught,
            "status": self.status,
        }


@dataclass(frozen=True, kw_only=True, repr=False)
class CaseResult(Result):
    """One case, run or not."""

    definition: CaseDefinition
    verdict: Verdict
    quantities: tuple[QuantityResult, ...]
    evidence: Evidence | None
    status: str
    """How the run ended; why it did not take place."""
    level: Level
    scene_name: str
    scene_sha256: str
    time_s: float = 0.0
    assumptions: tuple[Assumption, ...] = ()
    """Inputs that nobody gave and that the verdict rests on."""
    mutations: tuple[MutationResult, ...] = ()

    @property
    def broken(self) -> bool:
        """True when a mutation was run and not caught: the case proves nothing."""
        return any(not mutation.caught for mutation in self.mutations)

    @property
    def numbers(self) -> Mapping[str, float]:
        """All numbers that the case's text may ask for.

        For each quantity q: q, q_low and q_high (as far as assumed inputs move it), q_reference, q_error,
        q_relative (error over reference), q_uncertainty (95 % half-width of the comparison), q_limit; and
        the evidence's own.
        """
        named: dict[str, float] = {}
        for result in self.quantities:
            named |= _named_numbers(result)
        return named | dict(self.evidence.numbers if self.evidence else {})

    def filled(self, text: str) -> str:
        """A text of the case with its numbers put in; empty when it needs numbers and the case was not run.

        Raises: ValueError: the text asks for a number that the evidence does not hold.
        """
        if self.evidence is None and "{" in text:
            return ""
        return fill(text, self.numbers)

    @property
    def consequence(self) -> str:
        """The sentence for a designer, empty where the case was not run."""
        run = self.verdict is not Verdict.NOT_RUN
        return self.filled(self.definition.consequence_of(self.verdict)) if run else ""

    def to_dict(self) -> Document:
        """The result and all that a report shows of it; SI units, or the unit named beside the number."""
        definition = self.definition
        return {
            **_part(definition, _AS_DEFINED),
            "verdict": self.verdict.value,
            "quantities": [quantity.to_dict() for quantity in self.quantities],
            "explanation": self.filled(definition.explanation),
            "consequence": self.consequence,
            "reference": {k: v for k, v in vars(definition.reference).items() if k != "doubts"},
            "doubts": [text for doubt in definition.reference.doubts if (text := self.filled(doubt))],
            "cause": CAUSES[definition.cause] if self.verdict in _DEPARTS else "",
            "judgement": self.filled(definition.judgement),
            "rests_on": [vars(one) for one in self.assumptions],
            "level": self.level,
            "status": self.status,
            "scene": self.scene_name,
            "scene_sha256": self.scene_sha256,
            "time_s": self.time_s,
            "mutations": [mutation.to_dict() for mutation in self.mutations],
            "declared_mutations": [
                {k: v for k, v in vars(mutation).items() if k != "scene"} for mutation in definition.must_fail
            ],
            "broken": self.broken,
            **_evidence(self.evidence),
        }

    def rows(self) -> Rows:
        """Verdict, mutations, and every judged quantity beside what it is compared with."""
        definition, run = self.definition, self.evidence is not None
        values = {"verdict": self.verdict.value, "claim": definition.claim}
        consequence = (("consequence", self.consequence),) if definition.kind == "claim" else ()
        verdict = Finding(code=_CODES.get(self.verdict, "case_departs"), values=values)
        mutations = [
            Finding(
                code="mutation_caught" if each.caught else "mutation_missed",
                values={"what": each.what, "verdict": each.verdict.value, "expect": each.expect.value},
            )
            for each in self.mutations
        ]
        heads = ("quantity", "found", "reference or limit", "±", "verdict")
        table = Table(heads=heads, rows=[each.cells() for each in self.quantities] if run else [])
        return Rows(
            title=f"{definition.id}  {kind_text(definition)}  {self.verdict}",
            quantities=tuple(each.row() for each in self.quantities) if run else (),
            findings=(verdict, *mutations),
            facts=consequence if run else (("status", self.status),),
            tables=(table,),
            listed=0,
        )


def _named_numbers(result: QuantityResult) -> dict[str, float]:
    name, found, comparison = result.quantity.name, result.number, result.comparison
    if found is None or comparison is None:
        return {}
    low, high = found.reach
    named = {
        name: found.value,
        f"{name}_low": found.value + low,
        f"{name}_high": found.value + high,
        f"{name}_error": comparison.error,
        f"{name}_uncertainty": comparison.half_width,
        f"{name}_limit": result.quantity.limit,
    }
    if found.corrected is not None:
        named[f"{name}_corrected"] = found.corrected
    reference = result.reference
    if reference is not None:
        named[f"{name}_reference"] = reference.value
        named[f"{name}_reference_uncertainty"] = COVERAGE_FACTOR * reference.uncertainty
        if reference.value != 0:
            named[f"{name}_relative"] = comparison.error / reference.value
    return named


def kind_text(definition: CaseDefinition) -> str:
    """Such as "code verification", or "claim 12"."""
    number = "" if definition.number is None else f" {definition.number}"
    return definition.kind.replace("_", " ") + number


def definition_document(definition: CaseDefinition) -> Document:
    """What a list of cases says of one of them."""
    return _part(definition, _LISTED) | {"mutations": [mutation.id for mutation in definition.must_fail]}


def _part(definition: CaseDefinition, names: set[str]) -> Document:
    return {name: value for name, value in plain(definition).items() if name in names}


def _found(found: Found | None) -> Document:
    """Expanded uncertainties of a found number, and the standard ones of V&V 20 by their symbols there."""
    if found is None:
        names = ("error", "value_uncertainty", "value_low", "value_high", "numerical_uncertainty")
        return dict.fromkeys((*names, "input_uncertainty", "corrected", "validation"))
    (low, high), reference = found.reach, found.reference
    error = None if reference is None else found.error
    known = COVERAGE_FACTOR * math.hypot(found.numerical, found.input)
    parts = {
        "u_num": found.numerical,
        # An assumed input is equally likely anywhere within its reach.
        "u_input": math.hypot(found.input, from_range(found.reach)),
        "u_D": 0.0 if reference is None else reference.uncertainty,
    }
    return {
        "error": error,
        "value_uncertainty": known + max(-low, high),
        "value_low": found.value + low - known,
        "value_high": found.value + high + known,
        "numerical_uncertainty": COVERAGE_FACTOR * found.numerical,
        "input_uncertainty": COVERAGE_FACTOR * parts["u_input"],
        "corrected": found.corrected,
        "validation": {"E": error, **parts, "u_val": math.hypot(*parts.values())},
    }


def _evidence(evidence: Evidence | None) -> Document:
    if evidence is None:
        return {"numbers": {}, "series": [], "convergence": [], "tables": []}
    document = {name: plain(getattr(evidence, name)) for name in ("numbers", "series", "tables")}
    for series in document["series"]:
        series["y"] = [{k: v for k, v in curve.items() if v is not None} for curve in series["y"]]
    studies = [{"h": (one := plain(study)).pop("size"), **one} for study in evidence.convergence]
    return document | {"convergence": studies}


def merge_saved(document: Sequence[Document], saved: Sequence[Mapping[str, Any]]) -> list[Document]:
    """The records, with the `saved` result on the same scene for each heavy case that was not run."""
    earlier = {(case["id"], case["scene_sha256"]): dict(case) for case in saved}
    return [_merged(case, earlier.get((case["id"], case["scene_sha256"]))) for case in document]


def _merged(case: Document, earlier: Document | None) -> Document:
    keep = case["cost"] == "heavy" and case["verdict"] == Verdict.NOT_RUN.value
    if not keep or earlier is None or earlier["verdict"] == Verdict.NOT_RUN.value:
        return case
    status = f"kept from an earlier run of {earlier.get('date', 'an unknown date')}"
    return earlier | {"about": case["about"], "status": status}
