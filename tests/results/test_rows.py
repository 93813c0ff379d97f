"""A quantity says its interval in every output."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import replace

import pytest
from rich.console import Console

from ringbalance.results.numbers import plain
from ringbalance.results.result import Result, Rows, Table, csv_text
from ringbalance.results.rows import Finding, Parts, Quantity, around

STALL = Quantity(
    key="stall_pressure",
    name="pressure to empty a chamber",
    symbol="p_s",
    unit="Pa",
    value=418.4e3,
    lower=415.4e3,
    upper=430.4e3,
    parts=Parts(numerical=10.0, input=7.4e3, model=0.0),
    status="gas_drawn",
)


LAW = Table(caption="law", heads=("state", "u\nm/s"), rows=[("blocked", "–"), ("siphon", "−1.5")])


class Answer(Result):
    """A result as short as it may be."""

    def rows(self) -> Rows:
        found = Finding(code="off_axis", values={"distance_m": 0.5e-3})
        return Rows(title="A <disc>", quantities=(STALL,), findings=(found,), tables=(LAW,))

    def to_dict(self) -> dict[str, object]:
        return {"status": 1, **self.rows().document()}


def printed(width: int = 80) -> str:
    console = Console(width=width, file=io.StringIO(), record=True)
    console.print(Answer().rows().view())
    return console.export_text()


def test_a_quantity_and_a_finding_have_the_documented_keys() -> None:
    document = json.loads(json.dumps(Answer().to_dict(), allow_nan=False))
    (quantity,), (finding,) = document["quantities"], document["findings"]
    keys = ["key", "name", "symbol", "unit", "value", "lower", "upper", "parts", "causes", "origin", "status"]
    assert sorted(quantity) == sorted(keys)
    assert quantity["parts"] == {"numerical": 10.0, "input": 7.4e3, "model": 0.0}
    assert sorted(finding) == ["change", "code", "severity", "text", "values"]
    assert finding["values"] == {"distance_m": 0.5e-3}


def test_the_terminal_shows_a_lopsided_interval_and_the_status() -> None:
    lines = printed().splitlines()
    assert "the outer wall is round about an axis 0.5 mm beside the shaft" in lines[0]
    (row,) = (line for line in lines if "pressure to empty" in line)
    assert "(0.418 -0.003/+0.012) MPa (gas drawn)" in row
    assert any(line.split() == ["siphon", "-1.5"] for line in lines)


def test_texts_of_a_table_are_as_wide_as_the_output() -> None:
    note = "where the driven chamber is fuller than its opposite, liquid is lifted over the crest"
    console = Console(width=120, file=io.StringIO(), record=True)
    console.print(Rows(title="", quantities=(), tables=(replace(LAW, note=note),)).view())
    assert note in console.export_text().splitlines()


def test_a_number_out_of_range_says_of_what() -> None:
    beyond = Rows(title="", quantities=(replace(STALL, status="out_of_range"),))
    console = Console(width=120, file=io.StringIO(), record=True)
    console.print(beyond.view())
    assert "MPa (beyond the validity of its models, as a warning says)" in console.export_text()


def test_a_notebook_shows_the_same_rows() -> None:
    page = Answer()._repr_html_()
    assert "A &lt;disc&gt;" in page
    assert f'<td style="text-align:right">{STALL.text}</td>' in page
    assert "beside the shaft" in page


def test_a_short_text_has_title_quantity_and_finding() -> None:
    title, quantity, finding = repr(Answer()).splitlines()
    assert title == "A <disc>"
    assert quantity.strip() == f"{STALL.name} {plain(STALL.text)}"
    assert finding.strip() == Answer().rows().findings[0].text


@pytest.mark.parametrize("name", ["=cmd|calc!A0", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1"])
def test_csv_has_no_formula_of_a_name(name: str) -> None:
    text = csv_text({"gas.name": [name, "MHA2", -0.5], name: ["-", "1/0.5-2", None]})
    (head, *rows) = csv.reader(io.StringIO(text, newline=""))
    cell = f"'{name}".replace("\r", "\n")
    assert head == ["gas.name", cell]
    assert rows == [[cell, "'-"], ["MHA2", "1/0.5-2"], ["-0.5", ""]]


def test_csv_leaves_numbers_that_are_text_as_they_are() -> None:
    """Numbers written in full, as reference results of a unit are."""
    numbers = ["-8.518396615509643e-06", "-3", "+0.5", "-1e-300"]
    assert csv_text({"x": numbers}).splitlines() == ["x", *numbers]


def test_csv_holds_every_cell() -> None:
    text = csv_text({"time [s]": [0.1, 2e-9], "name, short": ["a", None]})
    assert list(csv.reader(io.StringIO(text))) == [["time [s]", "name, short"], ["0.1", "a"], ["2e-09", ""]]


@pytest.mark.parametrize(
    ("cells", "numeric"),
    [
        (["\u22121", "2 mm", "\u2013"], True),
        (['<span data-from="a">3</span>', "(4", "none"], True),
        (["< 2", "a", "1"], False),
    ],
)
def test_most_cells_decide_how_a_column_is_set(cells: list[str], numeric: bool) -> None:
    """Behind tags and the marks of traces."""
    assert Table(heads=("a",), rows=[(cell,) for cell in cells]).numeric == [numeric]


@pytest.mark.parametrize(
    ("ends", "width"),
    [
        ((None, None), None),
        ((1.0, 4.0), (1.0, 2.0)),
        ((None, 4.0), (math.inf, 2.0)),
        ((2.0, 4.0), (0.0, 2.0)),
    ],
)
def test_the_width_is_what_lies_between_value_and_ends(
    ends: tuple[float | None, float | None], width: tuple[float, float] | None
) -> None:
    assert Quantity(key="x", name="x", value=2.0, lower=ends[0], upper=ends[1]).width == width


def test_parts_add_as_squares() -> None:
    total = Parts(numerical=1.0, input=2.0, model=2.0).total
    assert total == 3.0
    assert around(5.0, total) == (2.0, 8.0)
    assert around(2.0, total) == (0.0, 5.0)
    assert around(0.0, total) == (0.0, 3.0)
    assert around(-2.0, total) == (-5.0, 1.0)
    assert around(5.0, 0.0) == (None, None)
    assert around(10.75625, 5.7e-14) == (None, None)
    assert around(10.75625, 1e-3, stated=False) == (None, None)
