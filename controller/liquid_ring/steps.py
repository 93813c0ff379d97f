"""Steps in time for a handful of states, explicit while that serves, implicit where friction makes it stiff.

The explicit step is an embedded Runge-Kutta step of order 5 with its error estimate of order 4.  A very
viscous liquid in a narrow tube answers in microseconds while the levels shift for minutes; there an implicit
method of the same order takes over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.integrate import Radau

from ringbalance.controller.dormand_prince import COUPLING, ESTIMATE, WEIGHTS
from ringbalance.scene.arrays import FloatArray

Rates = Callable[[FloatArray], list[float]]
"""Rates of change of all states; the time does not enter."""

RELATIVE_ERROR: Final = 1e-9
"""Of each state, allowed to one step."""
FIRST_STEP: Final = 1e-6
"""s."""
_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 5.0
_SHORTEST_STEP: Final = 1e-15
"""s, below which no error is looked at."""
_STIFF_AFTER: Final = 300
"""Explicit steps since the rates last jumped, after which the implicit method takes over."""


def step(rates: Rates, state: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """State at the end of one Dormand-Prince step, of order 5, and the estimate of its error."""
    slopes = np.empty((7, state.size))
    slopes[0] = rates(state)
    for stage in range(1, 6):
        slopes[stage] = rates(state + length * (COUPLING[stage, :stage] @ slopes[:stage]))
    end = state + length * (WEIGHTS @ slopes[:6])
    slopes[6] = rates(end)
    return end, length * (ESTIMATE @ slopes)


def _next_length(length: float, error: float) -> float:
    """From the largest error of the last step over the allowed one."""
    factor = _GROW if error == 0 else _SAFETY * error**-0.2
    return length * min(max(factor, _SHRINK), _GROW)


@dataclass(frozen=True, kw_only=True)
class Allowed:
    """Absolute error of each state in one step, shape (m,)."""

    explicit: FloatArray
    """Infinite for mere integrals, which ask for nothing."""
    implicit: FloatArray
    """Finite, as the implicit method needs."""


@dataclass(frozen=True, kw_only=True)
class Stepping:
    """What the steps so far leave for the next one."""

    steps: int = 0
    length: float = FIRST_STEP
    """To try next, s."""
    since: int = 0
    """Steps since the rates last jumped."""
    stiff: bool = False
    """Whether the implicit method is used from the first step on."""
    method: Radau | None = None
    """The implicit method under way; it belongs to the last record alone."""

    def reset(self) -> Stepping:
        """After a jump of the rates: short steps again."""
        return replace(self, length=FIRST_STEP, since=0, method=None)


@dataclass(frozen=True, kw_only=True)
class Taken:
    """One accepted step."""

    end: FloatArray
    """States, shape (m,)."""
    length: float
    """s."""
    within: Callable[[float], FloatArray]
    """States at a fraction of the way through it."""
    after: Stepping


def take(
    stepping: Stepping,
    *,
    rates: Rates,
    allowed: Allowed,
    state: FloatArray,
    time: float,
    stop: float,
    most: int,
) -> Taken:
    """One step that does not pass `stop`; from `most` steps on one is accepted whatever its error."""
    begun = replace(stepping, since=stepping.since + 1)
    if begun.stiff or begun.since > _STIFF_AFTER:
        begun = replace(begun, steps=begun.steps + 1)
        found = _implicit(begun, rates, allowed, state, time, stop)
        if found is not None:
            return found
        begun = replace(begun, method=None)
    return _explicit(begun, rates, allowed.explicit, state, stop - time, most)


def _explicit(
    begun: Stepping, rates: Rates, allowed: FloatArray, state: FloatArray, left: float, most: int
) -> Taken:
    steps, following = begun.steps, begun.length
    while True:
        steps += 1
        length = min(following, left)
        end, error = step(rates, state, length)
        relative = float(np.max(np.abs(error) / (allowed + RELATIVE_ERROR * np.abs(state))))
        if relative <= 1 or steps >= most or length < _SHORTEST_STEP:
            break
        following = _next_length(length, relative if np.isfinite(relative) else 1e6)
    if length < left or relative > 0.1:
        following = _next_length(length, relative)
    return Taken(
        end=end,
        length=length,
        within=lambda fraction: step(rates, state, fraction * length)[0],
        after=replace(begun, steps=steps, length=following),
    )


def _implicit(
    begun: Stepping, rates: Rates, allowed: Allowed, state: FloatArray, time: float, stop: float
) -> Taken | None:
    """None where it finds no step, as at a jump of the rates."""
    method = begun.method
    if method is None or method.t_bound != stop or method.t != time:
        method = Radau(lambda _, y: rates(y), time, state, stop, rtol=RELATIVE_ERROR, atol=allowed.implicit)
    try:
        method.step()
    except (ValueError, np.linalg.LinAlgError):
        return None
    if method.status == "failed":
        return None
    dense, length = method.dense_output(), float(method.t) - time
    return Taken(
        end=method.y,
        length=length,
        within=lambda fraction: np.asarray(dense(time + fraction * length)),
        after=replace(begun, method=method),
    )
