"""One closed-loop run: sample, command, gas open, gas closed, wait, until it settles or cannot."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.algorithm import Command, Controller, Measurement
from ringbalance.controller.algorithms.built_in import BuiltIn, command_of, show
from ringbalance.controller.algorithms.law_based import controller_of
from ringbalance.controller.balancer import Progress
from ringbalance.controller.document import command_document, simulation_history, simulation_rows
from ringbalance.controller.liquid_ring.loop_factor import loop_factor
from ringbalance.controller.liquid_ring.plant import LiquidRing
from ringbalance.controller.loop_plan import LoopPlan, Trace
from ringbalance.controller.outcome import run_findings
from ringbalance.controller.rotor import Sensor, chamber_letters, disc_unbalance, noisy_sensor
from ringbalance.controller.simulation import Injection, Sample, Simulation, noise_floor
from ringbalance.controller.terms import check_fit, dynamics_of, run_models, terms_modelled
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.injection.dynamics import EVENTS, RELATIVE_ERROR
from ringbalance.reduced_model.injection.moment import tabulate_moment
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.results.result import Presentation
from ringbalance.scene.models import Scene

_MAX_TRACED_SAMPLES: Final = 10_000


def simulate(
    scene: Scene,
    model: BalancerModel,
    *,
    controller: Controller[Any] | BuiltIn | None = None,
    sensor: Sensor | None = None,
    progress: Progress | None = None,
    modelled: Collection[str] | None = None,
    to_time_limit: bool = False,
    residual_fill: float | None = None,
    speed: float = 1.0,
    noise: np.random.Generator | None = None,
) -> Simulation:
    """One closed-loop run of a scene under a balancer model.

    Sample, step of the controller, gas into the commanded chambers (all pairs in parallel), gas off, wait of
    one period, next sample; until the amplitude has held for the hold time and, in all but 1 % of the
    samples, for a minute more, nothing can change any more, the run cannot succeed, or the time is up.
    `to_time_limit`: a run that has settled continues, with the same answer, to its time limit.
    Args:
        sensor: default the scene's noise from the scene's seed.
        modelled: of "tube inertia", "gas filling", "valve lag" and "liquid held in the tube" those to model;
            default all that the scene gives numbers for.
        residual_fill: fill of a driven chamber at which the rest of an injection is lost; default the
            fill at which gas enters the port.
        speed: factor on the law's velocity.
        noise: random numbers of the scene's sensor; default those of the scene's seed.
    Raises: SceneError: a rotor too slow to form a ring, or a model made for another disc.
    Raises: ValueError: terms to model that the scene or the law gives no numbers for; gas into both chambers
        of a pair at once.
    Source: section 5 and Fig. 5 of the liquid-ring paper.
    """
    check_ring(scene)
    check_fit(scene, model)
    used = run_models(scene=scene, model=model, terms=modelled)
    residual = residual_fill_ratio(scene, law=model.flow) if residual_fill is None else residual_fill
    dynamics = dynamics_of(scene=scene, model=model, modelled=terms_modelled(used), residual_fill=residual)
    algorithm = controller or controller_of(scene, model)
    loop = loop_factor(scene, model, algorithm)
    sensed = sensor is not None
    plan = LoopPlan.of(
        [scene], [algorithm], most_samples=_MAX_TRACED_SAMPLES, sensed=sensed, to_time_limit=to_time_limit
    )
    total = 2 * scene.disc.initial_fill
    plant = dynamics.plant(total=total, relative_error=RELATIVE_ERROR)
    tabulate_moment(plant[0], model, total=total)
    runs = plan.runs(
        1,
        start=scene.rotor_as_read.initial_vibration,
        gain=scene.rotor.influence,
        noise_floor=noise_floor(scene),
        residual_fill=residual,
        speed=speed,
    )
    foreign = None if isinstance(algorithm, BuiltIn) else algorithm
    outside = None
    if foreign is not None or sensor is not None:
        used_sensor = sensor or noisy_sensor(sensor=scene.sensor, seed=scene.run.seed)
        outside = _Outside(sensor=used_sensor, controller=foreign, chambers=scene.disc.chambers)

    def watch() -> None:
        if progress is not None:
            progress(float(runs[0]["time"]), scene.run.time_limit)
        if outside is not None:
            outside.answer(runs[0])

    random = noise or np.random.default_rng(scene.run.seed)
    deviations = random.standard_normal((1, _MAX_TRACED_SAMPLES, 2))
    watched = progress is not None or outside is not None
    trace = plan.carry(runs, plant, lambda _: deviations, traced=True, watch=watch if watched else None)
    positive = trace.instants[:, 1:].T
    fills = np.concatenate([positive, total - positive])
    vibration = scene.rotor.vibration(disc_unbalance(moment=model.moment, fill_ratio=fills))
    run = Simulation(
        scene=scene,
        plant=LiquidRing(model=model, chambers=scene.disc.chambers, dynamics=dynamics, total=total),
        state=runs[0],
        controller=scene.controller.kind if foreign is None else type(foreign).__name__,
        as_scene=controller is None and sensor is None,
        loop=loop,
        time=trace.instants[:, 0],
        amplitude=np.abs(vibration),
        phase=np.angle(vibration),
        reading=np.abs(vibration + scene.sensor.runout),
        fill_ratio=dict(zip(chamber_letters(scene.disc.chambers), fills, strict=True)),
        injections=_injections(trace, scene.disc.chambers),
        samples=_samples(trace, scene.disc.chambers, outside),
        terms_modelled=terms_modelled(used),
        models_used=used,
        presentation=Presentation(
            document=command_document, rows=simulation_rows, history=simulation_history
        ),
        again=partial(simulate, model=model),
    )
    return replace(run, findings=run_findings(run))


@dataclass(kw_only=True)
class _Outside:
    """A sensor and a controller of the caller's own, in Python."""

    sensor: Sensor
    controller: Controller[Any] | None
    """None: one of the program's, which is compiled."""
    chambers: int
    memory: Any = None
    measurements: list[Measurement | None] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.controller is not None:
            self.memory = self.controller.start()

    def answer(self, run: np.void) -> None:
        """Write a sample and the command that follows into an element of type `RUN`."""
        seen = self.sensor(float(run["time"]), complex(run["vibration"]))
        show(run, seen)
        self.measurements.append(seen)
        if self.controller is None:
            return
        match self.controller.step(self.memory, seen):
            case (state, Command() as command):
                self.memory = state
            case other:
                wanted = "the next state and a Command, as in return state, rb.Command(...)"
                name = type(self.controller).__name__
                raise TypeError(f"{name}.step returns {wanted}; it returned {other!r}")
        half = self.chambers // 2
        run["asked"], run["resting"] = 0.0, command.resting
        for valve in command.valves:
            if valve.chamber >= 2 * half:
                raise ValueError(f"chamber {valve.chamber}: this disc has chambers 0 to {2 * half - 1}")
            pair, side = valve.chamber % half, valve.chamber // half
            if run["asked"][pair] > 0:
                raise ValueError(f"gas into chambers {pair} and {pair + half} of one pair at once")
            run["asked"][pair], run["side"][pair] = valve.duration, side
        self.commands.append(command)


