"""Liquid in the tube, its moment by hand, and what an injection leaves in it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.pressure_profile import TubeLiquid
from ringbalance.reduced_model.tube.path import path_angle, path_radius
from ringbalance.scene.models import Scene
from scenes import with_tables

LINE = 1000.0 * math.pi / 4 * 1.5e-3**2
"""Mass per length of the full tube, kg/m."""


def string(crest: float, port: float) -> tuple[float, complex]:
    """Length and first moment of a taut string from port to opposite port about the crest's circle."""
    touch = math.acos(crest / port)
    leg = math.sqrt(port**2 - crest**2)
    ends = np.array([port, -port], dtype=complex)
    tangents = crest * np.exp(1j * np.array([touch, math.pi - touch]))
    arc = 2j * crest**2 * math.sin(math.pi / 2 - touch)
    return 2 * leg + crest * (math.pi - 2 * touch), complex(np.sum(leg * (ends + tangents) / 2) + arc)


def test_the_path_is_the_taut_string(table_1_scene: Scene) -> None:
    tube, share = table_1_scene.tube, np.linspace(0.0, 1.0, 20001)
    points = path_radius(tube=tube, share=share) * np.exp(1j * path_angle(tube=tube, share=share))
    length, moment = string(31.5e-3, 44.5e-3)
    assert points[[0, -1]] == pytest.approx([44.5e-3, -44.5e-3])
    assert np.sum(np.abs(np.diff(points))) == pytest.approx(length, rel=1e-6)
    # The tube is the string, stretched evenly.
    assert np.mean((points[1:] + points[:-1]) / 2) == pytest.approx(moment / length, rel=1e-6)


def test_a_full_tube_without_a_crest_is_an_arc_at_the_port_and_stays_full(table_1_scene: Scene) -> None:
    """2 rho S L r/pi for half a turn; nothing changes, and nothing falls back."""
    scene = with_tables(table_1_scene, tube={"hump_radius": None})
    found = calibrate(scene).tube_liquid
    assert found.before.state == found.after.state == "full"
    assert found.before.moment == pytest.approx(2j * LINE * 120e-3 * 44.5e-3 / math.pi, rel=1e-4)
    assert found.flowing_vibration == found.lasting_vibration == found.returned_volume == 0.0


def test_at_rest_each_leg_is_full_to_the_level(table_1_calibration: Calibration) -> None:
    """Gas over the crest: communicating vessels, so the legs end at the level of equal fills."""
    scene, found = table_1_calibration.scene, table_1_calibration.tube_liquid
    middle = np.argmin(np.abs(table_1_calibration.chamber.fill_ratio - 0.25))
    level = float(table_1_calibration.chamber.ring.surface_radius[middle])
    crest, port = 31.5e-3, 44.5e-3
    leg = (math.sqrt(port**2 - crest**2) - math.sqrt(level**2 - crest**2)) * 120e-3 / string(crest, port)[0]
    assert found.before.state == "legs"
    assert found.before.mass == pytest.approx(2 * LINE * leg, rel=2e-3)
    assert found.before.along == pytest.approx(0.0, abs=1e-12)
    assert scene.rotor.influence_coefficient * abs(found.after.moment - found.before.moment) == pytest.approx(
        found.lasting_vibration
    )


def test_vapour_holds_the_legs_above_the_level_and_the_rest_falls_back(
    table_1_calibration: Calibration,
) -> None:
    found, point = table_1_calibration.tube_liquid, table_1_calibration.answers
    assert found.after.state == "separated"
    assert found.before.mass < found.after.mass < found.flowing.mass < LINE * 120e-3
    # What flows over the crest on the near side, less what stays in the near leg.
    near = found.flowing.mass - found.after.mass / 2
    assert 0.5 * near < 1000.0 * found.returned_volume < near
    assert found.lasting_vibration <= found.limit
    assert point.velocity > 0


def test_a_slow_rotor_keeps_its_tube_full(table_1_scene: Scene) -> None:
    """At 3000 rpm the ambient pressure holds the column over the crest: half the string's moment is new."""
    rotor = dataclasses.replace(table_1_scene.rotor, speed=3000 * math.pi / 30)
    calibration = calibrate(dataclasses.replace(table_1_scene, rotor=rotor))
    found = TubeLiquid.of(calibration.scene, law=calibration.flow_law)
    assert found.after.state == "full"
    assert found.returned_volume == 0.0
    length, moment = string(31.5e-3, 44.5e-3)
    assert found.after.moment == pytest.approx(LINE * moment * 120e-3 / length, rel=1e-3)
    assert found.lasting_vibration > 10 * table_1_scene.rotor.influence_coefficient * abs(found.before.moment)
