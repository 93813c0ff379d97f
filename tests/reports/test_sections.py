"""Sections of the report: one list makes contents, page, evidence and figure files."""

from __future__ import annotations

import json
import re
from concurrent.futures import Future
from dataclasses import replace
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reports.figure import Drawing
from ringbalance.reports.page import render
from ringbalance.reports.pages import drag_coefficient as fifty
from ringbalance.reports.pages import eccentric, plain, tube
from ringbalance.reports.pages import paper_figures as paper_again
from ringbalance.reports.pages import tube_flow as inside
from ringbalance.reports.section import Section, Work
from ringbalance.reports.sections import SECTIONS, collected, completed, drawings_in, section_views, viewed
from ringbalance.reports.traced import untraced
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.processes import Workers
from ringbalance.verification.loops import calibration_of, loop_scene
from ringbalance.verification.runner import paper_scene

Record = dict[str, Any]


def test_every_section_has_its_template_and_nothing_else_lies_there() -> None:
    folder = files("ringbalance.reports").joinpath("templates")
    present = {item.name for item in folder.iterdir() if item.name.endswith(".html")}
    assert present == {section.file for section in (*SECTIONS, *eccentric.SECTIONS, *plain.SECTIONS)} | {
        "report.html",
        "macros.html",
        "decided.html",
    }


@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_the_contents_follow_the_list(pages: dict[str, str], whole: Record, name: str) -> None:
    links = re.findall(r'<li><a href="#(\w+)">', pages[name])
    assert links == [e["name"] for e in viewed(whole, section_views(whole)) if f"{e['place']}.html" == name]
    assert links[0] == {"report.html": "summary", "annex.html": "disc"}[name]
    places = [pages[name].index(f'<section id="{link}"') for link in links]
    assert places == sorted(places)


def test_a_section_without_evidence_stays_away(annex: str) -> None:
    assert 'id="fifty"' not in annex


def test_drawings_are_found_however_deep() -> None:
    one, two = (Drawing(name=name, svg="") for name in "ab")
    assert drawings_in({"x": [one, {"y": (two, None, "text")}], "z": 3}) == [one, two]


def test_a_plain_section_needs_no_functions() -> None:
    plain = Section(name="plain", title="Plain")
    assert plain.file == "plain.html"
    assert plain.view({}) == {}


@pytest.fixture(scope="module")
def work(paper_scene: Scene) -> Work:
    return Work(scene=paper_scene, calibration=calibrate(paper_scene), level="light")


def with_section(evidence: Record, name: str, record: Record | None) -> Record:
    """The evidence as it reads back from its file."""
    return {**evidence, name: json.loads(json.dumps(record, allow_nan=False))}


@pytest.fixture(scope="module")
def fifty_record(work: Work) -> Record:
    return fifty.SECTION.collect(work) or {}


def test_the_map_judges_fifty_for_each_liquid(fifty_record: Record) -> None:
    verdicts = {record["name"]: record["verdict"] for record in fifty_record["liquids"]}
    assert verdicts["water"] == "too high"
    assert verdicts["silicone oil 100 cSt"] == "too low"


@pytest.mark.usefixtures("unwritten")
def test_where_nothing_flows_the_page_says_so(evidence: Record, fifty_record: Record) -> None:
    dry = json.loads(json.dumps(fifty_record))
    dry["map"]["runs"] = False
    dry["apparent"] = None
    for record in dry["liquids"]:
        record["runs"] = False
        record["verdict"] = fifty._verdict_on_fifty(record)
    page = render({**evidence, "fifty": dry})["annex.html"]
    assert "no k can be given" in page
    assert "there is no map to draw" in page


@pytest.mark.usefixtures("unwritten")
def test_a_prescribed_k_is_named(evidence: Record, fifty_record: Record) -> None:
    prescribed = {**fifty_record, "decreed_k": 50.0}
    page = render(with_section(evidence, "fifty", prescribed))["annex.html"]
    assert 'The scene fixes k at <span data-from="fifty.decreed_k">50</span>' in page
    assert "The scene fixes k" not in render(with_section(evidence, "fifty", fifty_record))["annex.html"]


def test_the_velocity_decides_whether_fifty_is_right() -> None:
    record = {"runs": True, "velocity_m_s": 5.0, "velocity_uncertainty": 0.5}
    for paper, verdict in ((5.4, "right"), (4.6, "right"), (5.6, "too low"), (4.4, "too high")):
        assert fifty._verdict_on_fifty({**record, "velocity_paper_m_s": paper}) == verdict


@pytest.fixture(scope="module")
def hump_record(work: Work) -> Record:
    record = tube.CREST.collect(work)
    assert record is not None
    return record


@pytest.mark.usefixtures("unwritten")
def test_every_regime_that_is_found_is_drawn(evidence: Record, hump_record: Record) -> None:
    states = {state["regime"]: state for state in hump_record["states"]}
    assert set(states) == {"siphon", "separated", "blocked"}
    assert hump_record["absent"] == ["reverse"]
    assert states["siphon"]["margin_Pa"] > 0 > states["separated"]["margin_Pa"]
    assert (states["siphon"]["column"], states["separated"]["column"]) == ("holds", "separates")
    assert 'id="hump"' in render(with_section(evidence, "hump", hump_record))["annex.html"]


def test_a_margin_within_its_half_width_decides_nothing() -> None:
    assert [tube._column_code(*each) for each in ((2.0, 3.0), (3.0, 2.0), (-3.0, 2.0), (None, None))] == [
        "undecided",
        "holds",
        "separates",
        "none",
    ]


