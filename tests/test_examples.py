"""Every public name has an example in its docstring, which gives what it shows."""

from __future__ import annotations

import cmath
import doctest
import inspect
import math
import pydoc
from pathlib import Path
from typing import Final

import doc_tables
import pytest

import ringbalance as rb
from ringbalance.scene import registry

LONG: Final = {
    "Comparison",
    "Design",
    "Extremes",
    "MassDesign",
    "Tuning",
    "extremes",
    "find_design",
    "write_report",
}
"""Whose examples take long, or run what the example of the function that makes them runs."""
NAMES: Final = [
    pytest.param(name, marks=pytest.mark.heavy if name in LONG else ())
    for name in rb.__all__
    if name != "Sensor"
]


def examples(name: str) -> list[doctest.DocTest]:
    """The examples in a public name's own docstring."""
    text = inspect.getdoc(getattr(rb, name)) or ""
    names = {"rb": rb, "cmath": cmath, "math": math, "Path": Path}
    test = doctest.DocTestParser().get_doctest(text, names, f"rb.{name}", None, None)
    return [test] if test.examples else []


@pytest.mark.parametrize("name", NAMES)
def test_an_example_gives_what_it_shows(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(registry, "_PATHS", dict(registry._PATHS))
    (test,) = examples(name)
    assert any(f"rb.{name}" in each.source for each in test.examples) or name in {
        "Calibration",
        "Comparison",
        "Design",
        "EccentricRun",
        "EccentricScene",
        "Extremes",
        "Fit",
        "Panel",
        "Scene",
        "Simulation",
        "Sweep",
        "TradeStudy",
        "Tuning",
    }
    report: list[str] = []
    # Its own default reads the command line of pytest.
    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    runner.run(test, out=report.append)
    assert "".join(report) == ""


def test_a_sensor_stands_in_an_example() -> None:
    """An alias has no docstring of its own."""
    (test,) = examples("Measurement")
    assert any("rb.Sensor" in each.source for each in test.examples)


def test_the_page_of_names_has_their_docstrings() -> None:
    page = doc_tables.text_of("docs/api.md")
    assert doc_tables.fresh(page, doc_tables.PARTS["docs/api.md"]()) == page
    assert all(f"## `rb.{name}`" in page for name in rb.__all__)


def test_help_leads_to_every_name() -> None:
    text = pydoc.plain(pydoc.render_doc(rb))
    assert [name for name in rb.__all__ if name not in text] == []
