"""The section on measurements: there for a fitted scene alone, with data, intervals and profiles."""

from __future__ import annotations

import re
from dataclasses import asdict, replace
from typing import Any

import pytest

from ringbalance.reports.evidence import _scene_record
from ringbalance.reports.page import render
from ringbalance.reports.pages.measured import SECTION
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import Measured, MeasuredFile, MeasuredFinding, _MeasuredQuantity

MEASURED = Measured(
    files=(MeasuredFile(file="run_7.csv", kind="trial_weight", rows=31, sha256="ab" * 32),),
    quantities=(
        _MeasuredQuantity(
            quantity="tube.bore",
            unit="mm",
            before=1.5,
            before_low=1.45,
            before_high=1.55,
            value=1.47,
            low=1.46,
            high=1.48,
            verdict="identified",
            profile=(1.46, 1.47, 1.48),
            rise=(1.0, 0.0, 1.02),
        ),
        _MeasuredQuantity(
            quantity="disc.lambda_factor",
            unit="1",
            before=1.0,
            value=0.98,
            verdict="structurally not identified",
        ),
    ),
    findings=(MeasuredFinding(about="combination", text="the data identify lambda^2/(k + 1) within 3 %"),),
)


@pytest.fixture
def fitted(evidence: dict[str, Any]) -> dict[str, Any]:
    return {**evidence, "scene": {**evidence["scene"], "measured": asdict(MEASURED)}}


@pytest.mark.usefixtures("unwritten")
def test_report_and_annex_of_a_fitted_scene_name_its_measurements(fitted: dict[str, Any]) -> None:
    pages = render(fitted)
    assert "fitted to 31 measurements of this device" in pages["report.html"]
    assert "no measurement of this device is compared" not in pages["report.html"]
    section = pages["annex.html"].split('id="measured"')[1].split("<section")[0]
    text = " ".join(re.sub(r"<[^>]+>", " ", section).split())
    assert "fitted to 31 measurements" in text
    assert "identify 1 of 2 fitted quantities" in text
    assert "run_7.csv" in text
    assert "abababababab" in text
    assert "1.450 to 1.550" in text
    assert "1.460 to 1.480" in text
    assert "The data identify" in text


@pytest.mark.usefixtures("unwritten")
def test_findings_name_quantities_as_tables_do(fitted: dict[str, Any]) -> None:
    finding = {"about": "correlation", "text": "the errors of disc.lambda_factor (correlation -0.50)"}
    fitted["scene"]["measured"]["findings"] = [finding]
    assert "measured factor on λ (correlation −0.50)" in render(fitted)["annex.html"]


@pytest.mark.usefixtures("unwritten")
def test_without_measurements_there_is_no_section(evidence: dict[str, Any]) -> None:
    assert SECTION.view(evidence) is None
    assert 'id="measured"' not in render(evidence)["annex.html"]


def test_the_evidence_has_what_the_scene_says(paper_scene: Scene) -> None:
    assert _scene_record(paper_scene, "")["measured"] is None
    scene = replace(paper_scene, measured=MEASURED)
    assert _scene_record(scene, "")["measured"]["files"][0]["rows"] == 31
