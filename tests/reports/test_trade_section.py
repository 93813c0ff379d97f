"""The report's section on speed against accuracy, from a small document."""

from __future__ import annotations

from typing import Any

import pytest

from ringbalance.reports.pages.model_selection import SECTION

Record = dict[str, Any]


def fidelity(name: str, error: float, cost: float, *, front: bool = True) -> Record:
    return {"name": name, "error": error, "cost_s": cost, "on_front": front, "models": {}, "leaves_out": []}


def choice(tolerance: float, name: str, measured: float | None) -> Record:
    return {
        "tolerance": tolerance,
        "rung": name,
        "measured": measured,
        "cost_s": 2e-3,
        "reasons": [f"{name}: in; worth 1e-3", "checked: 2e-4"],
    }


@pytest.fixture
def evidence() -> Record:
    quantity = {
        "quantity": "wall_pressure",
        "title": "wall pressure",
        "status": {"code": "out_of_range", "text": "gravity leaves a closed ring above 0.3 only"},
        "rungs": [
            fidelity("formula", 0.09, 4e-5),
            fidelity("closed form", 1.6e-3, 3e-4),
            fidelity("coarse mesh", 1.7e-3, 0.04, front=False),
            fidelity("fine mesh", 0.0, 0.8),
        ],
        "knee": "closed form",
        "top": "fine mesh",
        "top_uncertainty": 7.8e-5,
        "choices": [
            choice(0.1, "formula", 0.09),
            choice(1e-2, "closed form", None),
            choice(0.01, "closed form", None),
        ],
    }
    return {
        "trade": {
            "tolerance": 0.01,
            "numbers": [
                {"name": "Re", "value": 27800.0, "formula": "u d/nu", "tells": "laminar or turbulent"},
                {
                    "name": "valve lag over valve-open time",
                    "value": None,
                    "formula": "lag over T",
                    "tells": "valve lag",
                },
            ],
            "quantities": [quantity, {**quantity, "quantity": "k", "rungs": []}],
        },
        "times": {"trade": {"rungs": {"wall_pressure": [{"name": "closed form", "seconds": 5.6e-4}]}}},
    }


def test_the_front_and_the_choices_are_reported(evidence: Record) -> None:
    found = SECTION.view(evidence)
    assert found is not None
    (quantity,) = found["quantities"]
    assert [row[0] for row in quantity["front"].rows] == ["formula", "closed form", "fine mesh"]
    assert quantity["front"].rows[1] == ("closed form", "0.16\u202f%", "300 µs", "560 µs")
    assert [row[1] for row in quantity["choices"].rows] == ["formula", "closed form"]
    assert quantity["own"]["reasons"][1].startswith("checked")
    assert "closed ring" in quantity["status"]
    assert found["numbers"].rows[1][1] == "–"


def test_the_figure_draws_every_model(evidence: Record) -> None:
    found = SECTION.view(evidence)
    assert found is not None
    figure = found["quantities"][0]["figure"]
    assert figure.name == "trade-wall-pressure"
    assert "4 models" in figure.alt


def test_without_a_trade_there_is_no_section() -> None:
    assert SECTION.view({"times": {}}) is None


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (0.01, "this scene's tolerance of 1.0 %"),
        (
            1e-10,
            "1.0 × 10⁻⁶, the nearest to this scene's tolerance of 1.0 × 10⁻¹⁰ that models are chosen for",
        ),
    ],
)
def test_a_tolerance_that_no_models_are_chosen_for_is_reported(
    evidence: Record, asked: float, told: str
) -> None:
    evidence["trade"]["tolerance"] = asked
    found = SECTION.view(evidence)
    assert found is not None
    assert found["tolerance"].replace("\u202f", " ").replace("\u2009", " ") == told
