"""Criticism, next measurement and saving of fits by the program's own laws."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_rigs import observations

from ringbalance.identification.criticism import Review
from ringbalance.identification.device import Models
from ringbalance.identification.fitting import FitResult, fit
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.next_measurement import (
    NextMeasurement,
    _offered_rows,
    _words_of,
    next_measurement,
)
from ringbalance.identification.reading import KINDS
from ringbalance.identification.saving import save_result
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from scenes import with_tables

ROWS = 24
SET = {
    "pressure": np.tile([0.6e6, 0.7e6, 0.9e6, 1.0e6], 6),
    "fill_ratio": np.tile([0.2, 0.25, 0.3], 8),
    "gas_time": np.random.default_rng(2).permutation(np.linspace(0.05, 0.3, ROWS)),
}


def transfers(
    true: Scene, models: Models, *, seed: int, known: bool = True, share: float = 0.01
) -> Observations:
    """Volumes moved, with a noise of one per cent."""
    plain = observations("transfer", SET | {"volume": np.ones(ROWS)}, ["A"] * ROWS)
    volume = KINDS["transfer"].predict(true, plain, models)
    sigma = share * volume
    noisy = volume + sigma * np.random.default_rng(seed).standard_normal(ROWS)
    return replace(
        plain,
        columns=SET | {"volume": noisy},
        uncertainty={"volume": 1.96 * sigma} if known else {},
    )


@pytest.fixture(scope="module")
def true(paper_scene: Scene) -> Scene:
    """A disc whose tube is a little narrower than its drawing."""
    return with_tables(paper_scene, tube={"bore": 1.47e-3})


@pytest.fixture(scope="module")
def found(paper_scene: Scene, true: Scene) -> FitResult:
    data = transfers(true, Models.of(paper_scene), seed=0)
    return fit(paper_scene, data=[data], parameters=["bore", "extra_loss"])


def test_a_right_law_is_not_criticised(found: FitResult) -> None:
    told = Review.of(found)
    assert told.criticism.describes
    assert {f.test for f in told.criticism.findings} == {"size", "runs"}


def test_data_of_another_law_are_not_described(paper_scene: Scene, true: Scene) -> None:
    """A disc whose flow is laminar, fitted as the turbulent one of the scene, with the noise stated."""
    thick = with_tables(true, liquid={"kinematic_viscosity": 50 * true.liquid.kinematic_viscosity})
    data = transfers(thick, Models.of(thick), seed=1)
    told = Review.of(fit(paper_scene, data=[data], parameters=["bore", "extra_loss"]))
    assert not told.describes
    assert "times as large as the stated noise" in told.text


@pytest.fixture(scope="module")
def four(paper_scene: Scene, true: Scene) -> tuple[Observations, FitResult, NextMeasurement]:
    """Four measurements, the bore fitted to them, and what a further one is expected to give."""
    data = transfers(true, Models.of(paper_scene), seed=0, share=0.02).where(np.array([0, 6, 13, 19]))
    first = fit(paper_scene, data=[data], parameters=["bore"])
    return data, first, next_measurement(first, "bore")


@pytest.mark.parametrize("row", [0, 13, 26])
def test_the_expected_gain_is_that_of_fits_made_again(
    paper_scene: Scene, four: tuple[Observations, FitResult, NextMeasurement], row: int
) -> None:
    """Interval of the bore with a candidate among four measurements, against the one expected without it.

    Noise is given, so that an interval depends on the draw through curvature alone: within 5 %.
    """
    data, first, told = four
    best = first.optimum
    offered = _offered_rows(best.residuals.problem.scene_at(best.t), "transfer", data)
    chosen = next(g for g in told.gains if g.candidate == _words_of(offered, row))
    volume = KINDS["transfer"].predict(first.scene, offered, Models.of(paper_scene))
    more = replace(offered.with_columns(volume=volume).where(np.array([row])), file="more.csv")
    again = fit(paper_scene, data=[data, more], parameters=["bore"])
    widths = [r.parameters[0].profile.high - r.parameters[0].profile.low for r in (first, again)]
    assert widths[1] / widths[0] == pytest.approx(chosen.ratio, rel=0.05)


def test_weak_parameters_are_asked_for_first(found: FitResult) -> None:
    told = next_measurement(found)
    widths = {p.name: p.profile.high - p.profile.low for p in found.parameters}
    assert told.parameter in widths
    assert told.gains[0].after <= told.gains[-1].after
    assert "of its width" in told.text or "no single measurement" in told.text


def test_the_saved_scene_is_the_fitted_one(found: FitResult, tmp_path: Path) -> None:
    target = tmp_path / "fitted.toml"
    data = [b.observations for b in found.optimum.residuals.problem.blocks]
    paper = load_scene(bundled_scene("liquid_ring_paper"))
    save_result(target, scene=paper, result=found, data=data, said=Review.of(found).text)
    scene = liquid_ring_scene(load_scene(target))
    assert scene.tube.bore == pytest.approx(found.parameter("bore").value, rel=1e-8)
    widths = {each.quantity: each.half_width for each in scene.uncertainty}
    low, high = found.parameter("bore").interval
    value = found.parameter("bore").value
    assert widths["bore"] == pytest.approx(max(high - value, value - low), rel=1e-6)
    assert scene.measured.files[0].kind == "transfer"
    said = {each.about for each in scene.measured.findings}
    assert said >= {"residuals", "correlation"}
    # The fitted scene is a scene to fit again: nothing moves by more than a tenth of its interval.
    again = fit(scene, data=data, parameters=["bore", "extra_loss"])
    assert abs(again.parameter("bore").value - value) < 0.5 * (high - low)
