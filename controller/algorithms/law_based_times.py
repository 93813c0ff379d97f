"""From a wanted balancing moment to the fills of the pairs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.controller.rotor import chamber_directions
from ringbalance.reduced_model.law.model import MomentCurve
from ringbalance.scene.arrays import FloatArray

SCAN: Final = 33
ROUNDS: Final = 11
END_STEP: Final = 1e-3
"""Share of the range of x over which a slope at its end is taken."""


def pair_changes(*, wanted: complex, bounds: Sequence[tuple[float, float]]) -> tuple[float, ...]:
    """Split a change of the disc's moment over its pairs, each within the bounds of its change, kg m.

    The change goes to the two directions on either side of it; what a pair cannot give goes to the pairs that
    are left; what no pair can give is asked, by its component, of those already at their ends, for the fills
    are only assumed.
    Source: section 4.2 of the liquid-ring paper, by oblique components for other numbers of chambers.
    """
    axes = [complex(e) for e in chamber_directions(2 * len(bounds))[: len(bounds)]]
    fixed: dict[int, float] = {}
    sense: dict[int, float] = {}
    free = dict.fromkeys(range(len(bounds)), 0.0)
    while free:
        left = wanted - sum(fixed[p] * axes[p] for p in fixed)
        free = _shares(left, {p: axes[p] for p in free})
        over = {p: min(max(c, bounds[p][0]), bounds[p][1]) for p, c in free.items()}
        over = {p: c for p, c in over.items() if c != free[p]}
        if not over:
            break
        sense |= {p: free[p] - bound for p, bound in over.items()}
        fixed |= over
        free = {p: c for p, c in free.items() if p not in over}
    missing = wanted - sum(c * axes[p] for p, c in (fixed | free).items())
    more = {p: c + _onward((missing * axes[p].conjugate()).real, sense[p]) for p, c in fixed.items()}
    return tuple((free | more)[p] for p in range(len(bounds)))


def _onward(component: float, sense: float) -> float:
    """Only in the sense in which the pair was asked for more than it has."""
    return component if component * sense > 0 else 0.0


def _shares(wanted: complex, axes: dict[int, complex]) -> dict[int, float]:
    """Components along the two neighbouring directions; along the axis when only one is there."""
    none = dict.fromkeys(axes, 0.0)
    if len(axes) == 1:
        return {p: (wanted * e.conjugate()).real for p, e in axes.items()}
    ends = [(p, s, s * e) for p, e in axes.items() for s in (1.0, -1.0)]
    ends.sort(key=lambda end: float(np.angle(end[2])) % (2 * np.pi))
    slack = -1e-12 * abs(wanted)
    for (p, s, a), (q, t, b) in zip(ends, [*ends[1:], ends[0]], strict=True):
        between = (a.conjugate() * b).imag
        first = (wanted.conjugate() * b).imag / between
        second = (a.conjugate() * wanted).imag / between
        if min(first, second) >= slack:
            return none | {p: s * max(first, 0.0), q: t * max(second, 0.0)}
    return none


def fill_for_moment(
    *, moment: MomentCurve, wanted: float, total: float, lowest: float, highest: float
) -> float:
    """Fill ratio of the positive chamber at which a pair has a moment, kg m, growing with that fill.

    Beyond the ends it continues straight, so that it may lie outside [lowest, highest].
    """

    def of(x: FloatArray) -> FloatArray:
        other = np.clip(total - x, lowest, highest)
        return moment.pair_moment(fill_ratio=x, opposite_fill_ratio=other)

    if highest <= lowest:
        return lowest
    step = END_STEP * (highest - lowest)
    ends = of(np.array([lowest, lowest + step, highest - step, highest]))
    if wanted <= ends[0]:
        return lowest + float((wanted - ends[0]) / (ends[1] - ends[0])) * step
    if wanted >= ends[3]:
        return highest + float((wanted - ends[3]) / (ends[3] - ends[2])) * step
    low, high = lowest, highest
    for _ in range(ROUNDS):
        x = np.linspace(low, high, SCAN)
        above = of(x) >= wanted
        above[0], above[-1] = False, True
        first = int(np.argmax(above))
        low, high = float(x[first - 1]), float(x[first])
    return high
