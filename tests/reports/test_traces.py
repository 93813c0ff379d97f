"""Every number that the report traces is what the evidence holds, and one quantity has one value."""

from __future__ import annotations

from typing import Any

import pytest
from check_traces import SAME, agrees, apart, printed, traces

from ringbalance.reports.traced import evidence_at, marked_up, read, traced, untraced

Record = dict[str, Any]


@pytest.fixture(scope="module")
def found(pages: dict[str, str]) -> list[tuple[str, str]]:
    return traces(pages.values())


def test_a_wrong_number_is_noticed(evidence: Record, found: list[tuple[str, str]]) -> None:
    for path in {path for path, _ in found}:
        value = evidence_at(evidence, path)
        text = next(text for own, text in found if own == path)
        shown, half = printed(text) or (0.0, 1.0)
        if isinstance(value, float) and abs(shown) > 3 * half:
            assert not agrees(text, 1.37 * value), path


def test_one_quantity_is_printed_with_one_value(found: list[tuple[str, str]]) -> None:
    names = {path: group[0] for group in SAME for path in group}
    values: dict[str, list[tuple[float, float, str]]] = {}
    for path, text in found:
        if number := printed(text):
            values.setdefault(names.get(path, path), []).append((*number, text))
    twice = {path: told for path, told in values.items() if len(told) > 1}
    assert twice
    for path, told in twice.items():
        for value, half, text in told:
            for other, other_half, other_text in told:
                apart = abs(value - other)
                # A value in another unit is told apart by its power of ten.
                assert apart <= half + other_half or not 0.01 < abs(value / (other or 1)) < 100, (
                    path,
                    text,
                    other_text,
                )


def test_places_of_one_quantity_agree(whole: Record) -> None:
    assert apart(whole) == []


def test_two_values_of_one_quantity_are_found(evidence: Record) -> None:
    evidence["calibration"]["budgets"]["velocity"]["value"] = 7.0
    assert [held for held in apart(evidence) if "operating_point.velocity_m_s" in held]


def test_a_trace_survives_a_sentence_and_markup_does_not() -> None:
    told = f"At {traced('3 um', 'a.0.b')} & <b> the {traced('lambda', 'c')}."
    assert untraced(told) == "At 3 um & <b> the lambda."
    page = marked_up(told)
    assert page == (
        'At <span data-from="a.0.b">3 µm</span> &amp; &lt;b&gt; the <span data-from="c">λ</span>.'
    )


def test_reading_takes_the_unit_that_suits() -> None:
    assert untraced(
        read({"a": [{"b": 2.5e-6}]}, "a.0.b", "m", width=1e-7)
    ) == "(2.50\u202f±\u202f0.10)\u202fµm".replace("\u202f±\u202f", "\u00a0±\u00a0")


def test_a_number_is_not_finer_than_inputs_of_which_nothing_is_said(evidence: Record) -> None:
    stated = {**evidence, "length_m": 0.123456}
    bare = {**stated, "scene": {**evidence["scene"], "states_uncertainty": False}}
    assert untraced(read(stated, "length_m", "m", width=1e-5)) == "(123.456\u00a0±\u00a00.010)\u202fmm"
    assert untraced(read(bare, "length_m", "m", width=1e-5)) == "123.5\u202fmm"
    wide = (untraced(read(each, "length_m", "m", width=1e-3)) for each in (bare, stated))
    assert len(set(wide)) == 1
