"""Second-order gravity effects against finite elements with a found free surface, and the lowest speed."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from ringbalance.physics.pressure.ring import ring_quantities
from ringbalance.reduced_model.chamber.gravity import check_ring, closed_ring, gravity_effect, gravity_ratio
from ringbalance.reduced_model.chamber.gravity_open import open_ring_effect
from ringbalance.scene import SceneError
from ringbalance.scene.models import Scene, Shaft


@pytest.mark.parametrize("shaft", ["horizontal", "vertical"])
def test_second_order_effect_agrees_with_finite_elements(table_1_scene: Scene, shaft: Shaft) -> None:
    disc, x = table_1_scene.disc, np.array([0.25, 0.5])
    common: dict[str, Any] = {"disc": disc, "density": 1000.0, "angular_velocity": 100.0, "fill_ratio": x}
    plain = ring_quantities(**common)
    heavy = ring_quantities(**common, gravity=9.80665, shaft=shaft)
    effect = gravity_effect(**common, gravity=9.80665, vertical=shaft == "vertical")
    # Plates are taken as radial in the estimate: it is good to a quarter, which its safety factor covers.
    for found, estimate in (
        (heavy.wall_pressure.value - plain.wall_pressure.value, effect.wall_pressure),
        (heavy.moment.value - plain.moment.value, effect.moment),
    ):
        np.testing.assert_allclose(found, estimate, rtol=0.2)


def test_effect_falls_with_the_fourth_power_of_speed_against_the_whole(table_1_scene: Scene) -> None:
    def share(omega: float) -> float:
        common: dict[str, Any] = {
            "disc": table_1_scene.disc,
            "density": 1000.0,
            "fill_ratio": np.array([0.25]),
        }
        effect = gravity_effect(**common, angular_velocity=omega, gravity=9.81, vertical=False)
        return float(effect.wall_pressure[0]) / omega**2

    assert share(100.0) / share(1000.0) == pytest.approx(1e4, rel=1e-9)


def test_slow_rotors_are_refused_with_the_lowest_speed(table_1_scene: Scene) -> None:
    slow = dataclasses.replace(table_1_scene, rotor=dataclasses.replace(table_1_scene.rotor, speed=10.0))
    with pytest.raises(SceneError, match=r"\[rotor\] speed.*above 160.* rpm"):
        check_ring(slow)
    upright = dataclasses.replace(slow, environment=dataclasses.replace(slow.environment, shaft="vertical"))
    check_ring(upright)
    check_ring(table_1_scene)


def test_ratio_is_gravity_over_centrifugal_acceleration(table_1_scene: Scene) -> None:
    assert gravity_ratio(table_1_scene) == pytest.approx(
        9.80665 / (table_1_scene.rotor.speed**2 * 0.04001), rel=1e-3
    )


def test_a_thin_ring_opens_first(table_1_scene: Scene) -> None:
    closed = closed_ring(
        disc=table_1_scene.disc,
        angular_velocity=60.0,
        gravity=9.80665,
        vertical=False,
        fill_ratio=np.array([0.0, 0.05, 0.25]),
    )
    assert list(closed) == [True, False, True]
    assert math.isclose(9.80665 / 60**2, 2.724e-3, rel_tol=1e-3)


@pytest.mark.parametrize("vertical", [False, True])
def test_two_derivations_of_the_effect_agree_on_closed_rings(table_1_scene: Scene, vertical: bool) -> None:
    bare = dataclasses.replace(table_1_scene.disc, plate_thickness=0.0)
    common: dict[str, Any] = {"disc": bare, "density": 1000.0, "gravity": 9.81, "vertical": vertical}
    fills = np.array([0.1, 0.25, 0.5])
    expansion, quadrature = (
        effect(**common, angular_velocity=200.0, fill_ratio=fills)
        for effect in (gravity_effect, open_ring_effect)
    )
    np.testing.assert_allclose(quadrature.moment, expansion.moment, rtol=2e-3)
    np.testing.assert_allclose(quadrature.wall_pressure, expansion.wall_pressure, rtol=2e-3, atol=1e-9)


def test_an_open_ring_loses_less_than_the_expansion_says(table_1_scene: Scene) -> None:
    bare = dataclasses.replace(table_1_scene.disc, plate_thickness=0.0)
    common: dict[str, Any] = {
        "disc": bare,
        "density": 1000.0,
        "gravity": 9.81,
        "vertical": False,
        "angular_velocity": 50.0,
    }
    fills = np.array([0.0, 0.005, 0.02])
    expansion, quadrature = (
        effect(**common, fill_ratio=fills) for effect in (gravity_effect, open_ring_effect)
    )
    assert quadrature.wall_pressure[0] == pytest.approx(0.0, abs=1e-9)
    assert np.all(quadrature.wall_pressure[1:] < expansion.wall_pressure[1:])
    whole = 1000.0 * 50.0**2 * (0.0445**2 - 0.0442**2) / 2
    assert abs(quadrature.wall_pressure[1]) < whole
