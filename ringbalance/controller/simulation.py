"""Record of one closed-loop run: samples, injections, gas, outcome and counts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.controller.algorithms.algorithm import Command, Measurement
from ringbalance.controller.algorithms.built_in import BELOW_MINIMUM, NO_SAMPLE
from ringbalance.controller.liquid_ring.loop_factor import LoopFactor
from ringbalance.controller.liquid_ring.plant import NEAR_RESIDUAL, LiquidRing
from ringbalance.controller.loop_records import AT_REST, IDLE, NOTICEABLE_CHANGE, RISING, SAMPLES
from ringbalance.controller.rotor import chamber_letters
from ringbalance.physics.gas import (
    GasLine,
    chamber_pressures,
    compression_work,
    leaking,
    normal_volume,
    nozzle_flow,
)
from ringbalance.physics.results import Status
from ringbalance.reduced_model.chamber.contributions import chamber_status
from ringbalance.reduced_model.gas_line import LineAnswer
from ringbalance.reduced_model.injection.dynamics import Event
from ringbalance.reduced_model.injection.line_answers import line_answers
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.results.result import PresentedResult
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

_LITRE = 1e-3
_CYCLE_THIRD: Final = 3
"""Least third of a run's corrections from which a limit cycle is known: one period and a half."""
_FALLS: Final = 0.9
"""Ratio of readings from one third to the next below which they fall."""


@dataclass(frozen=True, kw_only=True)
class Injection:
    """One opening of one valve, and its effect by the next sample."""

    time: float
    """Time at which the valve opens, s."""
    chamber: str
    """Letter of the driven chamber."""
    duration: float
    """Commanded valve-open time, s."""
    fill_before: float
    """x of the driven chamber at the command."""
    fill_after: float
    """x of the driven chamber at the next sample."""
    regime_start: Regime
    regime_end: Regime
    event: Event
    energy: float
    """Work of the driven chamber's gas against the surroundings, integral of (p - ambient) dV, J."""
    closing_pressure: float
    """Gauge pressure of the driven chamber's gas when its valve closed, Pa."""
    run_dry: float
    """Time for which the valve stayed open to an empty chamber, s."""

    @property
    def moved(self) -> bool:
        """True if any liquid passed."""
        return abs(self.fill_after - self.fill_before) > NOTICEABLE_CHANGE


@dataclass(frozen=True, kw_only=True)
class GasUse:
    """Gas of a run."""

    fillings: int
    normal_volume: float
    """Gas from the supply: content of the chambers above that of vented ones as their valves close, all of
    which is vented, gas that passed through, and gas that leaked, normal m^3."""
    leaked: float
    """Upper bound on the gas that leaked, normal m^3; part of `normal_volume`."""
    energy: float
    """Least work of compressing this gas, p V ln(p_1/p_a) for each filling, J."""
    run_dry: int
    """Injections that ran their chamber dry."""
    passed_through: float
    """Upper bound on the gas that passed through dry chambers, normal m^3; part of `normal_volume`."""
    residual_fill_ratio: float
    """Fill of a driven chamber below which gas enters its port."""
    below_residual: int
    """Injections that left their chamber below `residual_fill_ratio`, or ran it dry."""

    @property
    def finding(self) -> Finding | None:
        """Finding that gas entered a port; None where none did."""
        if not self.below_residual:
            return None
        numbers = {
            "count": self.below_residual,
            "fillings": self.fillings,
            "residual_fill": self.residual_fill_ratio,
            "run_dry": self.run_dry,
            "normal_litres": self.passed_through / _LITRE,
        }
        return Finding(code="gas_passed_through" if self.run_dry else "gas_entered_port", values=numbers)

    @classmethod
    def of(
        cls, *, scene: Scene, model: BalancerModel, injections: Sequence[Injection], time: float = 0.0
    ) -> GasUse:
        """Gas consumption of the injections of a run.

        A leak counts as choked, that to ambient at the pressure at closing for the whole opening.  Gas
        through a chamber that has run dry is bounded by a choked nozzle of the tube's section and by the
        line.
        Args: `time`: s, in which gas leaks from the supply.
        Source: (p_1 - p_a) V of each filling at closing; `compression_work`, `nozzle_flow`.
        """
        gas = scene.gas
        supply, vented = gas.pressure + gas.ambient_pressure, chamber_pressures(gas)[1]
        through = nozzle_flow(pressure=supply, area=model.tube_area, temperature=gas.temperature)
        line = GasLine.of(gas)
        if line is not None:
            # Filled volume over the time constant is the most that the line passes.
            through = min(through, supply / line.time_constant(volume=1.0))
        passed = through * math.fsum(done.run_dry for done in injections)
        dead = gas.dead_volume or 0.0
        content = math.fsum(
            # A vented chamber is full of ambient gas, which no supply has to deliver.
            done.closing_pressure * ((1 - done.fill_after) * model.chamber_volume + dead)
            for done in injections
        )
        opened = math.fsum(done.duration for done in injections)
        under_gas = math.fsum(done.duration * (done.closing_pressure + vented) for done in injections)
        leaked = leaking(gas, "leak_to_ambient") * under_gas
        leaked += leaking(gas, "leak_from_supply") * supply * (scene.disc.chambers * time - opened)
        total = content + passed + leaked
        residual = residual_fill_ratio(scene, law=model.flow)
        return cls(
            fillings=len(injections),
            normal_volume=normal_volume(pressure_volume=total, temperature=gas.temperature),
            energy=compression_work(
                pressure_volume=total, pressure=supply, ambient_pressure=gas.ambient_pressure
            ),
            run_dry=sum(done.run_dry > 0 for done in injections),
            residual_fill_ratio=residual,
            below_residual=sum(
                done.run_dry > 0 or done.fill_after < residual - NEAR_RESIDUAL for done in injections
            ),
            passed_through=normal_volume(pressure_volume=passed, temperature=gas.temperature),
            leaked=normal_volume(pressure_volume=leaked, temperature=gas.temperature),
        )


