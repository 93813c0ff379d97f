"""Sections of the report: one list makes contents, page, evidence and figure files."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from importlib.resources import files
from typing import Any

import pytest

from ringbalance.physics.tube.rotation_table import rotating_friction_ratio
from ringbalance.reports.figure import Drawing
from ringbalance.reports.page import render
from ringbalance.reports.pages import drag_coefficient as fifty
from ringbalance.reports.pages import eccentric, plain, tube
from ringbalance.reports.pages import tube_flow as inside
from ringbalance.reports.section import Section, Work
from ringbalance.reports.sections import SECTIONS, drawings_in, numbered, views_of
from ringbalance.scene.models import Scene
from ringbalance.verification.runner import paper_scene
from scenes import with_tables

Record = dict[str, Any]


def test_every_section_has_its_template_and_nothing_else_lies_there() -> None:
    folder = files("ringbalance.reports").joinpath("templates")
    present = {item.name for item in folder.iterdir() if item.name.endswith(".html")}
    assert present == {section.file for section in (*SECTIONS, *eccentric.SECTIONS, *plain.SECTIONS)} | {
        "report.html",
        "macros.html",
        "decided.html",
        "figures.html",
        "tallies.html",
    }


@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_the_contents_follow_the_list(pages: dict[str, str], sample: Record, name: str) -> None:
    links = re.findall(r'<li><a href="#(\w+)">', pages[name])
    assert links == [e["name"] for e in numbered(sample, views_of(sample)) if f"{e['document']}.html" == name]
    assert links[0] == {"report.html": "summary", "annex.html": "disc"}[name]
    places = [pages[name].index(f'<section id="{link}"') for link in links]
    assert places == sorted(places)


def test_a_section_without_evidence_stays_away(annex: str) -> None:
    assert 'id="fifty"' not in annex


def test_drawings_are_found_however_deep() -> None:
    first, two = (Drawing(name=name, svg="") for name in "ab")
    assert drawings_in({"x": [first, {"y": (two, None, "text")}], "z": 3}) == [first, two]


def test_a_plain_section_needs_no_functions() -> None:
    plain = Section(name="plain", title="Plain")
    assert plain.file == "plain.html"
    assert plain.view({}) == {}


@pytest.fixture(scope="module")
def work(paper_scene: Scene) -> Work:
    return Work(scene=paper_scene, level="light")


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
    dry["separated"] = None
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
    straight = replace(work, scene=with_tables(work.ring, tube={"hump_radius": None}))
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


def test_the_change_of_friction_is_that_of_the_table_for_turning_tubes(inside_record: Record) -> None:
    """The drawn section is on a coarse mesh; the table was computed on fine ones."""
    section = inside_record["section"]
    conditions = {"reynolds": section["reynolds"], "rotation_reynolds": section["rotation_reynolds"]}
    table = float(rotating_friction_ratio(**conditions).value)
    assert table > 1.01
    assert section["friction_change"] == pytest.approx(table - 1, rel=0.03)


def test_a_field_is_packed_to_four_digits() -> None:
    assert inside._packed([[1.23456, 2e-7], [0.0, -3.0]]) == "1.235 2e-07 0 -3"


def test_the_evidence_of_a_section_is_the_answer_of_its_last_job() -> None:
    work = Work(scene=paper_scene(), level="light")
    jobs = {section.name: section.jobs(work) for section in SECTIONS}
    parts = ("tuning", "other_reading", "valve 1", "valve 2", "valve 3")
    assert [job.name for job in jobs["summary"]] == [*parts, "summary"]
    assert jobs["summary"][-1].needs == parts
    assert [job.name for job in jobs["sloshing"]] == ["sloshing"]
    assert jobs["disc"] == []
    names = [job.name for some in jobs.values() for job in some]
    assert len(names) == len(set(names))
