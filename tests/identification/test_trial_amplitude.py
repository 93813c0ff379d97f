"""Trial weights without phases: made-up rotors, and the rotor of Rodrigues et al. with known washers.

The published numbers are amplitudes of Fig. 12 in J. Sound Vib. 330 (2011) 385, with 0 to 4 washers of
12.4 +- 0.5 g mm each at one angle, over speeds from 4000 to 5000 rpm above the resonances.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_rigs import observations

from ringbalance.identification.criticism import Review
from ringbalance.identification.fitting import FitResult, fit
from ringbalance.identification.identifiability import Identified
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.next_measurement import next_measurement
from ringbalance.identification.reading import KINDS
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.validation.comparison import measurements

WASHER, WASHER_95 = 12.4e-6, 0.5e-6
"""kg m; the second one is the expanded uncertainty (95 %) of each washer."""
PER_G_MM = 1e-6 / 1e-6
"""m/(kg m) of 1 um/(g mm)."""


def observed(
    unbalance: FloatArray, angle: FloatArray, amplitude: FloatArray, width: FloatArray | None
) -> Observations:
    columns = {"unbalance": unbalance, "angle": angle, "amplitude": amplitude}
    widths = {} if width is None else {"amplitude": width}
    return observations("trial_amplitude", columns, widths=widths)


def rotor(scene: Scene, *, coefficient: float = 1.0, amplitude: float = 8e-6, phase: float = 0.7) -> Scene:
    """A rotor whose lag and stated uncertainties play no part."""
    changed = replace(
        scene.rotor,
        influence_coefficient=coefficient,
        lag_angle=0.0,
        initial_amplitude=amplitude,
        initial_phase=phase,
    )
    return replace(scene, rotor=changed, uncertainty=())


def test_amplitudes_alone_give_the_coefficient(paper_scene: Scene) -> None:
    """Four positions of a weight and the run without it: the balancing method without a phase meter."""
    true = rotor(paper_scene, coefficient=1.3, amplitude=9e-6, phase=-2.0)
    unbalance = np.append(0.0, np.full(8, 6e-6))
    angle = np.append(0.0, np.tile(np.radians([0.0, 90.0, 180.0, 270.0]), 2))
    exact = KINDS["trial_amplitude"].predict(true, observed(unbalance, angle, unbalance, None), None)
    noisy = exact + 0.05e-6 * np.random.default_rng(1).standard_normal(9)
    result = fit(rotor(paper_scene), data=[observed(unbalance, angle, noisy, None)])
    low, high = result.parameter("influence_coefficient").interval
    assert low < 1.3 < high
    assert (high - low) / 1.3 < 0.05
    low, high = result.parameter("initial_amplitude").interval
    assert low < 9e-6 < high
    low, high = np.unwrap([-2.0, *result.parameter("initial_phase").interval])[1:]
    assert low < -2.0 < high


def test_phase_and_lag_are_not_identified_by_themselves(paper_scene: Scene) -> None:
    unbalance, angle = np.repeat([0.0, 6e-6], [1, 4]), np.radians([0.0, 0.0, 90.0, 180.0, 270.0])
    scene = rotor(paper_scene)
    exact = KINDS["trial_amplitude"].predict(scene, observed(unbalance, angle, unbalance, None), None)
    data = observed(unbalance, angle, exact, np.full(5, 0.1e-6))
    result = fit(scene, data=[data], parameters=["lag_angle", "initial_phase"])
    assert {each.verdict for each in result.parameters} == {Identified.STRUCTURALLY}


def washers() -> Observations:
    """Mean amplitude over the speeds for each number of washers.

    Uncertainty: that of the washers, and the scatter over the speeds, a change of K that no mean removes.
    """
    run, counts = measurements("rodrigues_2011"), np.arange(5)
    series = [
        run.columns["amplitude"][(run.series == "plain") & (run.columns["washers"] == n)] for n in counts
    ]
    mean = np.array([float(np.mean(each)) for each in series])
    scatter = np.array([1.96 * float(np.std(each, ddof=1)) for each in series])
    slope = (mean[-1] - mean[0]) / (4 * WASHER)
    width = np.hypot(scatter, slope * WASHER_95 * np.sqrt(counts))
    return observed(np.asarray(WASHER * counts, dtype=np.float64), np.zeros(5), mean, width)


@pytest.fixture(scope="module")
def by_vectors(paper_scene: Scene) -> FitResult:
    """The washers fitted with the rotor's own unbalance at any angle."""
    return fit(rotor(paper_scene), data=[washers()])


