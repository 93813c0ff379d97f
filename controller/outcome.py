"""How a run ended, found from its facts, and one text for each that says what to do next."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.controller.advice import lowered_gain, raised_gain
from ringbalance.controller.algorithms.built_in import BELOW_MINIMUM, NO_SAMPLE
from ringbalance.controller.formulas import NOTICEABLE, Cause, has_grown
from ringbalance.controller.liquid_ring.plant import DiscState, LiquidRing
from ringbalance.controller.liquid_ring.reach import BEYOND_CAPACITY, runs_back_text
from ringbalance.controller.liquid_ring.records import Event
from ringbalance.controller.rotor import chamber_letters
from ringbalance.controller.shortfall import liquid_not_driven, moment_missing
from ringbalance.controller.simulation import (
    NOISE_DEVIATIONS,
    Injection,
    Outcome,
    Sample,
    noise_floor,
)
from ringbalance.controller.tuning.dead_time import standing_remedy
from ringbalance.controller.tuning.loop_factor import STAYING_DEVIATIONS, LoopFactor
from ringbalance.controller.tuning.recommendation import recommended_gain
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

MICROMETRE: Final = 1e-6
MANY_OVERSHOOTS: Final = 2


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
        if self.last_command and not _longest(self).operation.moved:
            return _unmoved(self)
        return Outcome.TOO_MANY_SAMPLES if self.cause is Cause.SAMPLES else _out_of_time(self)

    @property
    def status(self) -> str:
        """One or two sentences: how the run ended, with its numbers, and what to do next."""
        text = _TEXTS[self.outcome](self)
        if not self.shortened:
            return text
        injections = "injection was" if self.shortened == 1 else "injections were"
        return (
            f"{text}; {self.shortened} {injections} shortened or left out to keep the residual fill of "
            f"{self.plant.residual_fill:.3g} in the driven chamber"
        )


def _longest(facts: Facts) -> Injection:
    return max(facts.last_command, key=lambda injection: injection.operation.duration)


def _unmoved(facts: Facts) -> Outcome:
    """Why the last command moved nothing."""
    if _longest(facts).operation.event in {Event.EMPTY, Event.FULL}:
        return Outcome.CHAMBER_EMPTY
    return Outcome.GAS_TIME_TOO_SHORT if _over_too_soon(facts) else Outcome.STALLED


def _over_too_soon(facts: Facts) -> bool:
    """Whether the gas would drive liquid, had it the time to fill the chamber."""
    plant, done = facts.plant, _longest(facts).operation
    if plant.dynamics.quasi_steady:
        return False
    flow, total = plant.model.flow, facts.state.pairs[0].total
    other = min(max(total - done.fill_after, 0.0), flow.max_fill_ratio)
    found = flow.evaluate(
        fill_ratio=done.fill_after, opposite_fill_ratio=other, gas_pressure=plant.gas_pressure
    )
    return bool(found.velocity > 0)


def _unusable(facts: Facts) -> int:
    return sum(sample.command.reason == NO_SAMPLE for sample in facts.samples)


def _out_of_time(facts: Facts) -> Outcome:
    if 2 * _unusable(facts) > len(facts.samples):
        return Outcome.NO_SAMPLES
    if facts.drift > NOTICEABLE:
        return Outcome.DRIFTING
    if NOISE_DEVIATIONS * facts.scene.sensor.amplitude_noise > facts.scene.controller.limit:
        return Outcome.NOISE
    last = facts.samples[-1].command
    if not last.resting and not last.valves and last.reason == BELOW_MINIMUM:
        return Outcome.GAS_TIME_TOO_SHORT
    return Outcome.TIME_LIMIT


def _um(length: float) -> str:
    return f"{length / MICROMETRE:.4g} um"


def _settled(facts: Facts) -> str:
    many = facts.overshoots > MANY_OVERSHOOTS
    cure = f"{facts.overshoots} overshoots: {_lower(facts)}" if many else "no further correction needed"
    return (
        f"settled: within the limit of {_um(facts.scene.controller.limit)} from "
        f"{facts.settling_time:.4g} s on, for the hold time of {facts.scene.controller.hold_time:.4g} s, "
        f"{_um(facts.final_amplitude)} at the end; {cure}"
    )


def _lower(facts: Facts) -> str:
    """What to change in a loop that overshoots; the law-based algorithm has no gain to lower."""
    if facts.scene.controller.kind == "law_based" and not facts.own_algorithm:
        return _standing(facts) or "check controller.assumed_influence_coefficient and assumed_lag_angle"
    return lowered_gain(facts.own_algorithm, _to_gain(facts))


def _to_gain(facts: Facts) -> str:
    """The gain that would be recommended, where there is one and it is lower."""
    settings = facts.scene.controller
    gain = recommended_gain(facts.scene, facts.plant.model, loop=facts.loop)
    if facts.loop.value is None or settings.kind == "law_based" or not 0 < gain < settings.proportional:
        return ""
    return f" to {gain * MICROMETRE:.3g} s/um"


def _hovering(facts: Facts) -> str:
    """Within the limit at the end or for a while, in a loop that is not expected to stay there."""
    settings, loop = facts.scene.controller, facts.loop
    head = (
        f"hovering: {_um(facts.final_amplitude)} at {facts.time:.4g} s, limit {_um(settings.limit)}, "
        f"hold time {settings.hold_time:.4g} s; "
    )
    sigma = facts.scene.sensor.amplitude_noise
    if NOISE_DEVIATIONS * sigma > settings.limit:
        cure = f"the sensor's own is {_um(sigma)}: raise controller.limit or average the sensor"
    else:
        cure = f"{_lower(facts)}, raise controller.limit or average the sensor"
    left = "" if loop.deviation is None else f" of {_um(loop.deviation)}"
    return head + (
        f"it is not expected to stay: noise keeps up a standard deviation{left}, and the limit must hold "
        f"{STAYING_DEVIATIONS:g} of them; {cure}"
    )


def _hold_incomplete(facts: Facts) -> str:
    return (
        f"{_not_settled(facts)}; within it from {facts.since:.4g} s on, but the hold time of "
        f"{facts.scene.controller.hold_time:.4g} s is not complete within the time limit of "
        f"{facts.scene.run.time_limit:.4g} s: raise run.time_limit"
    )


def _unstable(facts: Facts) -> str:
    return (
        f"unstable: the loop factor is {facts.loop.value:.3g}, and a residual grows from "
        f"{facts.loop.limit:.3g} on; {_um(facts.final_amplitude)} at {facts.time:.4g} s: lower "
        f"controller.proportional{_to_gain(facts)}"
    )


def _standing(facts: Facts) -> str:
    return "" if facts.own_algorithm else standing_remedy(facts.scene, facts.plant.model)


def _not_settled(facts: Facts) -> str:
    return (
        f"not settled: {_um(facts.final_amplitude)} at {facts.time:.4g} s against the limit of "
        f"{_um(facts.scene.controller.limit)}"
    )


def _time_limit(facts: Facts) -> str:
    if facts.overshoots > MANY_OVERSHOOTS:
        cure = f"{facts.overshoots} overshoots: {_lower(facts)}, or shorten the trial steps"
    else:
        cure = _standing(facts) or f"{raised_gain(facts.own_algorithm)} or raise run.time_limit"
    return f"{_not_settled(facts)}; time is up ({facts.scene.run.time_limit:.4g} s): {cure}"


def _stalled(facts: Facts) -> str:
    last = _longest(facts) if facts.last_command else None
    still = None if last is None or last.operation.moved else last
    beyond = facts.unreachable_amplitude > facts.scene.controller.limit
    return (
        f"{_not_settled(facts)}; stalled: {liquid_not_driven(facts.plant, facts.state, still)}"
        f"{f'; {_moments(facts)}' if beyond else ''}: raise gas.pressure, or lower rotor.speed"
    )


def _capacity(facts: Facts) -> str:
    return f"{_not_settled(facts)}; capacity exceeded: {_moments(facts)}: {BEYOND_CAPACITY}"


def _moments(facts: Facts) -> str:
    return moment_missing(facts.plant, facts.state, facts.scene.rotor)


def _empty(facts: Facts) -> str:
    chamber = facts.refused[0] if facts.refused else _longest(facts).chamber
    cure = "check rotor.influence_coefficient, the assumed lag angle, and the sense of rotation"
    return (
        f"{_not_settled(facts)}; no usable liquid is left in chamber {chamber} although the "
        f"unbalance is within the disc's capacity: {cure}"
    )


def _diverging(facts: Facts) -> str:
    if facts.overshoots >= 2:
        cure = (
            f"the residual turned round {facts.overshoots} times: {_lower(facts)}; if it still grows, "
            "check influence coefficient, lag angle and sense of rotation"
        )
    else:
        cure = (
            "check the influence coefficient, the lag angle that the controller assumes (more than 90 "
            "degrees off drives the liquid the wrong way) and the sense of rotation"
        )
    # The rises that end a run need not take it above its start.
    higher = facts.final_amplitude > facts.initial_amplitude
    since = f"from {_um(facts.initial_amplitude)} " if higher else "several times in a row, "
    return (
        f"unstable: diverging, stopped at {facts.time:.4g} s: the amplitude rose {since}to "
        f"{_um(facts.final_amplitude)}: {cure}"
    )


def _drifting(facts: Facts) -> str:
    return f"{_not_settled(facts)}; {runs_back_text(facts.scene, residual_fill=facts.plant.residual_fill)}"


def _too_short(facts: Facts) -> str:
    if facts.last_command and not _longest(facts).operation.moved:
        last = _longest(facts)
        return (
            f"{_not_settled(facts)}; {last.operation.duration * 1e3:.4g} ms of gas into chamber "
            f"{last.chamber} end before the pressure has moved any liquid: "
            f"{_standing(facts) or _pushed(facts)}"
        )
    return (
        f"{_not_settled(facts)}; the commanded valve-open times have fallen below the valves' minimum of "
        f"{facts.scene.controller.minimum_gas_time * 1e3:.4g} ms: {raised_gain(facts.own_algorithm)}, lower "
        "controller.minimum_gas_time or raise controller.limit"
    )


def _pushed(facts: Facts) -> str:
    """What moves liquid where an amplitude stands still."""
    settings = facts.scene.controller
    from_scene = settings.kind == "target_vector" and not facts.own_algorithm
    without = from_scene and settings.integral_time is None
    first = "set controller.integral_time to some periods, " if without else ""
    return f"{first}raise controller.limit, or use a larger or faster valve"


def _noise(facts: Facts) -> str:
    return (
        f"{_not_settled(facts)}; the limit lies below {NOISE_DEVIATIONS:g} standard deviations of the sensor "
        f"({_um(facts.scene.sensor.amplitude_noise)}): raise controller.limit or average the sensor"
    )


def _no_samples(facts: Facts) -> str:
    return (
        f"{_not_settled(facts)}; {_unusable(facts)} of {len(facts.samples)} samples were dropped or not a "
        "number, and no valve is opened on such a sample: check the vibration sensor and its phase reference"
    )


def _too_many(facts: Facts) -> str:
    return (
        f"{_not_settled(facts)}; stopped after {len(facts.samples)} samples, the most that one run takes, "
        f"before its time limit of {facts.scene.run.time_limit:.4g} s: raise controller.period or lower "
        "run.time_limit"
    )


_TEXTS: Final[Mapping[Outcome, Callable[[Facts], str]]] = {
    Outcome.SETTLED: _settled,
    Outcome.HOVERING: _hovering,
    Outcome.HOLD_INCOMPLETE: _hold_incomplete,
    Outcome.UNSTABLE: _unstable,
    Outcome.TIME_LIMIT: _time_limit,
    Outcome.STALLED: _stalled,
    Outcome.CAPACITY_EXCEEDED: _capacity,
    Outcome.CHAMBER_EMPTY: _empty,
    Outcome.DIVERGING: _diverging,
    Outcome.DRIFTING: _drifting,
    Outcome.GAS_TIME_TOO_SHORT: _too_short,
    Outcome.NOISE: _noise,
    Outcome.NO_SAMPLES: _no_samples,
    Outcome.TOO_MANY_SAMPLES: _too_many,
}
