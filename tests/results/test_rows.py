"""A quantity says its interval in every output."""

from __future__ import annotations

import csv
import io
import json
import math

import pytest
from rich.console import Console

from ringbalance.results.findings import Finding
from ringbalance.results.numbers import plain
from ringbalance.results.render import csv_text, html_table
from ringbalance.results.result import Result, Rows
from ringbalance.results.rows import Parts, Quantity, around
from ringbalance.results.table import Table

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
    """As short as a result may be."""

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
    keys = ["key", "name", "symbol", "unit", "value", "lower", "upper", "parts", "origin", "status"]
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


def test_a_notebook_shows_the_same_rows() -> None:
    page = Answer()._repr_html_()
    assert "A &lt;disc&gt;" in page
    assert STALL.text in page
    assert "beside the shaft" in page


def test_a_short_text_has_title_quantity_and_finding() -> None:
    title, quantity, finding = repr(Answer()).splitlines()
    assert title == "A <disc>"
    assert quantity.strip() == f"{STALL.name} {plain(STALL.text)}"
    assert finding.strip() == Answer().rows().findings[0].text


def test_csv_and_html_hold_every_cell() -> None:
    table = Table(heads=("a", "b\nm"), rows=[("x, y", "−1"), ("<z>", "2")])
    assert list(csv.reader(io.StringIO(csv_text(table)))) == [["a", "b m"], ["x, y", "-1"], ["<z>", "2"]]
    assert table.numeric == [False, True]
    assert '<td style="text-align:right">2</td>' in html_table(table)
    assert "&lt;z&gt;" in html_table(table)


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
    assert around(5.0, 0.0) == (None, None)
