"""Frames and signs: chamber A at angle 0, letters counter-clockwise, V1 = V0 + K U."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.controller.liquid_ring.plant import LiquidRing, starting_pressure
from ringbalance.controller.rotor import (
    assumed_rotor,
    chamber_directions,
    chamber_letters,
    disc_unbalance,
    wrapped,
)
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Scene

# lambda rho V / 2 per fill difference, by hand: 72 mm, 1000 kg/m^3, V of Eq. 4.
VOLUME = (math.pi / 4 * (44.5e-3**2 - 20.5e-3**2) - 2 * 2.777e-3 * 24e-3) * 62e-3
PER_DIFFERENCE = 72e-3 * 1000 * VOLUME / 2


RingOf = Callable[..., LiquidRing]


def test_four_chambers_lie_on_the_axes() -> None:
    assert chamber_letters(4) == ("A", "B", "C", "D")
    assert chamber_directions(4).tolist() == [1, 1j, -1, -1j]


@pytest.mark.parametrize("n", [2, 4, 6, 8, 26])
def test_opposite_chambers_are_exact_negatives(n: int) -> None:
    directions = chamber_directions(n)
    assert np.array_equal(directions[: n // 2], -directions[n // 2 :])
    assert np.abs(directions) == pytest.approx(1.0, abs=1e-15)
    assert np.all(np.diff(np.mod(np.angle(directions), 2 * np.pi)) > 0)


@pytest.mark.parametrize("n", [0, 3, 28, -2])
def test_impossible_numbers_of_chambers_are_refused(n: int) -> None:
    for function in (chamber_letters, chamber_directions):
        with pytest.raises(ValueError, match="even"):
            function(n)


@pytest.mark.parametrize(
    ("fills", "expected"),
    [
        ([0.35, 0.25, 0.15, 0.25], 0.2),
        ([0.25, 0.35, 0.25, 0.15], 0.2j),
        ([0.15, 0.20, 0.35, 0.30], -0.2 - 0.1j),
    ],
)
def test_the_moment_points_to_the_fuller_chambers(
    model: BalancerModel, fills: list[float], expected: complex
) -> None:
    moment = disc_unbalance(moment=model.moment, fill_ratio=fills)
    assert complex(moment) == pytest.approx(expected * PER_DIFFERENCE, rel=1e-12)


def test_six_chambers_add_obliquely(model: BalancerModel) -> None:
    moment = disc_unbalance(moment=model.moment, fill_ratio=[0.25, 0.35, 0.3, 0.25, 0.15, 0.2])
    expected = 0.2 * cmath.exp(1j * math.pi / 3) + 0.1 * cmath.exp(2j * math.pi / 3)
    assert complex(moment) == pytest.approx(expected * PER_DIFFERENCE, rel=1e-12)


def test_many_states_at_once_equal_one_by_one(model: BalancerModel) -> None:
    fills = np.random.default_rng(1).uniform(0, 0.5, size=(4, 5))
    together = disc_unbalance(moment=model.moment, fill_ratio=fills)
    apart = [complex(disc_unbalance(moment=model.moment, fill_ratio=fills[:, i])) for i in range(5)]
    assert together == pytest.approx(apart, rel=1e-14)


def test_the_vibration_lags_behind_the_unbalance(scene: Scene) -> None:
    still = replace(scene.rotor, initial_amplitude=0.0)
    seen = complex(still.vibration(1e-4 * cmath.exp(0.3j)))
    assert cmath.phase(seen) == pytest.approx(0.3 - math.radians(17), abs=1e-12)
    assert abs(seen) == pytest.approx(0.0108e-4, rel=1e-12)


def test_the_opposite_moment_cancels_the_initial_vibration(scene: Scene) -> None:
    k = scene.rotor.influence
    initial = 10e-6 * cmath.exp(0.5j * math.pi)
    assert abs(complex(scene.rotor.vibration(-initial / k))) < 1e-20


@pytest.mark.parametrize("turns", [-3, 0, 2])
def test_wrapping_ignores_whole_turns(turns: int) -> None:
    assert wrapped(1.2 + 2 * math.pi * turns) == pytest.approx(1.2, abs=1e-12)


def left_over(plant: LiquidRing, rotor: Rotor, *, wanted: complex) -> float:
    """What the disc cannot form of a moment, kg m: of a rotor that vibrates 1 m per kg m, against it."""
    against = replace(
        rotor,
        influence_coefficient=1.0,
        lag_angle=0.0,
        initial_amplitude=abs(wanted),
        initial_phase=cmath.phase(-wanted),
    )
    return plant.unreachable_vibration(rotor=against)


@pytest.mark.parametrize("n", [4, 6, 8])
def test_the_reach_is_the_polygon_of_full_pairs(
    scene: Scene, model: BalancerModel, n: int, ring_of: RingOf
) -> None:
    plant = ring_of(model, chambers=n)
    pair = plant.largest_pair_moment()
    assert pair == pytest.approx(PER_DIFFERENCE * 0.5, rel=1e-12)
    # All pairs full towards one corner: the side of the polygon is 2 M, its corners at M/sin(pi/n).
    corner = pair / math.sin(math.pi / n) * cmath.exp(1j * (math.pi / n if n % 4 == 0 else 0.0))
    assert left_over(plant, scene.rotor, wanted=corner * 0.999) == 0.0
    assert left_over(plant, scene.rotor, wanted=corner * 1.5) == pytest.approx(abs(corner) / 2, rel=1e-9)


def test_four_chambers_reach_a_square(scene: Scene, model: BalancerModel, ring_of: RingOf) -> None:
    plant, pair = ring_of(model, chambers=4), PER_DIFFERENCE * 0.5
    assert left_over(plant, scene.rotor, wanted=pair * (1.3 + 0.9j)) == pytest.approx(0.3 * pair)
    assert left_over(plant, scene.rotor, wanted=pair * (1.3 + 1.4j)) == pytest.approx(0.5 * pair)


def test_two_chambers_reach_a_line(scene: Scene, model: BalancerModel, ring_of: RingOf) -> None:
    plant, pair = ring_of(model, chambers=2), PER_DIFFERENCE * 0.5
    assert left_over(plant, scene.rotor, wanted=0.7 * pair) == pytest.approx(0.0, abs=1e-18)
    assert left_over(plant, scene.rotor, wanted=(0.7 + 0.2j) * pair) == pytest.approx(0.2 * pair)


def test_a_disc_that_moves_no_liquid_reaches_nothing(
    scene: Scene, model: BalancerModel, ring_of: RingOf
) -> None:
    plant = ring_of(model, chambers=4)
    rotor = replace(scene.rotor, influence_coefficient=1.0, initial_amplitude=3e-4)
    assert plant.unreachable_vibration(rotor=rotor, least_fill=0.25) == pytest.approx(3e-4, rel=1e-12)
    assert plant.moment_towards(1j, least_fill=0.25) == 0.0


def test_the_starting_pressure_of_the_paper_is_eq_19_at_rest(model: BalancerModel) -> None:
    # rho omega^2 V 0.5/(B theta), the stall pressure of an emptied chamber: 0.381 MPa.
    omega = 10000 * 2 * math.pi / 60
    stall = 1000 * omega**2 * VOLUME * 0.5 / (62e-3 * math.pi / 2)
    result = starting_pressure(law=model.flow, fill=0.0, opposite_fill=0.5, above=1e5)
    assert result == pytest.approx(stall, rel=1e-12)
    assert stall == pytest.approx(0.381e6, abs=500)


def test_a_result_says_that_its_rotor_is_assumed() -> None:
    whole = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    assert list(assumed_rotor(whole)) == []
    without = {"rotor.lag_angle": None, "rotor.initial_vibration": None}
    (finding,) = assumed_rotor(whole.with_values(without))
    assert finding.text.endswith("rotor.lag_angle 17 deg and rotor.initial_vibration 10 um at 90 deg")
    assert finding in rb.simulate(whole.with_values(without)).rows().findings
    assert list(assumed_rotor(rb.load_scene(rb.bundled_scene("eccentric_mass_paper")))) == []
