"""How a finished run ended, by its facts, and what it says: its numbers and what to do next, as findings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.controller.algorithms.built_in import BELOW_MINIMUM, NO_SAMPLE
from ringbalance.controller.balancer import FURTHER
from ringbalance.controller.liquid_ring.loop_factor import LoopFactor
from ringbalance.controller.liquid_ring.plant import (
    LEAST_PRESSURE,
    NEARLY_EMPTY,
    LiquidRing,
    starting_pressure,
)
from ringbalance.controller.loop_records import AT_REST, IDLE, NOTICEABLE, RISING, SAMPLES
from ringbalance.controller.rotor import chamber_letters
from ringbalance.controller.simulation import NOISE_DEVIATIONS, Injection, Outcome, Sample, noise_floor
from ringbalance.controller.terms import dead_time
from ringbalance.reduced_model.injection.dynamics import Event
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.results.rows import Finding, Value, sentences
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

_BY_SETTINGS: Final = {
    *(Outcome.HOVERING, Outcome.UNSTABLE, Outcome.TIME_LIMIT),
    *(Outcome.DIVERGING, Outcome.GAS_TIME_TOO_SHORT),
}
"""Ends that other settings may change."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Facts:
    """What a finished run knows about itself."""

    scene: Scene
    plant: LiquidRing
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
    def refused(self) -> tuple[str, ...]:
        """Letters of the driven chambers of those in the last command."""
        letters = chamber_letters(self.scene.disc.chambers)
        return tuple(letters[i] for i in np.flatnonzero(self.run["refused"]))

    @cached_property
    def unreachable_amplitude(self) -> float:
        """Vibration that remains with the liquid at its best, m."""
        return self.plant.unreachable_vibration(rotor=self.scene.rotor)

    @property
    def beyond_disc(self) -> float:
        """The same with gas that drives a chamber down to its residual fill, m."""
        return self.plant.unreachable_vibration(rotor=self.scene.rotor, least_fill=self.plant.residual_fill)

    @property
    def settling_time(self) -> float | None:
        """s, from which on the amplitude held; None when it has not."""
        first, last = float(self.run["held_since"]), float(self.run["since"])
        if self.run["settled"]:
            return first
        return last if self.run["cause"] == AT_REST and last < math.inf else None

    @property
    def last_command(self) -> tuple[Injection, ...]:
        """The injections of the last command; empty when there was none."""
        return tuple(i for i in self.injections if i.time == self.injections[-1].time)

    @property
    def longest(self) -> Injection | None:
        """The longest injection of the last command."""
        return max(self.last_command, key=lambda injection: injection.duration, default=None)

    @property
    def moves(self) -> bool:
        """Whether that has moved liquid, or there was none."""
        return self.longest is None or self.longest.moved

    @property
    def unusable(self) -> int:
        """Number of samples that every algorithm passed over."""
        return sum(sample.command.reason == NO_SAMPLE for sample in self.samples)

    @cached_property
    def outcome(self) -> Outcome:
        """How the run ended.

        SETTLED takes a true amplitude that held within the limit for the hold time and then in all but 1 % of
        the samples of a further minute, or a run in which nothing can change any more.  Both are known when
        they happen, so that a later time limit gives the same answer.
        """
        limit, cause = self.scene.controller.limit, self.run["cause"]
        if self.settling_time is not None:
            return Outcome.SETTLED
        if self.beyond_disc > limit and not self.loop.unstable:
            return Outcome.CAPACITY_EXCEEDED
        if self.run["drains"]:
            return Outcome.DRIFTING
        higher = self.amplitude[-1] > self.amplitude[0] + noise_floor(self.scene)
        if cause == RISING or (cause == IDLE and higher):
            return Outcome.DRIFTING if self.run["drift"] > NOTICEABLE else Outcome.DIVERGING
        if self.loop.unstable:
            return Outcome.UNSTABLE
        if self.unreachable_amplitude > limit:
            return Outcome.STALLED
        if self.run["lost"] or min(self.run["since"], self.run["held_since"]) < math.inf:
            return Outcome.HOVERING if self.run["lost"] else Outcome.HOLD_INCOMPLETE
        if self.refused and cause == IDLE:
            return Outcome.CHAMBER_EMPTY
        if self.longest is not None and not self.longest.moved:
            return _unmoved(self, self.longest)
        return Outcome.TOO_MANY_SAMPLES if cause == SAMPLES else _out_of_time(self)


