"""The closed loop: sample, command, gas open, gas closed, wait, sample again, until it settles or cannot."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.algorithm import Command, Controller, Measurement
from ringbalance.controller.algorithms.by_name import controller_of
from ringbalance.controller.algorithms.law_based import LawBased
from ringbalance.controller.algorithms.target_vector import TargetVector
from ringbalance.controller.algorithms.trial import Trial
from ringbalance.controller.checks import check_fit, check_settings
from ringbalance.controller.formulas import Cause, has_held, has_risen, stop_cause
from ringbalance.controller.liquid_ring.plant import Advance, DiscState, LiquidRing
from ringbalance.controller.outcome import Facts
from ringbalance.controller.rotor import Sensor, chamber_letters, disc_unbalance, noisy_sensor
from ringbalance.controller.run_findings import run_findings
from ringbalance.controller.simulation import (
    Injection,
    Outcome,
    Sample,
    Simulation,
    misadjustments,
)
from ringbalance.controller.terms import dynamics_of, run_models, terms_modelled
from ringbalance.controller.tuning.loop_factor import loop_factor
from ringbalance.reduced_model.chamber.gravity import check_ring
from ringbalance.reduced_model.law.model import BalancerModel, CompleteLaw
from ringbalance.reduced_model.operating.residual import residual_fill_ratio
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.models import Scene

Progress = Callable[[float, float], None]
"""Called with the simulated time and the time limit, s."""

GAS_POINTS: Final = 8
"""Instants recorded within one command's valve-open time."""
TAIL_POINTS: Final = 12
"""Instants recorded within a wait: an operation continues after its valve has closed."""
MAX_SAMPLES: Final = 10_000
"""Of one run: a command costs some hundredths of a second to work out and to carry through time."""
IDLE_OPERATIONS: Final = 3
"""Commands in a row, beyond one for each chamber, whose longest injection may move nothing."""


def simulate(
    scene: Scene,
    model: BalancerModel | None = None,
    *,
    flow_law: CompleteLaw | None = None,
    controller: Controller[Any] | None = None,
    sensor: Sensor | None = None,
    progress: Progress | None = None,
    modelled: Collection[str] | None = None,
    to_time_limit: bool = False,
    residual_fill: float | None = None,
) -> Simulation:
    """One closed-loop run of a scene under a balancer model.

    Sample, step of the controller, gas into the commanded chambers (all pairs in parallel), gas off, wait of
    one period, next sample; until the amplitude has held and is expected to stay, nothing can change any
    more, the run cannot succeed, or the time is up.  `to_time_limit`: a run that has settled continues, with
    the same answer, to its time limit.
    Args:
        flow_law: in place of `model`, a law that carries its own moments and volumes.
        sensor: default the scene's noise from the scene's seed.
        modelled: of "tube inertia", "gas filling", "valve lag" and "liquid held in the tube" those to model;
            default all that the scene gives numbers for.
        residual_fill: of a driven chamber; injections are shortened so that none falls below it. Default the
            fill at which gas enters the port.
    Raises: SceneError: an algorithm that this program does not have, settings without a meaning, a rotor too
        slow to form a ring, or a model made for another disc.
    Raises: ValueError: both a model and a flow law, or neither; terms to model that the scene or
        the law gives no numbers for.
    Source: section 5 and Fig. 5 of the liquid-ring paper.
    """
    check_settings(scene)
    check_ring(scene)
    balancer = _one_of(model, flow_law)
    check_fit(scene, balancer)
    used = run_models(scene=scene, model=balancer, asked=modelled)
    residual = residual_fill_ratio(scene, law=balancer.flow) if residual_fill is None else residual_fill
    dynamics = dynamics_of(scene=scene, model=balancer, modelled=terms_modelled(used), residual_fill=residual)
    used_controller = controller or controller_of(scene, balancer)
    run = _Run(
        scene=scene,
        loop=loop_factor(scene, balancer, used_controller),
        to_time_limit=to_time_limit,
        plant=LiquidRing(
            model=balancer,
            chambers=scene.disc.chambers,
            dynamics=dynamics,
        ),
        controller=used_controller,
        sensor=sensor or noisy_sensor(sensor=scene.sensor, seed=scene.run.seed),
        own_algorithm=_own_name(controller),
        as_scene=controller is None and sensor is None,
        exact=sensor is None and scene.sensor.amplitude_noise == scene.sensor.phase_noise == 0,
        state=DiscState.initial(disc=scene.disc),
    )
    run.cause = run.go(progress or (lambda _, __: None))
    return _record(run, used=used)


