"""An embedded Runge-Kutta step of order 5 with its error estimate of order 4, for a handful of states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Rates = Callable[[FloatArray], list[float]]
"""Rates of change of all states; the time does not enter."""

STAGES: Final = np.array(
    [
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
ESTIMATE: Final = np.array([-71 / 57600, 0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40])
"""Weights of order 5 less those of order 4, turned round."""
SAFETY: Final = 0.9
SHRINK: Final = 0.2
GROW: Final = 5.0


def step(rates: Rates, state: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """One step of the Dormand-Prince pair.

    Args:
        rates: of the states.
        state: at the start, shape (m,).
        length: of the step, s.

    Returns:
        State at the end, of order 5, and the estimate of its error, shape (m,) each.

    Source: Dormand and Prince, "A family of embedded Runge-Kutta formulae", J. Comp. Appl. Math. 6 (1980).
    """
    slopes = np.empty((7, state.size))
    slopes[0] = rates(state)
    end = state
    for stage in range(6):
        end = state + length * (STAGES[stage, : stage + 1] @ slopes[: stage + 1])
        slopes[stage + 1] = rates(end)
    return end, length * (ESTIMATE @ slopes)


def next_length(length: float, error: float) -> float:
    """Length to try next, from the error of the last step over what is allowed.

    Args:
        length: of the last step, s.
        error: its largest error over the allowed one.

    Returns:
        s.
    """
    factor = GROW if error == 0 else SAFETY * error**-0.2
    return length * min(max(factor, SHRINK), GROW)
