"""Every code has one whole sentence, its numbers in units, and its row in the documentation."""

from __future__ import annotations

import re

import doc_tables
import pytest

from ringbalance.results import rows
from ringbalance.results.numbers import SCALES
from ringbalance.results.rows import Finding, Quantity, Value, _Sentence, sentences

PLACES = re.compile(r"\{(\w+)(?::([^};]*))?(?:;(\d))?\}")


@pytest.mark.parametrize("code", sentences())
def test_a_sentence_fills_its_numbers_in_units_that_exist(code: str) -> None:
    sentence = sentences()[code]
    assert sentence.severity in ("info", "warning", "error")
    assert all(name.isidentifier() for name in sentence.values)
    for _, unit, _ in PLACES.findall(sentence.text):
        assert unit in ("", "%") or unit in SCALES
    text = Finding(code=code, values=dict.fromkeys(sentence.values, 0.25)).text
    assert "{" not in text
    assert text == text.strip()


def test_the_documentation_lists_every_code_as_the_program_has_it() -> None:
    page = doc_tables.text_of("docs/findings.md")
    assert doc_tables.fresh(page, doc_tables.PARTS["docs/findings.md"]()) == page


def test_a_number_that_is_missing_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    made_up = {
        "late": _Sentence(severity="warning", text="after {time:s;2}", change={"run.time_limit": "raise"})
    }
    monkeypatch.setattr(rows, "sentences", lambda: made_up)
    with pytest.raises(KeyError, match="time"):
        Finding(code="late").sentence()
    late = Finding(code="late", values={"time": 0.0123}, change={"run.time_limit": 200.0})
    assert late.text == "after 12 ms"
    assert late.changes == {"run.time_limit": 200.0}
    assert Finding(code="late").changes == {"run.time_limit": "raise"}
    assert late.sentence(lambda name, text: f"[{name}|{text}]") == "after [time|12\u202fms]"


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (5e-8, "m", "0.05\u202fµm"),
        (120, "s", "120\u202fs"),
        (123456, "", "123\u202f456"),
        (0.1234, "%", "12.34\u202f%"),
        ("A", "", "A"),
        (None, "m", "–"),
        (["a", "b", "c"], "", "a, b and c"),
        (
            Quantity(key="x", name="x", value=2e6, lower=1.9e6, upper=2.1e6, unit="Pa"),
            "m",
            "(2.00\u00a0±\u00a00.10)\u202fMPa",
        ),
    ],
)
def test_one_filter_writes_every_value(
    value: Value, unit: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sentence = _Sentence(severity="info", text=f"{{it:{unit}}}")
    monkeypatch.setattr(rows, "sentences", lambda: {"it": sentence})
    assert Finding(code="it", values={"it": value}).sentence() == text
