"""Measurements by others: the files, and the statistics of a model over them."""

from __future__ import annotations

import math
import tempfile
import tomllib
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import doc_tables
import numpy as np
import pytest
from scipy.stats import binomtest

from ringbalance.identification.kinds import bench
from ringbalance.identification.kinds.bench import _tank_frequency, laminar_ratio
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.reading import KINDS, read_observations
from ringbalance.physics.sloshing import FREQUENCY_UNCERTAINTY
from ringbalance.physics.tube.loss import tube_loss
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import NORMAL_95
from ringbalance.verification.cases.measured import CALIBRATING
from ringbalance.verification.catalogue import case_code, load_case
from ringbalance.verification.navier_stokes.tube import (
    DuctMesh,
    friction_ratio,
    solve_section_without_inertia,
)
from ringbalance.verification.validation.comparison import (
    Predictions,
    compare,
    friction,
    measurements,
)

_DATA = files("ringbalance.verification.validation") / "data"
_NAMES = sorted(path.name.removesuffix(".csv") for path in _DATA.iterdir() if path.name.endswith(".csv"))


@pytest.mark.parametrize("name", _NAMES)
def test_a_data_set_says_where_it_comes_from_and_what_it_supports(name: str) -> None:
    data = measurements(name)
    assert len(data) > 5
    assert all(np.all(np.isfinite(column)) for column in data.columns.values())
    head = (_DATA / f"{name}.csv").read_text(encoding="utf-8").split("\n")
    stated = tomllib.loads("\n".join(line[2:] for line in head if line.startswith("# ")))
    assert 0 < stated["uncertainty"] < 0.2
    assert stated["read"] in ("tables", "transcription", "figure")
    assert {"licence", "conditions", "supports", "does_not_support"} <= set(stated)
    assert all(value for key, value in stated.items() if key != "doi")