def _samples(trace: Trace, chambers: int, outside: _Outside | None) -> tuple[Sample, ...]:
    rows = trace.samples
    if outside is None:
        seen: list[Measurement | None] = [
            Measurement(time=float(row["time"]), amplitude=float(row["amplitude"]), phase=float(row["phase"]))
            for row in rows
        ]
    else:
        seen = outside.measurements
    commands = outside.commands if outside and outside.controller else [command_of(r, chambers) for r in rows]
    return tuple(
        Sample(time=float(row["time"]), measurement=measurement, command=command)
        for row, measurement, command in zip(rows, seen, commands, strict=True)
    )


def _injections(trace: Trace, chambers: int) -> tuple[Injection, ...]:
    letters = chamber_letters(chambers)
    return tuple(
        Injection(
            time=float(row["time"]),
            chamber=letters[row["chamber"]],
            duration=float(row["duration"]),
            fill_before=float(row["fill_before"]),
            fill_after=float(row["fill_after"]),
            regime_start=Regime(int(row["regime_start"])),
            regime_end=Regime(int(row["regime_end"])),
            event=EVENTS[int(row["event"])],
            energy=float(row["energy"]),
            closing_pressure=float(row["closing_pressure"]),
            run_dry=float(row["run_dry"]),
        )
        for row in trace.injections
    )
