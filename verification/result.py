"""Result of running a case: each quantity judged, the case's verdict, the evidence, and its mutations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

from ringbalance.results.numbers import format_given, percent
from ringbalance.results.numbers import plain as plain_text
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.typed_record import plain
from ringbalance.verification.assumptions import Assumption
from ringbalance.verification.case import (
    CAUSES,
    NEEDS_REFERENCE,
    CaseDefinition,
    JudgedQuantity,
    Mutation,
    fill,
)
from ringbalance.verification.evidence import (
    COVERAGE_FACTOR,
    Deviation,
    Evidence,
    Found,
    Level,
    from_range,
)
from ringbalance.verification.verdicts import Kind, Verdict, judge_quantity

Document = dict[str, Any]
_LISTED: Final = {"id", "kind", "about", "paper", "number", "title", "claim", "cost"}
_DEPARTS: Final = {Verdict.CORRECTED, Verdict.REFUTED, Verdict.INCONCLUSIVE}
_AS_DEFINED: Final = _LISTED | {
    *("protects", "assumes", "does_not_cover", "equations", "headline", "judged_on", "left_out"),
}
"""Keys of a result that are copied from its case.toml."""
_CODES: Final = {
    Verdict.PASSED: "case_holds",
    Verdict.CONFIRMED: "case_holds",
    Verdict.FAILED: "case_failed",
    Verdict.NOT_RUN: "case_not_run",
}
"""Finding by verdict; all other verdicts have "case_departs"."""
_FIGURES: Final = 6


@dataclass(frozen=True, kw_only=True)
class QuantityResult:
    """One judged quantity; its numbers are None when the case was not run."""

    quantity: JudgedQuantity
    verdict: Verdict
    number: Found | None = None
    deviation: Deviation | None = None

    @classmethod
    def of(cls, kind: Kind, quantity: JudgedQuantity, number: Found) -> Self:
        """Judge a computed number by the quantity's criteria."""
        verdict, deviation = judge_quantity(
            kind=kind, metric=quantity.metric, limit=quantity.limit, number=number
        )
        return cls(quantity=quantity, verdict=verdict, number=number, deviation=deviation)

    @property
    def half_width(self) -> float | None:
        """Half-width of the deviation that decided the quantity: 2 u_val plus the reach of assumed inputs.

        Zero where nothing uncertain entered; None where the case was not run.
        """
        number, deviation = self.number, self.deviation
        if number is None or deviation is None:
            return None
        reach = max(map(abs, number.reach))
        certain = number.numerical == 0 and number.input == 0
        judged_alone = self.quantity.metric not in NEEDS_REFERENCE
        return reach if certain and judged_alone else deviation.half_width + reach

    def to_dict(self) -> Document:
        """Record of the quantity in the JSON of its case."""
        number = self.number
        reference = None if number is None else number.reference
        return {
            **vars(self.quantity),
            "value": None if number is None else number.value,
            "reference": None if reference is None else reference.value,
            "uncertainty": self.half_width,
            "reference_uncertainty": None if reference is None else COVERAGE_FACTOR * reference.uncertainty,
            **_uncertainties(number),
            "verdict": self.verdict.value,
        }

    def row(self) -> Quantity:
        """The computed number with its interval."""
        quantity, document = self.quantity, _uncertainties(self.number)
        exact = not document["value_uncertainty"]
        return Quantity(
            key=quantity.name,
            name=quantity.title,
            value=None if self.number is None else self.number.value,
            unit=quantity.unit,
            lower=None if exact else document["value_low"],
            upper=None if exact else document["value_high"],
            digits=_FIGURES,
        )

    def cells(self) -> tuple[str, ...]:
        """Title, number, reference and limit, half-width of the deviation, and verdict."""
        quantity, unit, number = self.quantity, self.quantity.unit, self.number
        bound = {"at_most": "≤ ", "at_least": "≥ "}.get(quantity.metric)
        reference = None if number is None or number.reference is None else number.reference.value
        if bound is not None:
            against = bound + format_given(quantity.limit, unit)
        elif quantity.metric == "relative":
            against = f"{format_given(reference, unit)} within {percent(quantity.limit)}"
        elif quantity.metric == "absolute":
            against = f"{format_given(reference, unit)} within {format_given(quantity.limit, unit)}"
        else:
            against = format_given(reference, unit)
        width = format_given(self.half_width, unit, digits=2) if self.half_width else ""
        return quantity.title, self.row().text, against, width, self.verdict.value


