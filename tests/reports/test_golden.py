"""Two kept reports say what they said, word for word, and every number that they trace is the evidence's."""

from __future__ import annotations

import json
import random
from functools import cache
from typing import Any

import pytest
from check_traces import apart, traces, untrue
from report_texts import FOLDER, NAMES, kept_evidence, report_text

from ringbalance.reports.page import render
from ringbalance.reports.traced import evidence_at

FEWEST_TRACES = {"ring": 475, "masses": 50}


@cache
def evidence_of(name: str) -> dict[str, Any]:
    return kept_evidence(name)


@cache
def pages_of(name: str) -> tuple[str, ...]:
    """Pages without drawings, shared by the tests of this module."""
    return tuple(render(evidence_of(name)).values())


@pytest.mark.usefixtures("unwritten")
@pytest.mark.parametrize("name", NAMES)
def test_the_pages_say_what_they_said(name: str) -> None:
    golden = (FOLDER / f"{name}.txt").read_text(encoding="utf-8")
    assert report_text(evidence_of(name)) == golden, "run tools/generate.py --write reports, if meant"


@pytest.mark.usefixtures("unwritten")
@pytest.mark.parametrize("name", NAMES)
def test_every_traced_number_is_the_evidence_s(name: str) -> None:
    evidence, pages = evidence_of(name), pages_of(name)
    assert len(traces(pages)) >= FEWEST_TRACES[name]
    assert untrue(pages, evidence) == []
    assert apart(evidence) == []


@pytest.mark.usefixtures("unwritten")
def test_a_changed_number_changes_what_is_printed() -> None:
    evidence = json.loads(json.dumps(evidence_of("ring")))
    before = dict(traces(pages_of("ring")))
    for path in random.Random(3).sample(sorted(before), 60):
        owner, _, key = path.rpartition(".")
        holder, value = evidence_at(evidence, owner), evidence_at(evidence, path)
        if isinstance(value, float) and value and not isinstance(holder, list):
            holder[key] = 1.37 * value
    after = dict(traces(render(evidence).values()))
    assert sum(before[path] != after.get(path) for path in before) >= 25


@pytest.mark.usefixtures("unwritten")
@pytest.mark.parametrize("absent", ["own", "recommended"])
def test_one_setting_alone_makes_whole_pages(absent: str) -> None:
    """A scene that gives no gain has no setting of its own; one that is at its best gets no other."""
    evidence = json.loads(json.dumps(evidence_of("ring")))
    summary = evidence["summary"]
    either = summary["own"] or summary["recommended"]
    summary |= {"own": either, "recommended": either} | {absent: None}
    assert untrue(render(evidence).values(), evidence) == []
