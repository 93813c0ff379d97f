"""The report of a scene with eccentric masses: what stands in it, and where each number comes from."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from check_traces import traces, untrue

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_scene
from ringbalance.reports import evidence as evidence_module
from ringbalance.reports.evidence import _BAND_DEVICES, _run_up_record, parameters
from ringbalance.reports.page import render
from ringbalance.reports.pages import plain
from ringbalance.reports.pages.eccentric import SECTIONS
from ringbalance.reports.report import write_report
from ringbalance.results.numbers import shown
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
        patch.setattr(evidence_module, "_BAND_DEVICES", 2)
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
        *("eccentric-amplitude", "eccentric-run-up", "eccentric-lag", "eccentric-angles"),
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


def test_the_band_is_of_the_verdict_s_devices(evidence: Record) -> None:
    drawn, judged = evidence["drawn"], evidence["summary"]["own"]["fraction"]
    assert (drawn["runs"], drawn["settled"]) == (judged["of"], judged["count"])
    assert _BAND_DEVICES == plain._MAX_DEVICES == 64


def test_energy_run_up_and_what_decides_are_on_the_first_page(folder: Path, evidence: Record) -> None:
    page = re.sub(r"<[^>]+>", "", (folder / "report.html").read_text())
    run = evidence["closed_loop"]["balanced"]
    assert f"the drives take {shown(run['energy_J'], 'J', digits=2)} in this run" in page
    energy = evidence["summary"]["own"]["energy_J"]
    assert 0 < energy["p50"] <= energy["p90"]
    assert f"up to {shown(energy['p90'], 'J', digits=2)} in nine tenths" in page
    assert "Run-up: with the masses locked the limit of" in page
    assert "What the verdict assumes" in page


def test_the_run_up_s_numbers_follow_from_the_whirl(scene: EccentricScene) -> None:
    """At the speed found the locked rotor is at its limit; what is left grows by |alpha| of the speeds."""
    limit = 1.5 * scene.supervisor.limit
    record = _run_up_record(with_tables(scene, supervisor={"limit": limit}))
    assert record is not None
    plant, angles = PlantParameters.of(scene), scene.masses.initial_angle
    speeds = scene.rotor.profile[1]
    assert record["start_rad_s"] == speeds[0]
    if (speed := record["locked_limit_speed_rad_s"]) is not None:
        below, above = (abs(plant.steady_whirl(part * speed, angles)) for part in (1.0, 1.01))
        assert below <= limit < above
    grown = max(abs(plant.influence(speed)) for speed in np.linspace(speeds[0], speeds[-1], 5000))
    left = record["limit_at_start_m"] * grown / abs(plant.influence(speeds[0]))
    assert left == pytest.approx(limit, rel=1e-3)
    constant = with_tables(scene, rotor={"speed_profile": scene.rotor.speed_profile[:1]})
    assert _run_up_record(constant) is None


@pytest.mark.usefixtures("unwritten")
def test_a_run_that_did_not_come_to_its_estimates_is_shown(evidence: Record) -> None:
    changed = json.loads(json.dumps(evidence))
    run = changed["closed_loop"]["balanced"]
    run.update(residual_ratio=None, innovation=None, warnings=["the rotor stands still"])
    page = render(changed)["report.html"]
    assert "The rotor stands still." in page
    assert "normalised innovations" not in page
