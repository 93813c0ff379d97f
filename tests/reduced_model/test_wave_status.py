"""Waves too high for linear sloshing: every result over the range says so, and its interval holds them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ringbalance.physics.results import StatusCode
from ringbalance.physics.sloshing.response import sloshing_response
from ringbalance.reduced_model.calibration import Calibration, calibrate
from ringbalance.reduced_model.chamber.terms import _wave_mean, wave_height
from ringbalance.reduced_model.documents import calibration_document
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
    assert 1.0 < float(wave_height(scene, np.array(0.5))) / high < 2.0
    last = chamber.reported[-1]
    for curve in (chamber.moment, chamber.wall_pressure):
        assert high**2 / 4 < curve.uncertainty[last] / curve.value[last] < 1.0


def test_thin_rings_answer_in_higher_modes(table_1_scene: Scene) -> None:
    # Limits: the factor of three that the estimate claims; the lowest mode alone has 0.16 to 0.5 here.
    fills = np.array([0.02, 0.05, 0.1, 0.2, 0.3, 0.5])
    disc, speed = table_1_scene.disc, table_1_scene.rotor.speed
    found = sloshing_response(
        disc=disc, fill_ratio=fills, angular_velocity=speed, kinematic_viscosity=1e-6, gravity=9.80665
    )
    high = found.surface_amplitude.value / (disc.outer_radius - found.surface_radius)
    ratio = wave_height(table_1_scene, fills) / high
    assert np.all((ratio > 1 / 3) & (ratio < 3)), ratio
    assert np.all(ratio[:3] > 1), ratio


def test_a_fast_rotor_by_hand(table_1_calibration: Calibration) -> None:
    # a = 34.888 mm, alpha 0.70558, ln(R2/a) 0.24336, g/omega^2 8.943 um over a depth of 9.612 mm.  Shares of
    # modes 1 to 3 by quadrature: sin phi 0.5454 and -0.0495, cos phi 0.0976; s^2 1.1005, 3.538 and 6.180;
    # swings 10.95, 1.394 and 1.193: sqrt((5.972 + 0.059)^2 + 0.136^2) g/omega^2 = 0.5613 % of the depth, and
    # a little more by higher modes.
    assert table_1_calibration.chamber.moment.status.ok
    height = float(wave_height(table_1_calibration.scene, np.array(0.5)))
    assert height == pytest.approx(5.613e-3, rel=0.02)
    assert float(_wave_mean(table_1_calibration.scene, np.array(0.5))) == pytest.approx(height**2 / 4)


def test_the_bound_falls_with_the_fourth_power_of_the_speed(table_1_scene: Scene) -> None:
    one, two = (float(_wave_mean(at_speed(table_1_scene, rpm), np.array(0.4))) for rpm in (3000.0, 6000.0))
    assert one / two == pytest.approx(16.0)


def test_a_vertical_shaft_makes_no_waves(table_1_scene: Scene) -> None:
    upright = replace(table_1_scene, environment=replace(table_1_scene.environment, shaft="vertical"))
    assert _wave_mean(upright, np.array(0.4)) == 0.0
