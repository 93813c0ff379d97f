"""The ring under gravity by quadrature, against sums over a fine grid and against closed forms."""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np
import pytest
from block_discs import imported

from ringbalance.mesh.geometry import chamber_volume, half_angle, liquid_first_moment, surface_radius
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.chamber.tilted_ring import TiltedRing
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.scene import loop_models, models


def ring(
    scene: models.Scene,
    disc: models.Disc,
    *,
    tilt: float,
    fills: list[float],
    shaft: loop_models.Shaft = "horizontal",
) -> TiltedRing:
    """With 1000 kg/m^3 at 10 rad/s."""
    environment = loop_models.Environment(gravity=100.0 * tilt, shaft=shaft)
    rotor = dataclasses.replace(scene.rotor, speed=10.0)
    turning = dataclasses.replace(scene, disc=disc, environment=environment, rotor=rotor)
    return TiltedRing.of(turning, np.array(fills))


def test_without_gravity_it_is_the_closed_form(table_1_scene: models.Scene) -> None:
    disc = table_1_scene.disc
    for shaft in ("horizontal", "vertical"):
        found = ring(table_1_scene, disc, tilt=0.0, fills=[0.1, 0.25, 0.5], shaft=shaft)
        a = surface_radius(disc=disc, fill_ratio=np.array([0.1, 0.25, 0.5]))
        alpha = half_angle(disc=disc, radius=a)
        assert found.wall_pressure == pytest.approx(1000 * 100 / 2 * (disc.outer_radius**2 - a**2), rel=1e-12)
        exact = 1000 * disc.axial_width * liquid_first_moment(disc=disc, surface_radius=a)
        assert found.moment == pytest.approx(exact, rel=1e-12)
        assert found.moment_per_volume == pytest.approx(1000 * a * np.sin(alpha) / alpha, rel=1e-10)
        assert found.wall_pressure_ripple == pytest.approx(0.0, abs=1e-9)


def test_the_slope_of_the_moment_is_that_of_the_moment(table_1_scene: models.Scene) -> None:
    disc, x, step = table_1_scene.disc, 0.4, 1e-4
    for shaft in ("horizontal", "vertical"):
        found = ring(table_1_scene, disc, tilt=2e-3, fills=[x - step, x, x + step], shaft=shaft)
        volume = chamber_volume(disc=disc)
        slope = (found.moment[2] - found.moment[0]) / (2 * step * volume)
        # Liquid is added at every angle of gravity, so means and slopes commute.
        assert found.moment_per_volume[1] == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("shaft", ["horizontal", "vertical"])
@pytest.mark.parametrize("tilt", [1e-4, 3e-3])
def test_the_same_chamber_as_a_mesh_gives_the_same_ring(
    table_1_scene: models.Scene, tilt: float, shaft: loop_models.Shaft
) -> None:
    """But for its drawn arcs: R (h/2)^4/32 of the wall, over the depth of the ring."""
    disc, fills = table_1_scene.disc, [0.2, 0.4, 0.7]
    meshed = imported(disc, cells=(3, 24, 2))
    plain, found = (ring(table_1_scene, each, tilt=tilt, fills=fills, shaft=shaft) for each in (disc, meshed))
    assert np.all(plain.closed)
    assert np.all(found.closed)
    depth = disc.outer_radius - surface_radius(disc=disc, fill_ratio=fills)
    drawn = 2 * disc.outer_radius * (disc.central_angle / 24 / 2) ** 4 / 32 / depth
    for name in ("wall_pressure", "hydrostatic_pressure", "moment", "moment_per_volume"):
        difference = np.abs(getattr(found, name) / getattr(plain, name) - 1)
        assert np.all(difference < drawn)
    if shaft == "horizontal":
        for name in ("wall_pressure_ripple", "moment_ripple"):
            size = np.max(getattr(plain, name))
            assert np.all(np.abs(getattr(found, name) - getattr(plain, name)) < drawn.max() * size)


def test_a_ring_near_its_limiting_speed_costs_no_more_than_some_seconds(table_1_scene: models.Scene) -> None:
    """At 250 rpm with every term modelled; once it took fourteen, as each part solved each ring again."""
    rotor = dataclasses.replace(table_1_scene.rotor, speed=250 * math.pi / 30)
    slow = dataclasses.replace(table_1_scene, tolerance=1e-6, rotor=rotor)
    begin = time.process_time()
    document = calibration_document(calibrate(slow))
    assert time.process_time() - begin < 6
    assert document["status"]["code"] == "no_ring"
