"""Steps in time for a handful of states, explicit while that serves, implicit where friction makes it stiff.

The explicit step is an embedded Runge-Kutta step of order 5 with its error estimate of order 4.  A very
viscous liquid in a narrow tube answers in microseconds while the levels shift for minutes; there an implicit
method of the same order takes over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.integrate import Radau

from ringbalance.controller.dormand_prince import COUPLING, ESTIMATE, WEIGHTS
from ringbalance.scene.arrays import FloatArray

Rates = Callable[[FloatArray], list[float]]
"""Rates of change of all states; the time does not enter."""

SAFETY: Final = 0.9
SHRINK: Final = 0.2
GROW: Final = 5.0
RELATIVE_ERROR: Final = 1e-9
"""Of each state, allowed to one step."""
FIRST_STEP: Final = 1e-6
"""s."""
SHORTEST_STEP: Final = 1e-15
"""s, below which no error is looked at."""
STIFF_AFTER: Final = 300
"""Explicit steps since the rates last jumped, after which the implicit method takes over."""


def step(rates: Rates, state: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """One step of the Dormand-Prince pair.

    Args: `rates`: of the states. `state`: at the start, shape (m,). `length`: of the step, s.
    Returns: State at the end, of order 5, and the estimate of its error, shape (m,) each.
    Source: `dormand_prince`.
    """
    slopes = np.empty((7, state.size))
    slopes[0] = rates(state)
    for stage in range(1, 6):
        slopes[stage] = rates(state + length * (COUPLING[stage, :stage] @ slopes[:stage]))
    end = state + length * (WEIGHTS @ slopes[:6])
    slopes[6] = rates(end)
    return end, length * (ESTIMATE @ slopes)


def next_length(length: float, error: float) -> float:
    """Length to try next, from the error of the last step over what is allowed.

    Args: `length`: of the last step, s. `error`: its largest error over the allowed one.
    Returns: s.
    """
    factor = GROW if error == 0 else SAFETY * error**-0.2
    return length * min(max(factor, SHRINK), GROW)


@dataclass(frozen=True, kw_only=True)
class Taken:
    """One accepted step."""

    end: FloatArray
    """States, shape (m,)."""
    length: float
    """s."""
    within: Callable[[float], FloatArray]
    """States at a share of the way through it."""


class Stepper:
    """Takes steps, and remembers how long the next may be; lives as long as one march through time."""

    def __init__(self, *, rates: Rates, allowed: FloatArray, integral_error: float) -> None:
        """Begin with short explicit steps.

        Args: `rates`: of the states. `allowed`: absolute error of each state in one step, shape (m,);
            infinite for mere integrals. `integral_error`: absolute error of those under the implicit method,
            which needs one for all.
        """
        self.steps = 0
        self.stiff = False
        """Whether the implicit method is used from the first step on."""
        self._rates = rates
        self._allowed = allowed
        self._held = np.where(np.isinf(allowed), integral_error, allowed)
        self._length = FIRST_STEP
        self._since = 0
        self._method: Radau | None = None

    def reset(self) -> None:
        """The rates have jumped: continue with short steps."""
        self._length, self._since, self._method = FIRST_STEP, 0, None

    def take(self, state: FloatArray, *, time: float, stop: float, most: int) -> Taken:
        """One step from a state.

        Args: `state`: shape (m,). `time`: s. `stop`: s, which is not stepped over. `most`: number of steps
            from which on one is accepted whatever its error.
        """
        self._since += 1
        if self.stiff or self._since > STIFF_AFTER:
            found = self._implicit(state, time, stop)
            if found is not None:
                return found
        return self._explicit(state, time, stop, most)

    def _explicit(self, state: FloatArray, time: float, stop: float, most: int) -> Taken:
        while True:
            self.steps += 1
            length = min(self._length, stop - time)
            end, error = step(self._rates, state, length)
            relative = float(np.max(np.abs(error) / (self._allowed + RELATIVE_ERROR * np.abs(state))))
            if relative <= 1 or self.steps >= most or length < SHORTEST_STEP:
                break
            self._length = next_length(length, relative if np.isfinite(relative) else 1e6)
        if length < stop - time or relative > 0.1:
            self._length = next_length(length, relative)
        return Taken(end=end, length=length, within=lambda share: step(self._rates, state, share * length)[0])

    def _implicit(self, state: FloatArray, time: float, stop: float) -> Taken | None:
        """None where it finds no step, as at a jump of the rates."""
        self.steps += 1
        method = self._method
        if method is None or method.t_bound != stop or method.t != time:
            method = self._method = self._from(state, time, stop)
        if not _steps(method):
            self._method = None
            return None
        dense, length = method.dense_output(), float(method.t) - time
        return Taken(
            end=method.y, length=length, within=lambda share: np.asarray(dense(time + share * length))
        )

    def _from(self, state: FloatArray, time: float, stop: float) -> Radau:
        rates = self._rates
        return Radau(lambda _, y: rates(y), time, state, stop, rtol=RELATIVE_ERROR, atol=self._held)


def _steps(method: Radau) -> bool:
    """One step of the implicit method; False where it meets rates that it cannot follow."""
    try:
        method.step()
    except (ValueError, np.linalg.LinAlgError):
        return False
    return bool(method.status != "failed")
