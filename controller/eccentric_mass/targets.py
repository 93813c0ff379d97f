"""Where the two masses should lie, which of them goes where, and the search by trial for a better place.

Angles are rotor-fixed, positive with the rotation.  The masses share one circular track and cannot pass each
other; `gap` is the angle that one of them takes up, arc length over guide radius.

Fine tuning moves both masses a little, each way, and keeps the better place.  The paper takes the best of
four moves, even when all of them are worse than staying: near the best place that is a limit cycle as wide as
the move.  Here staying is the fifth candidate, and when it wins, moves are halved.

Correction is a step by the influence coefficient.  With the masses at rest the mean vibration in the
rotor's frame is z = alpha (U + p), p = b sum exp(j phi_i).  z/alpha is therefore the imbalance that is left
over, and targets for the estimate plus z/alpha undo it.  With alpha as configured in place of the true one
each step leaves the fraction |1 - alpha_true/alpha| of z: a stiffness known to a few per cent takes two
steps.  A step that does not help is halved.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.platform.compiled import compiled


class Targets(NamedTuple):
    """Angles that undo an imbalance as far as two masses can."""

    first: float
    """phi_m + half_angle, rad within (-pi, pi]."""
    second: float
    """phi_m - half_angle, rad within (-pi, pi]."""
    half_angle: float
    """Of each mass from the imbalance, rad."""
    residual: float
    """Imbalance that is left, kg m."""
    saturated: bool
    """Whether the imbalance is more than the masses can undo, which takes them side by side."""


class _Assignment(NamedTuple):
    """How far each mass goes."""

    first: float
    """Travel of the first mass, rad, signed, whole turns included."""
    second: float
    """Travel of the second mass, rad."""
    swapped: bool
    """Whether the first mass goes to the second target."""


@compiled
def wrapped(angle: float) -> float:
    """An angle within (-pi, pi]. Returns: The same direction, rad."""
    return math.pi - (math.pi - angle) % (2 * math.pi)


@compiled
def target_angles(imbalance: float, phase: float, moment: float, gap: float) -> Targets:
    """Angles at which the masses undo an imbalance.

    phi = phi_m +- beta, beta = arccos(-U/2b), at most pi - gap/2 so that the masses do not overlap on the far
    side of the imbalance.  Where it is cut, U - 2 b cos(gap/2) is left.
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


@compiled
def assign(first: float, second: float, target_one: float, target_two: float) -> _Assignment:
    """Send each mass to a target by the shortest pair of travels on which they do not meet.

    The sum of squared travels is least over both assignments and all whole turns that keep the order of the
    masses on the track.  Masses that share one law of motion then never come closer than they are at the
    start or at the end.
    Returns: _Assignment; of two equal ones the unswapped.
    Source: Eqs. 27 and 28 of the paper on eccentric masses, with angles wrapped.
    """
    lead = (second - first) % (2 * math.pi)
    best = _Assignment(0.0, 0.0, False)
    least = math.inf
    for swapped in (False, True):
        goal = target_two if swapped else target_one
        other = target_one if swapped else target_two
        # Keeping the order fixes the second travel once the first one is chosen.
        change = (other - goal) % (2 * math.pi) - lead
        for turn in (-1, 0, 1):
            travel = wrapped(goal - first) + 2 * math.pi * turn
            cost = travel**2 + (travel + change) ** 2
            if cost < least - 1e-12:
                least, best = cost, _Assignment(travel, travel + change, swapped)
    return best


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


def reach_of(scene: EccentricScene) -> float:
    """Largest imbalance that the masses cancel, kg m."""
    moment = PlantParameters.of(scene).moment
    gap = scene.masses.arc_length / scene.masses.guide_radius
    # Of an imbalance beyond all reach, what the masses side by side leave is what they lack.
    beyond = 4 * moment
    return beyond - target_angles(beyond, 0.0, moment, gap).residual
