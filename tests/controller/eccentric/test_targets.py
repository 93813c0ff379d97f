"""Targets and who goes where, against brute force; and the search by trial on a bowl."""

from __future__ import annotations

import cmath
import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.controller.eccentric_mass.memory import TUNING
from ringbalance.controller.eccentric_mass.targets import (
    MOVES,
    assign,
    begin_tuning,
    next_trial,
    separation,
    target_angles,
    tuning_place,
    wrapped,
)

MOMENT = 0.0414
GAP = 0.217
ANGLES = st.floats(-10, 10)


def residual(imbalance: float, phase: float, first: float, second: float) -> float:
    masses = MOMENT * (cmath.exp(1j * first) + cmath.exp(1j * second))
    return abs(imbalance * cmath.exp(1j * phase) + masses)


@given(st.floats(0, 0.0823), ANGLES)
def test_within_reach_nothing_is_left(imbalance: float, phase: float) -> None:
    result = target_angles(imbalance, phase, MOMENT, GAP)
    assert not result.saturated
    assert residual(imbalance, phase, result.first, result.second) < 1e-15
    assert result.residual == 0


@given(st.floats(0.083, 0.3), ANGLES)
def test_beyond_reach_the_masses_lie_side_by_side(imbalance: float, phase: float) -> None:
    result = target_angles(imbalance, phase, MOMENT, GAP)
    assert result.saturated
    apart = abs(wrapped(result.first - result.second))
    assert apart == pytest.approx(GAP, abs=1e-12)
    assert result.residual == pytest.approx(residual(imbalance, phase, result.first, result.second), rel=1e-9)


@pytest.mark.parametrize("imbalance", [0.01, 0.05, 0.0825, 0.12])
def test_no_other_places_are_better(imbalance: float) -> None:
    """Over all pairs of a fine grid that keep their distance."""
    grid = np.linspace(-np.pi, np.pi, 721)
    first, second = np.meshgrid(grid, grid)
    apart = np.abs(np.pi - np.mod(np.pi - (second - first), 2 * np.pi))
    left = np.abs(imbalance * np.exp(0.4j) + MOMENT * (np.exp(1j * first) + np.exp(1j * second)))
    best = np.min(left[apart >= GAP])
    assert target_angles(imbalance, 0.4, MOMENT, GAP).residual <= best + 1e-12


@given(ANGLES, st.floats(0.3, 5.9), ANGLES, st.floats(0.3, 5.9))
def test_travel_is_the_shortest_without_a_collision(
    first: float, lead: float, target: float, target_lead: float
) -> None:
    second, other = first + lead, target + target_lead
    result = assign(first, second, target, other)
    least = math.inf
    for goals, m, n in product(((target, other), (other, target)), range(-4, 5), range(-4, 5)):
        travels = goals[0] - first + 2 * np.pi * m, goals[1] - second + 2 * np.pi * n
        after = lead + travels[1] - travels[0]
        if 0 < after < 2 * np.pi:
            least = min(least, travels[0] ** 2 + travels[1] ** 2)
    assert result[0] ** 2 + result[1] ** 2 <= least + 1e-9
    ends = np.exp(1j * np.array([first + result[0], second + result[1]]))
    targets = np.exp(1j * np.array([target, other]))
    assert min(np.abs(ends - targets).max(), np.abs(ends - targets[::-1]).max()) < 1e-9
    assert 0 < lead + result[1] - result[0] < 2 * np.pi


def test_unwrapped_distances_send_the_masses_the_long_way() -> None:
    """Eq. 27 as printed: angles of 3.0 and -3.0 rad look six apart, though they are 0.28."""
    first, second, target, other = 3.0, 0.0, -3.0, 0.1
    printed = min(
        (first - target) ** 2 + (second - other) ** 2, (second - target) ** 2 + (first - other) ** 2
    )
    result = assign(first, second, target, other)
    assert result[0] == pytest.approx(2 * math.pi - 6.0)
    assert result[0] ** 2 + result[1] ** 2 < 0.02 * printed


def test_the_printed_arccos_adds_to_the_imbalance() -> None:
    """Eq. 26 without its minus sign puts both masses on the side of the imbalance."""
    wrong = math.acos(0.05 / (2 * MOMENT))
    assert residual(0.05, 0.0, wrong, -wrong) == pytest.approx(2 * 0.05)


@given(ANGLES)
def test_wrapped_is_the_same_direction(angle: float) -> None:
    assert -math.pi < wrapped(angle) <= math.pi
    assert cmath.exp(1j * wrapped(angle)) == pytest.approx(cmath.exp(1j * angle))


BEST = (2.3, 0.2)


def vibration(first: float, second: float) -> float:
    """Residual imbalance of two masses whose best places are `BEST`."""
    wanted = cmath.exp(1j * BEST[0]) + cmath.exp(1j * BEST[1])
    return abs(cmath.exp(1j * first) + cmath.exp(1j * second) - wanted)


def begun(goal: tuple[float, float], objective: float, step: float) -> np.void:
    tuning: np.void = np.zeros(1, dtype=TUNING)[0]
    begin_tuning(tuning, goal, objective, step)
    return tuning


def search(start: tuple[float, float], step: float, stop: float) -> tuple[np.void, int]:
    """The memory of the search at its end, and the number of trials."""
    tuning, trials = begun(start, vibration(*start), step), 0
    while not tuning["done"]:
        next_trial(tuning, vibration(*tuning_place(tuning)), 0.0, stop)
        trials += 1
        assert trials < 500
    return tuning, trials


@pytest.mark.parametrize("error", [(0.17, 0.17), (-0.17, 0.17), (0.1, 0.0), (-0.05, -0.12)])
def test_it_ends_at_the_best_place(error: tuple[float, float]) -> None:
    stop = math.radians(0.1)
    result, _ = search((BEST[0] + error[0], BEST[1] + error[1]), math.radians(4), stop)
    assert math.dist(result["base"], BEST) < 2 * stop
    assert result["least"] == vibration(*result["base"])
    assert tuning_place(result) == tuple(result["base"])


def test_staying_is_kept_when_nothing_helps() -> None:
    result, trials = search(BEST, 0.05, 0.01)
    assert tuple(result["base"]) == BEST
    assert trials == 12


def test_the_printed_rule_never_comes_to_rest() -> None:
    """The best of four moves, even when all are worse than staying: it circles at the width of the move."""
    angles, step = (BEST[0] + 0.01, BEST[1] + 0.01), math.radians(4)
    levels = []
    for _ in range(40):
        tried = [(angles[0] + step * a, angles[1] + step * b) for a, b in MOVES]
        angles = min(tried, key=lambda each: vibration(*each))
        levels.append(vibration(*angles))
    assert min(levels[-2:]) < max(levels[-2:])
    assert max(levels[-10:]) > 5 * search((BEST[0] + 0.01, BEST[1] + 0.01), step, 0.002)[0]["least"]


def test_a_move_that_helped_is_tried_again() -> None:
    tuning = begun((0.0, 1.0), 2.0, 0.1)
    next_trial(tuning, 1.95, 0.1, 0.01)
    assert (tuple(tuning["base"]), tuning["move"]) == ((0.0, 1.0), 1)
    next_trial(tuning, 1.0, 0.1, 0.01)
    assert tuple(tuning["base"]) == (-0.1, 1.1)
    assert tuning["move"] == 1


def test_separation_is_the_shorter_way() -> None:
    assert separation(0.1, 2 * math.pi - 0.1) == pytest.approx(0.2)
    assert separation(5.0, 5.0 + math.pi) == pytest.approx(math.pi)
