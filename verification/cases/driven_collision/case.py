"""The least distance of two masses on the way to targets that are assigned by the paper's rule."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.evidence import Evidence, Level, as_found

_CASES: Final = 20_000
_SEED: Final = 20_200_627
_INSTANTS: Final = 201
_FASTER: Final = 2.0
"""Pace of one mass over that of the other, where these differ."""
_ROUND_OFF: Final = 1e-9
"""rad."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Fractions of random cases in which the masses come nearer on the way than at both ends of it."""
    start, goal = _drawn(np.random.default_rng(_SEED))
    printed, other = _assigned(start, goal), _assigned(start, goal)[::-1]
    fractions = {
        "printed": _nearer(start, printed, faster=1.0),
        "other_assignment": _nearer(start, other, faster=1.0),
        "unequal_pace": _nearer(start, printed, faster=_FASTER),
    }
    return Evidence(
        found=as_found(nearer=fractions[defect or "printed"]),
        numbers={
            "cases": _CASES,
            "other": fractions["other_assignment"],
            "unequal": fractions["unequal_pace"],
        },
    )


def _drawn(random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Angles of the masses at the start and of their targets, rad, each of shape (2, cases).

    Targets are phi_im +- beta (Eq. 26), with beta on the far side of the imbalance.
    """
    start = random.uniform(-np.pi, np.pi, (2, _CASES))
    phase = random.uniform(-np.pi, np.pi, _CASES)
    half_angle = random.uniform(np.pi / 2, np.pi, _CASES)
    return start, np.stack([phase + half_angle, phase - half_angle])


def _assigned(start: FloatArray, goal: FloatArray) -> FloatArray:
    """Targets by mass, of the least sum of squared travels. Source: Eqs. 27 and 28."""
    straight = np.sum((start - goal) ** 2, axis=0)
    crossed = np.sum((start - goal[::-1]) ** 2, axis=0)
    return np.where(straight <= crossed, goal, goal[::-1])


def _nearer(start: FloatArray, goal: FloatArray, *, faster: float) -> float:
    """Fraction of the cases in which the distance along the track falls below that at both ends.

    Both masses approach their targets exponentially; the first one `faster` times as fast.
    """
    left = np.exp(-np.linspace(0.0, 30.0, _INSTANTS))
    left[0], left[-1] = 1.0, 0.0
    least = np.full(_CASES, np.inf)
    for fraction in left:
        difference = (goal[1] + (start[1] - goal[1]) * fraction) - (
            goal[0] + (start[0] - goal[0]) * fraction**faster
        )
        least = np.minimum(least, _distance(difference))
    ends = np.minimum(_distance(start[1] - start[0]), _distance(goal[1] - goal[0]))
    return float(np.mean(least < ends - _ROUND_OFF))


def _distance(difference: FloatArray) -> FloatArray:
    """The shorter way round between two masses, rad."""
    return np.asarray(np.abs(np.pi - (np.pi - difference) % (2 * np.pi)), dtype=np.float64)
