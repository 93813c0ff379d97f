"""The record of one closed-loop run, and how a run can end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from ringbalance.controller.algorithms.algorithm import Command, Measurement
from ringbalance.controller.gas_use import GasUse
from ringbalance.controller.liquid_ring.plant import Operation
from ringbalance.controller.tuning.loop_factor import LoopFactor
from ringbalance.physics.results import Status
from ringbalance.reduced_model.chamber.range import chamber_status
from ringbalance.reduced_model.gas_line import LineAnswer, line_answers
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.selection.registry import ModelUsed
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


class Outcome(StrEnum):
    """How a run ended."""

    SETTLED = "settled"
    HOVERING = "hovering"
    HOLD_INCOMPLETE = "hold_incomplete"
    UNSTABLE = "unstable"
    TIME_LIMIT = "time_limit"
    STALLED = "stalled"
    CAPACITY_EXCEEDED = "capacity_exceeded"
    CHAMBER_EMPTY = "chamber_empty"
    DIVERGING = "diverging"
    DRIFTING = "drifting"
    GAS_TIME_TOO_SHORT = "gas_time_too_short"
    NOISE = "noise"
    NO_SAMPLES = "no_samples"
    TOO_MANY_SAMPLES = "too_many_samples"


class Verdict(StrEnum):
    """What a run says of the loop."""

    SETTLED = "settled"
    """The amplitude has held within its limit and is expected to stay, or nothing can change any more."""
    HOVERING = "hovering"
    """It ends within the limit, or has held, and is not expected to stay."""
    NOT_SETTLED = "not settled"
    UNSTABLE = "unstable"
    """A small residual grows, or the amplitude did."""


@dataclass(frozen=True, kw_only=True)
class Sample:
    """One look at the vibration and what the controller made of it."""

    time: float
    """s."""
    measurement: Measurement | None
    """What the sensor gave; None for a dropped sample."""
    command: Command


@dataclass(frozen=True, kw_only=True)
class Injection:
    """One opening of one valve."""

    time: float
    """s, at which the valve opens."""
    chamber: str
    """Letter of the driven chamber."""
    operation: Operation


@dataclass(frozen=True, kw_only=True)
class Simulation:
    """One closed-loop run."""

    scene: Scene
    model: BalancerModel
    balancer: str
    """ "liquid_ring"."""
    integrator: str
    """How operations were carried through time."""
    outcome: Outcome
    verdict: Verdict
    settled: bool
    """Whether the amplitude held within the limit for the hold time and is expected to stay."""
    settling_time: float | None
    """s, from which on it first held, whatever the time limit; None when not settled."""
    hold_time: float
    """s."""
    loop: LoopFactor
    """The loop about the balanced state."""
    status: str
    """The verdict, how the run ended, and what to do next."""
    time: FloatArray
    """s, shape (m,): samples, and instants within operations and waits."""
    amplitude: FloatArray
    """True vibration, m zero-to-peak, shape (m,)."""
    phase: FloatArray
    """Of the true vibration, rad within (-pi, pi], shape (m,)."""
    fill_ratio: Mapping[str, FloatArray]
    """x of each chamber by letter, shape (m,) each."""
    injections: tuple[Injection, ...]
    samples: tuple[Sample, ...]
    overshoots: int
    """Times that the residual turned by more than 90 degrees between samples while above the limit."""
    shortened: int
    """Injections shortened or left out so that the driven chamber keeps its residual fill."""
    misadjustments: int
    """Operations after which the measured amplitude was higher by more than the noise floor."""
    noise_floor: float
    """m."""
    energy: float
    """Work of the driving gas against the surroundings over all injections, J."""
    models_used: tuple[ModelUsed, ...]
    """Every physical term, with its model and its estimated contribution."""
    terms_modelled: tuple[str, ...]
    """Names of the terms that are modelled beyond the flow law; empty: it alone carries the operations."""

    # Most runs are one of many, of which nobody asks what follows.
    @property
    def law(self) -> str:
        """Name of the model, such as "paper" or "calibrated"."""
        return self.model.name

    @property
    def limit(self) -> float:
        """m."""
        return self.scene.controller.limit

    @property
    def tolerance(self) -> float:
        """At which the models were selected."""
        return self.scene.tolerance

    @cached_property
    def gas(self) -> GasUse:
        """Gas consumption of all injections."""
        done = [injection.operation for injection in self.injections]
        return GasUse.of(scene=self.scene, model=self.model, operations=done)

    @cached_property
    def gas_line(self) -> tuple[LineAnswer, ...]:
        """What the gas line can deliver, or both ends of a default range of lines."""
        return line_answers(self.scene, self.model)

    @cached_property
    def model_status(self) -> Status:
        """Whether the models of the chamber hold over the range of fills."""
        return chamber_status(self.scene)
