"""Sloshing of the ring against exact waves, an independent spectral solution, and limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.results import StatusCode
from ringbalance.physics.sloshing import SloshingResponse, resonant_fills, sloshing_modes, sloshing_response
from ringbalance.physics.sloshing_system import SloshingSystem, sloshing_system
from ringbalance.scene.models import Disc
from ringbalance.verification.reference.chambers import CosineWaves

OMEGA = 10_000 * np.pi / 30


def bare(disc: Disc, angle: float) -> Disc:
    """A chamber without plates, for which waves are sums of cosines of the angle."""
    chambers = 2 * int(np.pi / angle + 1e-9)
    return replace(disc, plate_thickness=0.0, central_angle=angle, chambers=max(2, chambers))


def forced(disc: Disc, fill: Any, **conditions: Any) -> SloshingResponse:
    """Waves that gravity forces at 10 000 rpm, without viscosity unless it is given."""
    usual = {"angular_velocity": OMEGA, "kinematic_viscosity": 0.0, "gravity": 9.81}
    return sloshing_response(disc=disc, fill_ratio=fill, **(usual | conditions))


@pytest.mark.parametrize(("angle", "fill"), [(90.0, 0.25), (90.0, 0.5), (60.0, 0.1), (150.0, 0.4)])
def test_frequencies_match_an_independent_spectral_solution(disc: Disc, angle: float, fill: float) -> None:
    chamber = bare(disc, np.radians(angle))
    found = sloshing_modes(disc=chamber, fill_ratio=fill, modes=4)
    depth = float(np.log(disc.outer_radius / found.surface_radius[0]))
    exact = CosineWaves.of(central_angle=np.radians(angle), depth=depth).frequencies(modes=4)
    assert found.frequency_ratio.value[0] == pytest.approx(exact, rel=1e-4)
    assert np.all(
        np.abs(found.frequency_ratio.value[0] - exact) < found.frequency_ratio.uncertainty[0] + 2e-6
    )


@pytest.fixture
def still(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the Coriolis force out of every system."""

    def without(**arguments: Any) -> SloshingSystem:
        found = sloshing_system(**arguments)
        return replace(found, coriolis=0 * found.coriolis)

    monkeypatch.setattr("ringbalance.physics.sloshing.sloshing_system", without)


@pytest.mark.usefixtures("still")
def test_frequencies_converge_at_fourth_order(disc: Disc) -> None:
    chamber = bare(disc, np.pi / 2)
    k = 2.0
    exact = np.sqrt(k * np.tanh(k * np.log(disc.outer_radius / surface_radius(disc=chamber, fill_ratio=0.5))))
    errors = []
    for n in (2, 4, 8):
        cells = tuple((n * m, 3 * n * m) for m in (4, 2, 1))
        value = sloshing_modes(disc=chamber, fill_ratio=0.5, modes=1, cells=cells)
        errors.append(abs(float(value.frequency_ratio.value[0, 0]) - exact))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(np.abs(orders - 4) < 0.3)
    assert errors[-1] < 1e-9


def test_a_thin_film_has_shallow_water_waves(disc: Disc) -> None:
    """s = k sqrt(depth): the Coriolis force does nothing at leading order in a long shallow channel."""
    found = sloshing_modes(disc=disc, fill_ratio=1e-6, modes=3)
    a = found.surface_radius[0]
    length = disc.central_angle - 2 * np.arcsin(disc.plate_thickness / disc.outer_radius)
    shallow = np.pi * np.arange(1, 4) / length * np.sqrt(np.log(disc.outer_radius / a))
    assert found.frequency_ratio.value[0] == pytest.approx(shallow, rel=1e-4)


def test_plates_raise_the_frequencies_and_the_fill_does_too(disc: Disc) -> None:
    fills = np.linspace(0.02, 1.0, 6)
    with_plates = sloshing_modes(disc=disc, fill_ratio=fills, modes=3).frequency_ratio.value
    without = sloshing_modes(disc=replace(disc, plate_thickness=0.0), fill_ratio=fills, modes=3)
    assert np.all(np.diff(with_plates, axis=0) > 0)
    assert np.all(with_plates > without.frequency_ratio.value)


def test_resonant_fills_have_a_mode_at_the_speed(disc: Disc) -> None:
    fills = resonant_fills(disc=disc, modes=4)
    assert [mode for mode, _ in fills] == [2, 3, 4]
    for mode, fill in fills:
        ratios = sloshing_modes(disc=disc, fill_ratio=fill, modes=4).frequency_ratio.value[0]
        assert ratios[mode - 1] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    "fill", [0.25, *(pytest.param(each, marks=pytest.mark.heavy) for each in (0.4, 0.5))]
)
def test_the_interval_is_what_exact_waves_do_within_six_per_cent(disc: Disc, fill: float) -> None:
    """Without viscosity and plates; natural frequencies q times as high answer at s/q."""
    found = forced(bare(disc, np.pi / 2), fill)
    depth = float(np.log(disc.outer_radius / found.surface_radius[0]))
    waves = CosineWaves.of(central_angle=np.pi / 2, depth=depth)
    ratios = 1 / np.linspace(0.94, 1.06, 61)
    moments = [waves.amplification(frequency_ratio=s) for s in ratios]
    pressures = [waves.pressure_amplification(frequency_ratio=s, depth=depth) for s in ratios]
    assert found.amplification_interval[0] == pytest.approx([min(moments), max(moments)], rel=1e-2)
    assert found.pressure_amplification_interval[0] == pytest.approx(
        [min(pressures), max(pressures)], rel=1e-2
    )
    assert max(moments) - moments[30] > 1.1 * (moments[30] - min(moments))


