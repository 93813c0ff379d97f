"""The report stays short and small; where a browser is at hand, it is printed and its pages are counted."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Final

import pytest

MOST_PAGES: Final = 12
MOST_BYTES: Final = 1_500_000
BROWSER: Final = shutil.which("chromium") or shutil.which("google-chrome")


def test_the_report_and_its_annex_stay_small(pages: dict[str, str]) -> None:
    assert len(pages["report.html"].encode()) <= MOST_BYTES
    assert len(pages["annex.html"].encode()) <= MOST_BYTES


def test_styles_are_classes(pages: dict[str, str]) -> None:
    """Only sizes of equations, lengths of bars and the hidden sheet of glyphs have styles of their own."""
    for page in pages.values():
        styles = re.findall(r' style="([^":]*)', page)
        assert set(styles) <= {"width", "flex-grow", "position"}, set(styles)


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_the_report_prints_on_few_pages(pages: dict[str, str], tmp_path: Path) -> None:
    for name, text in pages.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    # Root may not use the sandbox of this browser; the page is this program's own.
    done = subprocess.run(
        [
            *(str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"),
            *(f"--user-data-dir={tmp_path / 'browser'}", f"--print-to-pdf={tmp_path / 'report.pdf'}"),
            str(tmp_path / "report.html"),
        ],
        capture_output=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    printed = (tmp_path / "report.pdf").read_bytes()
    assert 0 < len(re.findall(rb"/Type\s*/Page\b", printed)) <= MOST_PAGES
