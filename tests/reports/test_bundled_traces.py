"""Of every bundled scene, the report prints nothing but what its evidence holds, and each value's origin."""

from __future__ import annotations

import json
import random
from pathlib import Path

import pytest
from check_traces import agrees, apart, traces, untrue

from ringbalance.reports.report import write_report
from ringbalance.reports.traces import evidence_at
from ringbalance.scene import load_scene

SCENES = sorted((Path(__file__).resolve().parents[2] / "scenes").glob("*.toml"))
ORIGINS = {"given", "inferred", "assumed", "measured", "default"}


@pytest.mark.heavy
@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_a_hundred_values_lead_to_the_evidence(file: Path, tmp_path: Path) -> None:
    write_report(load_scene(file), tmp_path, scene_text=file.read_text(encoding="utf-8"), workers=2)
    pages = [(tmp_path / name).read_text(encoding="utf-8") for name in ("report.html", "annex.html")]
    evidence = json.loads((tmp_path / "evidence.json").read_bytes())
    found = traces(pages)
    assert len(found) > 30
    assert untrue(pages, evidence) == []
    assert apart(evidence) == []
    for path, text in random.Random(15).choices(found, k=100):
        assert agrees(text, evidence_at(evidence, path)), (path, text)
    assert {row["origin"] for row in evidence["scene"]["table"]} <= ORIGINS
