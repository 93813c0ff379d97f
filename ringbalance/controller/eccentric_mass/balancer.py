"""Balancer of two eccentric masses, as every command uses it."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import (
    AS_GIVEN,
    WATCH_TIME_S,
    Balancer,
    Demand,
    Draws,
    Outcomes,
    Progress,
    Remedy,
    RunResult,
    Setting,
    Settings,
    rotor_within,
    settles_within,
)
from ringbalance.controller.eccentric_mass.devices import (
    FITTED,
    PHASE,
    EccentricDevice,
    device,
    imbalance_ratios,
    on_rotor,
)
from ringbalance.controller.eccentric_mass.memory import STAGE_NAMES, Stage
from ringbalance.controller.eccentric_mass.outcome import EccentricOutcome
from ringbalance.controller.eccentric_mass.plant import PlantParameters, speed_at
from ringbalance.controller.eccentric_mass.remedies import remedies_of
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.run_rows import eccentric_history
from ringbalance.controller.eccentric_mass.sampled_loops import (
    RecommendedGains,
    loops_document,
    loops_quantities,
    loops_status,
)
from ringbalance.controller.eccentric_mass.scene_records import (
    EccentricRequirement,
    EccentricScene,
    eccentric_scene,
)
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.static_answers import (
    largest_whirl_per_imbalance,
    required_residual,
    static_quantities,
    whirl_per_imbalance,
)
from ringbalance.controller.eccentric_mass.targets import reach_of
from ringbalance.controller.eccentric_mass.tried_settings import trials_of
from ringbalance.controller.rotor import CommonRotor, Rotors, rotor_fault
from ringbalance.controller.trials import MEASURE_INPUT, DrawnInput, Information, Trials
from ringbalance.results.result import Rows
from ringbalance.results.rows import Quantity
from ringbalance.scene.draws import run_noise
from ringbalance.scene.origins import SceneFile, value_at, with_values_at

_GAINS: Final = ("lqr.state_weight", "friction_filter.speed_gain", "friction_filter.pair_gain")
_LEAST_NOISE_FRACTION: Final = 0.01
"""Smallest sensor noise that the filter assumes, as a fraction of the amplitude limit."""
_WHIRL_DECAY_TIMES: Final = 12.0
"""Waiting time before balancing starts, in time constants of the free whirl."""
_MAX_GAIN_FACTOR: Final = 10.0
"""Largest factor on a gain that is tried."""
_REST_TIMES: Final = 4.0
"""Length of the runs of a search, over the time to rest of the scene's own run."""
_REMEDY_DEVICES: Final = 8
"""Number of devices whose runs decide which remedies are tried."""


