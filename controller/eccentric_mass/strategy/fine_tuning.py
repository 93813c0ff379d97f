"""Fine tuning by trial: both masses are moved a little, each way, and the better place is kept.

The paper takes the best of four moves, even when all of them are worse than staying: near the best place
that is a limit cycle as wide as the move.  Here staying is the fifth candidate, and when it wins, moves are
halved.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ringbalance.controller.compilation.compiled import compiled

MOVES = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))


class Tuning(NamedTuple):
    """Where the search is."""

    base: tuple[float, float]
    """Best place so far, rad, unwrapped."""
    best: float
    """Objective there, m."""
    step: float
    """Size of the moves, rad."""
    move: int
    """Of the four, the one that is tried now."""
    failed: int
    """Moves in a row that were no better than staying."""
    trials: int
    """Places looked at since the start."""
    done: bool
    """Whether the moves have become shorter than the search is asked for."""


@compiled
def tuning_start(first: float, second: float, objective: float, step: float) -> Tuning:
    """Begin at the present place."""
    return Tuning((first, second), objective, step, 0, 0, 0, False)


@compiled
def tuning_place(tuning: Tuning) -> tuple[float, float]:
    """Angles of both masses to go to now, rad; the best place when the search is done."""
    first, second = tuning.base
    if tuning.done:
        return first, second
    one, two = MOVES[tuning.move]
    return first + tuning.step * one, second + tuning.step * two


@compiled
def tuning_next(tuning: Tuning, objective: float, margin: float, stop: float) -> Tuning:
    """Take in what the present trial gave.

    Args: `objective`: at the place of the trial, m; infinite for one that cannot be taken up.
    Returns: The search with its next trial; a move that helped is tried again first.
    Source: section 3.6 of the paper on eccentric masses, with staying compared and the moves halved.
    """
    base, best, step, move, failed, trials, _ = tuning
    if objective < best - margin:
        return Tuning(tuning_place(tuning), objective, step, move, 0, trials + 1, False)
    if failed < 3:
        return Tuning(base, best, step, (move + 1) % 4, failed + 1, trials + 1, False)
    half = 0.5 * step
    return Tuning(base, best, half, (move + 1) % 4, 0, trials + 1, half < stop)


@compiled
def separation(first: float, second: float) -> float:
    """Angle between two masses, the shorter way round. Returns: Within [0, pi], rad."""
    return abs(math.pi - (math.pi - second + first) % (2 * math.pi))
