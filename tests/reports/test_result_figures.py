"""Results draw themselves in the report's style, and give their quantities to pandas and xarray."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from short_answers import answer, short

from ringbalance.reports.figure import LIGHT
from ringbalance.results.result import Result, Rows
from ringbalance.results.rows import Quantity
from ringbalance.scene import registry
from ringbalance.verification.trade import TradeStudy


def trade_study() -> TradeStudy:
    models = [{"model": name, "error": error} for name, error in (("formula", 0.09), ("finest", 0.0))]
    quantity = {"quantity": "velocity", "title": "velocity", "uncertainty": 1e-3, "models": models}
    rates = [{"model": each["model"], "designs_per_second": 10.0, "seconds": 0.1} for each in models]
    return TradeStudy(scene=short(), quantities=(quantity,), times={"velocity": rates})


FIGURES = {
    "calibration": {"tornado", "moment", "lambda", "drag"},
    "run": {"run-amplitude", "run-valve-open", "fill-ratios", "residual-polar"},
    "eccentric run": {"eccentric-amplitude", "eccentric-angles", "eccentric-imbalance", "eccentric-friction"},
    "tuning": {"settling"},
    "fit": {"fit-trial-weight-0"},
    "comparison": {"settling"},
    "trade": {"trade-velocity"},
}


@pytest.mark.parametrize("name", FIGURES)
def test_a_result_draws_itself(name: str, tmp_path: Path) -> None:
    result = trade_study() if name == "trade" else answer(name)
    figures = result.plot(tmp_path / "result.svg")
    assert {drawing.name for drawing in figures.drawings} == FIGURES[name]
    text = (tmp_path / "result.svg").read_text(encoding="utf-8")
    assert text == figures.svg() == figures._repr_svg_()
    assert ElementTree.fromstring(text).tag.endswith("svg")
    assert LIGHT["--fig-ink"] in text


class Answer(Result):
    """A mass of 2 kg, at most 3, and a time that is not known."""

    def to_dict(self) -> dict[str, Any]:
        return {}

    def rows(self) -> Rows:
        mass = Quantity(key="mass", name="mass of the disc", value=2.0, unit="kg", upper=3.0)
        time = Quantity(key="time", name="time", value=None, unit="s")
        return Rows(title="An answer", quantities=(mass, time))


def test_what_has_no_figure_says_so() -> None:
    with pytest.raises(TypeError, match="Answer there is no figure"):
        Answer().plot()


def test_quantities_become_a_frame_and_a_dataset(monkeypatch: pytest.MonkeyPatch) -> None:
    packages = {
        "pandas_frame": lambda columns, index: (columns, index),
        "xarray_array": lambda value, attrs: (value, attrs),
        "xarray_dataset": lambda variables, attrs: (variables, attrs),
    }
    monkeypatch.setattr("ringbalance.results.result.registered", lambda _, name: packages[name])
    columns, index = Answer().to_pandas()
    assert index == ["mass", "time"]
    assert (columns["value"], columns["unit"], columns["upper"]) == ([2.0, None], ["kg", "s"], [3.0, None])
    variables, attributes = Answer().to_xarray()
    assert variables["mass"] == (2.0, {"long_name": "mass of the disc", "units": "kg", "upper": 3.0})
    assert math.isnan(variables["time"][0])
    assert attributes == {"title": "An answer"}


def test_without_the_package_its_name_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry._PATHS, ("function", "pandas_frame"), "no_such_package_here:DataFrame")
    with pytest.raises(ModuleNotFoundError, match="needs the package pandas"):
        Answer().to_pandas()
