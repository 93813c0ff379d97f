"""Every number that the report traces is what the evidence holds, and one quantity has one value."""

from __future__ import annotations

from typing import Any

import pytest
from check_traces import SAME, agrees, apart, printed, traces

from ringbalance.reports.traced import evidence_at, finished, marked, placed, total_of
from ringbalance.reports.traced import printed as traced
from ringbalance.results.numbers import believed

Record = dict[str, Any]


@pytest.fixture(scope="module")
def traced_numbers(pages: dict[str, str]) -> list[tuple[str, str]]:
    return traces(pages.values())


def test_a_wrong_number_is_noticed(evidence: Record, traced_numbers: list[tuple[str, str]]) -> None:
    for path in {path for path, _ in traced_numbers}:
        value = evidence_at(evidence, path)
        text = next(text for traced_path, text in traced_numbers if traced_path == path)
        shown, half = printed(text) or (0.0, 1.0)
        if isinstance(value, float) and abs(shown) > 3 * half:
            assert not agrees(text, 1.37 * value), path


def test_one_quantity_is_printed_with_one_value(traced_numbers: list[tuple[str, str]]) -> None:
    names = {path: group[0] for group in SAME for path in group}
    values: dict[str, list[tuple[float, float, str]]] = {}
    for path, text in traced_numbers:
        if number := printed(text):
            values.setdefault(names.get(path, path), []).append((*number, text))
    twice = {path: readings for path, readings in values.items() if len(readings) > 1}
    assert twice
    for path, readings in twice.items():
        for value, half, text in readings:
            for other, other_half, other_text in readings:
                apart = abs(value - other)
                # A value in another unit is told apart by its power of ten.
                assert apart <= half + other_half or not 0.01 < abs(value / (other or 1)) < 100, (
                    path,
                    text,
                    other_text,
                )


def test_places_of_one_quantity_agree(sample: Record) -> None:
    assert apart(sample) == []


def test_two_values_of_one_quantity_are_found(evidence: Record) -> None:
    evidence_at(evidence, "calibration.quantities.wall_pressure")["value"] = 7.0
    assert [held for held in apart(evidence) if "calibration.chamber.wall_pressure_Pa.-1" in held]


def test_a_number_is_printed_with_its_place_and_markup_is_not_obeyed() -> None:
    value = placed({"a": [{"b_m": 2.5e-6}]})["a"][0]["b_m"]
    assert traced(value, 1e-7) == '<span data-from="a.0.b_m">(2.50\u00a0±\u00a00.10)\u202fµm</span>'
    assert marked("<3", value) == '<span data-from="a.0.b_m">&lt;3</span>'
    assert finished("3 um & <b> lambda") == "3 µm & <b> λ"


def test_a_number_is_not_finer_than_inputs_of_which_nothing_is_said() -> None:
    fine, wide = 1e-5, 1e-3
    assert believed(0.123456, fine, stated=True) == fine
    assert believed(0.123456, fine, stated=False) is None
    assert believed(0.123456, wide, stated=False) == wide


@pytest.mark.parametrize(
    ("ends", "half_width"),
    [
        ({"lower": 0.8, "upper": 1.1}, 0.2),
        ({"lower": 0.8, "upper": None}, 0.2),
        ({"lower": None, "upper": None}, 0.5),
    ],
)
def test_a_half_width_on_a_page_reaches_to_the_farther_end(
    ends: dict[str, float | None], half_width: float
) -> None:
    quantity = {"value": 1.0, "parts": {"numerical": 0.0, "input": 0.3, "model": 0.4}, **ends}
    assert total_of(quantity) == pytest.approx(half_width)
