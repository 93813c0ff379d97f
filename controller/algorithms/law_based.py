"""The law-based algorithm: valve-open times straight from the flow law, and it learns the influence
coefficient.

From a wanted balancing moment to the fills of the pairs it goes by `pair_changes` and `fill_for_moment`.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.controller.algorithms.algorithm import Command, Measurement, ValveCommand, opening
from ringbalance.controller.liquid_ring.motion import PairState
from ringbalance.controller.liquid_ring.plant import DiscState, LiquidRing
from ringbalance.controller.rotor import chamber_directions, disc_unbalance
from ringbalance.reduced_model.law.model import MomentCurve
from ringbalance.scene.arrays import FloatArray

PRIOR_STANDARD_DEVIATION: Final = 0.5
"""Standard deviation, relative, of the assumed influence coefficient before the first operation."""
LEAST_LAW_STANDARD_DEVIATION: Final = 0.05
"""Standard deviation, relative, below which no flow law's velocity is trusted."""
MAGNITUDE_RANGE: Final = 10.0
"""Factor around the assumed magnitude that the estimate keeps to: no response proves no coefficient."""


@dataclass(frozen=True, kw_only=True)
class _InfluenceEstimate:
    """Estimate of K in V1 = V0 + K U."""

    value: complex
    """K, m/(kg m)."""
    variance: float
    """Mean square of its error, both components together, (m/(kg m))^2."""

    def updated(
        self,
        *,
        moment_change: complex,
        vibration_change: complex,
        noise_variance: float,
        law_standard_deviation: float,
        assumed_magnitude: float,
    ) -> _InfluenceEstimate:
        """Learn from one operation, dV = K dU + noise, by a Kalman filter of one complex number.

        gain = P dU* / (P |dU|^2 + R), K <- K + gain (dV - K dU), P <- P R/(P |dU|^2 + R), with R =
        `noise_variance` + (s |K dU|)^2, s = `law_standard_deviation` (relative): a response that noise could
        have made moves K little, and no moment counts as better known than by s. P never falls below
        (s |K|)^2, so the estimate keeps following. All SI; variances are of both components together.
        Source: Kalman, "A New Approach to Linear Filtering and Prediction Problems", J. Basic Eng. 82 (1960).
        """
        k, p = self.value, self.variance
        expected = abs(moment_change) ** 2 * p
        if expected == 0:
            return self
        rest = noise_variance + abs(law_standard_deviation * k * moment_change) ** 2
        gain = p * moment_change.conjugate() / (expected + rest)
        value = _held(k + gain * (vibration_change - k * moment_change), k, assumed_magnitude)
        left = p * rest / (expected + rest)
        return _InfluenceEstimate(value=value, variance=max(left, abs(law_standard_deviation * value) ** 2))


@dataclass(frozen=True, kw_only=True)
class _LawBasedState:
    """Everything that the algorithm remembers between samples."""

    disc: DiscState
    """The chambers' liquid as the law has it, when the valves last opened."""
    influence: _InfluenceEstimate
    previous: Measurement | None = None
    """The last usable sample."""
    valves: tuple[ValveCommand, ...] = ()
    """What was commanded on it."""