@dataclass(frozen=True, kw_only=True)
class MutationResult:
    """Verdict on a case with a deliberate defect."""

    mutation: Mutation
    verdict: Verdict
    status: str
    judged: bool
    """False if the run broke down before anything was judged."""

    @property
    def caught(self) -> bool:
        """True if the case was judged with this defect, and came out as it must."""
        return self.judged and self.verdict is self.mutation.expect

    def to_dict(self) -> Document:
        """Record of the mutation in the JSON of its case."""
        return {
            "id": self.mutation.id,
            "must_fail": self.mutation.what,
            "expect": self.mutation.expect.value,
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
    """End of the run, or the reason why it did not take place."""
    level: Level
    scene_name: str
    scene_sha256: str
    time_s: float = 0.0
    assumptions: tuple[Assumption, ...] = ()
    """Assumed inputs that the verdict rests on."""
    mutations: tuple[MutationResult, ...] = ()

    @property
    def broken(self) -> bool:
        """True if a mutation was run and not caught: the case proves nothing."""
        return any(not mutation.caught for mutation in self.mutations)

    @property
    def numbers(self) -> Mapping[str, float]:
        """All numbers that placeholders of the case's text may name.

        For each quantity q: q, q_low and q_high (its range over the assumed inputs), q_corrected,
        q_reference, q_reference_uncertainty (95 %), q_error, q_relative (error over reference),
        q_uncertainty (95 % half-width of the deviation), q_limit; and the numbers of the evidence.
        """
        numbers: dict[str, float] = {}
        for result in self.quantities:
            name, number, deviation = result.quantity.name, result.number, result.deviation
            if number is None or deviation is None:
                continue
            low, high = number.reach
            numbers |= {
                name: number.value,
                f"{name}_low": number.value + low,
                f"{name}_high": number.value + high,
                f"{name}_error": deviation.error,
                f"{name}_uncertainty": deviation.half_width,
                f"{name}_limit": result.quantity.limit,
            }
            if number.corrected is not None:
                numbers[f"{name}_corrected"] = number.corrected
            if (reference := number.reference) is not None:
                numbers[f"{name}_reference"] = reference.value
                numbers[f"{name}_reference_uncertainty"] = COVERAGE_FACTOR * reference.uncertainty
                if reference.value != 0:
                    numbers[f"{name}_relative"] = deviation.error / reference.value
        return numbers | dict(self.evidence.numbers if self.evidence else {})

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

    @property
    def brief(self) -> str:
        """Case and verdict in a line, with the quantity that departs most, relative to its reference."""
        apart = {
            abs(each.deviation.error / ((each.number.reference and each.number.reference.value) or 1.0)): each
            for each in self.quantities
            if each.verdict is self.verdict and each.number is not None and each.deviation is not None
        }
        title = self.rows().title
        if not apart:
            return title
        name, computed, against, *_ = apart[max(apart)].cells()
        return plain_text(f"{title}: {name} {computed}, to be {against}")

    def to_dict(self) -> Document:
        """The result and all that a report shows of it; SI units, or the unit named beside the number."""
        definition, evidence = self.definition, self.evidence
        document = {
            **_part(definition, _AS_DEFINED),
            "verdict": self.verdict.value,
            "quantities": [quantity.to_dict() for quantity in self.quantities],
            "explanation": self.filled(definition.explanation),
            "consequence": self.consequence,
            "reference": {k: v for k, v in vars(definition.reference).items() if k != "doubts"},
            "doubts": [text for doubt in definition.reference.doubts if (text := self.filled(doubt))],
            "cause": CAUSES[definition.cause] if self.verdict in _DEPARTS else "",
            "judgement": self.filled(definition.judgement),
            "rests_on": [vars(assumption) for assumption in self.assumptions],
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
        }
        if evidence is None:
            return document | {"numbers": {}, "series": [], "convergence": [], "tables": []}
        document |= {name: plain(getattr(evidence, name)) for name in ("numbers", "series", "tables")}
        for series in document["series"]:
            series["y"] = [{k: v for k, v in curve.items() if v is not None} for curve in series["y"]]
        studies = map(plain, evidence.convergence)
        return document | {"convergence": [{"h": study.pop("size"), **study} for study in studies]}

    def rows(self) -> Rows:
        """Verdict, mutations, and every judged quantity beside what it is compared with."""
        definition, run = self.definition, self.evidence is not None
        values = {"verdict": self.verdict.value, "claim": definition.claim}
        consequence = (("consequence", self.consequence),) if definition.kind == "claim" else ()
        verdict = Finding(code=_CODES.get(self.verdict, "case_departs"), values=values)
        mutations = [
            Finding(
                code="mutation_caught" if each.caught else "mutation_missed",
                values={
                    "what": each.mutation.what,
                    "verdict": each.verdict.value,
                    "expect": each.mutation.expect.value,
                },
            )
            for each in self.mutations
        ]
        heads = ("quantity", "found", "reference and limit", "±", "verdict")
        table = Table(heads=heads, rows=[each.cells() for each in self.quantities] if run else [])
        return Rows(
            title=f"{definition.id}  {kind_text(definition)}  {self.verdict}",
            quantities=tuple(each.row() for each in self.quantities) if run else (),
            findings=(verdict, *mutations),
            facts=consequence if run else (("status", self.status),),
            tables=(table,),
            listed=0,
        )


def kind_text(definition: CaseDefinition) -> str:
    """Kind of a case for readers, with number and paper of a claim: "claim 12, liquid ring"."""
    of_paper = f" {definition.number}, {definition.paper}" if definition.number is not None else ""
    return (definition.kind + of_paper).replace("_", " ")


def definition_document(definition: CaseDefinition) -> Document:
    """Record of a case in the list of all cases."""
    return _part(definition, _LISTED) | {"mutations": [mutation.id for mutation in definition.must_fail]}


def _part(definition: CaseDefinition, names: set[str]) -> Document:
    return {name: value for name, value in plain(definition).items() if name in names}


def _uncertainties(number: Found | None) -> Document:
    """Expanded uncertainties of a number, and the standard ones of V&V 20 by their symbols there."""
    if number is None:
        names = ("error", "value_uncertainty", "value_low", "value_high", "numerical_uncertainty")
        return dict.fromkeys((*names, "input_uncertainty", "corrected", "validation"))
    (low, high), reference = number.reach, number.reference
    error = None if reference is None else number.error
    half_width = COVERAGE_FACTOR * math.hypot(number.numerical, number.input)
    parts = {
        "u_num": number.numerical,
        # An assumed input is equally likely anywhere within its reach.
        "u_input": math.hypot(number.input, from_range(number.reach)),
        "u_D": 0.0 if reference is None else reference.uncertainty,
    }
    return {
        "error": error,
        "value_uncertainty": half_width + max(-low, high),
        "value_low": number.value + low - half_width,
        "value_high": number.value + high + half_width,
        "numerical_uncertainty": COVERAGE_FACTOR * number.numerical,
        # Assumed inputs may lie anywhere within their ranges: their whole reach, not its standard deviation.
        "input_uncertainty": COVERAGE_FACTOR * number.input + max(-low, high),
        "corrected": number.corrected,
        "validation": {"E": error, **parts, "u_val": math.hypot(*parts.values())},
    }


def merge_saved(document: Sequence[Document], saved: Sequence[Mapping[str, Any]]) -> list[Document]:
    """The records, with the `saved` result on the same scene for each heavy case that was not run."""
    earlier_results = {(case["id"], case["scene_sha256"]): dict(case) for case in saved}
    merged = []
    for case in document:
        earlier = earlier_results.get((case["id"], case["scene_sha256"]))
        waiting = case["cost"] == "heavy" and case["verdict"] == Verdict.NOT_RUN.value
        if waiting and earlier is not None and earlier["verdict"] != Verdict.NOT_RUN.value:
            status = f"kept from an earlier run of {earlier.get('date', 'an unknown date')}"
            merged.append(earlier | {"about": case["about"], "status": status})
        else:
            merged.append(case)
    return merged
