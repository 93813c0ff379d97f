"""Fit as JSON document (SI, intervals of 95 %) and as printed rows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any, Final

import numpy as np

from ringbalance.identification.criticism import Review
from ringbalance.identification.fitting import FitResult, FittedParameter
from ringbalance.identification.identifiability import Identified
from ringbalance.identification.intervals import covariance
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.next_measurement import NextMeasurement
from ringbalance.identification.reading import KINDS
from ringbalance.results.numbers import rounded
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import FloatArray, IntArray, finite
from ringbalance.scene.describe import in_usual_unit, si_unit, usual_unit
from ringbalance.scene.errors import MODEL_ERRORS
from ringbalance.scene.uncertain import NORMAL_95

_STRONG: Final = 0.9
"""Correlation beyond which two parameters are reported as correlated."""
_MOST_LINES: Final = 10
_WORDS: Final = {
    Identified.IDENTIFIED: "yes",
    Identified.PRACTICALLY: "hardly",
    Identified.STRUCTURALLY: "no",
}
_NOTABLE_RESIDUAL: Final = 3.0
"""Normalised residual beyond which a row is reported."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Fit(Result):
    """A fit with the tests of its residuals and the measurement that would help most.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> data = rb.bundled_scene("liquid_ring_paper").parent / "measurements" / "trial_weight.csv"
        >>> print(rb.fit(scene, data))
        Pan's liquid-ring disc (liquid_ring_paper.toml), fitted to 7 measurements
          influence_coefficient (0.011226 ± 0.000060) um/(g mm)
          lag_angle (19.25 ± 0.31)°
          nothing in the residuals speaks against the fit (4 tests, 5 % level)
    """

    result: FitResult
    data: tuple[Observations, ...]
    review: Review
    next_measurement: NextMeasurement

    @property
    def parameters(self) -> tuple[FittedParameter, ...]:
        """Parameters with value and interval (95 %), SI, and whether the data identify them."""
        return self.result.parameters

    @property
    def succeeded(self) -> bool:
        """True if the fit describes the data."""
        return self.review.describes

    def to_dict(self) -> dict[str, Any]:
        """Document that `ringbalance fit --json` prints."""
        result, scene = self.result, self.result.optimum.residuals.problem.scene
        return {
            "scene": _chosen(scene, "name source sha256"),
            "data": [
                _chosen(each, "file kind source sha256")
                | {"rows": len(each), "uncertainty_given": sorted(each.uncertainty)}
                for each in self.data
            ],
            "parameters": [
                _chosen(
                    each,
                    "name path value at_bound before before_interval before_source contradicts doubts text",
                )
                | {"interval": [finite(end) for end in each.interval], "verdict": each.verdict.value}
                for each in result.parameters
            ],
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
            **_chosen(result, "exact loss starts evaluations log_likelihood"),
            **{name: dict(getattr(result, name)) for name in ("held", "pulls")},
            "criticism": {
                **_chosen(self.review, "describes text"),
                "findings": [
                    _chosen(each, "test p_value fails")
                    | {"residuals_of": each.block, "corrected_p_value": each.corrected}
                    for each in self.review.criticism.findings
                ],
                **{
                    name: [asdict(each) for each in getattr(self.review, name)]
                    for name in ("explained", "readings", "ranges")
                },
            },
            "next_measurement": _chosen(self.next_measurement, "parameter text")
            | {
                "candidates": [
                    {"measurement": each.candidate, "expected_width_ratio": each.ratio}
                    for each in self.next_measurement.gains
                ]
            },
            **self.rows().document(),
        }

    def rows(self) -> Rows:
        """Parameters with their intervals, the verdict on the fit, and further findings."""
        result, scene = self.result, self.result.optimum.residuals.problem.scene
        count = sum(len(each) for each in self.data)
        held = [name for name in result.held if name not in MODEL_ERRORS]
        causes = dict.fromkeys(MODEL_ERRORS[name] for name in result.held if name in MODEL_ERRORS)
        facts = {
            "not fitted, [uncertainty] in all intervals": ", ".join(held),
            "errors of models, in all intervals": ", ".join(causes),
            "not fitted, taken as exact": ", ".join(result.exact),
        }
        heads = ("quantity", "fitted", "from", "to", "unit", "before", "identified")
        rows = []
        for each in result.parameters:
            path, upper = each.path, None if each.before_interval is None else each.before_interval[1]
            low, high = (in_usual_unit(path, end) if math.isfinite(end) else end for end in each.interval)
            value, before = (in_usual_unit(path, number) for number in (each.value, each.before))
            width = (high - low) / 2 if math.isfinite(high - low) else abs(value)
            ends = [rounded(end, width) if math.isfinite(end) else "?" for end in (low, high)]
            range_before = f"{before:.4g}"
            if upper is not None:
                range_before += f" ± {in_usual_unit(path, upper) - before:.2g}"
            cells = each.name, rounded(value, width), *ends, usual_unit(path), range_before
            rows.append((*cells, _WORDS[each.verdict]))
        quantities = [
            Quantity(
                key=each.path,
                name=each.name,
                unit=si_unit(each.path),
                value=each.value,
                lower=finite(each.interval[0]),
                upper=finite(each.interval[1]),
                origin="fitted",
                status="ok"
                if each.verdict is Identified.IDENTIFIED
                else each.verdict.value.replace(" ", "_"),
            )
            for each in result.parameters
        ]
        return Rows(
            title=f"{scene.name} ({scene.source}), fitted to {count} measurements",
            quantities=tuple(quantities),
            findings=(
                *_findings(result, self.review),
                *result.pulled,
                Finding(code="next_measurement", values={"text": self.next_measurement.text}),
            ),
            facts=[(name, text) for name, text in facts.items() if text],
            tables=(Table(heads=heads, rows=rows, note="from, to: ends of the 95 % interval"),),
            listed=0,
        )


