"""A fit as JSON: SI units, intervals of 95 %."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ringbalance.identification.balancers import exact_inputs
from ringbalance.identification.criticism.review import Review
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.next_measurement import NextMeasurement
from ringbalance.identification.result import FileResiduals, FitResult, FittedParameter, Noise


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
            "against": each.against,
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
        "describes": told.criticism.describes,
        "text": told.criticism.text,
        "findings": findings,
        "laws": laws,
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
        "interval": [_finite(end) for end in found.interval],
        "at_bound": list(found.at_bound),
        "before": found.before,
        "before_interval": None if found.before_interval is None else list(found.before_interval),
        "contradicts": found.contradicts,
        "doubts": list(found.doubts),
        "verdict": found.verdict.value,
        "text": found.text,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


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
