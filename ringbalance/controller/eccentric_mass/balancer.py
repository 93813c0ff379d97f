"""Two driven eccentric masses as every command knows them."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import (
    AS_GIVEN,
    FURTHER,
    Balancer,
    Demand,
    Draws,
    Outcomes,
    Progress,
    Remedy,
    RunResult,
    Setting,
    Settings,
    settles_within,
)
from ringbalance.controller.eccentric_mass.devices import FITTED, PHASE, Device, device, on_rotor
from ringbalance.controller.eccentric_mass.plant import PlantParameters, speed_at
from ringbalance.controller.eccentric_mass.remedies import remedies_of
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.run_rows import eccentric_history
from ringbalance.controller.eccentric_mass.sampled_loops import (
    RecommendedGains,
    advised,
    loops_document,
    loops_quantities,
    loops_status,
)
from ringbalance.controller.eccentric_mass.scene_records import (
    EccentricRequirement,
    EccentricRotor,
    EccentricScene,
    eccentric_scene,
)
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.targets import reach_of
from ringbalance.controller.rotor import CommonRotor, Rotors, rotor_fault
from ringbalance.controller.trials import MEASURE_INPUT, Axis, DrawnInput, Information, Trials
from ringbalance.results.requirements import AT_MOST
from ringbalance.results.result import Rows
from ringbalance.results.rows import Quantity
from ringbalance.scene.draws import run_noise
from ringbalance.scene.origins import SceneFile, with_values_at

_FINEST_SHARE: Final = 0.01
"""Noise that a filter assumes, at the least, as a share of the amplitude to come below."""
_SETTLED_WHIRL: Final = 12.0
"""Time constants of the free whirl after which a run with eccentric masses starts to balance."""
_REACH: Final = 10.0
"""Factor up to which a gain is tried."""
_ADVISING: Final = 8
"""Devices whose runs say what would mend them."""
_SIZING: Final = 256
"""Devices whose imbalance, without a run, sizes the masses."""


class EccentricMassBalancer(Balancer):
    """Two masses that motors drive along one track.

    A scene gives the rotor by mass, stiffness and damping, alpha = W^2/(K_B - M W^2 + j C_B W), and takes a
    common one back as K_B = M W^2 + Re(W^2/alpha) and C_B = Im(W^2/alpha)/W, with the mass M of rotor and
    balancer together, which alpha at one speed leaves open.
    """

    energy_kind = "energy_electrical"
    scene: EccentricScene

    def __init__(self, scene: EccentricScene, rotors: Rotors | None = None) -> None:
        self.scene, self._rotors = scene, rotors

    def settings(self) -> tuple[Setting, ...]:
        """Gains of the drives."""
        lqr, friction = self.scene.lqr, self.scene.friction_filter
        values = {
            "lqr.state_weight": lqr.state_weight,
            "friction_filter.speed_gain": friction.speed_gain,
            "friction_filter.pair_gain": friction.pair_gain,
        }
        return tuple(
            Setting(path=path, value=value, lowest=value / _REACH, highest=value * _REACH)
            for path, value in values.items()
            if value > 0
        )

    def run(
        self,
        settings: Settings,
        draws: Draws,
        *,
        trace: bool = False,
        progress: Progress | None = None,
    ) -> Outcomes:
        """See `Balancer`."""
        return self._runs([settings], draws, trace=trace, progress=progress)[0]

    def run_all(
        self,
        settings: Sequence[Settings],
        draws: Draws,
        *,
        further: float = FURTHER,  # noqa: ARG002
    ) -> tuple[Outcomes, ...]:
        """See `Balancer`; masses at rest are watched to the end of the run."""
        return self._runs(settings, draws)

    def _runs(
        self,
        settings: Sequence[Settings],
        draws: Draws,
        *,
        trace: bool = False,
        progress: Progress | None = None,
    ) -> tuple[Outcomes, ...]:
        drawn = [self._device(number, drawn=draws.devices) for number in draws.numbers]
        outcomes = []
        for asked in settings:
            scene = with_values_at(self.scene, asked)
            strategy, results = StrategySettings.of(scene), []
            for number, each in zip(draws.numbers, drawn, strict=True):
                seed = run_noise(scene.run.seed, number) if draws.devices else scene.run.seed + number
                plant = with_values_at(each.scene, asked)
                run = simulate_eccentric(plant, seed=seed, settings=strategy, progress=progress)
                start = plant.supervisor.start
                amplitude = run.amplitude[run.time >= start]
                late = math.inf if run.settling_time is None else max(0.0, run.settling_time - start)
                results.append(
                    RunResult(
                        run=run,
                        settling_time=late,
                        final_amplitude=run.final_amplitude,
                        energy=run.electrical_energy,
                        worst_amplitude=float(np.max(amplitude)) if amplitude.size else run.worst_amplitude,
                        ended=run.outcome.value,
                        usable_moment=reach_of(plant),
                        unbalance=plant.imbalance.mass * plant.imbalance.radius,
                    )
                )
            inputs = [each.inputs for each in drawn]
            outcomes.append(Outcomes.of(results, numbers=draws.numbers, inputs=inputs, trace=trace))
        return tuple(outcomes)

    def _device(self, number: int, *, drawn: bool) -> Device:
        return device(self.scene, number, self._rotors) if drawn else Device(scene=self.scene, inputs={})

    def asked_fraction(self) -> float:
        """The scene's."""
        return self.scene.requirement.fraction

    def demands(self) -> tuple[Demand, ...]:
        """Settled in time, at the latest when the speed changes, and what may remain where it is stated."""
        scene, wanted = self.scene, self.scene.requirement
        until = (scene.steady_until or scene.run.time_limit) - scene.supervisor.start
        time = until if wanted.settling_time is None else wanted.settling_time
        settles = settles_within(time, stated=wanted.settling_time is not None)
        if wanted.residual is None:
            return (settles,)
        residual = Demand(
            code="residual",
            outcome="final_amplitude",
            sense=AT_MOST,
            required=wanted.residual,
            unit="m",
            stated=True,
        )
        return settles, residual

    def trials(self) -> tuple[Trials, ...]:
        """The gains of the drives with their margins, where the scene's have less: no other gain decides
        whether masses settle."""
        changes = advised(self.scene)
        if all(loop.value <= loop.recommended for loop in RecommendedGains.of(self.scene).loops):
            return ()
        loops = Axis(name="margins of the drives", levels=(0.0, 1.0), first=(0, 1))
        kind = self.scene.balancer
        return (Trials(kind=kind, axes=(loops,), settings=lambda at: changes if at[loops.name] else {}),)

    def remedies(self) -> tuple[Remedy, ...]:
        """Parts of another size, and what helps runs that end as those of the scene and some devices."""
        own, drawn = (self.run({}, draws) for draws in (AS_GIVEN, Draws.first(_ADVISING)))
        scenes = (self._device(number, drawn=True).scene for number in range(_SIZING))
        # Imbalance over what the masses cancel.
        shares = [each.imbalance.mass * each.imbalance.radius / reach_of(each) for each in scenes]
        return remedies_of(self.scene, drawn, own, shares)

    def drawn_input(self, name: str) -> DrawnInput:
        """See `Balancer`."""
        if name == PHASE:
            return DrawnInput(common=False, measure="", path=PHASE)
        if name.startswith(FITTED):
            return DrawnInput(common=True, measure=MEASURE_INPUT)
        return super().drawn_input(name)

    def on_scene(self, scene: SceneFile) -> EccentricMassBalancer:
        """See `Balancer`."""
        return EccentricMassBalancer(eccentric_scene(scene), self._rotors)

    def rotor(self, number: int | None = None) -> CommonRotor:
        """At the speed at which the strategy starts; see `Balancer`."""
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
        )

    def on_rotor(self, rotor: CommonRotor, rotors: Rotors | None = None) -> EccentricMassBalancer:
        """Opposite each other until the rotor's vibration is steady, with the noise that both balancers have.

        A wrong assumption stays as wrong as it was. Raises: SceneError: no such rotor has these masses.
        """
        scene = self.scene
        before, masses = scene.rotor, scene.masses
        whole = before.mass + 2 * masses.mass if rotor.mass is None else rotor.mass
        lighter = replace(scene, rotor=replace(before, mass=whole - 2 * masses.mass))
        plant = on_rotor(lighter, rotor)
        _check_rotor(rotor, scene, plant.rotor)
        moved = replace(
            plant,
            sensor=replace(
                scene.sensor, position_noise=rotor.noise, velocity_noise=rotor.noise * rotor.speed
            ),
            imbalance_filter=_believed(
                scene, plant.rotor, rotor, heavier=whole / (before.mass + 2 * masses.mass)
            ),
            supervisor=replace(scene.supervisor, limit=rotor.limit),
            requirement=EccentricRequirement(fraction=scene.requirement.fraction),
        )
        return EccentricMassBalancer(_steady_start(moved), rotors)

    def sampling_time(self) -> float:
        """See `Balancer`."""
        return self.scene.sensor.step

    def span(self) -> float:
        """See `Balancer`."""
        return self.scene.run.time_limit - self.scene.supervisor.start

    def lasting(self, span: float) -> EccentricMassBalancer:
        """See `Balancer`."""
        limit = span + self.scene.supervisor.start
        return EccentricMassBalancer(
            replace(self.scene, run=replace(self.scene.run, time_limit=limit)), self._rotors
        )

    def information(self, scene: SceneFile) -> Information:
        """Loops of the drives."""
        gains = RecommendedGains.of(eccentric_scene(scene))
        return Information(
            quantities=loops_quantities(gains),
            facts=(("loops of the drives", loops_status(gains)),),
            document=loops_document(gains),
        )

    def quantities(self) -> tuple[Quantity, ...]:
        """Reach, and the largest gains of the drives; see `Balancer`."""
        reach = Quantity(
            key="reach", name="usable moment in any direction", unit="kg m", value=reach_of(self.scene)
        )
        return (reach, *loops_quantities(RecommendedGains.of(self.scene)))

    def rows(self, run: EccentricRun) -> Rows:
        """See `Balancer`."""
        return run.rows()

    def history(self, run: EccentricRun) -> Mapping[str, Sequence[Any]]:
        """See `Balancer`."""
        return eccentric_history(run)


