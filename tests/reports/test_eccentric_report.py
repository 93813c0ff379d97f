"""The report of a scene with eccentric masses: what stands in it, and where each number comes from."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from check_traces import traces, untrue

from ringbalance.controller.eccentric_mass import requirements
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_scene
from ringbalance.reports import evidence as evidence_module
from ringbalance.reports.evidence import parameters
from ringbalance.reports.page import render
from ringbalance.reports.pages.eccentric import SECTIONS
from ringbalance.reports.report import write_report
from ringbalance.scene import bundled_scene, load_scene

Record = dict[str, Any]
UNCERTAIN = ("rotor.stiffness", "imbalance.mass", "masses.friction_arm")
"""Inputs that the pages name: each is run at both ends of its interval."""


@pytest.fixture(scope="module")
def scene() -> EccentricScene:
    told = eccentric_scene(load_scene(bundled_scene("driven_masses_small")))
    first, *_ = told.rotor.speed_profile
    profile = (first, replace(first, time=8.0), replace(first, time=10.0, speed=0.9 * first.speed))
    return replace(
        told,
        uncertainty=tuple(each for each in told.uncertainty if each.quantity in UNCERTAIN),
        rotor=replace(told.rotor, speed_profile=profile),
        run=replace(told.run, time_limit=11.0),
    )


@pytest.fixture(scope="module")
def folder(scene: EccentricScene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        # The claims of its paper have tests of their own, and so have the intervals of the study.
        patch.setattr(evidence_module, "load_cases", tuple)
        patch.setattr(requirements, "DRAWS", 5)
        write_report(scene, out, scene_text='name = "small"\n')
    return out


@pytest.fixture(scope="module")
def evidence(folder: Path) -> Record:
    found: Record = json.loads((folder / "evidence.json").read_text())
    return found


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
        *("eccentric-angles", "sampled-poles", "requirements"),
    }


def test_every_traced_number_is_the_evidence_s(folder: Path, evidence: Record) -> None:
    pages = [(folder / name).read_text() for name in ("report.html", "annex.html")]
    assert len(traces(pages)) > 30
    assert untrue(pages, evidence) == []


def test_every_section_is_there_and_says_something(folder: Path) -> None:
    pages = {place: (folder / f"{place}.html").read_text() for place in ("report", "annex")}
    for section in SECTIONS:
        # No claim was judged for this report, and the scene is not the paper's.
        page = pages["annex" if section.of_paper else section.place]
        # This scene was not fitted to measurements.
        assert (f'<section id="{section.name}"' in page) == (section.name != "measured")
    assert "nan" not in re.sub(r"<svg.*?</svg>", "", pages["report"], flags=re.DOTALL).lower().split()


def test_the_first_page_compares_with_the_locked_rotor(folder: Path, evidence: Record) -> None:
    page = (folder / "report.html").read_text()
    status = evidence["closed_loop"]["balanced"]["status"]
    assert status.split(":")[0].capitalize() in page
    assert "with the masses locked where they start" in page
    for row in evidence["requirements"]:
        assert row["quantity"] in page


@pytest.mark.usefixtures("unwritten")
def test_an_unmet_requirement_is_not_called_met(evidence: Record) -> None:
    changed = json.loads(json.dumps(evidence))
    missed = {**changed["requirements"][0], "quantity": "patience", "achieved": None, "verdict": "not met"}
    changed["requirements"] = [{**missed, "achieved_interval": None, "required_interval": None}]
    page = render(changed)["report.html"]
    assert re.search(r"Patience</th>.*?not reached.*?not met", page)
    assert "0 of 1 requirements are met; not met: patience." in page


@pytest.mark.usefixtures("unwritten")
def test_a_result_that_not_all_drawn_runs_come_to_reads_as_one_sentence(evidence: Record) -> None:
    changed = json.loads(json.dumps(evidence))
    row = {**changed["requirements"][0], "quantity": "settling time", "unit": "s", "achieved": 2.32}
    row.update(verdict="undecided", reached=0.38, lost=["masses.friction_arm"], achieved_interval=None)
    changed["requirements"] = [row, {**row, "quantity": "patience", "reached": 1.0}]
    page = re.sub(r"<[^>]*>", "", render(changed)["report.html"])
    assert "2.32\u202fs with the scene’s values" in page
    assert "none: of the runs with drawn inputs 38\u202f% get there, the others never do" in page
    assert "none: with an input at the end of its own interval the run never gets there" in page
    assert "Of the runs with inputs drawn from their uncertainty 38\u202f% settle." in page


@pytest.mark.usefixtures("unwritten")
def test_what_a_requirement_depends_on_is_named_with_what_to_do(evidence: Record) -> None:
    changed = json.loads(json.dumps(evidence))
    row = changed["requirements"][1]
    row["effects"] = {
        "rotor.mass": [1e-9, 0.0],
        "rotor.damping": [5e-7, 0.0],
        "motor.resistance": [1e-12, 0.0],
    }
    row.update(verdict="undecided", lost=[], achieved_interval=[0.0, 6e-7])
    changed["requirements"] = [row]
    page = re.sub(r"<[^>]*>", "", render(changed)["report.html"])
    assert "up to 0.600\u202fµm" in page
    assert "Measure damping of the rotor: this decides" in page
    assert "limit of the supervisor" in page
    assert ">supervisor.limit<" not in page


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
