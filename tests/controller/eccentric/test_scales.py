"""Filters on machines of any size, and what an interval of the imbalance holds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from eccentric_runs import bundled, normalised, true_imbalance
from scipy.stats import binom, chi2

from ringbalance.controller.eccentric_mass.devices import device
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.scene.origins import value_at
from ringbalance.verification.papers import RPM, at_constant_speed, changed


def shrunk(size: float) -> EccentricScene:
    """The washing machine with all lengths that are seen or walked `size` times as long."""
    wash = at_constant_speed(bundled("washing_machine"), time_limit=1.2)
    radius = size * wash.masses.guide_radius
    wash = changed(wash, {"masses.guide_radius": radius, "masses.friction_arm": (0.1 * radius, 0.1 * radius)})
    wash = changed(wash, {"imbalance.radius": size * wash.imbalance.radius})
    noise = ("sensor.position_noise", "sensor.velocity_noise")
    return changed(wash, {path: size * value_at(wash, path) for path in noise})


@pytest.mark.parametrize("size", [1e-3, 1.0, 30.0])
def test_errors_are_those_claimed_at_any_size(size: float) -> None:
    """The sum over eight seeds is chi-square with 16 degrees of freedom; one in a million fails."""
    low, high = chi2.ppf([5e-7, 1 - 5e-7], 16)
    assert low < sum(normalised(shrunk(size), seed) for seed in range(8)) < high


def test_an_estimation_takes_no_longer_than_its_information() -> None:
    """Ten nanometres of noise on ten micrometres of vibration: 0.2 % after a few samples."""
    run = simulate_eccentric(changed(bundled("driven_masses_small"), {"run.time_limit": 1.0}))
    first = run.stages[0]
    assert first.name == "imbalance estimation"
    assert first.end < 0.02


def ellipse(scene: EccentricScene, number: int) -> tuple[float, float]:
    """Squared error of a drawn plant's imbalance over the stated covariance, with the rotor and without."""
    plant = device(changed(scene, {"requirement.phase_range": 0.0}), number).scene
    run = simulate_eccentric(plant, seed=number, settings=StrategySettings.of(scene))
    estimates = simulate_eccentric(scene).to_dict()["estimates"]
    noise = np.asarray(estimates["imbalance_covariance"][-1])
    error = run.history["imbalance"][-1] - true_imbalance(plant)
    # The scene's own imbalance is drawn as well; what is not known of the rotor is a share of it.
    share = PlantParameters.of(plant).unbalance / PlantParameters.of(scene).unbalance
    covariance = noise + share**2 * np.asarray(estimates["imbalance_rotor_covariance"])
    return float(error @ np.linalg.solve(covariance, error)), float(error @ np.linalg.solve(noise, error))


def estimating(name: str) -> EccentricScene:
    return at_constant_speed(bundled(name), time_limit=1.5)


@pytest.mark.parametrize("name", ["washing_machine", "eccentric_mass_paper"])
def test_the_imbalances_interval_holds_what_is_not_known_of_the_rotor(name: str) -> None:
    """Stated for 95 %; the ellipses of the noise alone hold next to none."""
    errors = [ellipse(estimating(name), number) for number in range(6)]
    bound = chi2.ppf(0.95, 2)
    assert sum(both < bound for both, _ in errors) >= 4
    assert sum(noise < bound for _, noise in errors) <= 2


@pytest.mark.heavy
@pytest.mark.parametrize("name", ["washing_machine", "eccentric_mass_paper"])
def test_95_per_cent_of_built_machines_lie_in_the_ellipse(name: str) -> None:
    count, bound = 40, chi2.ppf(0.95, 2)
    held = sum(ellipse(estimating(name), number)[0] < bound for number in range(count))
    assert held >= binom.ppf(0.01, count, 0.95)


def test_half_widths_are_in_the_document() -> None:
    scene = estimating("washing_machine")
    estimates = simulate_eccentric(scene).to_dict()["estimates"]
    covariance = np.asarray(estimates["imbalance_covariance"][-1]) + np.asarray(
        estimates["imbalance_rotor_covariance"]
    )
    np.testing.assert_allclose(
        estimates["imbalance_half_width_kg_m"], 1.96 * np.sqrt(np.diag(covariance)), rtol=1e-4
    )
    # Stiffness known to 3 %, mass to 2 %, damping to 20 %: one to six per cent of the imbalance.
    size = PlantParameters.of(scene).unbalance
    assert 0.01 * size < np.max(estimates["imbalance_half_width_kg_m"]) < 0.06 * size
    certain = simulate_eccentric(replace(scene, uncertainty=())).to_dict()["estimates"]
    assert np.all(np.asarray(certain["imbalance_rotor_covariance"]) == 0)


@pytest.mark.parametrize("weight", [1e5, 1e6, 1e7])
def test_a_held_regulator_is_stable_for_a_step_that_goes_with_its_fastest_pole(weight: float) -> None:
    """At high weights k_d is sqrt(0.1) k_p; J/k_d is the fastest time constant, and with a margin of two the
    longest hold."""
    scene = changed(bundled("eccentric_mass_paper"), {"lqr.state_weight": weight})
    regulator, plant = RecommendedGains.of(scene).regulator, PlantParameters.of(scene)
    inertia = plant.inertia + plant.drive_inertia - 2 * plant.moment**2 / plant.mass
    assert not regulator.stable
    assert regulator.recommended_step == pytest.approx(inertia / math.sqrt(0.1 * weight), rel=0.2)


@pytest.mark.parametrize("gain", [200.0, 2e4, 5e5])
def test_the_longest_hold_is_that_of_the_fastest_pole(gain: float) -> None:
    """The rate's pole, with B_add gamma in place of C_add, is -(C_add + B_add gamma)/J: twice the gain is
    stable for holds up to 2/|pole|, less what the rotor gives way."""
    scene = changed(
        bundled("eccentric_mass_paper"),
        {"friction_filter.speed_gain": gain, "friction_filter.pair_gain": 0.0},
    )
    speed, plant = RecommendedGains.of(scene).speed, PlantParameters.of(scene)
    inertia = plant.inertia + plant.drive_inertia
    pole = (plant.drive_damping + 2 * plant.drive_gain * gain) / inertia
    assert not speed.stable
    assert speed.recommended_step == pytest.approx(2 / pole, rel=0.05)


def test_a_coarse_euler_transition_is_named_before_the_stiffness() -> None:
    paper = at_constant_speed(bundled("eccentric_mass_paper"), time_limit=4.0, speed=220 * RPM)
    coarse = changed(paper, {"imbalance_filter.discretisation": "euler"})
    run = simulate_eccentric(coarse)
    assert run.innovation is not None
    assert run.innovation > 1.5
    codes = {each.code for each in run.warned}
    assert "euler_too_coarse" in codes
    assert "innovations_unlike_model" not in codes