def _unmoved(facts: Facts, last: Injection) -> Outcome:
    """Why the last command moved nothing; gas that would drive it may lack the time to fill the chamber."""
    plant = facts.plant
    if last.event in {Event.EMPTY, Event.FULL}:
        return Outcome.CHAMBER_EMPTY
    if plant.dynamics.quasi_steady:
        return Outcome.STALLED
    other = min(max(plant.total - last.fill_after, 0.0), plant.model.flow.max_fill_ratio)
    flow = plant.model.flow.evaluate(
        fill_ratio=last.fill_after, opposite_fill_ratio=other, gas_pressure=plant.gas_pressure
    )
    return Outcome.GAS_TIME_TOO_SHORT if flow.velocity > 0 else Outcome.STALLED


def _out_of_time(facts: Facts) -> Outcome:
    if 2 * facts.unusable > len(facts.samples):
        return Outcome.NO_SAMPLES
    if facts.run["drift"] > NOTICEABLE:
        return Outcome.DRIFTING
    if NOISE_DEVIATIONS * facts.scene.sensor.amplitude_noise > facts.scene.controller.limit:
        return Outcome.NOISE
    last = facts.samples[-1].command
    if not last.resting and not last.valves and last.reason == BELOW_MINIMUM:
        return Outcome.GAS_TIME_TOO_SHORT
    return Outcome.TIME_LIMIT


def run_findings(facts: Facts) -> tuple[Finding, ...]:
    """The first says how the run ended, the others what stands behind it and what to change."""
    outcome = facts.outcome
    code = outcome.value
    if not facts.moves:
        unmoved = {Outcome.STALLED: "stalled_at_start", Outcome.GAS_TIME_TOO_SHORT: "injection_too_short"}
        code = unmoved.get(outcome, code)
    numbers = _numbers(facts)
    ended = Finding(code=code, values={name: numbers[name] for name in sentences()[code].values})
    return (ended, *_causes(facts), *_shortened(facts))


def _numbers(facts: Facts) -> dict[str, Value]:
    """Of which a sentence takes what it names."""
    settings, run = facts.scene.controller, facts.scene.run
    numbers: dict[str, Value] = {
        "initial_amplitude": float(facts.amplitude[0]),
        "final_amplitude": float(facts.amplitude[-1]),
        "limit": settings.limit,
        "time": float(facts.run["time"]),
        "time_limit": run.time_limit,
        "hold_time": settings.hold_time,
        "further": FURTHER,
        "lost": int(facts.run["lost"]),
        "settling_time": facts.settling_time,
        "since": float(facts.run["since"]),
        "loop_factor": facts.loop.value,
        "loop_factor_limit": facts.loop.limit,
        "minimum_gas_time": settings.minimum_gas_time,
        "noise": facts.scene.sensor.amplitude_noise,
        "deviations": NOISE_DEVIATIONS,
        "samples": len(facts.samples),
        "unusable": facts.unusable,
    }
    if facts.longest is not None:
        numbers |= {"duration": facts.longest.duration, "chamber": facts.longest.chamber}
    if facts.outcome is Outcome.STALLED:
        numbers |= _pressures(facts)
    if facts.outcome is Outcome.CAPACITY_EXCEEDED:
        numbers |= _moments(facts)
    if facts.outcome is Outcome.CHAMBER_EMPTY and facts.refused:
        numbers |= {"chamber": facts.refused[0]}
    return numbers