def test_a_tube_without_a_hump_has_no_such_section(evidence: Record, work: Work) -> None:
    straight = replace(work, scene=replace(work.scene, tube=replace(work.scene.tube, hump_radius=None)))
    assert tube.CREST.collect(straight) is None
    assert tube.CREST.view(evidence) is None


def test_the_figures_of_sections_carry_no_colour_of_their_own(
    evidence: Record, fifty_record: Record, hump_record: Record
) -> None:
    views = [
        fifty.SECTION.view({**evidence, "fifty": fifty_record}),
        tube.CREST.view({**evidence, "hump": hump_record}),
    ]
    for drawing in drawings_in(views):
        bare = re.sub(r'(href="|url\()#[^")]+', "", drawing.svg)
        assert not re.search(r"#[0-9a-fA-F]{3,8}\b(?![-\w])|\bblack\b|\bwhite\b|rgb\(", bare), drawing.name


@pytest.fixture(scope="module")
def inside_record(work: Work) -> Record:
    record = inside.SECTION.collect(work)
    assert record is not None
    return record


def test_a_field_is_packed_to_four_digits() -> None:
    assert inside._packed([[1.23456, 2e-7], [0.0, -3.0]]) == "1.235 2e-07 0 -3"


def test_the_three_dimensional_check_tells_when_it_was_run(evidence: Record) -> None:
    assert inside._three_dimensional_check(evidence) is None
    case = {
        "id": "bent_tube_3d",
        "kind": "solution_verification",
        "title": "The bent tube in three dimensions",
        "verdict": "not run",
        "status": "heavy: run with --level heavy",
        "quantities": [],
    }
    check = inside._three_dimensional_check({**evidence, "verification": [case]})
    assert check is not None
    assert (check["when"], check["hash"]) == ("", "")
    assert "heavy" in check["why_not_run"]
    run: dict[str, Any] = {**case, "verdict": "passed", "date": "2031-05-06", "scene_sha256": "ef" * 32}
    run["quantities"] = [
        {"name": "k", "unit": "1", "value": 12.3, "reference": 12.1, "uncertainty": 0.4, "verdict": "passed"}
    ]
    check = inside._three_dimensional_check({**evidence, "verification": [run]})
    assert check is not None
    assert (check["when"], check["hash"]) == ("2031-05-06", "efefefefefef")
    assert untraced(check["rows"][0]["value"]).startswith("12.3")


@pytest.fixture(scope="module")
def again(work: Work) -> Record:
    return paper_again.SECTION.collect(work) or {}


def test_the_papers_figures_come_out_of_one_set_of_constants(evidence: Record, again: Record) -> None:
    assert again["constants"]["rate_m_per_s"] == pytest.approx(7.2e-6, rel=0.01)
    assert len(again["trial"]) == 4
    assert all(run["settled"] and run["misadjustments"] for run in again["trial"])
    assert [bool(run["overshoots"]) for run in again["gains"]] == [False, False, False, True, True]
    assert max(run["settling_time_s"] for run in again["amplitudes"]) < 5
    assert sum(run["misadjustments"] for run in again["amplitudes"]) == 0
    for told in again["velocity"]:
        assert told["departure_paper"] == pytest.approx(told["departure_printed"], abs=2e-3)
        assert told["departure_levels"] > told["departure_paper"] + 0.01
    view = paper_again.SECTION.view(with_section(evidence, "paper_again", again))
    assert view is not None
    assert {drawing.name for drawing in drawings_in(view)} == {
        f"paper-figure-{name}" for name in ("4", "4-law", "6", "7", "7-phase", "8")
    }


def test_half_the_fitted_constant_gives_the_literal_reading_the_same_runs(again: Record) -> None:
    scene = loop_scene(paper_scene(), kind="target_vector", proportional=0.16e6, integral_time=None)
    model = paper_model(scene)
    half = replace(scene.rotor, influence_coefficient=scene.rotor.influence_coefficient / 2)
    literal = simulate(replace(scene, rotor=half), replace(model, moment=paper_again._literal_moment(model)))
    own = simulate(scene, model)
    np.testing.assert_allclose(literal.amplitude, own.amplitude, rtol=1e-9, atol=1e-15)
    reading = again["reading"]
    ratio = reading["onset_literal_s_per_m"] / reading["onset_transferred_s_per_m"]
    assert ratio == pytest.approx(0.5, abs=0.05)
    assert (
        reading["figure_8"]["literal"]["overshoots"] > 0 == reading["figure_8"]["transferred"]["overshoots"]
    )


def test_only_the_papers_moment_has_a_literal_reading(work: Work) -> None:
    with pytest.raises(ValueError, match="only the paper's model"):
        paper_again._literal_moment(work.calibration.model)


def test_evidence_is_in_the_page_s_order_whoever_collected_it() -> None:
    scene = paper_scene()
    work = Work(scene=scene, calibration=calibration_of(scene), level="light")
    found = {"trade": {"a": 1}, "summary": {"b": 2}}
    alone = completed(dict(found), {}, work, None)
    assert list(alone) == ["summary", "trade"]
    with Workers(1) as pool:
        # No worker has begun it.
        shared = completed(dict(found), {"sloshing": Future()}, work, pool)
    assert list(shared) == ["summary", "sloshing", "trade"]
    whole = collected(work, without=[s.name for s in SECTIONS if s.name != "sloshing"])
    assert shared["sloshing"] == whole["sloshing"]
