"""Asynchronous instability against numbers by hand and the roots of the coupled equations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.chamber.contributions import AsynchronousInstability
from ringbalance.scene.models import Scene
from scenes import with_tables


def with_mass(scene: Scene, kilograms: float) -> Scene:
    return with_tables(scene, rotor={"influence_coefficient": 1 / kilograms})


@pytest.mark.parametrize("kilograms", [93.0, 5.0])
def test_growth_against_the_coupled_roots(table_1_scene: Scene, kilograms: float) -> None:
    scene = with_mass(table_1_scene, kilograms)
    found = AsynchronousInstability.of(scene)
    assert found is not None
    disc, omega = scene.disc, scene.rotor.speed
    a = float(surface_radius(disc=disc, fill_ratio=found.fill_ratio))
    k, theta = 2.0, math.pi / 2
    square = k * math.tanh(k * math.log(disc.outer_radius / a))
    overlap = quad(lambda phi: math.sin(k * phi) * math.sin(phi), -theta / 2, theta / 2)[0]
    ratio = 4 / 2 * 1000.0 * disc.axial_width * a**2 * overlap**2 * square / (theta / 2) / kilograms
    critical = (1 - math.sqrt(square)) * omega
    assert found.critical_speed == pytest.approx(critical)
    # (w_c^2 - w^2) (s^2 - (w - 1)^2) = ratio w^4 in units of omega.
    rotor = np.poly1d([-1.0, 0.0, (critical / omega) ** 2])
    wave = np.poly1d([-1.0, 2.0, square - 1.0])
    roots = (rotor * wave - ratio * np.poly1d([1.0, 0, 0, 0, 0])).roots
    assert found.growth == pytest.approx(float(np.max(roots.imag)) * omega / critical, rel=0.15)


def test_sizes_by_hand(table_1_scene: Scene) -> None:
    """An independent check gives 0.3 to 1 % at 93 kg, about 2 % at 5 kg, whirl at a third of the speed."""
    heavy, light = (AsynchronousInstability.of(with_mass(table_1_scene, m)) for m in (93.0, 5.0))
    assert heavy is not None
    assert light is not None
    assert 0.003 < heavy.growth < 0.01
    assert 0.015 < light.growth < 0.04
    assert light.growth / heavy.growth == pytest.approx(math.sqrt(93 / 5))
    assert 0.2 < heavy.critical_speed / table_1_scene.rotor.speed < 0.7
    assert heavy.finding is None
    assert light.finding is not None
    assert light.finding.values["damping_ratio"] == light.growth


def test_waves_faster_than_the_rotor_are_no_risk(table_1_scene: Scene) -> None:
    disc = replace(table_1_scene.disc, central_angle=0.2, chambers=30, plate_thickness=1e-4)
    deep = replace(disc, inner_radius=1e-3, max_fill_ratio=1.0, initial_fill=0.5)
    found = AsynchronousInstability.of(replace(table_1_scene, disc=deep))
    assert found is None or found.fill_ratio < 0.2