def _causes(facts: Facts) -> Iterator[Finding]:
    """What a formula or a count explains; what to change, runs of drawn devices tell."""
    outcome = facts.outcome
    if outcome is Outcome.HOVERING:
        yield from _noise(facts)
    if outcome in {Outcome.TIME_LIMIT, Outcome.GAS_TIME_TOO_SHORT}:
        yield from _dead_time(facts)
    if outcome is Outcome.DIVERGING:
        yield Finding(code="check_direction")
    if outcome is Outcome.STALLED and facts.unreachable_amplitude > facts.scene.controller.limit:
        yield Finding(code="unbalance_beyond_gas", values=_moments(facts))
    if outcome is Outcome.DRIFTING:
        total = 2 * facts.scene.disc.initial_fill
        fill = total - min(facts.plant.residual_fill, total / 2)
        yield Holding.of(facts.scene, fill_ratio=fill).finding or Finding(code="tube_runs_back")
    if outcome in _BY_SETTINGS:
        code = "own_overshoots" if facts.own_algorithm else "overshoots"
        yield Finding(code=code, values={"overshoots": int(facts.run["overshoots"])})


def _noise(facts: Facts) -> Iterator[Finding]:
    sigma, deviation = facts.scene.sensor.amplitude_noise, facts.loop.deviation
    if NOISE_DEVIATIONS * sigma > facts.scene.controller.limit:
        yield Finding(code="sensor_noise_too_high", values={"noise": sigma})
    elif deviation is not None and math.isfinite(deviation):
        yield Finding(code="noise_sustained", values={"deviation": deviation})


def _dead_time(facts: Facts) -> list[Finding]:
    """That an amplitude above the limit stands still, as its valve-open time moves nothing."""
    scene, loop = facts.scene, facts.loop
    if facts.own_algorithm or scene.controller.kind == "trial" or loop.rate == 0.0:
        return []
    lost = dead_time(scene, facts.plant.model, rate=loop.rate)
    rest = max(lost - min(scene.controller.offsets(scene.disc.chambers)), 0.0)
    per_time = loop.rate if scene.controller.kind == "law_based" else 1.0 / scene.controller.proportional
    if rest * per_time <= scene.controller.limit:
        return []
    return [Finding(code="dead_time", values={"standing_amplitude": rest * per_time, "dead_time": lost})]


def _shortened(facts: Facts) -> Iterator[Finding]:
    if count := int(facts.run["shortened"]):
        numbers: dict[str, Value] = {"count": count, "residual_fill": facts.plant.residual_fill}
        yield Finding(code="injections_shortened", values=numbers)


def _moments(facts: Facts) -> dict[str, Value]:
    """The unbalance, the usable moment of a pair under the scene's gas, and what is left at best."""
    return {
        "unbalance": abs(facts.scene.rotor.initial_unbalance),
        "pair_moment": abs(facts.plant.largest_pair_moment()),
        "unreachable": facts.plant.unreachable_vibration(rotor=facts.scene.rotor),
    }


def _pressures(facts: Facts) -> dict[str, Value]:
    """Where the gas drives no liquid, and the pressures that would; None: its liquid has left the port."""
    plant, still = facts.plant, None if facts.moves else facts.longest
    lowest = max(0.0, plant.total - plant.model.flow.max_fill_ratio)
    numbers: dict[str, Value] = {
        "gas_pressure": plant.gas_pressure,
        "fill": plant.least_fill,
        "pressure_to_empty": _needed(plant, lowest + NEARLY_EMPTY),
    }
    if still is not None:
        fill = still.fill_after
        numbers |= {"fill": fill, "chamber": still.chamber, "pressure_to_start": _needed(plant, fill)}
    return numbers


def _needed(plant: LiquidRing, fill: float) -> float | None:
    """The pressure, Pa, from which an injection begins at a fill, over an empty crest: short ones all do."""
    law = plant.model.flow
    return starting_pressure(
        law=law,
        fill=fill,
        opposite_fill=min(plant.total - fill, law.max_fill_ratio),
        primed=False,
        above=max(plant.gas_pressure, LEAST_PRESSURE),
    )