def _believed(scene: EccentricScene, found: EccentricRotor, rotor: CommonRotor, *, heavier: float) -> Any:
    """The imbalance filter's assumptions; `heavier`: mass of rotor and masses over that before."""
    before, believed = scene.rotor, scene.imbalance_filter
    assumed = max(rotor.noise, _FINEST_SHARE * rotor.limit)
    louder, stiffer = assumed / believed.position_noise, found.stiffness / before.stiffness
    damping = believed.assumed_damping
    return replace(
        believed,
        position_noise=assumed,
        velocity_noise=assumed * rotor.speed,
        velocity_walk=believed.velocity_walk * louder * stiffer / heavier,
        unbalance_walk=believed.unbalance_walk * louder * heavier,
        assumed_mass=believed.assumed_mass * (found.mass / before.mass),
        assumed_stiffness=believed.assumed_stiffness * stiffer,
        assumed_damping=found.damping if before.damping == 0 else damping * (found.damping / before.damping),
    )


def _steady_start(scene: EccentricScene) -> EccentricScene:
    """At constant speed; the strategy waits until the vibration from the rotor's start has died away."""
    whole = scene.rotor.mass + 2 * scene.masses.mass
    start = _SETTLED_WHIRL * 2 * whole / scene.rotor.damping
    start = math.ceil(start / scene.sensor.step) * scene.sensor.step
    first = scene.masses.initial_angle[0]
    return replace(
        scene,
        masses=replace(scene.masses, initial_angle=(first, first + math.pi)),
        supervisor=replace(scene.supervisor, start=start),
        run=replace(scene.run, time_limit=scene.run.time_limit + start),
    )


def _check_rotor(rotor: CommonRotor, scene: EccentricScene, found: EccentricRotor) -> None:
    """Faults of what the common rotor asks of this scene's."""
    if found.mass <= 0 or abs(rotor.unbalance) > found.mass * scene.imbalance.radius:
        problem = "these masses, or the imbalance, are heavier than the rotor itself"
        raise rotor_fault(scene, "masses.mass", problem, "lighter masses")
    if found.stiffness <= 0 or found.damping <= 0:
        lag = math.degrees(-cmath.phase(rotor.influence))
        problem = f"no bearing of this kind gives a lag of {lag:.4g} deg with this influence coefficient"
        allowed = "a lag_angle above 0 deg and below 180 deg, the greater the lighter the rotor"
        raise rotor_fault(scene, "rotor.stiffness", problem, allowed)