class EccentricMassBalancer(Balancer):
    """Balancer of two masses that motors drive along one track.

    A scene gives mass, stiffness and damping of the rotor, hence alpha = W^2/(K_B - M W^2 + j C_B W).  A
    rotor given by alpha at one speed W leaves the mass M of rotor and balancer open; with M known, K_B = M
    W^2 + Re(W^2/alpha) and C_B = Im(W^2/alpha)/W.
    """

    energy_kind = "energy_electrical"
    scene: EccentricScene

    def settings(self) -> tuple[Setting, ...]:
        """Gains of the drives, each with the scene's value and its bounds."""
        values = ((path, value_at(self.scene, path)) for path in _GAINS)
        return tuple(
            Setting.about(path, value, factor=_MAX_GAIN_FACTOR) for path, value in values if value > 0
        )

    def run(
        self,
        settings: Settings,
        draws: Draws,
        *,
        trace: bool = False,
        progress: Progress | None = None,
    ) -> Outcomes:
        """Run the devices one by one; see `Balancer`."""
        return self._outcomes(settings, draws, self._devices(draws), trace=trace, progress=progress)

    def run_all(
        self,
        settings: Sequence[Settings],
        draws: Draws,
        *,
        watch_time: float = WATCH_TIME_S,  # noqa: ARG002
    ) -> tuple[Outcomes, ...]:
        """Run several settings; masses at rest are watched to the end of the run. See `Balancer`."""
        devices = self._devices(draws)
        return tuple(self._outcomes(each, draws, devices) for each in settings)

    def _outcomes(
        self,
        settings: Settings,
        draws: Draws,
        devices: Sequence[EccentricDevice],
        *,
        trace: bool = False,
        progress: Progress | None = None,
    ) -> Outcomes:
        scene = with_values_at(self.scene, settings)
        strategy, results = StrategySettings.of(scene), []
        end = {} if draws.complete else {"run.time_limit": self._soon}
        for number, each in zip(draws.numbers, devices, strict=True):
            seed = run_noise(scene.run.seed, number) if draws.devices else scene.run.seed + number
            plant = with_values_at(each.scene, {**settings, **end})
            run = simulate_eccentric(plant, seed=seed, settings=strategy, progress=progress)
            start, ended, settled_at = plant.supervisor.start, run.outcome.value, run.settling_time
            amplitude = run.amplitude[run.time >= start]
            final = run.final_amplitude
            if end and settled_at is not None:
                # What is left is magnified as with masses that stay where they are.
                now = whirl_per_imbalance(plant, float(run.speed[-1]))
                final *= largest_whirl_per_imbalance(plant, after=run.end) / now
                if final > plant.supervisor.limit:
                    ended, settled_at = EccentricOutcome.RISES_AGAIN.value, None
            results.append(
                RunResult(
                    run=run,
                    settling_time=math.inf if settled_at is None else max(0.0, settled_at - start),
                    final_amplitude=run.final_amplitude,
                    energy=run.electrical_energy,
                    worst_amplitude=float(np.max(amplitude)) if amplitude.size else run.worst_amplitude,
                    ended=ended,
                    usable_moment=reach_of(plant),
                    unbalance=plant.imbalance.mass * plant.imbalance.radius,
                )
            )
        inputs = [each.inputs for each in devices]
        return Outcomes.of(results, numbers=draws.numbers, inputs=inputs, trace=trace)

    def _devices(self, draws: Draws) -> list[EccentricDevice]:
        if not draws.devices:
            return [EccentricDevice(scene=self.scene, inputs={})] * len(draws.numbers)
        return [device(self.scene, number, self._rotors) for number in draws.numbers]

    def required_fraction(self) -> float:
        """Fraction of the devices that the scene requires to meet every demand."""
        return self.scene.requirement.fraction

    def demands(self) -> tuple[Demand, ...]:
        """Settled within the stated time, else until the speed changes; and residual vibration, if stated."""
        scene, requirement = self.scene, self.scene.requirement
        until = (scene.steady_until or scene.run.time_limit) - scene.supervisor.start
        time = until if requirement.settling_time is None else requirement.settling_time
        settles = settles_within(time, stated=requirement.settling_time is not None)
        allowed = required_residual(scene)
        return (
            (settles,) if allowed is None else (settles, rotor_within(allowed, code="residual", stated=True))
        )

    def trials(self) -> tuple[Trials, ...]:
        """Trials of the strategy's settings; empty for locked masses."""
        locked = self.scene.supervisor.strategy == "locked"
        return () if locked else (trials_of(self.scene, self._nominal),)

    @cached_property
    def _nominal(self) -> EccentricRun:
        """Run of the scene as it is."""
        nominal: EccentricRun = self.run({}, AS_GIVEN, trace=True).traced[0].run
        return nominal

    @cached_property
    def _soon(self) -> float:
        """Time at which the runs of a search end, s: when the speed changes, or long after the scene's own
        run has come to rest."""
        rest = [each.start for each in self._nominal.stages if each.name == STAGE_NAMES[Stage.REST]]
        start, steady = self.scene.supervisor.start, self.scene.steady_until or self.scene.run.time_limit
        return min(steady, start + _REST_TIMES * (rest[0] - start)) if rest else steady

    def remedies(self) -> tuple[Remedy, ...]:
        """Parts of another size, and changes suited to the ways in which runs of some devices end."""
        nominal, sample = (self.run({}, draws) for draws in (AS_GIVEN, Draws.first(_REMEDY_DEVICES)))
        return tuple(remedies_of(self.scene, nominal, sample, imbalance_ratios(self.scene, self._rotors)))

    def drawn_input(self, name: str) -> DrawnInput:
        """Kind of an input; no measurement is proposed for the direction of an imbalance."""
        if name == PHASE:
            return DrawnInput(common=False, measure="", path=PHASE)
        if name.startswith(FITTED):
            return DrawnInput(common=True, measure=MEASURE_INPUT)
        return super().drawn_input(name)

    def rotor(self, number: int | None = None) -> CommonRotor:
        """Rotor at the speed at which the strategy starts; see `Balancer`."""
        scene = self.scene if number is None else device(self.scene, number, self._rotors).scene
        speed, _ = speed_at(*scene.rotor.profile, scene.supervisor.start)
        if speed <= 0:
            problem = "the rotor does not turn forwards when balancing starts"
            raise rotor_fault(scene, "rotor.speed_profile", problem, "a speed above 0 rpm at that time")
        parameters = PlantParameters.of(scene)
        if parameters.damping == 0:
            problem = "without damping the vibration before balancing never becomes steady"
            raise rotor_fault(scene, "rotor.damping", problem, "a damping coefficient above 0 N*s/m")
        imbalance = scene.imbalance
        return CommonRotor(
            source=scene.source,
            speed=speed,
            influence=parameters.influence(speed),
            unbalance=cmath.rect(imbalance.mass * imbalance.radius, imbalance.phase),
            mass=parameters.mass,
            noise=scene.sensor.position_noise,
            limit=scene.supervisor.limit,
            settling_time=scene.requirement.settling_time,
        )

    def on_rotor(self, rotor: CommonRotor, rotors: Rotors | None = None) -> EccentricMassBalancer:
        """Balancer on a rotor, masses opposite each other until the vibration is steady, with the rotor's
        noise.

        Errors of the assumed rotor keep their ratio. Raises: SceneError: no such rotor has these masses, or
            the sensor has runout, which is no imbalance at any speed that the filter could estimate.
        """
        if rotor.runout is not None:
            problem = f"the sensor of {rotor.source} has runout, which runs of eccentric masses do not model"
            raise rotor_fault(self.scene, "sensor", problem, "a comparison without sensor.runout")
        scene, before = self.scene, self.scene.rotor
        own_mass = before.mass + 2 * scene.masses.mass
        mass = own_mass if rotor.mass is None else rotor.mass
        plant = on_rotor(with_values_at(scene, {"rotor.mass": mass - 2 * scene.masses.mass}), rotor)
        after = plant.rotor
        if after.mass <= 0 or abs(rotor.unbalance) > after.mass * scene.imbalance.radius:
            problem = "these masses, or the imbalance, are heavier than the rotor itself"
            raise rotor_fault(scene, "masses.mass", problem, "lighter masses")
        if after.stiffness <= 0 or after.damping <= 0:
            lag = math.degrees(-cmath.phase(rotor.influence))
            problem = f"no bearing of this kind gives a lag of {lag:.4g} deg with this influence coefficient"
            allowed = "a lag_angle above 0 deg and below 180 deg, the greater the lighter the rotor"
            raise rotor_fault(scene, "rotor.stiffness", problem, allowed)
        # The strategy waits until the vibration from the rotor's start has died away.
        step, total_mass = scene.sensor.step, after.mass + 2 * scene.masses.mass
        start = math.ceil(_WHIRL_DECAY_TIMES * 2 * total_mass / after.damping / step) * step
        angle = scene.masses.initial_angle[0]
        # The filter's noises and its rotor change as the sensor and the rotor do.
        keys, mass_ratio = scene.imbalance_filter, mass / own_mass
        noise = max(rotor.noise, _LEAST_NOISE_FRACTION * rotor.limit)
        louder, stiffer = noise / keys.position_noise, after.stiffness / before.stiffness
        damping = keys.assumed_damping * (after.damping / before.damping) if before.damping else after.damping
        values = {
            "sensor.position_noise": rotor.noise,
            "sensor.velocity_noise": rotor.noise * rotor.speed,
            "imbalance_filter.position_noise": noise,
            "imbalance_filter.velocity_noise": noise * rotor.speed,
            "imbalance_filter.velocity_walk": keys.velocity_walk * louder * stiffer / mass_ratio,
            "imbalance_filter.unbalance_walk": keys.unbalance_walk * louder * mass_ratio,
            "imbalance_filter.assumed_mass": keys.assumed_mass * (after.mass / before.mass),
            "imbalance_filter.assumed_stiffness": keys.assumed_stiffness * stiffer,
            "imbalance_filter.assumed_damping": damping,
            "masses.initial_angle": (angle, angle + math.pi),
            "supervisor.limit": rotor.limit,
            "supervisor.start": start,
            "run.time_limit": scene.run.time_limit + start,
        }
        requirement = EccentricRequirement(
            fraction=scene.requirement.fraction, settling_time=rotor.settling_time
        )
        mounted = replace(with_values_at(plant, values), requirement=requirement)
        return EccentricMassBalancer(mounted, rotors)

    def sampling_time(self) -> float:
        """Time between two samples, s."""
        return self.scene.sensor.step

    def span(self) -> float:
        """Time from the start of balancing to the end of a run, s."""
        return self.scene.run.time_limit - self.scene.supervisor.start

    def lasting(self, span: float) -> EccentricMassBalancer:
        """Balancer with runs that balance for `span`, s."""
        end = {"run.time_limit": span + self.scene.supervisor.start}
        return EccentricMassBalancer(with_values_at(self.scene, end), self._rotors)

    def information(self, scene: SceneFile) -> Information:
        """Loops of the drives."""
        gains = RecommendedGains.of(eccentric_scene(scene))
        return Information(
            quantities=loops_quantities(gains),
            facts=(("loops of the drives", loops_status(gains)),),
            document=loops_document(gains),
        )

    def quantities(self) -> tuple[Quantity, ...]:
        """Answers without a run, and the largest gains of the drives; see `Balancer`."""
        return (*static_quantities(self.scene), *loops_quantities(RecommendedGains.of(self.scene)))

    def rows(self, run: EccentricRun) -> Rows:
        """Rows of a run as `simulate` prints them."""
        return run.rows()

    def history(self, run: EccentricRun) -> Mapping[str, Sequence[Any]]:
        """Columns of every sample of a run."""
        return eccentric_history(run)
