"""Waves too high for linear sloshing: every result over the range says so, and its interval holds them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from ringbalance.physics.results import StatusCode
from ringbalance.physics.sloshing.response import sloshing_response
from ringbalance.reduced_model.calibration import Calibration, calibrate
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.selection.chamber_terms import wave_height, wave_mean
from ringbalance.scene.models import Scene


def at_speed(scene: Scene, rpm: float) -> Scene:
    return replace(scene, rotor=replace(scene.rotor, speed=rpm * math.pi / 30))


@pytest.fixture(scope="module")
def slow(table_1_scene: Scene) -> Calibration:
    return calibrate(at_speed(table_1_scene, 600.0))


def test_moment_pressure_and_lambda_inherit_the_status(slow: Calibration) -> None:
    chamber = slow.chamber
    for part in (chamber, chamber.moment, chamber.wall_pressure, chamber.moment_per_mass):
        assert part.status.code is StatusCode.OUT_OF_RANGE
    document = calibration_document(slow)
    assert document["lambda"]["status"] == "out_of_range"
    assert document["chamber"]["moment_status"] == "out_of_range"
    assert document["chamber"]["wall_pressure_status"] == "out_of_range"


def test_the_interval_holds_the_waves_of_finite_elements(slow: Calibration) -> None:
    # Waves of 1.06 of the depth at the largest fill: second order is about 1.06^2/4 = 28 %.
    scene, chamber = slow.scene, slow.chamber
    found = sloshing_response(
        disc=scene.disc,
        fill_ratio=[0.5],
        angular_velocity=scene.rotor.speed,
        kinematic_viscosity=1e-6,
        gravity=9.80665,
    )
    high = found.surface_amplitude.value[0] / (scene.disc.outer_radius - found.surface_radius[0])
    assert high == pytest.approx(1.06, abs=0.01)
    assert 1.0 < wave_height(scene, 0.5) / high < 2.0
    last = chamber.reported[-1]
    for curve in (chamber.moment, chamber.wall_pressure):
        assert high**2 / 4 < curve.uncertainty[last] / curve.value[last] < 1.0


def test_a_fast_rotor_by_hand(table_1_calibration: Calibration) -> None:
    # a = 34.888 mm: s^2 = 2 tanh(2 ln(44.5/34.888)) = 0.90315, swing 9.325; alpha 40.43 deg; g/omega^2
    # 8.943 um; waves 9.325 * 0.6486 * 8.943e-6/9.612e-3 = 5.627e-3 of the depth, (5.627e-3)^2/4 = 7.92e-6.
    assert table_1_calibration.chamber.moment.status.ok
    assert wave_mean(table_1_calibration.scene, 0.5) == pytest.approx(7.92e-6, rel=2e-3)


def test_the_bound_falls_with_the_fourth_power_of_the_speed(table_1_scene: Scene) -> None:
    one, two = (wave_mean(at_speed(table_1_scene, rpm), 0.4) for rpm in (3000.0, 6000.0))
    assert one / two == pytest.approx(16.0)


def test_a_vertical_shaft_makes_no_waves(table_1_scene: Scene) -> None:
    upright = replace(table_1_scene, environment=replace(table_1_scene.environment, shaft="vertical"))
    assert wave_mean(upright, 0.4) == 0.0