def _synthetic(
    rng: np.random.Generator, *, bias: float, scatter: float, count: int = 4000
) -> dict[str, float]:
    true = rng.uniform(1, 10, count)
    series = np.repeat(np.array([f"rig {i}" for i in range(20)]), count // 20)
    measured = true * np.exp(0.01 * rng.standard_normal(count))
    predicted = true * (1 + bias) * np.exp(scatter * rng.standard_normal(count))
    return Predictions(
        predicted=predicted,
        measured=measured,
        series=series,
        stated=2 * np.hypot(scatter, bias) * predicted,
        uncertainty=np.full(count, 0.02),
        columns={},
    ).statistics


def test_bias_and_scatter_of_a_made_up_model_are_found() -> None:
    statistics = _synthetic(np.random.default_rng(1), bias=0.03, scatter=0.04)
    assert statistics["points"] == 4000
    assert statistics["series"] == 20
    assert abs(statistics["bias"] - 0.03) < statistics["bias_uncertainty"]
    assert statistics["standard_deviation"] == pytest.approx(0.04, rel=0.05)


def test_the_band_of_an_unbiased_model_holds_what_it_promises() -> None:
    statistics = _synthetic(np.random.default_rng(2), bias=0.0, scatter=0.03)
    inside = round(statistics["share_within"] * statistics["points"])
    assert binomtest(inside, statistics["points"], 0.954).pvalue > 1e-3
    assert statistics["width_needed"] == pytest.approx(1.96 / 2, rel=0.03)


def test_scatter_that_the_measurements_explain_is_not_the_models() -> None:
    statistics = _synthetic(np.random.default_rng(3), bias=0.0, scatter=0.0)
    assert statistics["standard_deviation"] < 0.003


def test_the_interval_of_the_bias_covers_when_rigs_differ() -> None:
    # Each rig is off by its own 2 %; points of a rig are no independent evidence.
    rng, covered = np.random.default_rng(4), 0
    series = np.repeat(np.array([f"rig {i}" for i in range(8)]), 50)
    for _ in range(400):
        measured = np.exp(np.repeat(0.02 * rng.standard_normal(8), 50) + 0.005 * rng.standard_normal(400))
        statistics = Predictions(
            predicted=np.ones(400),
            measured=measured,
            series=series,
            stated=np.full(400, 0.04),
            uncertainty=np.full(400, 0.01),
            columns={},
        ).statistics
        covered += abs(statistics["bias"]) <= statistics["bias_uncertainty"]
    assert binomtest(covered, 400, 0.95).pvalue > 1e-3


def test_points_come_in_ascending_order_with_their_walls() -> None:
    rough = measurements("nikuradse_1933")
    smooth = replace(rough, columns={**rough.columns, "relative_roughness": np.zeros(len(rough))})
    points, plain = friction(rough), friction(smooth)
    assert np.all(np.diff(points.columns["reynolds"]) >= 0)
    assert np.all(points.predicted > plain.predicted)
    both = friction(rough, measurements("mckeon_2004"))
    assert np.all(np.diff(both.columns["reynolds"]) >= 0)
    of_rough = np.isin(both.series, rough.series)
    assert np.array_equal(both.predicted[of_rough], points.predicted)
    assert set(both.columns) == {"friction_factor", "reynolds"}


def test_laminar_friction_of_ducts_against_finite_elements() -> None:
    for aspect in (1.0, 2.9, 8.0):
        system = DuctMesh(aspect_ratio=aspect).system()
        ratio = friction_ratio(solve_section_without_inertia(system=system, rotation_reynolds=0.0))
        assert float(laminar_ratio(np.array([aspect]))[0]) == pytest.approx(ratio, rel=1e-4)
    assert laminar_ratio(np.array([0.0, 1e4])) == pytest.approx([1.0, 1.5], rel=1e-3)


def test_the_budget_of_k_holds_bias_and_scatter_of_turbulent_friction(paper_scene: Scene) -> None:
    numbers = case_code("measured_smooth_tubes").compute(paper_scene, "light").numbers
    spread = math.hypot(numbers["turbulent_bias"], 2 * numbers["turbulent_standard_deviation"])
    tube, rotor = replace(paper_scene.tube, roughness=0.0), replace(paper_scene.rotor, speed=0.0)
    loss = tube_loss(replace(paper_scene, tube=tube, rotor=rotor), np.array([15.0]))
    assert loss.uncertainty_parts["friction correlation"] >= spread * loss.terms["friction"]
    assert loss.k.uncertainty >= loss.uncertainty_parts["friction correlation"]


def test_measured_friction_drifts_from_the_correlation_as_its_error_is_taken_to() -> None:
    """`with_errors` has a slope of U/1.96 per e-fold of Re: that of series of smooth tubes, turbulent and
    over at least a factor of two, is within a factor of two of it (root mean square)."""
    points = friction(*map(measurements, ("mckeon_2004", "stanton_pannell_1914", "senecal_1951")))
    points = points.where((points.columns["reynolds"] > 6000) & (points.columns["reynolds"] < 1e5))
    apart = points.measured / points.predicted - 1
    stated = points.stated / points.predicted / NORMAL_95
    slopes = []
    for series in np.unique(points.series):
        log_re = np.log(points.columns["reynolds"][mine := points.series == series])
        if np.count_nonzero(mine) >= 6 and np.ptp(log_re) > math.log(2):
            slopes.append(np.polyfit(log_re, apart[mine], 1)[0] / np.mean(stated[mine]))
    assert len(slopes) >= 6
    assert 0.5 < math.sqrt(np.mean(np.square(slopes))) < 2


_HEAD = '# kind = "friction"\n# source = "me"\n# uncertainty = 0.02\n'


def parsed(text: str) -> Observations:
    """A file of a user."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.csv"
        path.write_text(text, encoding="utf-8")
        return read_observations([path])[0]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('# kind = "rain"\n# source = "me"\n# uncertainty = 0.1\na\n1\n', "rain"),
        ('# kind = "flow"\n# source = "me"\n# uncertainty = 0.1\na\n1\n', "a scene predicts"),
        (_HEAD.replace("# uncertainty = 0.02\n", "") + "reynolds,friction_factor\n1,1\n", "uncertainty"),
        (_HEAD + "friction_factor\n0.02\n", "reynolds"),
        (_HEAD + "reynolds,friction_factor,colour\n1000,0.02,3\n", "colour"),
        (_HEAD + "reynolds,friction_factor\n1000,0\n", "friction_factor"),
        (_HEAD + "reynolds,friction_factor\n1e-320,0.02\n", "line 5"),
        (_HEAD + "reynolds,friction_factor,aspect_ratio\n1000,0.02,0.2\n", "aspect_ratio"),
        (
            _HEAD.replace("friction", "wave_frequency") + "depth_over_width,frequency_ratio\n1000,2\n",
            "depth_over_width",
        ),
    ],
)
def test_what_cannot_be_predicted_is_refused_by_name(text: str, named: str) -> None:
    with pytest.raises(SceneError, match=named):
        compare(parsed(text))


def test_a_comparison_is_confirmed_by_its_own_predictions_and_refuted_by_others() -> None:
    data = measurements("stanton_pannell_1914")
    points = compare(data)
    rows = "".join(f"{r},{f}\n" for r, f in zip(data.columns["reynolds"], points.predicted, strict=True))
    perfect = compare(parsed(_HEAD + "reynolds,friction_factor\n" + rows))
    assert perfect.statistics["bias"] == pytest.approx(0, abs=1e-12)
    assert (points.verdict, perfect.verdict) == ("confirmed", "confirmed")
    assert compare(data, mutation="ten_per_cent_high").verdict == "refuted"


def test_the_uncertainty_of_wave_frequencies_comes_from_tanks_that_are_not_judged() -> None:
    data = measurements("addington_1960")
    study = load_case("measured_waves").study
    assert study is not None
    taught = np.isin(data.series, study.settings["taught"])
    statistics = compare(data.where(taught)).statistics
    width = math.hypot(statistics["bias"], 2 * statistics["standard_deviation"])
    assert round(width, 2) == FREQUENCY_UNCERTAINTY


def test_the_bore_of_a_tube_comes_from_a_point_that_is_not_judged() -> None:
    data = measurements("eisenklam_1958")
    taught = compare(data.where(np.isin(data.series, CALIBRATING)))
    assert taught.predicted == pytest.approx(taught.measured, rel=1e-3)
    assert taught.measured.size == len(CALIBRATING)


def test_end_losses_that_are_left_out_are_noticed() -> None:
    data = measurements("eisenklam_1958")
    long = data.where(np.char.startswith(data.series, "tube"))
    reynolds, slenderness = bench.tube_numbers(long)
    friction = slenderness * 64 / reynolds
    points = compare(long)
    pairs = zip(slenderness, reynolds, strict=True)
    dynamic = points.predicted / (1 + np.array([bench.tube_loss(*pair, 100.0)[0] for pair in pairs]))
    assert np.max(np.abs(points.predicted / points.measured - 1)) < 0.04
    assert np.min(dynamic * (1 + friction) / points.measured) < 0.8


@pytest.mark.parametrize("depth", [0.06, 0.3, 1.5])
def test_a_chamber_of_large_radius_is_a_tank(depth: float) -> None:
    exact = math.sqrt(math.pi * math.tanh(math.pi * depth))
    assert _tank_frequency(depth) == pytest.approx(exact, rel=1e-4)


def test_adiabatic_venting_of_a_choked_vessel_is_the_closed_form() -> None:
    # p/p0 = (1 + (gamma - 1) t/(2 tau))^(-2 gamma/(gamma - 1)), isothermal exp(-t/tau).
    columns = (
        "time [s],pressure [bar],start_pressure [bar],far_pressure [bar],temperature [K],volume [l],"
        "conductance [l/(s*bar)]"
    )
    text = _HEAD.replace("friction", "vessel") + f"{columns}\n1,4,10,1,293.15,1,1\n"
    points = compare(parsed(text))
    adiabatic = 5 * (2.5 ** (1 / 7) - 1)
    assert points.predicted[0] == pytest.approx((adiabatic + math.log(2.5)) / 2, rel=1e-5)
    assert points.stated[0] ** 2 - (0.1 * points.predicted[0]) ** 2 == pytest.approx(
        ((math.log(2.5) - adiabatic) / 2) ** 2, rel=1e-3
    )


def test_every_bundled_set_of_a_kind_that_is_predicted_has_its_columns() -> None:
    for name in _NAMES:
        data = measurements(name)
        if KINDS[data.kind].stated:
            assert compare(data).predicted.size == len(data)


def test_the_page_on_measurements_lists_the_kinds_and_its_example_can_be_read() -> None:
    page = doc_tables.text_of("docs/measurements.md")
    assert doc_tables.fresh(page, doc_tables.PARTS["docs/measurements.md"]()) == page
    example = page.split("```text\n")[1].split("```")[0]
    assert len(compare(parsed(example)).measured) == 3