class Outcome(StrEnum):
    """End of a run."""

    SETTLED = "settled"
    HOVERING = "hovering"
    HOLD_INCOMPLETE = "hold_incomplete"
    UNSTABLE = "unstable"
    TIME_LIMIT = "time_limit"
    LIMIT_CYCLE = "limit_cycle"
    STALLED = "stalled"
    CAPACITY_EXCEEDED = "capacity_exceeded"
    CHAMBER_EMPTY = "chamber_empty"
    DIVERGING = "diverging"
    DRIFTING = "drifting"
    GAS_TIME_TOO_SHORT = "gas_time_too_short"
    NOISE = "noise"
    NO_SAMPLES = "no_samples"
    TOO_MANY_SAMPLES = "too_many_samples"


class RunVerdict(StrEnum):
    """Verdict of a run on the loop."""

    SETTLED = "settled"
    """The amplitude has held within its limit and stayed there, or nothing can change any more."""
    HOVERING = "hovering"
    """The amplitude has held within its limit, and has left it again."""
    NOT_SETTLED = "not settled"
    UNSTABLE = "unstable"
    """A small residual grows, or the amplitude did."""


_VERDICTS: Final[Mapping[Outcome, RunVerdict]] = {
    Outcome.SETTLED: RunVerdict.SETTLED,
    Outcome.HOVERING: RunVerdict.HOVERING,
    Outcome.UNSTABLE: RunVerdict.UNSTABLE,
    Outcome.DIVERGING: RunVerdict.UNSTABLE,
}
"""Verdict by outcome; any other: not settled."""


@dataclass(frozen=True, kw_only=True)
class Sample:
    """One sample of the vibration and the command that answers it."""

    time: float
    """s."""
    measurement: Measurement | None
    """Reading of the sensor; None for a dropped sample."""
    command: Command


