"""Reports stay short and small, in print too, and show nothing but what their evidence holds."""

from __future__ import annotations

import json
import random
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any, Final

import pytest
from check_traces import agrees, apart, traces, untrue

from ringbalance.reports.page import render
from ringbalance.reports.report import write_report
from ringbalance.reports.traced import evidence_at
from ringbalance.scene import load_scene

MOST_PAGES: Final = 12
MOST_BYTES: Final = 1_500_000
SCENES: Final = sorted((Path(__file__).resolve().parents[2] / "scenes").glob("*.toml"))
ORIGINS: Final = {"given", "inferred", "assumed", "measured", "derived", "default"}
BROWSER: Final = shutil.which("chromium") or shutil.which("google-chrome")


def test_the_report_and_its_annex_stay_small(pages: dict[str, str]) -> None:
    assert len(pages["report.html"].encode()) <= MOST_BYTES
    assert len(pages["annex.html"].encode()) <= MOST_BYTES


def test_styles_are_classes(pages: dict[str, str]) -> None:
    """Only sizes of equations, lengths of bars and the hidden sheet of glyphs have styles of their own."""
    for page in pages.values():
        styles = re.findall(r' style="([^":]*)', page)
        assert set(styles) <= {"width", "flex-grow", "position"}, set(styles)


def printed_pages(page: Path) -> int:
    """Pages that Chromium prints of a file."""
    out = page.parent / "printed.pdf"
    # Root may not use the sandbox of this browser; the page is this program's own.
    done = subprocess.run(
        [
            *(str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"),
            *(f"--user-data-dir={page.parent / 'browser'}", f"--print-to-pdf={out}", str(page)),
        ],
        capture_output=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    return len(re.findall(rb"/Type\s*/Page\b", out.read_bytes()))


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_the_report_prints_on_few_pages(pages: dict[str, str], tmp_path: Path) -> None:
    for name, text in pages.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert 0 < printed_pages(tmp_path / "report.html") <= MOST_PAGES


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_nothing_is_wider_than_paper(evidence: dict[str, Any], name: str, tmp_path: Path) -> None:
    """Chromium shrinks a whole print until its widest table fits: letters of 8 pt would come out as 5 pt."""
    gain = {"law": "paper", "drag_coefficient": 50.0, "velocity_m_s": 5.0, "gain_per_operation": 0.6}
    gain |= {"moment_per_transferred_mass_m": 0.073, "slope_m_per_s": 7.5e-6}
    evidence["consequences"] = {"gain": [gain], "paper": evidence["summary"]["own"]}
    evidence["verification"][0]["quantities"][0] |= {
        "title": "volume of two adjacent full chambers",
        "uncertainty": 1.7e-9,
        "reference": 6.885e-5,
        "reference_uncertainty": 5.8e-9,
        "validation": {"E": -1.3e-6, "u_val": 1.2e-8, "u_num": 5.0e-13, "u_input": 1.9e-9, "u_D": 2.9e-9},
        "criterion": "within ±, and ± ≤ 1 %",
    }
    text = re.sub(r"@media screen[^{]*\{", "@media speech {", render(evidence)[name])
    text = text.replace("@media print {", "@media all {")
    measure = "<script>onload = () => { document.title = document.documentElement.scrollWidth; }</script>"
    (tmp_path / name).write_text(text + measure, encoding="utf-8")
    options = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--dump-dom")
    browser = (str(BROWSER), *options, "--window-size=665,1000", f"--user-data-dir={tmp_path / 'browser'}")
    done = subprocess.run(
        [*browser, str(tmp_path / name)],
        capture_output=True,
        text=True,
        timeout=240,
        check=True,
    )
    assert "<title>665</title>" in done.stdout


@pytest.mark.heavy
@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_a_hundred_values_lead_to_the_evidence(file: Path, tmp_path: Path) -> None:
    write_report(load_scene(file), tmp_path, scene_text=file.read_text(encoding="utf-8"), workers=2)
    pages = [(tmp_path / name).read_text(encoding="utf-8") for name in ("report.html", "annex.html")]
    evidence = json.loads((tmp_path / "evidence.json").read_bytes())
    traced = traces(pages)
    assert len(traced) > 30
    assert untrue(pages, evidence) == []
    assert apart(evidence) == []
    for path, text in random.Random(15).choices(traced, k=100):
        assert agrees(text, evidence_at(evidence, path)), (path, text)
    assert len(pages[0].encode()) <= MOST_BYTES
    if BROWSER is not None:
        assert 0 < printed_pages(tmp_path / "report.html") <= MOST_PAGES
    assert {row["origin"] for row in evidence["scene"]["table"]} <= ORIGINS
