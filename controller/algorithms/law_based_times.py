"""From a wanted balancing moment to valve-open times: which pairs, which fills, how long by the flow law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.transfer import Drive, Event, Integrator
from ringbalance.controller.rotor import chamber_directions
from ringbalance.reduced_model.law.model import MomentCurve
from ringbalance.scene.arrays import FloatArray

SCAN: Final = 33
ROUNDS: Final = 11
FILL_ERROR: Final = 1e-9
"""Error in fill ratio at which a valve-open time is good enough."""
MAX_NEWTON: Final = 30
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


def gas_time(*, drive: Drive, fill: float, integrator: Integrator, longest: float) -> float:
    """Valve-open time, s, that lowers the driven chamber to a fill ratio, t = (V/S) integral dx/u(x).

    Found by inverting an integrator's x(t) with Newton's method, dx/dt = -(S/V) u, within a bracket. At most
    `longest`; zero when the fill is not below the present one or nothing flows; the time of the stall when
    the flow stalls before; below the smallest possible fill the last velocity is kept.
    Source: section 5.1 of the liquid-ring paper in the limit of small segments, solved for the time.
    """
    if fill >= drive.fill:
        return 0.0
    instants = np.linspace(0.0, longest, SCAN)
    path = integrator(drive, instants)
    if path.event is Event.BLOCKED:
        return 0.0
    reached = path.fill <= fill
    if not np.any(reached):
        return _time_to_the_end(drive, fill, path.event, path.event_time, longest)
    first = int(np.argmax(reached))
    before, after = float(instants[first - 1]), float(instants[first])
    if path.event_time is not None:
        after = min(after, path.event_time)
    above, below = float(path.fill[first - 1]), float(path.fill[first])
    guess = before + (after - before) * (above - fill) / (above - below)
    return _inverted(drive, fill, integrator, (before, guess, after))


def _time_to_the_end(
    drive: Drive, fill: float, event: Event, event_time: float | None, longest: float
) -> float:
    if event_time is None:
        return longest
    if event not in {Event.EMPTY, Event.FULL}:
        return min(event_time, longest)
    velocity = float(drive.flow(drive.lowest).velocity)
    more = (drive.lowest - fill) / (drive.exchange_rate * velocity) if velocity > 0 else 0.0
    return min(event_time + more, longest)


def _inverted(
    drive: Drive, fill: float, integrator: Integrator, bracket: tuple[float, float, float]
) -> float:
    low, t, high = bracket
    for _ in range(MAX_NEWTON):
        x = float(integrator(drive, np.array([t])).fill[-1])
        if abs(x - fill) <= FILL_ERROR or high - low <= 4e-16 * high:
            break
        low, high = (t, high) if x > fill else (low, t)
        rate = drive.exchange_rate * float(drive.flow(x).velocity)
        step = t + (x - fill) / rate if rate > 0 else high
        t = step if low < step < high else (low + high) / 2
    return t