def _chosen(record: Any, names: str) -> dict[str, Any]:
    """Fields and properties of a record that enter the document under the same names."""
    return {name: getattr(record, name) for name in names.split()}


def _findings(result: FitResult, review: Review) -> Iterator[Finding]:
    """Verdict, parameters and their products, noise, correlated errors, and rows with large residuals."""
    code = "fit_describes" if review.describes else "fit_contradicted"
    yield Finding(code=code, values={"text": review.text})
    yield from (Finding(code="sense_undecided", values={"text": text}) for text in review.undecided)
    for each in result.parameters:
        name: dict[str, Value] = {"name": each.name}
        if each.verdict is not Identified.IDENTIFIED:
            yield Finding(code="not_identified", values=name | {"text": each.text})
        for end, bound, side in zip(each.interval, each.at_bound, ("lower", "upper"), strict=True):
            # This end is a bound of the scene, not of the data.
            if bound and math.isfinite(end):
                yield Finding(code="interval_open", values=name | {"side": side})
        yield from (Finding(code="parameter_doubted", values=name | {"text": text}) for text in each.doubts)
    for product in result.combinations:
        values: dict[str, Value] = {"combination": product.text, "value": product.value}
        values["uncertainty"] = product.relative_uncertainty
        yield Finding(code="combination_identified", values=values)
    for noise in result.noise:
        kind, column_name = noise.group.split(" ")
        values = {"kind": kind, "name": column_name}
        if noise.standard_deviation is None:
            yield Finding(code="noise_stated", values=values)
            continue
        column, size = KINDS[kind].column(column_name), noise.standard_deviation
        assert column is not None
        values |= {"size": column.written(size), "standard_deviation": size}
        values["freedom"] = round(noise.degrees_of_freedom or 0)
        yield Finding(code="noise_estimated", values=values)
    for (i, first), (j, second) in combinations(enumerate(result.parameters), 2):
        correlation = float(result.correlations[i, j])
        if abs(correlation) >= _STRONG:
            values = {"first": first.name, "second": second.name, "correlation": correlation}
            yield Finding(code="errors_correlated", values=values)
    for file in result.residuals:
        far = file.lines[np.max(np.abs(file.normalised), axis=1) > _NOTABLE_RESIDUAL]
        if far.size:
            values = {"file": file.file, "lines": _listed(far.tolist()), "deviations": _NOTABLE_RESIDUAL}
            yield Finding(code="rows_far_off", values=values)
        if np.any(file.down_weighted):
            lines = _listed(file.lines[file.down_weighted].tolist())
            yield Finding(code="rows_down_weighted", values={"file": file.file, "lines": lines})


