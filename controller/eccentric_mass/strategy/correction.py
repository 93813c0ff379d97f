"""Correction of the targets by the vibration that is left: a step by the influence coefficient.

With the masses at rest the mean vibration in the rotor's frame is z = alpha (U + p), p = b sum exp(j phi_i).
z/alpha is therefore the imbalance that is left over, and targets for the estimate plus z/alpha undo it.  With
alpha as configured in place of the true one each step leaves the fraction |1 - alpha_true/alpha| of z: a
stiffness known to a few per cent takes two steps.  A step that does not help is halved.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from ringbalance.scene.platform.compiled import compiled

MOST_STEPS: Final = 8
"""Of one run."""
_LEAST_SHARE: Final = 0.25
"""Of a whole step, which a step that does not help is halved down to."""
_WORTH: Final = 2.0
"""Times the margin of a mean, which a vibration must exceed for a step to show a gain."""


class Correction(NamedTuple):
    """The best place so far, and the step that is tried from it."""

    place: tuple[float, float]
    """Goal of each mass there, rad, unwrapped."""
    residual: complex
    """Mean vibration there, m; infinite before the first mean."""
    imbalance: complex
    """For which the targets there were, kg m."""
    aim: complex
    """For which the present targets are, kg m."""
    goal: tuple[float, float]
    """Of the present step, rad, unwrapped; friction may hold the masses short of it."""
    share: float
    """Of a whole step that is taken."""
    steps: int
    """Taken so far."""


@compiled
def correction_start(place: tuple[float, float], imbalance: complex) -> Correction:
    """The masses go to the first targets. Returns: Correction without a mean."""
    return Correction(place, complex(math.inf, 0.0), imbalance, imbalance, place, 1.0, 0)


@compiled
def correction_judged(old: Correction, residual: complex, margin: float, held: bool) -> Correction:
    """Compare a mean vibration with that of staying at the best place so far.

    Args: `held`: whether friction held a mass short of its goal. Where nothing got worse a further step adds
    to the goal, so that the mass breaks away.
    Returns: The correction from the better place; half the share when the step did not help.
    """
    here, best, half = abs(residual), abs(old.residual), 0.5 * old.share
    if here < best - margin or old.share == 0:
        return Correction(old.goal, residual, old.aim, old.aim, old.goal, old.share, old.steps)
    if held and here <= best + margin:
        return Correction(old.goal, residual, old.aim, old.aim, old.goal, half, old.steps)
    return Correction(old.place, old.residual, old.imbalance, old.imbalance, old.place, half, old.steps)


@compiled
def correction_aim(old: Correction, influence: complex) -> complex:
    """Imbalance for which the next targets are, kg m. Args: `influence`: alpha as configured, m/(kg m)."""
    return old.imbalance + old.share * old.residual / influence


@compiled
def correction_step(old: Correction, aim: complex, goal: tuple[float, float]) -> Correction:
    """One step from the best place. Returns: With its aim and goal."""
    return Correction(old.place, old.residual, old.imbalance, aim, goal, old.share, old.steps + 1)


@compiled
def correction_back(old: Correction) -> Correction:
    """Back to the best place, where the next mean is the last. Returns: Correction with no share left."""
    return Correction(old.place, old.residual, old.imbalance, old.imbalance, old.place, 0.0, old.steps)


@compiled
def correction_ends(correction: Correction, margin: float) -> bool:
    """Whether no further step is worth its time."""
    shown = abs(correction.residual) > _WORTH * margin
    return not shown or correction.share < _LEAST_SHARE or correction.steps >= MOST_STEPS
