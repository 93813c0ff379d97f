"""Coefficients of the method of order 5 in the Runge-Kutta pair of Dormand and Prince.

Source: Dormand and Prince, "A family of embedded Runge-Kutta formulae", J. Comp. Appl. Math. 6 (1980).
"""

from __future__ import annotations

from typing import Final

import numpy as np

COUPLING: Final = np.array(
    [
        [0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    ]
)
"""Weights of the earlier stages, a row for each of the six stages."""
TIMES: Final = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0])
"""Of the stages, as fractions of the step."""
WEIGHTS: Final = np.array([35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84])
"""Of the stages in the result of order 5."""
