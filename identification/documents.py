"""A fit as JSON (SI, intervals of 95 %), and as a person reads it: what was found, how sure it is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from ringbalance.identification.criticism import Review, summaries
from ringbalance.identification.fitting import FitResult, FittedParameter, Noise, exact_inputs
from ringbalance.identification.identifiability import Identified
from ringbalance.identification.intervals import covariance
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.likelihood import Block
from ringbalance.identification.next_measurement import NextMeasurement
from ringbalance.identification.optimisation import Optimum
from ringbalance.identification.reading import KINDS
from ringbalance.results.numbers import rounded
from ringbalance.results.result import Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import FloatArray, IntArray, finite
from ringbalance.scene.describe import in_usual_unit, si_unit, usual_unit
from ringbalance.scene.errors import MODEL_ERRORS
from ringbalance.scene.uncertain import NORMAL_95


def fit_document(
    result: FitResult, *, data: Sequence[Observations], told: Review, following: NextMeasurement
) -> dict[str, Any]:
    """What `ringbalance fit --json` prints."""
    scene = result.optimum.residuals.problem.scene
    return {
        "scene": _chosen(scene, "name source sha256"),
        "data": [
            _chosen(each, "file kind source sha256")
            | {"rows": len(each), "uncertainty_given": sorted(each.uncertainty)}
            for each in data
        ],
        "parameters": [_parameter(each) for each in result.parameters],
        "combinations": [asdict(each) for each in result.combinations],
        "correlations": {
            "names": [parameter.name for parameter in result.parameters],
            "matrix": result.correlations.tolist(),
        },
        "noise": [asdict(each) for each in result.noise],
        "residuals": [
            _chosen(each, "file kind")
            | {name: getattr(each, name).tolist() for name in ("lines", "normalised", "down_weighted")}
            for each in result.residuals
        ],
        "data_over_fit": [
            _chosen(each, "kind column slope slope_uncertainty") for each in against_fit(result)
        ],
        "exact": exact_inputs(result),
        **_chosen(result, "loss starts evaluations log_likelihood"),
        **{name: dict(getattr(result, name)) for name in ("held", "pulls")},
        "criticism": _criticism(told),
        "next_measurement": _chosen(following, "parameter text")
        | {
            "candidates": [
                {"measurement": each.candidate, "expected_width_ratio": each.ratio}
                for each in following.gains
            ]
        },
        **fit_rows(result, data=data, told=told, following=following).document(),
    }


def _chosen(record: Any, names: str) -> dict[str, Any]:
    """Fields and properties of a record that stand in the document under their own names."""
    return {name: getattr(record, name) for name in names.split()}


def _criticism(told: Review) -> dict[str, Any]:
    return {
        **_chosen(told, "describes text"),
        "findings": [
            _chosen(each, "test p_value fails")
            | {"residuals_of": each.block, "corrected_p_value": each.corrected}
            for each in told.criticism.findings
        ],
        "laws": [
            {"other_law": each.other} | _chosen(each, "separation preference text") for each in told.laws
        ],
        **{
            name: [asdict(each) for each in getattr(told, name)]
            for name in ("explained", "readings", "ranges")
        },
    }


def _parameter(found: FittedParameter) -> dict[str, Any]:
    return {
        **_chosen(
            found, "name path value at_bound before before_interval before_source contradicts doubts text"
        ),
        "interval": [finite(end) for end in found.interval],
        "verdict": found.verdict.value,
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
            Finding(code="next_measurement", values={"text": following.text}),
        ),
        facts=[(name, text) for name, text in facts.items() if text],
        tables=(Table(heads=heads, rows=rows, note="from, to: ends of the 95 % interval"),),
        listed=0,
    )


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
    yield from (Finding(code="sense_undecided", values={"text": text}) for text in told.undecided)


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
    yield from result.pulled


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
    return Finding(
        code="noise_estimated", values=numbers | more | {"freedom": round(noise.degrees_of_freedom or 0)}
    )


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
    return list(dict.fromkeys(MODEL_ERRORS[name] for name in names if name in MODEL_ERRORS))


@dataclass(frozen=True, kw_only=True, eq=False)
class AgainstFit:
    """Numbers of one column of one kind of data, SI; of a vibration its real and imaginary parts."""

    kind: str
    column: str
    dimension: str | None
    unit: str
    """Of the file's column."""
    component: IntArray
    """Of every number: 0, or 1 of the imaginary part of a vibration."""
    measured: FloatArray
    """Less what is no quantity of the device, such as the vibration without trial weight."""
    measured_uncertainty: FloatArray
    """Expanded (95 %), by the noise that is stated or estimated."""
    fitted: FloatArray
    fitted_uncertainty: FloatArray
    """Expanded (95 %), of all that was fitted together."""

    @property
    def slope(self) -> float | None:
        """Measured over fitted values, a line through zero weighted by noise; None for fitted zeros."""
        square = self._square
        return float(np.sum(self._weights * self.measured * self.fitted) / square) if square else None

    @property
    def slope_uncertainty(self) -> float | None:
        """Of the slope by the noise, expanded (95 %)."""
        return float(NORMAL_95 / np.sqrt(self._square)) if self._square else None

    @property
    def _square(self) -> float:
        return float(np.sum(self._weights * self.fitted**2))

    @property
    def _weights(self) -> FloatArray:
        return np.asarray((NORMAL_95 / self.measured_uncertainty) ** 2)


