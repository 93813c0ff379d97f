"""The search by trial on a bowl: it ends at the bottom; the printed one circles round it."""

from __future__ import annotations

import cmath
import math

import pytest

from ringbalance.controller.eccentric_mass.targets import (
    MOVES,
    Tuning,
    separation,
    tuning_next,
    tuning_place,
    tuning_start,
)

BEST = (2.3, 0.2)


def vibration(first: float, second: float) -> float:
    """Residual imbalance of two masses whose best places are `BEST`."""
    wanted = cmath.exp(1j * BEST[0]) + cmath.exp(1j * BEST[1])
    return abs(cmath.exp(1j * first) + cmath.exp(1j * second) - wanted)


def search(start: tuple[float, float], step: float, stop: float) -> Tuning:
    tuning = tuning_start(*start, vibration(*start), step)
    while not tuning.done:
        tuning = tuning_next(tuning, vibration(*tuning_place(tuning)), 0.0, stop)
        assert tuning.trials < 500
    return tuning


@pytest.mark.parametrize("error", [(0.17, 0.17), (-0.17, 0.17), (0.1, 0.0), (-0.05, -0.12)])
def test_it_ends_at_the_best_place(error: tuple[float, float]) -> None:
    stop = math.radians(0.1)
    found = search((BEST[0] + error[0], BEST[1] + error[1]), math.radians(4), stop)
    assert math.dist(found.base, BEST) < 2 * stop
    assert found.best == vibration(*found.base)
    assert tuning_place(found) == found.base


def test_staying_is_kept_when_nothing_helps() -> None:
    found = search(BEST, 0.05, 0.01)
    assert found.base == BEST
    assert found.trials == 12


def test_the_printed_rule_never_comes_to_rest() -> None:
    """The best of four moves, even when all are worse than staying: it circles at the width of the move."""
    place, step = (BEST[0] + 0.01, BEST[1] + 0.01), math.radians(4)
    levels = []
    for _ in range(40):
        tried = [(place[0] + step * a, place[1] + step * b) for a, b in MOVES]
        place = min(tried, key=lambda at: vibration(*at))
        levels.append(vibration(*place))
    assert min(levels[-2:]) < max(levels[-2:])
    assert max(levels[-10:]) > 5 * search((BEST[0] + 0.01, BEST[1] + 0.01), step, 0.002).best


def test_a_move_that_helped_is_tried_again() -> None:
    tuning = tuning_start(0.0, 1.0, 2.0, 0.1)
    helped = tuning_next(tuning, 1.0, 0.0, 0.01)
    assert helped.base == (0.1, 1.1)
    assert helped.move == tuning.move
    assert tuning_next(tuning, 1.95, 0.1, 0.01).base == (0.0, 1.0)


def test_separation_is_the_shorter_way() -> None:
    assert separation(0.1, 2 * math.pi - 0.1) == pytest.approx(0.2)
    assert separation(5.0, 5.0 + math.pi) == pytest.approx(math.pi)
