"""Targets of the two masses, their assignment and correction, and the search by trial for better angles.

Angles are rotor-fixed, positive with the rotation.  The masses share one circular track and cannot pass each
other; `gap` is the angle that one of them occupies, arc length over guide radius.

Fine tuning moves both masses a little, in four ways, and keeps the better angles.  The paper takes the best
of four moves even if all are worse than staying, which gives a limit cycle as wide as the move near the
optimum. Here staying is the fifth candidate; if it is best, moves are halved.

Correction is a step by the influence coefficient.  With the masses at rest the mean vibration in the rotor's
frame is z = alpha (U + p), p = b sum exp(j phi_i).  z/alpha is therefore the residual imbalance, and targets
for the estimate plus z/alpha cancel it.  With alpha as configured in place of the true one each step leaves
the fraction |1 - alpha_true/alpha| of z: a stiffness known to a few per cent takes two steps.  A step that
does not help is halved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

from ringbalance.controller.eccentric_mass.memory import Pair
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray, Record
from ringbalance.scene.platform.compiled import in_place


class Targets(NamedTuple):
    """Angles that cancel an imbalance as far as two masses can."""

    first: float
    """phi_m + half_angle, rad within (-pi, pi]."""
    second: float
    """phi_m - half_angle, rad within (-pi, pi]."""
    half_angle: float
    """Angle of each mass from the imbalance, rad."""
    residual: float
    """Residual imbalance, kg m."""
    saturated: bool
    """True if the imbalance exceeds what the masses cancel; they then lie side by side."""


@in_place
def wrapped(angle: float) -> float:
    """Angle wrapped into (-pi, pi], rad."""
    return math.pi - (math.pi - angle) % (2 * math.pi)


@in_place
def target_angles(imbalance: float, phase: float, moment: float, gap: float) -> Targets:
    """Angles at which the masses cancel an imbalance.

    phi = phi_m +- beta, beta = arccos(-U/2b), at most pi - gap/2 so that the masses do not overlap on the far
    side of the imbalance.  At that bound the residual is U - 2 b cos(gap/2).
    Source: Eqs. 25 and 26 of the paper on eccentric masses, whose arccos lost its sign and which lets masses
    overlap.
    """
    reach = math.acos(max(-0.5 * imbalance / moment, -1.0))
    half_angle = min(reach, math.pi - 0.5 * gap)
    left = imbalance + 2 * moment * math.cos(half_angle)
    saturated = half_angle < reach or imbalance > 2 * moment
    return Targets(
        wrapped(phase + half_angle),
        wrapped(phase - half_angle),
        half_angle,
        max(left, 0.0) if saturated else 0.0,
        saturated,
    )


@in_place
def assign(first: float, second: float, target_one: float, target_two: float) -> Pair:
    """Assign each mass to a target by the shortest pair of travels on which the masses do not meet.

    The sum of squared travels is least over both assignments and all whole turns that keep the order of the
    masses on the track.  Masses that share one law of motion then never come closer than they are at the
    start or at the end.
    Returns: Travel of each mass, rad, signed, whole turns included; of two equal pairs, first mass to first
        target.
    Source: Eqs. 27 and 28 of the paper on eccentric masses, with angles wrapped.
    """
    lead, least, best = (second - first) % (2 * math.pi), math.inf, (0.0, 0.0)
    for goal, other in ((target_one, target_two), (target_two, target_one)):
        # Keeping the order fixes the second travel once the first one is chosen.
        change = (other - goal) % (2 * math.pi) - lead
        for turn in (-1, 0, 1):
            travel = wrapped(goal - first) + 2 * math.pi * turn
            cost = travel**2 + (travel + change) ** 2
            if cost < least - 1e-12:
                least, best = cost, (travel, travel + change)
    return best


MOVES = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))


@in_place
def begin_tuning(tuning: Record, goal: Sequence[float], amplitude: float, step: float) -> None:
    """Begin the search by trial from a goal and its mean amplitude, m. Args: `step`: first move, rad."""
    set_pair(tuning.base, goal[0], goal[1])
    tuning.least, tuning.move_size = amplitude, step
    tuning.move, tuning.failed, tuning.done = 0, 0, 0


@in_place
def tuning_place(tuning: Record) -> Pair:
    """Angles of the present trial, rad; the best angles when the search is done."""
    step = 0.0 if tuning.done else tuning.move_size
    first, second = MOVES[tuning.move]
    return tuning.base[0] + step * first, tuning.base[1] + step * second


@in_place
def next_trial(tuning: Record, objective: float, margin: float, stop: float) -> None:
    """Process the result of the present trial; a move that helped is tried again first.

    Args: `objective`: mean amplitude of the trial, m; infinite for angles at which the masses overlap.
    Source: section 3.6 of the paper on eccentric masses, with staying as a candidate and halved moves.
    """
    if objective < tuning.least - margin:
        first, second = tuning_place(tuning)
        set_pair(tuning.base, first, second)
        tuning.least, tuning.failed = objective, 0
        return
    tuning.move, tuning.failed = (tuning.move + 1) % 4, tuning.failed + 1
    if tuning.failed > 3:
        tuning.move_size, tuning.failed = 0.5 * tuning.move_size, 0
        tuning.done = 1 if tuning.move_size < stop else 0


@in_place
def separation(first: float, second: float) -> float:
    """Smaller angle between two masses, within [0, pi], rad."""
    return abs(math.pi - (math.pi - second + first) % (2 * math.pi))


MAX_CORRECTION_STEPS: Final = 8
_LEAST_STEP_FRACTION: Final = 0.25
"""Smallest correction step, as a fraction of the full step; steps that do not help are halved."""
_SHOWN_MARGINS: Final = 2.0
"""Smallest vibration worth a further step, in margins of the mean: a smaller one shows no gain."""


@in_place
def begin_correction(correction: Record, imbalance: complex, goal: Pair) -> None:
    """Begin with the first targets, for the estimated imbalance; no mean vibration is known yet."""
    correction.residual, correction.share, correction.steps = complex(math.inf, 0.0), 1.0, 0
    correction.aim, correction.best_aim = imbalance, imbalance
    set_pair(correction.goal, goal[0], goal[1])
    set_pair(correction.best_goal, goal[0], goal[1])


@in_place
def judge_correction(correction: Record, residual: complex, margin: float, held: bool) -> bool:
    """Compare a mean vibration with that of the best goal so far, and keep the better goal.

    A step that did not help is halved. Args: `held`: True if friction held a mass short of its goal; if the
    vibration did not rise, the new goal is kept, so that the next step adds to it and the mass breaks away.
    Returns: True if the correction is complete: no gain to show, steps too small, or too many.
    """
    amplitude, best = abs(residual), abs(correction.residual)
    better = amplitude < best - margin or correction.share == 0
    if not better:
        correction.share *= 0.5
    if better or (held and amplitude <= best + margin):
        correction.residual, correction.best_aim = residual, correction.aim
        set_pair(correction.best_goal, correction.goal[0], correction.goal[1])
    else:
        aim_back(correction)
    shown = abs(correction.residual) > _SHOWN_MARGINS * margin
    small = correction.share < _LEAST_STEP_FRACTION
    return bool(not shown or small or correction.steps >= MAX_CORRECTION_STEPS)


@in_place
def aim_back(correction: Record) -> None:
    """Reset aim and targets to the best goal so far."""
    correction.aim = correction.best_aim
    set_pair(correction.goal, correction.best_goal[0], correction.best_goal[1])


@in_place
def set_pair(pair: FloatArray, first: float, second: float) -> None:
    """Write two numbers into an array."""
    pair[0], pair[1] = first, second


def reach_of(scene: EccentricScene) -> float:
    """Largest imbalance that the masses cancel, kg m."""
    moment = PlantParameters.of(scene).moment
    # An imbalance beyond all reach less its residual, with the masses side by side.
    beyond = 4 * moment
    return beyond - target_angles(beyond, 0.0, moment, scene.masses.gap).residual
