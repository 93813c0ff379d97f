"""What a person sees: status, summary, a line of bars, the injections."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from ringbalance.controller.document import _sparkline
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene


def printed(scene: Scene, model: BalancerModel) -> str:
    stream = io.StringIO()
    Console(file=stream, width=110).print(simulate(scene, model).rows().view())
    return stream.getvalue()


def test_a_run_without_injections_and_one_with_too_many(scene: Scene, model: BalancerModel) -> None:
    quiet = replace(scene, rotor=replace(scene.rotor, initial_amplitude=0.0))
    assert "Injections" not in printed(quiet, model)
    trial = replace(scene, controller=replace(scene.controller, kind="trial"))
    assert "more: see --json" in printed(trial, model)


@pytest.mark.parametrize(
    ("values", "bars"),
    [([1.0, 1e-3, 1e-9], "█▁▁"), ([0.0, 0.0], "▁▁"), ([1.0, 10**-1.5], "█▄"), ([], "")],
)
def test_bars_are_logarithmic_over_three_decades(values: list[float], bars: str) -> None:
    found = _sparkline(np.array(values))
    assert found == bars or (bars == "█▄" and found in {"█▄", "█▅"})
