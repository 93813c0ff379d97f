"""A fit as JSON (SI, intervals of 95 %), and as a person reads it: what was found, how sure it is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from ringbalance.identification.against_fit import against_fit
from ringbalance.identification.criticism import Review, summaries
from ringbalance.identification.fitting import FileResiduals, FitResult, FittedParameter, Noise, exact_inputs
from ringbalance.identification.identifiability import Identified
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.kinds.registry import KINDS
from ringbalance.identification.next_measurement import NextMeasurement
from ringbalance.identification.parameters import MODEL_ERRORS
from ringbalance.results.numbers import rounded
from ringbalance.results.result import Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import finite
from ringbalance.scene.describe import in_usual_unit, si_unit, usual_unit


def fit_document(
    result: FitResult, *, data: Sequence[Observations], told: Review, following: NextMeasurement
) -> dict[str, Any]:
    """What `ringbalance fit --json` prints."""
    scene = result.optimum.residuals.problem.scene
    names = [parameter.name for parameter in result.parameters]
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "data": [_file(each) for each in data],
        "parameters": [_parameter(each) for each in result.parameters],
        "combinations": [asdict(each) for each in result.combinations],
        "correlations": {"names": names, "matrix": result.correlations.tolist()},
        "noise": [_noise(each) for each in result.noise],
        "residuals": [_residuals(each) for each in result.residuals],
        "data_over_fit": [
            {
                "kind": each.kind,
                "column": each.column,
                "slope": each.slope,
                "slope_uncertainty": each.slope_uncertainty,
            }
            for each in against_fit(result)
        ],
        "held": dict(result.held),
        "pulls": dict(result.pulls),
        "exact": exact_inputs(result),
        "loss": result.loss,
        "starts": result.starts,
        "evaluations": result.evaluations,
        "log_likelihood": result.log_likelihood,
        "criticism": _criticism(told),
        "next_measurement": _following(following),
        **fit_rows(result, data=data, told=told, following=following).document(),
    }


def _criticism(told: Review) -> dict[str, Any]:
    findings = [
        {
            "test": each.test,
            "residuals_of": each.block,
            "p_value": each.p_value,
            "corrected_p_value": each.corrected,
            "fails": each.fails,
        }
        for each in told.criticism.findings
    ]
    laws = [
        {
            "other_law": each.other,
            "separation": each.separation,
            "preference": each.preference,
            "text": each.text,
        }
        for each in told.laws
    ]
    return {
        "describes": told.describes,
        "text": told.text,
        "findings": findings,
        "laws": laws,
        "explained": [asdict(each) for each in told.explained],
        "readings": [asdict(each) for each in told.readings],
        "ranges": [asdict(each) for each in told.ranges],
    }


def _following(found: NextMeasurement) -> dict[str, Any]:
    return {
        "parameter": found.parameter,
        "text": found.text,
        "candidates": [
            {"measurement": each.candidate, "expected_width_ratio": each.ratio} for each in found.gains
        ],
    }


def _file(data: Observations) -> dict[str, Any]:
    return {
        "file": data.file,
        "kind": data.kind,
        "source": data.source,
        "rows": len(data),
        "sha256": data.sha256,
        "uncertainty_given": sorted(data.uncertainty),
    }


def _parameter(found: FittedParameter) -> dict[str, Any]:
    return {
        "name": found.name,
        "path": found.path,
        "value": found.value,
        "interval": [finite(end) for end in found.interval],
        "at_bound": list(found.at_bound),
        "before": found.before,
        "before_interval": None if found.before_interval is None else list(found.before_interval),
        "contradicts": found.contradicts,
        "doubts": list(found.doubts),
        "verdict": found.verdict.value,
        "text": found.text,
    }


def _noise(found: Noise) -> dict[str, Any]:
    return {
        "group": found.group,
        "standard_deviation": found.standard_deviation,
        "estimated": found.estimated,
        "degrees_of_freedom": found.freedom,
    }


def _residuals(found: FileResiduals) -> dict[str, Any]:
    return {
        "file": found.file,
        "kind": found.kind,
        "lines": found.lines.tolist(),
        "normalised": found.normalised.tolist(),
        "down_weighted": found.down_weighted.tolist(),
    }


_STRONG: Final = 0.9
"""Correlation from which two parameters are named together."""
_MOST_LINES: Final = 10
_WORDS: Final = {
    Identified.IDENTIFIED: "yes",
    Identified.PRACTICALLY: "hardly",
    Identified.STRUCTURALLY: "no",
}
_FAR: Final = 3.0
"""Normalised residual of a row that is named."""


def fit_rows(
    result: FitResult, *, data: Sequence[Observations], told: Review, following: NextMeasurement
) -> Rows:
    """Parameters with their intervals, whether the fit holds, and what else the data say."""
    scene, count = result.optimum.residuals.problem.scene, sum(len(each) for each in data)
    held = [name for name in result.held if name not in MODEL_ERRORS]
    facts = {
        "not fitted, [uncertainty] in all intervals": ", ".join(held),
        "errors of models, in all intervals": ", ".join(_causes(result.held)),
        "not fitted, taken as exact": ", ".join(exact_inputs(result)),
    }
    heads = ("quantity", "fitted", "from", "to", "unit", "before", "identified")
    rows = [(each.name, *_numbers(each), _WORDS[each.verdict]) for each in result.parameters]
    return Rows(
        title=f"{scene.name} ({scene.source}), fitted to {count} measurements",
        quantities=tuple(_quantity(each) for each in result.parameters),
        findings=(
            *_review(told),
            *_findings(result),
            Finding(code="next_measurement", values=_text(following)),
        ),
        facts=[(name, text) for name, text in facts.items() if text],
        tables=(Table(heads=heads, rows=rows, note="from, to: ends of the 95 % interval"),),
        listed=0,
    )


def _text(following: NextMeasurement) -> dict[str, Value]:
    return {"text": following.text}


def _quantity(found: FittedParameter) -> Quantity:
    low, high = (finite(end) for end in found.interval)
    status = "ok" if found.verdict is Identified.IDENTIFIED else found.verdict.value.replace(" ", "_")
    return Quantity(
        key=found.path,
        name=found.name,
        unit=si_unit(found.path),
        value=found.value,
        lower=low,
        upper=high,
        origin="fitted",
        status=status,
    )


def _review(told: Review) -> Iterator[Finding]:
    yield Finding(code="fit_describes" if told.describes else "fit_contradicted", values={"text": told.text})
    for outcome, text in summaries(told.laws):
        code = "other_law_fits_better" if outcome == "other" else "laws_compared"
        yield Finding(code=code, values={"text": text})


def _numbers(found: FittedParameter) -> tuple[str, str, str, str, str]:
    """Value, ends of its interval, unit, and what was known before, in the usual unit."""
    path = found.path
    low, high = (in_usual_unit(path, end) if math.isfinite(end) else end for end in found.interval)
    value, before = (in_usual_unit(path, number) for number in (found.value, found.before))
    width = (high - low) / 2 if math.isfinite(high - low) else abs(value)
    ends = [rounded(end, width) if math.isfinite(end) else "?" for end in (low, high)]
    known = f"{before:.4g}"
    if found.before_interval is not None:
        far = in_usual_unit(path, found.before_interval[1])
        known = f"{before:.4g} ± {far - before:.2g}"
    return rounded(value, width), ends[0], ends[1], usual_unit(path), known


def _findings(result: FitResult) -> Iterator[Finding]:
    for each in result.parameters:
        yield from _of_parameter(each)
    for found in result.combinations:
        numbers: dict[str, Value] = {"combination": found.text, "value": found.value}
        yield Finding(
            code="combination_identified", values=numbers | {"uncertainty": found.relative_uncertainty}
        )
    yield from (_noise_finding(each) for each in result.noise)
    yield from _pairs(result)
    yield from _far_rows(result)
    yield from (Finding(code="pulled", values={"text": each}) for each in result.pulled)


def _of_parameter(found: FittedParameter) -> Iterator[Finding]:
    name: dict[str, Value] = {"name": found.name}
    if found.verdict is not Identified.IDENTIFIED:
        yield Finding(code="not_identified", values=name | {"text": found.text})
    for end, bound, side in zip(found.interval, found.at_bound, ("lower", "upper"), strict=True):
        # The data did not set this end.
        if bound and math.isfinite(end):
            yield Finding(code="interval_open", values=name | {"side": side})
    yield from (Finding(code="parameter_doubted", values=name | {"text": each}) for each in found.doubts)


def _noise_finding(noise: Noise) -> Finding:
    kind, name = noise.group.split(" ")
    numbers: dict[str, Value] = {"kind": kind, "name": name}
    if not noise.estimated or noise.standard_deviation is None:
        return Finding(code="noise_stated", values=numbers)
    column = KINDS[kind].column(name)
    assert column is not None
    size = column.written(noise.standard_deviation)
    more: dict[str, Value] = {"size": size, "standard_deviation": noise.standard_deviation}
    return Finding(code="noise_estimated", values=numbers | more | {"freedom": round(noise.freedom or 0)})


def _pairs(result: FitResult) -> Iterator[Finding]:
    """Parameters whose errors go together."""
    names = [each.name for each in result.parameters]
    for i, first in enumerate(names):
        for j in range(i + 1, len(names)):
            correlation = float(result.correlations[i, j])
            if abs(correlation) >= _STRONG:
                numbers: dict[str, Value] = {"first": first, "second": names[j], "correlation": correlation}
                yield Finding(code="errors_correlated", values=numbers)


def _far_rows(result: FitResult) -> Iterator[Finding]:
    """Rows that lie far off, and those that a robust loss counts less."""
    for each in result.residuals:
        far = each.lines[np.max(np.abs(each.normalised), axis=1) > _FAR]
        if far.size:
            numbers: dict[str, Value] = {
                "file": each.file,
                "lines": _listed(far.tolist()),
                "deviations": _FAR,
            }
            yield Finding(code="rows_far_off", values=numbers)
        if np.any(each.down_weighted):
            lines = _listed(each.lines[each.down_weighted].tolist())
            yield Finding(code="rows_down_weighted", values={"file": each.file, "lines": lines})


def _listed(lines: Sequence[int]) -> str:
    shown = ", ".join(map(str, lines[:_MOST_LINES]))
    return shown + (f" and {len(lines) - _MOST_LINES} more" if len(lines) > _MOST_LINES else "")


def _causes(names: Iterable[str]) -> list[str]:
    """Causes of the errors of models among the names of inputs."""
    return list(dict.fromkeys(MODEL_ERRORS[name][0] for name in names if name in MODEL_ERRORS))
