"""The report of a scene with eccentric masses: what stands in it, and where each number comes from."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from check_traces import traces, untrue

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_scene
from ringbalance.reports import evidence as evidence_module
from ringbalance.reports.evidence import parameters
from ringbalance.reports.page import render
from ringbalance.reports.pages import plain
from ringbalance.reports.pages.eccentric import SECTIONS
from ringbalance.reports.report import write_report
from ringbalance.scene import bundled_scene, load_scene
from scenes import with_tables

Record = dict[str, Any]
UNCERTAIN = ("rotor.stiffness", "imbalance.mass", "masses.friction_arm")
"""Inputs that the pages name."""


@pytest.fixture(scope="module")
def scene() -> EccentricScene:
    small = eccentric_scene(load_scene(bundled_scene("driven_masses_small")))
    first, *_ = small.rotor.speed_profile
    profile = (first, replace(first, time=8.0), replace(first, time=10.0, speed=0.9 * first.speed))
    return with_tables(
        small,
        uncertainty=tuple(each for each in small.uncertainty if each.quantity in UNCERTAIN),
        rotor={"speed_profile": profile},
        run={"time_limit": 11.0},
    )


@pytest.fixture(scope="module")
def folder(scene: EccentricScene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        # The claims of its paper have tests of their own, and so have the intervals of the study.
        patch.setattr(evidence_module, "load_cases", tuple)
        patch.setattr(plain, "_MAX_DEVICES", 2)
        write_report(scene, out, scene_text='name = "small"\n')
    return out


@pytest.fixture(scope="module")
def evidence(folder: Path) -> Record:
    document: Record = json.loads((folder / "evidence.json").read_text())
    return document


def test_report_and_annex_are_written_with_their_figures(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} >= {
        "report.html",
        "annex.html",
        "evidence.json",
        "figures",
    }
    names = {path.stem for path in (folder / "figures").iterdir()}
    assert names >= {
        *("eccentric-amplitude", "eccentric-run-up", "eccentric-imbalance", "eccentric-friction"),
        *("eccentric-angles", "sampled-poles"),
    }


def test_every_traced_number_is_the_evidence_s(folder: Path, evidence: Record) -> None:
    pages = [(folder / name).read_text() for name in ("report.html", "annex.html")]
    assert len(traces(pages)) > 30
    assert untrue(pages, evidence) == []


def test_every_section_is_there_and_says_something(folder: Path) -> None:
    pages = {stem: (folder / f"{stem}.html").read_text() for stem in ("report", "annex")}
    for section in SECTIONS:
        # No claim was judged for this report, and the scene is not the paper's.
        page = pages["annex" if section.of_paper else section.document]
        # This scene was not fitted to measurements.
        assert (f'<section id="{section.name}"' in page) == (section.name != "measured")
    assert "nan" not in re.sub(r"<svg.*?</svg>", "", pages["report"], flags=re.DOTALL).lower().split()


def test_the_first_page_compares_with_the_locked_rotor(folder: Path, evidence: Record) -> None:
    page = (folder / "report.html").read_text()
    status = evidence["closed_loop"]["balanced"]["status"]
    assert status.split(":")[0].capitalize() in page
    assert "with the masses locked where they start" in page
    fraction = evidence["summary"]["own"]["fraction"]
    assert f"{fraction['of']}</span> drawn devices" in page


def test_no_value_is_empty(scene: EccentricScene) -> None:
    assert [row["path"] for row in parameters(scene) if not row["value"]] == []


def test_every_value_has_its_origin(scene: EccentricScene) -> None:
    rows = {(row["group"], row["quantity"]): row for row in parameters(scene)}
    mass = rows["Masses", "guide radius"]
    assert mass["origin"] == scene.origin_of("masses.guide_radius")
    assert mass["value"] == f"{1e3 * scene.masses.guide_radius:.6g}\u202fmm"
    assert "from" in rows["Rotor", "speed profile"]["value"]
    assert all(row["note"] for row in rows.values())
    for arm in rows["Masses", "friction arm"]["value"].split(", "):
        assert arm.endswith("m")


@pytest.mark.usefixtures("unwritten")
def test_unstable_loops_are_named(evidence: Record) -> None:
    changed = json.loads(json.dumps(evidence))
    assert "All lie within: stable." in render(changed)["report.html"]
    changed["tuning"]["loops"][0] |= {"name": "speed control", "poles": [[-1.3, 0.0]], "stable": False}
    assert "unstable: speed control." in render(changed)["report.html"]


@pytest.mark.usefixtures("unwritten")
def test_a_run_that_did_not_come_to_its_estimates_is_shown(evidence: Record) -> None:
    changed = json.loads(json.dumps(evidence))
    run = changed["closed_loop"]["balanced"]
    run.update(residual_ratio=None, innovation=None, warnings=["the rotor stands still"])
    page = render(changed)["report.html"]
    assert "The rotor stands still." in page
    assert "normalised innovations" not in page
