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
from scenes import with_tables


def printed(scene: Scene, model: BalancerModel) -> str:
    stream = io.StringIO()
    Console(file=stream, width=110).print(simulate(scene, model).rows().view())
    return stream.getvalue()


def test_a_run_without_injections_and_one_with_too_many(scene: Scene, model: BalancerModel) -> None:
    quiet = with_tables(scene, rotor={"initial_amplitude": 0.0})
    assert "Injections" not in printed(quiet, model)
    trial = with_tables(scene, controller={"kind": "trial"})
    assert "more: see --json" in printed(trial, model)


@pytest.mark.parametrize(
    ("values", "bars"),
    [([1.0, 1e-3, 1e-9], "█▁▁"), ([0.0, 0.0], "▁▁"), ([1.0, 10**-1.5], "█▄"), ([], "")],
)
def test_bars_are_logarithmic_over_three_decades(values: list[float], bars: str) -> None:
    result = _sparkline(np.array(values))
    assert result == bars or (bars == "█▄" and result in {"█▄", "█▅"})


def test_what_the_scene_requires_and_a_settled_run_does_not_show(scene: Scene, model: BalancerModel) -> None:
    run = simulate(scene, model)
    assert run.settling_time is not None
    strict = replace(
        scene.requirement, residual=scene.controller.limit / 2, settling_time=run.settling_time / 2
    )
    rows = simulate(replace(scene, requirement=strict), model).rows()
    late, loose = rows.findings[1:3]
    assert (late.code, late.values["required"]) == ("settled_too_late", run.settling_time / 2)
    assert (loose.code, loose.values["allowed"]) == ("limit_above_requirement", strict.residual)
    assert late.text in list(rows.lines())
    kept = replace(strict, residual=scene.controller.limit, settling_time=run.settling_time)
    assert len(simulate(replace(scene, requirement=kept), model).findings) == len(run.findings)
