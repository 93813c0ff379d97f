"""Measurements by others: the files, and the statistics of a model over them."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from ringbalance.scene.models import Scene
from ringbalance.verification.catalogue import case_code
from ringbalance.verification.validation.measurements import measurements
from ringbalance.verification.validation.model_bias import ModelStatistics, model_statistics
from ringbalance.verification.validation.tube_friction import friction_points

_DATA = files("ringbalance.verification.validation") / "data"
_NAMES = sorted(path.name.removesuffix(".csv") for path in _DATA.iterdir() if path.name.endswith(".csv"))


@pytest.mark.parametrize("name", _NAMES)
def test_a_data_set_says_where_it_comes_from_and_what_it_supports(name: str) -> None:
    data = measurements(name)
    assert len(data) > 5
    assert 0 < data.source.uncertainty < 0.2
    assert all(np.all(np.isfinite(column)) for column in data.columns.values())
    head = (_DATA / f"{name}.csv").read_text(encoding="utf-8").split("\n")
    stated = tomllib.loads("\n".join(line[2:] for line in head if line.startswith("# ")))
    assert all(value for key, value in stated.items() if key != "doi")


def _synthetic(
    rng: np.random.Generator, *, bias: float, scatter: float, count: int = 4000
) -> ModelStatistics:
    true = rng.uniform(1, 10, count)
    series = np.repeat(np.array([f"rig {i}" for i in range(20)]), count // 20)
    measured = true * np.exp(0.01 * rng.standard_normal(count))
    predicted = true * (1 + bias) * np.exp(scatter * rng.standard_normal(count))
    return model_statistics(
        predicted=predicted,
        measured=measured,
        series=series,
        stated=2 * np.hypot(scatter, bias) * predicted,
        measurement_uncertainty=np.full(count, 0.02),
    )


def test_bias_and_scatter_of_a_made_up_model_are_found() -> None:
    found = _synthetic(np.random.default_rng(1), bias=0.03, scatter=0.04)
    assert found.points == 4000
    assert found.series == 20
    assert abs(found.bias - 0.03) < found.bias_uncertainty
    assert found.standard_deviation == pytest.approx(0.04, rel=0.05)


def test_the_band_of_an_unbiased_model_holds_what_it_promises() -> None:
    found = _synthetic(np.random.default_rng(2), bias=0.0, scatter=0.03)
    inside = round(found.share_within * found.points)
    assert binomtest(inside, found.points, 0.954).pvalue > 1e-3


def test_scatter_that_the_measurements_explain_is_not_the_models() -> None:
    found = _synthetic(np.random.default_rng(3), bias=0.0, scatter=0.0)
    assert found.standard_deviation < 0.003


def test_the_interval_of_the_bias_covers_when_rigs_differ() -> None:
    # Each rig is off by its own 2 %; points of a rig are no independent evidence.
    rng, covered = np.random.default_rng(4), 0
    series = np.repeat(np.array([f"rig {i}" for i in range(8)]), 50)
    for _ in range(400):
        measured = np.exp(np.repeat(0.02 * rng.standard_normal(8), 50) + 0.005 * rng.standard_normal(400))
        found = model_statistics(
            predicted=np.ones(400),
            measured=measured,
            series=series,
            stated=np.full(400, 0.04),
            measurement_uncertainty=np.full(400, 0.01),
        )
        covered += abs(found.bias) <= found.bias_uncertainty
    assert binomtest(covered, 400, 0.95).pvalue > 1e-3


def test_points_come_in_ascending_order_with_their_walls() -> None:
    points = friction_points("nikuradse_1933", "mckeon_2004")
    assert np.all(np.diff(points.reynolds) >= 0)
    smooth = points.relative_roughness == 0
    assert smooth.sum() == len(measurements("mckeon_2004"))
    rough = points.predicted()
    plain = replace(points, relative_roughness=np.zeros_like(points.reynolds)).predicted()
    assert np.array_equal(rough[smooth], plain[smooth])
    assert np.all(rough[~smooth] > plain[~smooth])


def test_the_readme_says_what_the_comparison_finds(paper_scene: Scene) -> None:
    readme = " ".join((Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8").split())
    smooth, rough, ducts, rotor = (
        case_code(f"measured_{name}").compute(paper_scene, "light")
        for name in ("smooth_tubes", "rough_tubes", "ducts", "rotor")
    )
    numbers, share = smooth.numbers, smooth.found["share_within"].value
    assert (
        f"({numbers['points']:.0f} points of {numbers['series']:.0f} tubes and rigs, "
        f"bias {numbers['turbulent_bias']:.1%}, {share:.1%} within both intervals)"
    ).replace("%", " %") in readme
    for one in (rough, ducts):
        share = one.found["share_within"].value
        assert f"({one.numbers['points']:.0f} points, {share:.1%} within)".replace("%", " %") in readme
    assert f"({rotor.numbers['points']:.0f} points)" in readme