@dataclass(frozen=True, kw_only=True, repr=False)
class Simulation(PresentedResult):
    """One closed-loop run.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> run = rb.simulate(scene)
        >>> len(run.injections), float(run.amplitude[-1]) < scene.controller.limit
        (9, True)
    """

    scene: Scene
    plant: LiquidRing
    state: np.void
    """State at the end, type `RUN`."""
    controller: str
    """`controller.kind` of the scene; of another algorithm the name of its type."""
    as_scene: bool
    """True if algorithm and sensor are those of the scene."""
    loop: LoopFactor
    findings: tuple[Finding, ...] = ()
    """Findings on how the run ended, why, and what to do next."""
    time: FloatArray
    """s, shape (m,): samples, and instants within operations and waits."""
    amplitude: FloatArray
    """Vibration of the rotor, m zero-to-peak, shape (m,)."""
    phase: FloatArray
    """Phase of the rotor's vibration, rad within (-pi, pi], shape (m,)."""
    reading: FloatArray
    """Amplitude as a sensor without noise shows it, with its runout, m zero-to-peak, shape (m,)."""
    fill_ratio: Mapping[str, FloatArray]
    """x of each chamber by letter, shape (m,) each."""
    injections: tuple[Injection, ...]
    samples: tuple[Sample, ...]
    models_used: tuple[ModelUsed, ...]
    """Every physical term, with its model and its estimated contribution."""
    terms_modelled: tuple[str, ...]
    """Names of the terms that are modelled beyond the flow law; empty: the flow law alone."""
    again: Callable[..., Simulation]
    """Runs another scene under the same law; `modelled`: names of the terms to model."""

    @property
    def status(self) -> str:
        """The findings as sentences."""
        return "; ".join(finding.text for finding in self.findings)

    @property
    def model(self) -> BalancerModel:
        """The disc under its law."""
        return self.plant.model

    @property
    def overshoots(self) -> int:
        """Times that the residual turned by more than 90 degrees between samples while above the limit."""
        return int(self.state["overshoots"])

    @property
    def shortened(self) -> int:
        """Injections ended by gas in the port of the driven chamber, which keeps its residual fill."""
        return int(self.state["shortened"])

    @property
    def misadjustments(self) -> int:
        """Operations after which the measured amplitude was higher by more than the noise floor."""
        return int(self.state["misadjustments"])

    @property
    def usable_moment(self) -> float:
        """Largest unbalance that the disc cancels in the direction of the scene's, kg m."""
        return self.plant.moment_towards(-self.scene.rotor.initial_unbalance)

    @property
    def settling_time(self) -> float | None:
        """Time from which on the amplitude held within its limit, s; None: not settled."""
        first, last = float(self.state["held_since"]), float(self.state["since"])
        if self.state["settled"]:
            return first
        return last if self.state["cause"] == AT_REST and last < math.inf else None

    @property
    def refused(self) -> tuple[str, ...]:
        """Letters of the driven chambers of the last command at their residual fills."""
        letters = chamber_letters(self.scene.disc.chambers)
        return tuple(letters[i] for i in np.flatnonzero(self.state["refused"]))

    @cached_property
    def unreachable_amplitude(self) -> float:
        """Reading that remains with the best fills, m."""
        return self.plant.unreachable_vibration(rotor=self.scene.rotor_as_read)

    @property
    def longest(self) -> Injection | None:
        """The longest injection of the last command; None when there was none."""
        last = [each for each in self.injections if each.time == self.injections[-1].time]
        return max(last, key=lambda injection: injection.duration, default=None)

    @property
    def unusable(self) -> int:
        """Number of samples that the run's algorithm could not use."""
        return sum(sample.command.reason == NO_SAMPLE for sample in self.samples)

    @cached_property
    def outcome(self) -> Outcome:
        """End of the run.

        SETTLED takes a reading, without noise, that held within the limit for the hold time and then in all
        but 1 % of the samples of a further minute, or a run in which nothing can change any more.  Both are
        known when they happen, so that a later time limit gives the same answer.
        """
        state, limit, cause = self.state, self.limit, self.state["cause"]
        if self.settling_time is not None:
            return Outcome.SETTLED
        residual = self.plant.residual_fill
        beyond_disc = self.plant.unreachable_vibration(rotor=self.scene.rotor_as_read, least_fill=residual)
        if beyond_disc > limit and not self.loop.unstable:
            return Outcome.CAPACITY_EXCEEDED
        if state["drains"]:
            return Outcome.DRIFTING
        higher = self.reading[-1] > self.reading[0] + noise_floor(self.scene)
        if cause == RISING or (cause == IDLE and higher):
            return Outcome.DRIFTING if state["drift"] > NOTICEABLE_CHANGE else Outcome.DIVERGING
        if self.loop.unstable:
            return Outcome.UNSTABLE
        if self.unreachable_amplitude > limit:
            return Outcome.STALLED
        if state["lost"] or min(state["since"], state["held_since"]) < math.inf:
            if state["lost"] or self.limit_cycle:
                return Outcome.HOVERING if state["lost"] else Outcome.LIMIT_CYCLE
            return Outcome.TOO_MANY_SAMPLES if cause == SAMPLES else Outcome.HOLD_INCOMPLETE
        if self.refused and cause == IDLE:
            return Outcome.CHAMBER_EMPTY
        # The time limit may have cut the first injections short.
        first, end = self.samples[0], self.scene.run.time_limit
        cut = any(first.time + each.duration > end for each in first.command.valves)
        if self.longest is not None and not self.longest.moved and not cut:
            # The last injection moved nothing; gas may lack the time to fill the chamber.
            last, plant = self.longest, self.plant
            if last.event in {Event.EMPTY, Event.FULL}:
                return Outcome.CHAMBER_EMPTY
            if plant.dynamics.quasi_steady:
                return Outcome.STALLED
            other = min(max(plant.total - last.fill_after, 0.0), plant.model.flow.max_fill_ratio)
            flow = plant.model.flow.evaluate(
                fill_ratio=last.fill_after, opposite_fill_ratio=other, gas_pressure=plant.gas_pressure
            )
            return Outcome.GAS_TIME_TOO_SHORT if flow.velocity > 0 else Outcome.STALLED
        return Outcome.TOO_MANY_SAMPLES if cause == SAMPLES else self._out_of_time

    @property
    def _out_of_time(self) -> Outcome:
        if 2 * self.unusable > len(self.samples):
            return Outcome.NO_SAMPLES
        if self.state["drift"] > NOTICEABLE_CHANGE:
            return Outcome.DRIFTING
        if NOISE_DEVIATIONS * self.scene.sensor.amplitude_noise > self.limit:
            return Outcome.NOISE
        if self.limit_cycle:
            return Outcome.LIMIT_CYCLE
        last = self.samples[-1].command
        if not last.resting and not last.valves and last.reason == BELOW_MINIMUM:
            return Outcome.GAS_TIME_TOO_SHORT
        return Outcome.TIME_LIMIT

    @cached_property
    def limit_cycle(self) -> tuple[int, float] | None:
        """Corrections of a limit cycle and the largest reading that they meet, m; None: no limit cycle.

        Corrections continue to the time limit, the readings that their last third meets have not fallen, and
        of the liquid that it and the third before move, more than half is moved back.
        """
        times = [sample.time for sample in self.samples if sample.command.valves]
        third = len(times) // 3
        if third < _CYCLE_THIRD:
            return None
        last = times[-2 * third :]
        if times[-1] + 2.0 * np.diff(last).max() < self.scene.run.time_limit:
            return None
        met = np.interp(last, self.time, self.reading)
        before, after = met[:third], met[third:]
        falls = after.max() < _FALLS * before.max() or after.mean() < _FALLS * before.mean()
        moves = np.diff([np.interp(last, self.time, fills) for fills in self.fill_ratio.values()])
        undone = np.abs(moves.sum(axis=1)).sum() < 0.5 * np.abs(moves).sum()
        return (len(last), float(met.max())) if undone and not falls else None

    @property
    def verdict(self) -> RunVerdict:
        """Verdict on the loop."""
        return _VERDICTS.get(self.outcome, RunVerdict.NOT_SETTLED)

    @property
    def balancer(self) -> str:
        """Kind of the balancer, as in the scene."""
        return self.scene.balancer

    @property
    def settled(self) -> bool:
        """True if the amplitude held within the limit for the hold time, and stayed there."""
        return self.outcome is Outcome.SETTLED

    @property
    def energy(self) -> float:
        """Work of the driving gas against the surroundings over all injections, J."""
        return math.fsum(injection.energy for injection in self.injections)

    @property
    def law(self) -> str:
        """Name of the model, such as "paper" or "calibrated"."""
        return self.model.name

    @property
    def limit(self) -> float:
        """Amplitude to come below, m."""
        return self.scene.controller.limit

    @cached_property
    def gas(self) -> GasUse:
        """Gas consumption of all injections."""
        end = float(self.time[-1])
        return GasUse.of(scene=self.scene, model=self.model, injections=self.injections, time=end)

    @cached_property
    def gas_line(self) -> tuple[LineAnswer, ...]:
        """Gas that the line can deliver, or both ends of a default range of lines."""
        return line_answers(self.scene, self.model)

    @cached_property
    def model_status(self) -> Status:
        """Status of the models of the chamber over the range of fills."""
        return chamber_status(self.scene)


ROUND_OFF: Final = 1e-9
"""Rise of the amplitude that counts as round-off, relative to the initial amplitude."""
NOISE_DEVIATIONS: Final = 3.0


def noise_floor(scene: Scene) -> float:
    """Rise of the amplitude between two samples that noise alone does not explain, m.

    3 sqrt(2) sigma: three standard deviations of the difference of two samples.
    """
    noise, largest = scene.sensor.amplitude_noise, scene.rotor.initial_amplitude
    return NOISE_DEVIATIONS * math.sqrt(2) * noise + ROUND_OFF * largest
