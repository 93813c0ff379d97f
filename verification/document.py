"""Results of cases as plain JSON-able records, and heavy results kept from an earlier run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.verification.case import CAUSES, CaseDefinition
from ringbalance.verification.evidence import (
    COVERAGE_FACTOR,
    Convergence,
    Curve,
    Evidence,
    Found,
    Reference,
    Series,
    Table,
)
from ringbalance.verification.result import CaseResult, MutationResult, QuantityResult
from ringbalance.verification.typed_record import plain
from ringbalance.verification.verdicts import Verdict

Document = dict[str, Any]
_LISTED: Final = {"id", "kind", "about", "paper", "number", "title", "claim", "cost"}
_DEPARTS: Final = {Verdict.CORRECTED, Verdict.REFUTED, Verdict.INCONCLUSIVE}
_AS_DEFINED: Final = _LISTED | {
    *("protects", "assumes", "does_not_cover", "equations", "headline", "judged_on", "left_out"),
}
"""What a record has as its case.toml has it."""


def case_document(result: CaseResult) -> Document:
    """One case's result, and all that a report shows of it; SI units, or the unit named beside the number."""
    definition = result.definition
    return {
        **_part(definition, _AS_DEFINED),
        "verdict": result.verdict.value,
        "quantities": [_quantity(quantity) for quantity in result.quantities],
        "explanation": result.filled(definition.explanation),
        "consequence": _consequence(result),
        "reference": {k: v for k, v in vars(definition.reference).items() if k != "doubts"},
        "doubts": [text for doubt in definition.reference.doubts if (text := result.filled(doubt))],
        "cause": CAUSES[definition.cause] if result.verdict in _DEPARTS else "",
        "judgement": result.filled(definition.judgement),
        "rests_on": [vars(one) for one in result.assumptions],
        "level": result.level,
        "status": result.status,
        "scene": result.scene_name,
        "scene_sha256": result.scene_sha256,
        "time_s": result.time_s,
        "mutations": [_mutation(mutation) for mutation in result.mutations],
        "declared_mutations": [
            {k: v for k, v in vars(mutation).items() if k != "scene"} for mutation in definition.must_fail
        ],
        "broken": result.broken,
        **_evidence(result.evidence),
    }


def definition_document(definition: CaseDefinition) -> Document:
    """What a list of cases says of one of them."""
    return _part(definition, _LISTED) | {"mutations": [mutation.id for mutation in definition.must_fail]}


def _part(definition: CaseDefinition, names: set[str]) -> Document:
    return {name: value for name, value in plain(definition).items() if name in names}


def _consequence(result: CaseResult) -> str:
    if result.verdict is Verdict.NOT_RUN:
        return ""
    return result.filled(result.definition.consequence_of(result.verdict))


def _quantity(result: QuantityResult) -> Document:
    quantity, found, reference = result.quantity, result.found, result.reference
    return {
        **vars(quantity),
        "value": None if found is None else found.value,
        "reference": None if reference is None else reference.value,
        "uncertainty": result.half_width,
        "reference_uncertainty": None if reference is None else COVERAGE_FACTOR * reference.uncertainty,
        **_found(found, reference),
        "verdict": result.verdict.value,
    }


def _found(found: Found | None, reference: Reference | None) -> Document:
    """Expanded uncertainties of a found number, and the standard ones of V&V 20 by their symbols there."""
    if found is None:
        names = ("error", "value_uncertainty", "value_low", "value_high", "numerical_uncertainty")
        return dict.fromkeys((*names, "input_uncertainty", "corrected", "validation"))
    low, high = found.reach
    error = None if reference is None else found.value - reference.value
    known = COVERAGE_FACTOR * math.hypot(found.numerical, found.input)
    parts = {
        "u_num": found.numerical,
        "u_input": found.input_standard_uncertainty,
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


def _mutation(mutation: MutationResult) -> Document:
    return {
        "id": mutation.id,
        "must_fail": mutation.what,
        "expect": mutation.expect.value,
        "verdict": mutation.verdict.value,
        "failed": mutation.caught,
        "status": mutation.status,
    }


def _evidence(evidence: Evidence | None) -> Document:
    if evidence is None:
        return {"numbers": {}, "series": [], "convergence": [], "tables": []}
    return {
        "numbers": {name: float(value) for name, value in evidence.numbers.items()},
        "series": [_series(series) for series in evidence.series],
        "convergence": [_convergence(study) for study in evidence.convergence],
        "tables": [_table(table) for table in evidence.tables],
    }


def _series(series: Series) -> Document:
    return {
        "name": series.name,
        "x": {**vars(series.x), "values": _numbers(series.x.values)},
        "y": [_curve(curve) for curve in series.y],
        "log": series.log,
    }


def _curve(curve: Curve) -> Document:
    given = {key: value for key, value in vars(curve).items() if value is not None}
    return {
        key: _numbers(value) if key in ("values", "uncertainty") else value for key, value in given.items()
    }


def _convergence(study: Convergence) -> Document:
    lists = {key: getattr(study, key) for key in ("observed_order", "error", "value")}
    shown = vars(study) | {key: None if v is None else _numbers(v) for key, v in lists.items()}
    return {"h": _numbers(shown.pop("size")), **shown}


def _table(table: Table) -> Document:
    columns = {
        name: [value if isinstance(value, str) else float(value) for value in values]
        for name, values in table.columns.items()
    }
    return {"name": table.name, "columns": columns, "units": dict(table.units)}


def _numbers(values: npt.ArrayLike) -> list[float | None]:
    """A curve may have gaps: a value that is not finite there is none."""
    return [float(v) if np.isfinite(v) else None for v in np.asarray(values, dtype=np.float64).ravel()]


def results_document(results: Iterable[CaseResult]) -> list[Document]:
    """Results of several cases as JSON-able records."""
    return [case_document(result) for result in results]


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