def _listed(lines: Sequence[int]) -> str:
    shown = ", ".join(map(str, lines[:_MOST_LINES]))
    return shown + (f" and {len(lines) - _MOST_LINES} more" if len(lines) > _MOST_LINES else "")


@dataclass(frozen=True, kw_only=True, eq=False)
class AgainstFit:
    """Measured and fitted numbers of one column of one kind of data, SI; vibrations as two components."""

    kind: str
    column: str
    dimension: str | None
    unit: str
    """Unit of the file's column."""
    component: IntArray
    """Component of every number: 0, or 1 for the imaginary part of a vibration."""
    measured: FloatArray
    """Measured numbers less the other fitted unknowns, such as the vibration without trial weight."""
    measured_uncertainty: FloatArray
    """Expanded uncertainty (95 %) by stated or estimated noise."""
    fitted: FloatArray
    fitted_uncertainty: FloatArray
    """Expanded uncertainty (95 %) of the prediction by all fitted unknowns together."""
    slope: float | None
    """Slope of measured over fitted values, weighted line through zero; None if all fitted are zero."""
    slope_uncertainty: float | None
    """Expanded uncertainty (95 %) of the slope by the noise."""


def against_fit(result: FitResult) -> list[AgainstFit]:
    """One entry for each kind and column that was fitted, in the order of the data."""
    best = result.optimum
    problem, residuals, scale = best.residuals.problem, best.residuals, best.residuals.scale
    (effects, _), free = best.of_all, problem.free
    spread = covariance(np.concatenate(best.of_all))
    b, n = residuals.linear_values(best.t)
    predicted = problem.at(best.t) + residuals.held @ (n - residuals.pulled)
    of_unknowns = np.r_[: best.t.size, best.t.size + free.shape[1] : effects.shape[1]]
    of_device, spread = effects[:, of_unknowns], spread[np.ix_(of_unknowns, of_unknowns)]
    # By group: component, measured, its uncertainty, fitted, its uncertainty.
    numbers: dict[str, list[FloatArray]] = {}
    first = {block.group: block for block in reversed(problem.blocks)}
    for block, mine in problem.rows:
        lower = np.linalg.inv(block.whiten)
        rows = lower @ (of_device[mine] / scale[mine][:, None])
        noise = lower / scale[mine][None, :]
        columns = [
            np.arange(block.measured.size) // len(block.observations),
            lower @ (problem.measured[mine] - free[mine] @ b),
            NORMAL_95 * np.sqrt(np.sum(noise**2, axis=1)),
            lower @ predicted[mine],
            NORMAL_95 * np.sqrt(np.einsum("ij,jk,ik->i", rows, spread, rows)),
        ]
        numbers.setdefault(block.group, []).append(np.array(columns))
    entries = []
    for group, parts in numbers.items():
        block, joined = first[group], np.concatenate(parts, axis=1)
        column = block.kind.column(block.column)
        _, measured, noise, fitted, _ = joined
        weights = np.asarray((NORMAL_95 / noise) ** 2)
        square = float(np.sum(weights * fitted**2))
        entries.append(
            AgainstFit(
                kind=block.observations.kind,
                column=block.column,
                dimension=None if column is None else column.dimension,
                unit="" if column is None else column.unit,
                component=joined[0].astype(np.int64),
                measured=joined[1],
                measured_uncertainty=joined[2],
                fitted=joined[3],
                fitted_uncertainty=joined[4],
                slope=float(np.sum(weights * measured * fitted) / square) if square else None,
                slope_uncertainty=float(NORMAL_95 / np.sqrt(square)) if square else None,
            )
        )
    return entries
