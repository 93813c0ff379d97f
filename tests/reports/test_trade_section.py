"""The report's section on speed against accuracy, from a small document."""

from __future__ import annotations

from typing import Any

from ringbalance.reports.pages.cases import TRADE


def test_models_are_listed_with_error_and_speed() -> None:
    models = [("formula", 0.09, 2e4), ("closed form", 1.6e-3, 3e3), ("fine mesh", 0.0, 1.25)]
    quantity: dict[str, Any] = {
        "quantity": "wall_pressure",
        "title": "wall pressure",
        "status": {"code": "out_of_range", "text": "gravity leaves a closed ring above 0.3 only"},
        "uncertainty": 7.8e-5,
        "models": [{"model": name, "error": error} for name, error, _ in models],
    }
    terms = [
        {"term": "valve lag", "group": "t/T", "estimated_contribution": None},
        {"term": "tube inertia", "group": "2 L/((k + 1) u T)", "estimated_contribution": 0.51},
    ]
    evidence = {
        "trade": {"terms": terms, "quantities": [quantity, {**quantity, "models": []}]},
        "times": {
            "trade": {"wall_pressure": [{"model": n, "designs_per_second": rate} for n, _, rate in models]}
        },
    }
    view = TRADE.view(evidence)
    assert view is not None
    (shown,) = view["quantities"]
    assert [row[0] for row in shown["models"].rows] == ["formula", "closed form", "fine mesh"]
    assert shown["models"].rows[1][1] == "0.16\u202f%"
    assert shown["models"].rows[2][1] == "–"
    assert "closed ring" in shown["status"]
    assert view["terms"].rows[0][2] == "–"


def test_without_a_trade_there_is_no_section() -> None:
    assert TRADE.view({"times": {}}) is None