@pytest.fixture(scope="module")
def in_line(paper_scene: Scene) -> FitResult:
    """The washers fitted as if the rotor's own unbalance stood at their angle, so that amplitudes add."""
    aligned = rotor(paper_scene, phase=0.0)
    return fit(aligned, data=[washers()], parameters=["influence_coefficient", "initial_amplitude"])


def test_the_rotor_of_rodrigues_has_one_coefficient(by_vectors: FitResult, in_line: FitResult) -> None:
    """1.02 +- 0.05 um per g mm, stated beforehand for amplitudes in line; both fits must agree with it.

    Agreement: the difference is within the root of the sum of the squares of both half-widths.
    """
    for result in (by_vectors, in_line):
        found = result.parameter("influence_coefficient")
        half = (found.interval[1] - found.interval[0]) / 2
        assert abs(found.value / PER_G_MM - 1.02) < np.hypot(half / PER_G_MM, 0.05)
        assert half / PER_G_MM < 0.12
        assert found.verdict is Identified.IDENTIFIED


def test_the_page_has_what_the_fits_find(by_vectors: FitResult, in_line: FitResult) -> None:
    text = (Path(__file__).resolve().parents[2] / "docs" / "fit.md").read_text(encoding="utf-8")
    free, aligned = (each.parameter("influence_coefficient") for each in (by_vectors, in_line))
    low, high = (end / PER_G_MM for end in free.interval)
    assert f"{free.value / PER_G_MM:.2f} ({low:.2f} to {high:.2f}) µm per" in text
    half = (aligned.interval[1] - aligned.interval[0]) / 2 / PER_G_MM
    assert f"{aligned.value / PER_G_MM:.3f} ± {half:.3f} where" in text


def test_a_washer_elsewhere_would_tell_most_of_the_phase(by_vectors: FitResult) -> None:
    """All washers stood at one angle: one elsewhere tells the angle to the own unbalance."""
    told = next_measurement(by_vectors, "initial_phase")
    best = next(g for g in told.gains if g.candidate.startswith("trial amplitude"))
    assert "angle 0 deg" not in best.candidate
    assert best.ratio < 0.5


def test_its_vibration_is_linear_in_the_unbalance(paper_scene: Scene, by_vectors: FitResult) -> None:
    """No pattern beyond the stated uncertainties; a vibration that grew with the square would be told."""
    assert Review.of(by_vectors).criticism.describes
    linear = washers()
    grown = np.array(linear.columns["amplitude"]) * np.array([1.0, 1.0, 1.0, 1.25, 1.6])
    bent = replace(linear, columns=dict(linear.columns) | {"amplitude": grown})
    assert not Review.of(fit(rotor(paper_scene), data=[bent])).criticism.describes


def test_amplitudes_contain_a_runout_whose_phase_must_be_known(paper_scene: Scene) -> None:
    """V0 + R in the place of V0; the rotor's own vibration follows only where the scene states both of R."""
    kind, data = (
        KINDS["trial_amplitude"],
        observed(np.array([0.0, 6e-6]), np.zeros(2), np.array([9e-6, 9e-6]), None),
    )
    scene = rotor(paper_scene, amplitude=9e-6, phase=0.5)
    sensor = replace(scene.sensor, runout_amplitude=1e-6, runout_phase=1.2)
    known = replace(scene, sensor=sensor)
    start = 9e-6 * np.exp(0.5j) + 1e-6 * np.exp(1.2j)
    expected = np.abs(start + scene.rotor.influence * np.array([0.0, 6e-6]))
    assert kind.predict(known, data, None) == pytest.approx(expected, rel=1e-12)
    assert kind.obstacle(known, data) == kind.obstacle(scene, data) == ""
    unknown = replace(scene, sensor=replace(sensor, runout_phase=None))
    assert "sensor.runout" in kind.obstacle(unknown, data)