def _own_name(controller: Controller[Any] | None) -> str:
    """Name of a caller's algorithm; empty for one of the program's."""
    known = controller is None or isinstance(controller, TargetVector | Trial | LawBased)
    return "" if known else type(controller).__name__


def _one_of(model: BalancerModel | None, flow_law: CompleteLaw | None) -> BalancerModel:
    if model is not None and flow_law is None:
        return model
    if flow_law is not None and model is None:
        return BalancerModel.of(flow_law)
    raise ValueError("give a model or a flow_law, such as calibrate(scene).flow_law; not both, not neither")


@dataclass(kw_only=True)
class _Run(Facts):
    """What changes during one run; lives inside one call of `simulate`."""

    to_time_limit: bool
    controller: Controller[Any]
    sensor: Sensor
    exact: bool
    as_scene: bool
    """Whether algorithm and sensor are those of the scene."""
    times: list[FloatArray] = field(default_factory=list)
    fills: list[FloatArray] = field(default_factory=list)
    vibrations: list[ComplexArray] = field(default_factory=list)
    last_usable: Measurement | None = None
    operated: bool = False
    rises: int = 0
    idle: int = 0
    seen: tuple[tuple[float, ...], complex] | None = None
    """The fills last looked at, and their vibration: most waits change nothing."""
    at_residual: frozenset[int] = frozenset()
    """Chambers whose last injection was shortened or left out, and that no injection has filled since."""
    cut: bool = False
    """Whether the time limit has shortened a valve-open time or a wait."""

    @property
    def remaining(self) -> float:
        return self.scene.run.time_limit - self.time

    def go(self, progress: Progress) -> Cause:
        """Cycle until there is a cause to stop."""
        self._keep(np.zeros(1), np.array(self.state.fills())[:, None])
        memory = self.controller.start()
        for _ in range(MAX_SAMPLES):
            progress(self.time, self.scene.run.time_limit)
            measurement = self._measured()
            memory, command = self.controller.step(memory, measurement)
            self.samples.append(Sample(time=self.time, measurement=measurement, command=command))
            self._watch(measurement)
            cause = self._cause(command)
            if cause is not Cause.NONE:
                return cause
            self._gas(command)
        return Cause.SAMPLES

    def _measured(self) -> Measurement | None:
        seen, chambers = self.sensor(self.time, self._vibration()), range(self.plant.chambers)
        without = tuple(chamber in self.at_residual for chamber in chambers)
        return None if seen is None else replace(seen, at_residual=without)

    def _vibration(self) -> complex:
        fills = self.state.fills()
        if self.seen is None or self.seen[0] != fills:
            moment = disc_unbalance(moment=self.plant.model.moment, fill_ratio=fills)
            self.seen = fills, complex(self.scene.rotor.vibration(moment))
        return self.seen[1]

    @property
    def _rests(self) -> bool:
        """Whether no liquid can move until a valve is commanded to open."""
        return self.state.rests and not self.plant.floods

    @property
    def _held(self) -> bool:
        """Whether the amplitude has held; what the time limit has cut short would have ended otherwise."""
        held = not self.cut and has_held(self.time, self.since, self.scene.controller.hold_time)
        held = held and not self.plant.drains(self.state, self.runs_back, self.scene)
        if held and self.held_since == math.inf:
            self.held_since = self.since
        return held

    def _watch(self, measurement: Measurement | None) -> None:
        """Count the rises in a row; a sample without a usable amplitude is passed over."""
        if measurement is None or not measurement.usable(needs_phase=False):
            return
        if self.last_usable is not None and self.operated:
            higher = has_risen(self.last_usable.amplitude, measurement.amplitude, self.noise_floor)
            self.rises = self.rises + 1 if higher else 0
        self.last_usable, self.operated = measurement, False

    def _cause(self, command: Command) -> Cause:
        first, last = self.samples[0].measurement, self.last_usable
        return Cause(
            stop_cause(
                self._held and self.loop.stays and not self.to_time_limit,
                self.rises,
                self.controller.rises_tolerated,
                first is not None
                and last is not None
                and has_risen(first.amplitude, last.amplitude, self.noise_floor),
                self.idle,
                IDLE_OPERATIONS + self.plant.chambers,
                command.resting and self.exact and self._rests and not (self.cut or self.to_time_limit),
                self.remaining,
            )
        )

    def _gas(self, command: Command) -> None:
        """All valves of a command open together; after the last one has closed the loop waits."""
        if not command.valves:
            self._wait()
            return
        asked = {valve.chamber: min(valve.duration, self.remaining) for valve in command.valves}
        self.cut = any(valve.duration > self.remaining for valve in command.valves)
        gas_times = self._permitted(asked)
        if not gas_times:
            self.idle += 1
            self._wait()
            return
        advance = self.plant.advance(
            self.state, gas_times=gas_times, duration=max(gas_times.values()), points=GAS_POINTS
        )
        letters = chamber_letters(self.plant.chambers)
        self.injections += [
            Injection(time=self.time, chamber=letters[operation.chamber], operation=operation)
            for operation in advance.operations
        ]
        before = self._vibration()
        self._pass(advance)
        self.operated = True
        self._wait()
        self._conclude(len(advance.operations))
        change = abs(self._vibration() - before)
        # Noise keeps opening the other valve a little; what counts is the one that should do the work.
        done = [injection.operation for injection in self.injections[-len(advance.operations) :]]
        working = max(done, key=lambda one: one.duration).moved or change > self.scene.controller.limit
        self.idle = 0 if working else self.idle + 1

    def _permitted(self, asked: Mapping[int, float]) -> dict[int, float]:
        """The valve-open times that leave each driven chamber its residual fill."""
        settings = self.scene.controller
        offsets = settings.offsets(self.plant.chambers)
        found = self.plant.permitted(self.state, gas_times=asked)
        kept = {
            i: time
            for i, time in found.items()
            if time == asked[i] or time >= settings.minimum_gas_time + offsets[i]
        }
        letters, n = chamber_letters(self.plant.chambers), self.plant.chambers
        short = [i for i, time in asked.items() if kept.get(i) != time]
        self.refused, self.shortened = tuple(letters[i] for i in short), self.shortened + len(short)
        self.at_residual = self.at_residual.difference(asked, ((i + n // 2) % n for i in asked)).union(short)
        return kept

    def _conclude(self, count: int) -> None:
        """The last command's injections with what they have done until now."""
        for place in range(len(self.injections) - count, len(self.injections)):
            injection = self.injections[place]
            done = self.plant.concluded(self.state, injection.operation)
            self.injections[place] = replace(injection, operation=done)

    def _wait(self) -> None:
        duration = min(self.scene.controller.period, self.remaining)
        self.cut = self.cut or duration < self.scene.controller.period
        if duration > 0:
            self._pass(self.plant.advance(self.state, gas_times={}, duration=duration, points=TAIL_POINTS))

    def _pass(self, advance: Advance) -> None:
        time = self.time + advance.instants
        # A valve may open for less than the clock resolves: the record keeps one entry for one time.
        later = time > np.concatenate([[self.time], time[:-1]])
        self._keep(time[later], advance.fill_ratio[:, later])
        self.state = advance.state
        self.drift, self.runs_back = max(self.drift, advance.drift), advance.runs_back
        self.time = float(time[-1])

    def _keep(self, time: FloatArray, fill_ratio: FloatArray) -> None:
        moment = disc_unbalance(moment=self.plant.model.moment, fill_ratio=fill_ratio)
        seen = self.scene.rotor.vibration(moment)
        self.times.append(time)
        self.fills.append(fill_ratio)
        self.vibrations.append(seen)
        above = np.flatnonzero(np.abs(seen) > self.scene.controller.limit)
        if above.size:
            later = int(above[-1]) + 1
            self.since = float(time[later]) if later < time.size else math.inf
        elif time.size:
            self.since = min(self.since, float(time[0]))


def _record(run: _Run, *, used: tuple[ModelUsed, ...]) -> Simulation:
    """Judge a finished run and freeze it."""
    time, fills = np.concatenate(run.times), np.concatenate(run.fills, axis=1)
    seen = np.concatenate(run.vibrations)
    run.amplitude = np.abs(seen)
    settled = run.outcome is Outcome.SETTLED
    return Simulation(
        scene=run.scene,
        model=run.plant.model,
        balancer="liquid_ring",
        controller=run.own_algorithm or run.scene.controller.kind,
        as_scene=run.as_scene,
        outcome=run.outcome,
        settled=settled,
        settling_time=run.settling_time if settled else None,
        hold_time=run.scene.controller.hold_time,
        loop=run.loop,
        findings=run_findings(run),
        time=time,
        amplitude=run.amplitude,
        phase=np.angle(seen),
        fill_ratio=dict(zip(chamber_letters(run.plant.chambers), fills, strict=True)),
        injections=tuple(run.injections),
        samples=tuple(run.samples),
        overshoots=run.overshoots,
        shortened=run.shortened,
        misadjustments=misadjustments(run.samples, floor=run.noise_floor),
        noise_floor=run.noise_floor,
        energy=math.fsum(injection.operation.energy for injection in run.injections),
        terms_modelled=terms_modelled(used),
        models_used=used,
    )