def test_a_peak_within_the_interval_is_found(disc: Disc) -> None:
    """The third mode 3 % beside the speed: the upper end is what the peak over fills comes to.

    Damping and the other modes move the peak off the undamped resonance, so that it is looked for.  Its fill
    differs by at most 6 %; forcing and damping go with powers of it of two at most: 12 %.
    """
    resonant = dict(resonant_fills(disc=disc, modes=3))[3]
    cells = ((8, 24), (4, 12), (2, 6))
    fills = resonant * np.array([1.06, *np.linspace(1.0, 1.04, 21)])
    found = forced(disc, fills, kinematic_viscosity=1e-6, cells=cells)
    beside, *near = found.amplification.value
    assert 3 * beside < found.amplification_interval[0, 1] == pytest.approx(max(near), rel=0.12)


def test_gravity_only_tilts_the_surface_of_a_short_chamber(disc: Disc) -> None:
    """Of one degree: the lowest mode is 13 times as fast as the disc turns, or faster."""
    found = forced(bare(disc, np.radians(1.0)), [0.1, 0.5])
    assert found.amplification.value == pytest.approx(1.0, abs=0.01)
    half = np.radians(0.5)
    # At the edge gravity along the chamber counts as cos(angle) less its mean, across as sin(angle).
    highest = 9.81 / OMEGA**2 * np.hypot(np.sin(half) / half - np.cos(half), np.sin(half))
    assert found.surface_amplitude.value == pytest.approx(highest, rel=0.01)


def test_viscosity_limits_the_peak_and_nothing_else(disc: Disc) -> None:
    # The third mode: even ones hardly feel gravity.
    peak = dict(resonant_fills(disc=disc, modes=3))[3]
    swings = []
    for viscosity in (1e-6, 1e-5, 1e-4):
        found = forced(disc, [peak, 0.25], kinematic_viscosity=viscosity)
        swings.append(found.surface_amplitude.value)
    at_peak, beside = np.array(swings).T
    # At resonance the waves fall with the root of the viscosity, beside it hardly.
    assert at_peak[0] / at_peak[1] == pytest.approx(np.sqrt(10), rel=0.2)
    assert beside[0] / beside[1] == pytest.approx(1.0, abs=0.03)


def test_waves_that_are_not_small_and_a_ring_that_is_not_there_are_said(disc: Disc) -> None:
    def status(rpm: float) -> StatusCode:
        return forced(disc, 0.14, angular_velocity=rpm * np.pi / 30, kinematic_viscosity=1e-6).status.code

    assert [status(rpm) for rpm in (100, 500, 20_000)] == [
        StatusCode.NO_RING,
        StatusCode.OUT_OF_RANGE,
        StatusCode.OK,
    ]


@settings(max_examples=10, deadline=None, derandomize=True)
@given(
    fill=st.floats(1e-6, 1.0),
    angle=st.floats(10.0, 175.0),
    thickness=st.floats(0.0, 0.9),
    inner=st.floats(0.05, 0.95),
)
def test_any_chamber_has_positive_rising_frequencies(
    disc: Disc, fill: float, angle: float, thickness: float, inner: float
) -> None:
    theta = np.radians(angle)
    radius = inner * disc.outer_radius
    strip = thickness * radius * np.sin(min(theta / 2, np.pi / 2))
    chamber = replace(disc, inner_radius=radius, central_angle=theta, chambers=2, plate_thickness=strip)
    found = sloshing_modes(disc=chamber, fill_ratio=fill, modes=3, cells=((8, 24), (4, 12), (2, 6)))
    ratios = found.frequency_ratio.value[0]
    assert np.all(np.isfinite(ratios))
    assert np.all(ratios > 0)
    assert np.all(np.diff(ratios) > 0)


@pytest.mark.parametrize("fill", [0.0, -0.1, 1.1, np.nan])
def test_a_fill_without_a_ring_is_refused(disc: Disc, fill: float) -> None:
    with pytest.raises(ValueError, match="fill_ratio"):
        sloshing_modes(disc=disc, fill_ratio=fill)
    with pytest.raises(ValueError, match="fill_ratio"):
        forced(disc, fill, kinematic_viscosity=1e-6)
