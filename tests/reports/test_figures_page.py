"""Figures that answer a pointer: positions and numbers of points, keys, and a page that loads nothing."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from report_texts import kept_evidence

import ringbalance as rb
from ringbalance.panels.document import module_text
from ringbalance.reports.figures_page import ReadableFigure, ReadingColumn, figures_page
from ringbalance.reports.pages.first_page import SECTION, pressure_page
from ringbalance.scene.models import Scene

Record = dict[str, Any]
NODE: Final = shutil.which("node")
BROWSER: Final = shutil.which("chromium") or shutil.which("google-chrome")
MOST_BYTES: Final = 300_000
"""Of the page of a sweep of 2,000 points: what a panel may take, which is sent by mail in the same way."""
needs_node = pytest.mark.skipif(NODE is None, reason="no Node on this machine")


@pytest.fixture(scope="module")
def evidence() -> Record:
    return kept_evidence("ring")


@pytest.fixture(scope="module")
def page(evidence: Record) -> str:
    view = SECTION.view(evidence)
    assert view is not None
    return pressure_page(evidence, view["pressure"])


@pytest.fixture(scope="module")
def sweep_page(paper_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> str:
    vary = {"tube.bore": "0.5mm:2mm:50", "gas.pressure": "0.2MPa:0.8MPa:40"}
    table = rb.sweep(paper_scene, vary, intervals=False)
    return str(table.plot(tmp_path_factory.mktemp("sweep"))[-1].read_text(encoding="utf-8"))


def content_of(page: str) -> Record:
    (text,) = re.findall(r'<script type="application/json" id="content">(.*?)</script>', page, re.DOTALL)
    content: Record = json.loads(text)
    return content


def in_node(script: str, content: object) -> Any:
    """Value of an expression of the module's functions and `content`."""
    module = module_text("figures")
    address = "data:text/javascript;base64," + base64.b64encode(module.encode()).decode()
    lines = (
        f"import {{ nearest, next, reading, marks, frameAt }} from {json.dumps(address)};",
        f"const content = {json.dumps(content)};",
        f"console.log(JSON.stringify({script}));",
    )
    command = [str(NODE), "--input-type=module"]
    done = subprocess.run(
        command, input="\n".join(lines), capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_points_lie_on_the_curves(evidence: Record, page: str) -> None:
    """Positions are worked out from the axes; the curves are where matplotlib drew them."""
    content, view = content_of(page), SECTION.view(evidence)
    assert view is not None
    pattern = r'<path d="([^"]+)"[^>]*style="[^"]*stroke: var\(--fig-found\)'
    paths = [
        re.findall(r"[ML] ([\d.]+) ([\d.]+)", path) for path in re.findall(pattern, view["pressure"].svg)
    ]
    curves = [np.array(path, dtype=float) for path in paths if len(path) > 5]
    (figure,) = content["figures"]
    assert len(figure["frames"]) == 3
    for curve, frame in zip(curves, figure["frames"], strict=True):
        positions = np.array([point for point in frame["at"] if None not in point])
        # Both are rounded to a tenth of a point; the axes cut the curves at their ends.
        distances = np.abs(curve[:, None] - positions).max(axis=2).min(axis=0)
        left, _, width, _ = frame["box"]
        inside = (positions[:, 0] >= left) & (positions[:, 0] <= left + width)
        assert inside.sum() >= 10
        assert distances[inside].max() <= 0.15


def test_each_row_is_a_level_of_the_evidence(evidence: Record, page: str) -> None:
    content, levels = content_of(page), evidence["summary"]["along"]["levels"]
    heads = [head for head, _ in content["heads"]]
    for row, level in zip(content["rows"], levels, strict=True):
        texts = dict(zip(heads, row, strict=True))
        assert float(texts["gas pressure, gauge"]) == pytest.approx(1e-6 * level["value"], rel=1e-3)
        assert float(texts["devices that settle"].split("\u202f")[0]) == pytest.approx(
            100 * level["fraction"]["value"], abs=0.5
        )
        half = level["settling_time_s"]["p50"]
        assert texts["until half have settled"] == ("" if half is None else f"{half:.4g}")
        assert texts["verdict"] == level["verdict"]


def test_ends_of_devices_that_do_not_settle_are_named(evidence: Record) -> None:
    view = SECTION.view(evidence)
    assert view is not None
    levels = [
        {**level, "ended": {"settled": 52, "out_of_reach": 4, "hovering": 8}}
        for level in evidence["summary"]["along"]["levels"]
    ]
    summary = {**evidence["summary"], "along": {**evidence["summary"]["along"], "levels": levels}}
    content = content_of(pressure_page({**evidence, "summary": summary}, view["pressure"]))
    assert "hovering 8, out of reach 4" in content["rows"][0]


def test_the_page_stays_small_and_loads_nothing(page: str, sweep_page: str) -> None:
    assert len(sweep_page.encode()) <= MOST_BYTES
    for text in (page, sweep_page):
        (policy,) = re.findall(r'Content-Security-Policy" content="([^"]+)"', text)
        (script,) = re.findall(r'<script type="module">(.*?)</script>', text, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"script-src &#39;sha256-{digest}&#39;" in policy or f"script-src 'sha256-{digest}'" in policy
        assert html.unescape(policy).startswith("default-src 'none'; img-src data:;")
        assert "connect-src" not in policy
        addresses = {*re.findall(r"https?://[^\s\"'<)]+", text)}
        assert addresses <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}


def test_a_name_cannot_leave_its_element(evidence: Record) -> None:
    view = SECTION.view(evidence)
    assert view is not None
    name = "</script><script>alert(1)</script><!--"
    figure = ReadableFigure(drawing=view["pressure"], label=name, caption=name, curves=[([0.5], [50.0])])
    columns = [ReadingColumn(name=name, values=[name])]
    text = figures_page(name, name, columns, [figure], start=0, along_x=True, has_dark=True)
    assert "<script>alert" not in text
    assert "<!--" not in text
    assert content_of(text)["rows"] == [[name]]


@needs_node
def test_keys_reach_every_point_of_a_curve(page: str) -> None:
    content = content_of(page)
    at, count = content["figures"][0]["frames"][0]["at"], len(content["rows"])
    walk = """(() => {
        const rows = [next(content, 0, "Home", true)];
        for (let i = 0; i < content.length; i++) rows.push(next(content, rows.at(-1), "ArrowRight", true));
        return [rows, ...["ArrowUp", "x", "End"].map((key) => next(content, 3, key, true))];
    })()"""
    rows, up, other, end = in_node(walk, at)
    assert rows == [*range(count), count - 1]
    assert (up, other, end) == (3, 3, count - 1)


@needs_node
def test_keys_move_by_one_cell_of_a_map(sweep_page: str) -> None:
    """Rows of a grid vary fastest in the pressure: up is the next row, right the row a column on."""
    at = content_of(sweep_page)["figures"][0]["frames"][0]["at"]
    keys = ["ArrowUp", "ArrowDown", "ArrowRight", "ArrowLeft"]
    assert in_node(f"{json.dumps(keys)}.map((key) => next(content, 645, key, false))", at) == [
        646,
        644,
        685,
        605,
    ]
    assert in_node(f"{json.dumps(keys)}.map((key) => next(content, 0, key, false))", at) == [1, 0, 40, 0]
    assert in_node('["Home", "End"].map((key) => next(content, 645, key, false))', at) == [0, len(at) - 1]


@needs_node
def test_a_pointer_chooses_the_nearest_point(sweep_page: str) -> None:
    content = content_of(sweep_page)
    at = content["figures"][0]["frames"][0]["at"]
    chosen = "content.map(([x, y]) => nearest(content, x + 0.9, y - 0.9, false))"
    assert in_node(chosen, at) == [*range(len(at))], "cells are at least 2.5 pt wide"
    assert in_node("nearest([[null, 1], [5, null]], 5, 1, false)", 0) == -1
    assert in_node("nearest([[null, 1], [5, null]], 0, 1, true)", 0) == 1
    texts = in_node("reading(content, 645)", content)
    assert texts[:3] == [["row", "645"], ["bore d", "0.9898\u202fmm"], ["gas pressure", "0.2769\u202fMPa"]]
    unknown = {"heads": [["flow", "m/s"]], "rows": [[""]]}
    assert in_node("reading(content, 0)", unknown) == [["flow", "–"]]


@needs_node
def test_marks_show_the_row_in_each_frame(page: str) -> None:
    (figure,) = content_of(page)["figures"]
    marked = in_node("marks(content, 4, true)", figure)
    assert [tag for tag, _ in marked] == ["line", "circle"] * 3
    low = in_node("marks(content, 0, true)", figure)
    # Half of the devices do not settle at the lowest pressure: no ring in the third frame.
    assert [tag for tag, _ in low].count("circle") == 2
    left, top, _, height = figure["frames"][2]["box"]
    assert (
        in_node(f"frameAt(content, {left + 1}, {top + height / 2}).box", figure) == figure["frames"][2]["box"]
    )
    assert in_node("frameAt(content, 0, 0).box", figure) == figure["frames"][0]["box"]


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_the_page_reads_out_the_recommended_pressure(page: str, tmp_path: Path) -> None:
    """Its script runs under its own policy, from a local disk."""
    file = tmp_path / "figures.html"
    file.write_text(page, encoding="utf-8")
    done = subprocess.run(
        [
            *(str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"),
            *(f"--user-data-dir={tmp_path / 'browser'}", file.as_uri()),
        ],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert "<dt>gas pressure, gauge</dt><dd>0.56\u202fMPa</dd>" in done.stdout
    assert "<circle cx=" in done.stdout
