"""How a run ended, by its facts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ringbalance.controller.algorithms.built_in import BELOW_MINIMUM, NO_SAMPLE
from ringbalance.controller.formulas import NOTICEABLE, Cause, has_grown
from ringbalance.controller.liquid_ring.plant import DiscState, LiquidRing
from ringbalance.controller.rotor import chamber_letters
from ringbalance.controller.simulation import (
    NOISE_DEVIATIONS,
    Injection,
    Outcome,
    Sample,
    noise_floor,
)
from ringbalance.controller.tuning.loop_factor import LoopFactor
from ringbalance.reduced_model.injection.dynamics import Event
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True, eq=False)
class Facts:
    """What a finished run knows about itself."""

    scene: Scene
    plant: LiquidRing
    state: DiscState
    loop: LoopFactor
    own_algorithm: str
    """Name of the caller's; empty: that of the scene."""
    run: np.void
    """As it ended, of type `RUN`."""
    samples: tuple[Sample, ...]
    injections: tuple[Injection, ...]
    amplitude: FloatArray
    """True vibration, m zero-to-peak."""

    @property
    def time(self) -> float:
        """s."""
        return float(self.run["time"])

    @property
    def since(self) -> float:
        """s, from which on the true amplitude has not been above the limit; infinite while it is."""
        return float(self.run["since"])

    @property
    def drift(self) -> float:
        """Largest change of a fill ratio while the gas was off."""
        return float(self.run["drift"])

    @property
    def shortened(self) -> int:
        """Injections shortened or left out so that the driven chamber keeps its residual fill."""
        return int(self.run["shortened"])

    @property
    def refused(self) -> tuple[str, ...]:
        """Letters of the driven chambers of those in the last command."""
        letters = chamber_letters(self.scene.disc.chambers)
        return tuple(letters[i] for i in np.flatnonzero(self.run["refused"]))

    @property
    def cause(self) -> Cause:
        """Why the loop stopped cycling."""
        return Cause(int(self.run["cause"]))

    @property
    def initial_amplitude(self) -> float:
        """m."""
        return float(self.amplitude[0])

    @property
    def final_amplitude(self) -> float:
        """m."""
        return float(self.amplitude[-1])

    @property
    def noise_floor(self) -> float:
        """Rise of the amplitude between two samples that noise alone does not explain, m."""
        return noise_floor(
            amplitude_noise=self.scene.sensor.amplitude_noise,
            initial_amplitude=self.scene.rotor.initial_amplitude,
        )

    @property
    def overshoots(self) -> int:
        """Times that the residual turned between samples while above the limit."""
        return int(self.run["overshoots"])

    @cached_property
    def unreachable_amplitude(self) -> float:
        """Vibration that remains with the liquid at its best, m."""
        return self.plant.unreachable_vibration(state=self.state, rotor=self.scene.rotor)

    @property
    def beyond_disc(self) -> float:
        """The same with gas that drives a chamber down to its residual fill, m."""
        return self.plant.unreachable_vibration(
            state=self.state, rotor=self.scene.rotor, least_fill=self.plant.residual_fill
        )

    @property
    def settling_time(self) -> float | None:
        """s, from which on the amplitude first held; None when it has not, or is not expected to stay."""
        held_since = float(self.run["held_since"])
        if self.loop.stays and held_since < math.inf:
            return held_since
        return self.since if self.cause is Cause.AT_REST and self.since < math.inf else None

    @property
    def last_command(self) -> tuple[Injection, ...]:
        """The injections of the last command; empty when there was none."""
        return tuple(i for i in self.injections if i.time == self.injections[-1].time)

    @cached_property
    def outcome(self) -> Outcome:
        """How the run ended.

        SETTLED takes a true amplitude that held within the limit for the hold time in a loop that is expected
        to stay there, or a run in which nothing can change any more.  Both are known when they happen, so
        that a later time limit gives the same answer.
        """
        limit = self.scene.controller.limit
        if self.settling_time is not None:
            return Outcome.SETTLED
        if self.beyond_disc > limit and not self.loop.unstable:
            return Outcome.CAPACITY_EXCEEDED
        if self.run["drains"]:
            return Outcome.DRIFTING
        higher = self.final_amplitude > self.initial_amplitude + self.noise_floor
        if has_grown(self.cause, higher):
            return Outcome.DRIFTING if self.drift > NOTICEABLE else Outcome.DIVERGING
        if self.loop.unstable:
            return Outcome.UNSTABLE
        if self.unreachable_amplitude > limit:
            return Outcome.STALLED
        if min(self.since, float(self.run["held_since"])) < math.inf:
            return Outcome.HOLD_INCOMPLETE if self.loop.stays else Outcome.HOVERING
        if self.refused and self.cause is Cause.IDLE:
            return Outcome.CHAMBER_EMPTY
        if self.last_command and not longest(self).operation.moved:
            return _unmoved(self)
        return Outcome.TOO_MANY_SAMPLES if self.cause is Cause.SAMPLES else _out_of_time(self)


def longest(facts: Facts) -> Injection:
    """The longest injection of the last command; there must have been one."""
    return max(facts.last_command, key=lambda injection: injection.operation.duration)


def _unmoved(facts: Facts) -> Outcome:
    """Why the last command moved nothing."""
    if longest(facts).operation.event in {Event.EMPTY, Event.FULL}:
        return Outcome.CHAMBER_EMPTY
    return Outcome.GAS_TIME_TOO_SHORT if _over_too_soon(facts) else Outcome.STALLED


def _over_too_soon(facts: Facts) -> bool:
    """Whether the gas would drive liquid, had it the time to fill the chamber."""
    plant, done = facts.plant, longest(facts).operation
    if plant.dynamics.quasi_steady:
        return False
    flow, total = plant.model.flow, facts.state.pairs[0].total
    other = min(max(total - done.fill_after, 0.0), flow.max_fill_ratio)
    found = flow.evaluate(
        fill_ratio=done.fill_after, opposite_fill_ratio=other, gas_pressure=plant.gas_pressure
    )
    return bool(found.velocity > 0)


def unusable(facts: Facts) -> int:
    """Number of samples that every algorithm passed over."""
    return sum(sample.command.reason == NO_SAMPLE for sample in facts.samples)


def _out_of_time(facts: Facts) -> Outcome:
    if 2 * unusable(facts) > len(facts.samples):
        return Outcome.NO_SAMPLES
    if facts.drift > NOTICEABLE:
        return Outcome.DRIFTING
    if NOISE_DEVIATIONS * facts.scene.sensor.amplitude_noise > facts.scene.controller.limit:
        return Outcome.NOISE
    last = facts.samples[-1].command
    if not last.resting and not last.valves and last.reason == BELOW_MINIMUM:
        return Outcome.GAS_TIME_TOO_SHORT
    return Outcome.TIME_LIMIT