@dataclass(frozen=True, kw_only=True)
class LawBased:
    """Valve-open times that take the whole residual away in one operation, t = (V/S) integral dx/u(x) for
    each pair.

    The residual unbalance V/K asks for a change of the disc's moment; the moment curve turns it into fill
    ratios of the pairs, the flow law into valve-open times, with the chambers' fills followed by the same law
    since the start.  After each operation K is re-estimated from what the vibration did (`updated`), so a
    wrong influence coefficient, lag angle or speed of the flow spoils only the first operation.  There is no
    gain to tune.

    Limits: a valve whose time is below minimum_gas_time does not open, one above maximum_gas_time is cut to
    it.  Where the law says that nothing flows, or that a chamber is empty, gas is given all the same, since
    fills and law are only assumed: `probe` long, or as long as the missing moment would take.
    At or below `limit` the algorithm rests.  A dropped sample or a NaN changes nothing: no valve opens, and
    the next usable sample shows the response.
    """

    ring: LiquidRing
    """The disc as the algorithm assumes it."""
    initial: DiscState
    """Its liquid at the start."""
    influence: complex
    """K before the first operation, m/(kg m)."""
    limit: float
    """m."""
    amplitude_noise: float
    """Standard deviation of a sample's amplitude, m."""
    phase_noise: float
    """Standard deviation of a sample's phase, rad."""
    probe: float
    """s."""
    minimum_gas_time: float
    """s."""
    maximum_gas_time: float
    """s."""
    offsets: tuple[float, ...] = ()
    """Added to a valve's time, one for each chamber, s: what the law does not know; empty: none."""

    @property
    def rises_tolerated(self) -> int:
        """Two: the first response corrects a belief that was wrong."""
        return 2

    @property
    def law_standard_deviation(self) -> float:
        """Standard deviation of the law's velocity at the start, relative."""
        pair, flow = self.initial.pairs[0], self.ring.model.flow
        found = flow.evaluate(
            fill_ratio=pair.fill, opposite_fill_ratio=pair.opposite_fill, gas_pressure=self.ring.gas_pressure
        )
        velocity = abs(float(found.velocity))
        own = float(found.uncertainty) / (2 * velocity) if velocity > 0 else 0.0
        return max(own, LEAST_LAW_STANDARD_DEVIATION)

    def start(self) -> _LawBasedState:
        variance = abs(PRIOR_STANDARD_DEVIATION * self.influence) ** 2
        estimate = _InfluenceEstimate(value=self.influence, variance=variance)
        return _LawBasedState(disc=self.initial, influence=estimate)

    def step(self, state: _LawBasedState, measurement: Measurement | None) -> tuple[_LawBasedState, Command]:
        if measurement is None or not measurement.usable(needs_phase=True):
            return state, Command(reason="no usable sample")
        seen = self._seen(state, measurement)
        if measurement.amplitude <= self.limit:
            return seen, Command(resting=True)
        command = opening(
            self._gas_times(seen, _vector(measurement)),
            minimum_gas_time=self.minimum_gas_time,
            maximum_gas_time=self.maximum_gas_time,
            offsets=self.offsets,
        )
        return replace(seen, valves=command.valves), command

    def _seen(self, state: _LawBasedState, now: Measurement) -> _LawBasedState:
        """Follow the liquid to the sample's time, and learn from the response."""
        before = state.previous
        if before is None or now.time <= before.time:
            return replace(state, previous=now, valves=())
        disc = self._advanced(state, now.time - before.time)
        if not state.valves:
            return replace(state, disc=disc, previous=now)
        influence = state.influence.updated(
            moment_change=self._moment(disc) - self._moment(state.disc),
            vibration_change=_vector(now) - _vector(before),
            noise_variance=self._noise(now) + self._noise(before),
            law_standard_deviation=self.law_standard_deviation,
            assumed_magnitude=abs(self.influence),
        )
        return _LawBasedState(disc=disc, influence=influence, previous=now)

    def _advanced(self, state: _LawBasedState, interval: float) -> DiscState:
        times = {valve.chamber: min(self._acting(valve), interval) for valve in state.valves}
        return self.ring.advance(state.disc, gas_times=times, duration=interval, points=1).state

    def _acting(self, valve: ValveCommand) -> float:
        """Of a valve-open time, s, what moves liquid by the law."""
        offset = self.offsets[valve.chamber] if self.offsets else 0.0
        return max(valve.duration - offset, 0.0)

    def _noise(self, sample: Measurement) -> float:
        return self.amplitude_noise**2 + (sample.amplitude * self.phase_noise) ** 2

    def _moment(self, disc: DiscState) -> complex:
        return complex(disc_unbalance(moment=self.ring.model.moment, fill_ratio=disc.fills()))

    def _gas_times(self, state: _LawBasedState, vibration: complex) -> tuple[tuple[int, float], ...]:
        pairs = state.disc.pairs
        moments = [self._pair_moments(pair) for pair in pairs]
        changes = pair_changes(
            wanted=-vibration / state.influence.value,
            bounds=[(low - now, high - now) for now, low, high in moments],
        )
        asked = [
            self._pair_time(index, pair, now + change)
            for index, (pair, (now, _, _), change) in enumerate(zip(pairs, moments, changes, strict=True))
            if change != 0
        ]
        return tuple(asked)

    def _pair_moments(self, pair: PairState) -> tuple[float, float, float]:
        """Now, smallest and largest."""
        low, high = self._range(pair)
        x = np.array([pair.fill, low, high])
        found = self.ring.model.moment.pair_moment(fill_ratio=x, opposite_fill_ratio=pair.total - x)
        return float(found[0]), float(found[1]), float(found[2])

    def _range(self, pair: PairState) -> tuple[float, float]:
        lowest = max(
            min(self.ring.residual_fill, pair.total / 2), pair.total - self.ring.model.flow.max_fill_ratio
        )
        return lowest, pair.total - lowest

    def _pair_time(self, index: int, pair: PairState, moment: float) -> tuple[int, float]:
        low, high = self._range(pair)
        curve, total = self.ring.model.moment, pair.total
        wanted = fill_for_moment(moment=curve, wanted=moment, total=total, lowest=low, highest=high)
        first = wanted < pair.fill
        chamber = index if first else index + self.ring.chambers // 2
        target = wanted if first else total - wanted
        time = self.ring.gas_time(pair, first=first, fill=target, longest=self.maximum_gas_time)
        blocked = time == 0 and target < (pair.fill if first else pair.opposite_fill)
        return chamber, self.probe if blocked else time


def _vector(measurement: Measurement) -> complex:
    return cmath.rect(measurement.amplitude, measurement.phase)


def _held(value: complex, before: complex, assumed: float) -> complex:
    magnitude = abs(value)
    if magnitude == 0:
        return before / abs(before) * assumed / MAGNITUDE_RANGE
    bounded = min(max(magnitude, assumed / MAGNITUDE_RANGE), assumed * MAGNITUDE_RANGE)
    return value * (bounded / magnitude)


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
