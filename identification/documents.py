"""A fit as JSON (SI, intervals of 95 %), and as a person reads it: what was found, how sure it is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ringbalance.identification.against_fit import against_fit
from ringbalance.identification.balancers import MODEL_ERRORS, exact_inputs
from ringbalance.identification.criticism.law_comparison import summaries
from ringbalance.identification.criticism.review import Review
from ringbalance.identification.data.kinds import KINDS
from ringbalance.identification.data.measurements import Observations
from ringbalance.identification.identifiability import Verdict
from ringbalance.identification.next_measurement import NextMeasurement
from ringbalance.identification.result import FileResiduals, FitResult, FittedParameter, Noise
from ringbalance.results.numbers import rounded
from ringbalance.scene.arrays import finite
from ringbalance.scene.describe import in_usual_unit, usual_unit
from ringbalance.scene.units import format_quantity


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
_NARROW: Final = 8
"""Characters of a number and its sign of plus or minus."""
_WORDS: Final = {
    Verdict.IDENTIFIED: ("yes", "green"),
    Verdict.PRACTICALLY: ("hardly", "yellow"),
    Verdict.STRUCTURALLY: ("no", "yellow"),
}
_FAR: Final = 3.0
"""Normalised residual of a row that is named."""


def fit_view(
    result: FitResult, *, data: Sequence[Observations], told: Review, following: NextMeasurement
) -> RenderableType:
    """Parameters, whether the fit holds, and what else the data say, for a rich console."""
    remarks = [*_review(told), *_remarks(result), Text(_sentence(following.text))]
    return Group(_heading(result, data), _parameters(result), *remarks)


def _review(told: Review) -> Iterator[Text]:
    yield Text(_sentence(told.text), "" if told.describes else "bold red")
    for outcome, text in summaries(told.laws):
        yield Text(_sentence(text), "yellow" if outcome == "other" else "")


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _heading(result: FitResult, data: Sequence[Observations]) -> RenderableType:
    rows = sum(len(each) for each in data)
    files = "one file" if len(data) == 1 else f"{len(data)} files"
    name = result.optimum.residuals.problem.scene.name
    return Text(f"{name}, fitted to {rows} measurements of {files}", style="bold")


def _parameters(result: FitResult) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=0, pad_edge=False, header_style="bold")
    for name in ("quantity", "fitted", "from", "to (95 %)", "unit", "before", "identified"):
        left, narrow = name in ("quantity", "unit", "identified"), name == "before"
        # In a narrow terminal this column alone is broken into lines: a name cut short is no use.
        table.add_column(
            name,
            justify="left" if left else "right",
            no_wrap=not narrow,
            min_width=_NARROW if narrow else None,
        )
    for each in result.parameters:
        word, style = _WORDS[each.verdict]
        table.add_row(each.name, *_numbers(each), Text(word, style=style))
    return table


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


def _remarks(result: FitResult) -> Iterator[Text]:
    for each in result.parameters:
        if each.verdict is not Verdict.IDENTIFIED:
            yield Text(f"{each.name}: {each.text}.", style="yellow")
        yield from _bounds(each)
        yield from (Text(f"{each.name}: {doubt}.", style="yellow") for doubt in each.doubts)
    for found in result.combinations:
        yield Text(
            f"The data identify {found.text} within {100 * found.relative_uncertainty:.2g} % (95 %): "
            f"{found.value:.4g}, in SI units."
        )
    yield from (Text(_noise_text(each)) for each in result.noise)
    yield from map(Text, _pairs(result))
    yield from _rows(result)
    yield from (Text(_sentence(each), style="yellow") for each in result.pulled)
    if held := [name for name in result.held if name not in MODEL_ERRORS]:
        yield Text(f"Not fitted, their [uncertainty] is in all intervals: {', '.join(held)}.", "dim")
    if models := _causes(result.held):
        yield Text(f"So is what the models themselves may be off by: {', '.join(models)}.", "dim")
    if exact := exact_inputs(result):
        yield Text(f"Not fitted and without [uncertainty], so taken as exact: {', '.join(exact)}.", "dim")


def _bounds(found: FittedParameter) -> Iterator[Text]:
    """Ends of an interval that the data did not set."""
    for end, bound, word in zip(found.interval, found.at_bound, ("lower", "upper"), strict=True):
        if bound and math.isfinite(end):
            text = f"{found.name}: its interval has no {word} end; it stops where the scene's rules do."
            yield Text(text, style="yellow")


def _noise_text(noise: Noise) -> str:
    kind, name = noise.group.split(" ")
    if not noise.estimated or noise.standard_deviation is None:
        return f"Noise of {name} ({kind}): as the file states it."
    column = KINDS[kind].column(name)
    size = f"{noise.standard_deviation:.3g}"
    if column is not None and column.dimension is not None:
        size = format_quantity(noise.standard_deviation, column.dimension, column.unit, digits=3)
    freedom = f"{noise.freedom:.0f} degrees of freedom"
    return f"Noise of {name} ({kind}), estimated: {size} standard deviation, {freedom}."


def _pairs(result: FitResult) -> Iterator[str]:
    """Parameters whose errors go together."""
    names = [each.name for each in result.parameters]
    for i, first in enumerate(names):
        for j in range(i + 1, len(names)):
            correlation = float(result.correlations[i, j])
            if abs(correlation) >= _STRONG:
                yield f"The errors of {first} and {names[j]} go together: correlation {correlation:+.3f}."


def _rows(result: FitResult) -> Iterator[Text]:
    """Rows that lie far off, and those that a robust loss counts less."""
    for each in result.residuals:
        size = np.max(np.abs(each.normalised), axis=1)
        far = each.lines[size > _FAR]
        if far.size:
            lines = _listed(far.tolist())
            text = f"{each.file}: {lines} more than {_FAR:g} standard deviations from the fit"
            yield Text(f"{text}; look at what was written down there.", style="yellow")
        if np.any(each.down_weighted):
            lines = _listed(each.lines[each.down_weighted].tolist())
            yield Text(f"{each.file}: {lines} counted less than half by the robust loss.", style="yellow")


def _listed(lines: Sequence[int]) -> str:
    shown = ", ".join(map(str, lines[:_MOST_LINES]))
    more = f" and {len(lines) - _MOST_LINES} more" if len(lines) > _MOST_LINES else ""
    return f"line {shown} is" if len(lines) == 1 else f"lines {shown}{more} are"


def _causes(names: Iterable[str]) -> list[str]:
    """Causes of the errors of models among the names of inputs."""
    return list(dict.fromkeys(MODEL_ERRORS[name][0] for name in names if name in MODEL_ERRORS))