def against_fit(result: FitResult) -> list[AgainstFit]:
    """One entry for each kind and column that was fitted, in the order of the data."""
    best = result.optimum
    numbers = _beside(best)
    parts: dict[str, list[tuple[Block, FloatArray]]] = {}
    for block, rows in best.residuals.problem.rows:
        parts.setdefault(block.group, []).append((block, numbers[:, rows]))
    return [_entry(each) for each in parts.values()]


def _entry(parts: Sequence[tuple[Block, FloatArray]]) -> AgainstFit:
    first = parts[0][0]
    kind, name = first.observations.kind, first.column
    column = first.kind.column(name)
    joined = np.concatenate([numbers for _, numbers in parts], axis=1)
    return AgainstFit(
        kind=kind,
        column=name,
        dimension=None if column is None else column.dimension,
        unit="" if column is None else column.unit,
        component=np.concatenate([_component(block) for block, _ in parts]),
        measured=joined[0],
        measured_uncertainty=joined[1],
        fitted=joined[2],
        fitted_uncertainty=joined[3],
    )


def _component(block: Block) -> IntArray:
    rows = len(block.observations)
    return np.arange(block.measured.size) // rows


def _beside(best: Optimum) -> FloatArray:
    """Measured, its uncertainty, fitted, its uncertainty, of all numbers, shape (4, n)."""
    residuals = best.residuals
    problem, scale = residuals.problem, residuals.scale
    free = problem.free
    effects, _ = best.of_all
    spread = covariance(np.concatenate(best.of_all))
    b, n = residuals.linear_values(best.t)
    fitted = problem.at(best.t) + residuals.held @ (n - residuals.pulled)
    kept = np.r_[: best.t.size, best.t.size + free.shape[1] : effects.shape[1]]
    of_device, spread = effects[:, kept], spread[np.ix_(kept, kept)]
    found = []
    for block, mine in problem.rows:
        lower = np.linalg.inv(block.whiten)
        rows = lower @ (of_device[mine] / scale[mine][:, None])
        noise = lower / scale[mine][None, :]
        found.append(
            [
                lower @ (problem.measured[mine] - free[mine] @ b),
                NORMAL_95 * np.sqrt(np.sum(noise**2, axis=1)),
                lower @ fitted[mine],
                NORMAL_95 * np.sqrt(np.einsum("ij,jk,ik->i", rows, spread, rows)),
            ]
        )
    return np.concatenate([np.array(each) for each in found], axis=1)
