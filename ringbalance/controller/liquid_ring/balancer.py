"""The liquid ring as a `Balancer`."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.algorithm import Controller
from ringbalance.controller.algorithms.law_based import controller_of
from ringbalance.controller.balancer import (
    WATCH_TIME_S,
    Balancer,
    Demand,
    Draws,
    Input,
    Outcomes,
    Progress,
    Remedy,
    RunResult,
    Setting,
    Settings,
    inputs_of,
    rotor_within,
    settles_within,
)
from ringbalance.controller.document import (
    CONSUMPTION,
    conventions,
    line_runs,
    line_runs_table,
    simulation_history,
)
from ringbalance.controller.judging.judge import MOST_DRAWS
from ringbalance.controller.liquid_ring.capacity import beyond_capacity
from ringbalance.controller.liquid_ring.devices import Spread, rotor_like
from ringbalance.controller.liquid_ring.drawn_runs import DrawnRuns
from ringbalance.controller.liquid_ring.drying import part_per_gas
from ringbalance.controller.liquid_ring.loop_factor import loop_information, short_period
from ringbalance.controller.liquid_ring.offers import drawn_input, remedies_of, trials, valves_of
from ringbalance.controller.loop import simulate
from ringbalance.controller.rotor import CommonRotor, Rotors, Sensor, wrapped
from ringbalance.controller.simulation import Outcome, Simulation
from ringbalance.controller.terms import run_models
from ringbalance.controller.trials import DrawnInput, Information, Trials
from ringbalance.reduced_model.calibration import calibrate, calibrated_model, chamber_and_law, law_by_name
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.crater import largest_ratio
from ringbalance.reduced_model.injection.dynamics import gives_forces
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import (
    CALIBRATED,
    UNCHECKED,
    BalancerModel,
    completed_model,
    lacking,
)
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.terms import IN_INJECTIONS, NOT_MODELLED, ModelUsed
from ringbalance.results.requirements import AT_LEAST, AT_MOST
from ringbalance.results.result import Rows
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.changes import rechecked
from ringbalance.scene.draws import BLOCK, run_noise
from ringbalance.scene.loop_models import RequirementSettings, Runout
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import SceneFile, raw_value_at, with_values_at
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES, half_widths

_SETTING_FACTORS: Final = {
    "gas.pressure": 3.0,
    "controller.proportional": 30.0,
    "controller.integral_time": 30.0,
}
"""Largest factors on settings that are tried, up and down."""


@dataclass(frozen=True, eq=False)
class LiquidRingBalancer(Balancer):
    """A disc with chambers that a gas drives liquid between; options as in `ringbalance.simulate`."""

    options = frozenset({"flow_law", "controller", "sensor", "modelled"})
    verdict_draws = (BLOCK, MOST_DRAWS)
    energy_kind = "energy_compression"
    watched_to_end = False
    scene: Scene
    _: KW_ONLY
    flow_law: Any = None
    """A law, or a name for `law_by_name`; None: calibrated from the scene."""
    controller: Controller[Any] | None = None
    sensor: Sensor | None = None
    modelled: Collection[str] | None = None
    to_time_limit: bool = False
    rotors: Rotors | None = None
    """Rotors of drawn devices; None: their own, drawn."""
    full: LiquidRingBalancer | None = None
    """Balancer with all of the liquid, which controllers of untraced runs assume; None: this one."""

    def __post_init__(self) -> None:
        """Refuse a controller that is no algorithm."""
        if (algorithm := self.controller) is None or (
            hasattr(algorithm, "start") and hasattr(algorithm, "step")
        ):
            return
        raise TypeError(f"an algorithm has start() and step(state, measurement), which {algorithm!r} has not")

    @cached_property
    def model(self) -> BalancerModel:
        """The disc under its law."""
        law = self.flow_law
        if law is None:
            return calibrated_model(self.scene)
        if isinstance(law, str):
            return law_by_name(self.scene, law)
        if isinstance(law, CalibratedLaw | PaperLaw):
            return BalancerModel.of(law)
        return completed_model(law, by=chamber_and_law(self.scene)[1])

    @property
    def models_used(self) -> tuple[ModelUsed, ...]:
        return run_models(scene=self.scene, model=self.model)

    def inputs(self) -> tuple[Input, ...]:
        """Inputs of the scene, with assumed uncertainties where it states none."""
        widths = half_widths(self.scene).items()
        by_path = {f"{UNCERTAIN_QUANTITIES[name]}.{name}": each for name, each in widths}
        return inputs_of(self.scene, lambda path, _: by_path.get(path, by_path.get(path.split("[")[0], 0.0)))

    def settings(self) -> tuple[Setting, ...]:
        """Gas pressure, gain and integral time."""
        values = ((path, raw_value_at(self.scene, path), factor) for path, factor in _SETTING_FACTORS.items())
        return tuple(Setting.about(path, value, factor=by) for path, value, by in values if value is not None)

    def run(
        self,
        settings: Settings,
        draws: Draws,
        *,
        trace: bool = False,
        progress: Progress | None = None,
    ) -> Outcomes:
        """Closed-loop runs; those of the program's own algorithm and sensor without traces run together."""
        foreign = (self.controller, self.sensor, self.modelled) != (None, None, None)
        if not (trace or foreign or self.to_time_limit):
            return self.run_all([settings], draws)[0]
        scene = with_values_at(self.scene, settings)
        runs = (self._traced(scene, n, devices=draws.devices, progress=progress) for n in draws.numbers)
        return Outcomes.of(tuple(runs), trace=trace)

    def run_all(
        self, settings: Sequence[Settings], draws: Draws, *, watch_time: float = WATCH_TIME_S
    ) -> tuple[Outcomes, ...]:
        """Run several settings with the program's own algorithms and sensor, without traces."""
        return self.drawn_runs.outcomes(settings, draws, watch_time=watch_time)

    def required_fraction(self) -> float:
        return self.scene.requirement.fraction

    def demands(self) -> tuple[Demand, ...]:
        """Settled in time by the reading, amplitude of the rotor itself, unbalance to correct, crater."""
        requirement = self.scene.requirement
        time = self.span() if requirement.settling_time is None else requirement.settling_time
        stated, allowed = requirement.settling_time is not None, self.scene.required_amplitude
        demands = [settles_within(time, stated=stated, amplitude=allowed)]
        if allowed is not None and self.scene.sensor.runout_amplitude is not None:
            demands.append(rotor_within(allowed, stated=True))
        further = (
            ("correction_moment", "usable_moment", AT_LEAST, requirement.correction_moment, "kg m"),
            ("crater", "crater", AT_MOST, requirement.crater, "1"),
        )
        return *demands, *(
            Demand(code=code, outcome=outcome, sense=sense, required=required, unit=unit, stated=True)
            for code, outcome, sense, required, unit in further
            if required is not None
        )

    def reported(self) -> tuple[Demand, ...]:
        """The rotor's own vibration against a limit of the readings, where they differ."""
        if self.scene.required_amplitude is not None or self.scene.sensor.runout_amplitude is None:
            return ()
        return (rotor_within(self.limit, stated=False),)

    def trials(self) -> tuple[Trials, ...]:
        """Gain, integral time and a common offset of the valve-open times, and the gas pressure."""
        return trials(self.scene, self.model, limit=self.limit)

    def remedies(self) -> tuple[Remedy, ...]:
        return tuple(remedies_of(self.scene, self.model))

    def choices(self) -> tuple[Remedy, ...]:
        """Valves that can be bought, where the scene gives none."""
        return valves_of(self.scene)

    def drawn_input(self, name: str) -> DrawnInput:
        return drawn_input(name)

    def on_scene(self, scene: SceneFile) -> LiquidRingBalancer:
        return replace(self, scene=liquid_ring_scene(scene))

    def after_loss(self, part: float) -> LiquidRingBalancer:
        """This balancer without a part of every chamber's liquid, of which its controller does not know."""
        if part == 0.0:
            return self
        left = (1.0 - part) * self.scene.disc.max_fill_ratio
        changes = {"disc.max_fill_ratio": left, "disc.initial_fill": left / 2}
        less = self.on_scene(rechecked(self.scene).with_values(changes, origin="inferred"))
        return replace(less, full=self)

    @property
    def limit(self) -> float:
        """Amplitude that may remain, m: the one required, else the controller's limit."""
        required = self.scene.required_amplitude
        return self.scene.controller.limit if required is None else required

    @cached_property
    def drawn_runs(self) -> DrawnRuns:
        """Runs of the scene's devices, with caches."""
        remade = self.flow_law in (None, CALIBRATED, UNCHECKED)
        spread = Spread.of(self.scene, self.model, remade=remade)
        return DrawnRuns(
            scene=self.scene,
            model=self.model,
            spread=spread,
            limit=self.limit,
            rotors=self.rotors,
            bare=self.flow_law == UNCHECKED,
            full=None if self.full is None else self.full.drawn_runs,
        )

    def _traced(self, scene: Scene, number: int, *, devices: bool, progress: Progress | None) -> RunResult:
        loop: dict[str, Any] = {"controller": self.controller}
        informed = self.drawn_runs.informed if self.flow_law == UNCHECKED else self.model
        model, moment = informed, 1.0
        if devices:
            device = self.drawn_runs.device(number)
            model, scene, moment = device.model, device.under(scene, of=self.scene), device.moment
            loop = {
                "controller": self.controller or controller_of(scene, informed),
                "speed": device.speed,
                "noise": run_noise(self.scene.run.seed, number),
            }
        else:
            scene = replace(scene, run=replace(scene.run, seed=scene.run.seed + number))
        run = simulate(
            scene,
            model,
            sensor=self.sensor,
            progress=progress,
            modelled=self.modelled,
            to_time_limit=self.to_time_limit,
            **loop,
        )
        run = replace(run, findings=(*run.findings, *_law_findings(self.flow_law, run)))
        return RunResult(
            run=run,
            settling_time=math.inf if run.settling_time is None else run.settling_time,
            final_amplitude=float(run.amplitude[-1]),
            energy=run.gas.energy,
            worst_amplitude=float(np.max(run.amplitude)),
            ended=run.outcome.value,
            usable_moment=moment * run.usable_moment,
            unbalance=moment * abs(scene.rotor.initial_unbalance),
            crater=float(largest_ratio(scene, np.array(run.state["least_driven"]))),
            lost=part_per_gas(scene, run.model) * (run.state["gas"] - run.state["leaked"]),
        )

    def rotor(self, number: int | None = None) -> CommonRotor:
        scene = self.scene if number is None else self.drawn_runs.device(number).scene
        size = self.scene.sensor.runout_amplitude
        return CommonRotor(
            source=scene.source,
            speed=scene.rotor.speed,
            influence=scene.rotor.influence,
            unbalance=scene.rotor.initial_unbalance,
            mass=None,
            noise=scene.sensor.amplitude_noise,
            limit=self.limit,
            settling_time=self.scene.requirement.settling_time,
            runout=None if size is None else Runout(amplitude=size, phase=self.scene.sensor.runout_phase),
            limits_rotor=size is not None and self.scene.required_amplitude is not None,
        )

    def on_rotor(self, rotor: CommonRotor, rotors: Rotors | None = None) -> LiquidRingBalancer:
        """Balancer on another rotor, with the same valve-open time per unbalance and the same errors of
        assumptions. Raises: SceneError: the rotor is too slow to form a ring."""
        before, control = self.scene.rotor, self.scene.controller
        after = rotor_like(before, rotor)
        share = after.influence_coefficient / before.influence_coefficient
        scene = replace(
            self.scene,
            rotor=after,
            sensor=replace(
                self.scene.sensor,
                amplitude_noise=rotor.noise,
                phase_noise=min(rotor.noise / after.initial_amplitude, 1.0),
                runout_amplitude=None if rotor.runout is None else rotor.runout.amplitude,
                runout_phase=None if rotor.runout is None else rotor.runout.phase,
            ),
            controller=replace(
                control,
                limit=rotor.limit,
                proportional=control.proportional / share,
                fine_below=control.fine_below * share,
                assumed_influence_coefficient=control.assumed_influence_coefficient * share,
                assumed_lag_angle=wrapped(control.assumed_lag_angle - before.lag_angle + after.lag_angle),
            ),
            requirement=RequirementSettings(
                settling_time=rotor.settling_time,
                fraction=self.scene.requirement.fraction,
                residual=rotor.limit if rotor.limits_rotor else None,
            ),
        )
        check_ring(scene)
        return replace(self, scene=scene, rotors=rotors)

    def sampling_time(self) -> float:
        return self.scene.controller.period

    def lasting(self, span: float) -> LiquidRingBalancer:
        run = replace(self.scene.run, time_limit=span)
        return replace(self, scene=replace(self.scene, run=run), to_time_limit=True)

    def information(self, scene: SceneFile) -> Information:
        """Loop factor and margins, drawn errors of the devices, and what a single run takes to hold."""
        ring = liquid_ring_scene(scene)
        loop, document = loop_information(ring, self.model), self.drawn_runs.spread.document()
        rows = conventions(simulate(ring, self.model))
        consumption = [each.document() for each in rows if each.key in CONSUMPTION]
        return replace(loop, document={**loop.document, "drawn": document, "consumption": consumption})

    def beyond_capacity(self, scene: SceneFile, ended: Sequence[str], settings: str) -> tuple[Finding, ...]:
        """Findings on liquid that a machine moves beyond the fills at which runs end, on a short period."""
        ring = liquid_ring_scene(scene)
        short = short_period(ring, self.model) if Outcome.DRIFTING.value in ended else ()
        return (*beyond_capacity(ring, self.model, ended, settings=settings), *short)

    def quantities(self) -> tuple[Quantity, ...]:
        return calibrate(self.scene).rows().quantities

    def rows(self, run: Simulation) -> Rows:
        """Rows of a run, with its results at both ends of the default range of an unstated gas line.

        Where these settle and the run does not, or the reverse, the verdict is that this is undecided.
        """
        rows, runs = run.rows(), line_runs(run)
        first, *others = rows.findings
        if any(each.settled != run.settled for each in runs.values()):
            ends = "; ".join(f"with the {end} line {each.findings[0].text}" for end, each in runs.items())
            first = Finding(code="valve_decides", values={"at_once": first.text, "ends": ends})
        tables = (line_runs_table(runs), *rows.tables)
        return replace(rows, findings=(first, *others), tables=tables)

    def history(self, run: Simulation) -> Mapping[str, Sequence[Any]]:
        return simulation_history(run)


def _law_findings(law: object, run: Simulation) -> Iterator[Finding]:
    """Findings on numbers that a law of the caller's own does not give: taken from elsewhere, or left out."""
    if law is None or isinstance(law, CalibratedLaw | PaperLaw | str):
        return
    terms = [row.term for row in run.models_used if row.term in IN_INJECTIONS and row.model == NOT_MODELLED]
    if names := lacking(law):
        yield Finding(code="own_law_lacks", values={"names": names})
    if terms and not gives_forces(run.model.flow):
        yield Finding(code="own_law_without_forces", values={"terms": terms})
