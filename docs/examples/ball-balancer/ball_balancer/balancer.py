"""Two balls in a race as every command knows them."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ball_balancer.scene_keys import BallScene
from ringbalance.controller.balancer import (
    Balancer,
    Draws,
    Outcomes,
    Progress,
    Remedy,
    RunResult,
    Setting,
    Settings,
)
from ringbalance.controller.rotor import CommonRotor, Rotors, rotor_fault
from ringbalance.controller.trials import SearchAxis, Trials, rounded
from ringbalance.results.result import Rows
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.narrowing import scene_as
from ringbalance.scene.origins import SceneFile, with_values_at
from ringbalance.scene.uncertain import NORMAL_95

INSTANTS = 2001


@dataclass(frozen=True, kw_only=True, eq=False)
class BallRun:
    """One run of the balls from where they lie."""

    scene: BallScene
    time: FloatArray
    amplitude: FloatArray
    settling_time: float | None

    @property
    def settled(self) -> bool:
        """Whether the amplitude ends and stays below the limit."""
        return self.settling_time is not None

    @property
    def status(self) -> str:
        """How it ended."""
        end = f"{self.amplitude[-1] * 1e6:.3g} um"
        return f"settled at {end}" if self.settled else f"not settled: {end} remain, take heavier balls"

    def to_dict(self) -> dict[str, Any]:
        """As a JSON document in SI."""
        return {
            "balancer": self.scene.balancer,
            "settled": self.settled,
            "settling_time_s": self.settling_time,
            "status": self.status,
            "limit_m": self.scene.vibration.limit,
            "time_s": self.time.tolist(),
            "amplitude_m": self.amplitude.tolist(),
        }


class BallBalancer(Balancer):
    """Two balls of mass m at radius r in oil of drag c, under the rotor's whirl x at speed w.

    c r phi' = m w^2 Re(x conj(j exp(j phi))), x = alpha (U_0 + m r sum exp(j phi)): the tangential force of
    the race's acceleration, averaged over a turn, against the drag; the balls' own inertia is left out.
    """

    energy_kind = "energy_none"
    scene: BallScene

    def __init__(self, scene: BallScene, rotors: Rotors | None = None) -> None:
        self.scene, self.rotors = scene, rotors

    def settings(self) -> tuple[Setting, ...]:
        """The drag, by the choice of the oil."""
        drag = self.scene.balls.drag
        return (Setting(path="balls.drag", value=drag, lowest=drag / 30, highest=drag * 30),)

    def run(
        self,
        settings: Settings,
        draws: Draws,
        *,
        trace: bool = False,
        progress: Progress | None = None,
    ) -> Outcomes:
        """One run a draw; a drawn device starts with its balls anywhere."""
        scene = with_values_at(self.scene, settings)
        runs = []
        for place, number in enumerate(draws.numbers):
            if progress is not None:
                progress(place * scene.run.time_limit, len(draws.numbers) * scene.run.time_limit)
            run = _rolled(self._drawn(scene, number) if draws.devices else scene)
            runs.append(
                RunResult(
                    run=run,
                    settling_time=math.inf if run.settling_time is None else run.settling_time,
                    final_amplitude=float(run.amplitude[-1]),
                    energy=0.0,
                    worst_amplitude=float(np.max(run.amplitude)),
                    ended="settled" if run.settling_time is not None else "time_limit",
                    usable_moment=2.0 * scene.balls.mass * scene.balls.race_radius,
                    unbalance=abs(self.rotor().unbalance),
                )
            )
        return Outcomes.of(runs, trace=trace)

    def _drawn(self, scene: BallScene, number: int) -> BallScene:
        random = np.random.default_rng([scene.run.seed, number])
        inputs = BallBalancer(scene).inputs()
        parts = random.standard_normal(len(inputs)) / NORMAL_95
        values = {
            each.path: each.value + each.half_width * part for each, part in zip(inputs, parts, strict=True)
        }
        one, other = random.uniform(-math.pi, math.pi, 2).tolist()
        balls = replace(scene.balls, initial_angle=(one, other))
        device = with_values_at(replace(scene, balls=balls), values)
        return device if self.rotors is None else _on(device, self.rotors(number))

    def trials(self) -> tuple[Trials, ...]:
        """The drag between its bounds."""
        drag = SearchAxis(
            name="balls.drag", levels=tuple(np.geomspace(1 / 30, 30, 9).tolist()), first=(0, 2, 4, 6, 8)
        )
        value = self.scene.balls.drag
        settings = lambda point: {drag.name: rounded(point[drag.name] * value)}  # noqa: E731
        return (Trials(kind="drag", axes=(drag,), settings=settings),)

    def remedies(self) -> tuple[Remedy, ...]:
        """More oil."""
        return (Remedy(code="drag", changes={"balls.drag": 2.0 * self.scene.balls.drag}),)

    def on_scene(self, scene: SceneFile) -> BallBalancer:
        """Other balls."""
        return BallBalancer(scene_as(BallScene, scene))

    def rotor(self, number: int | None = None) -> CommonRotor:
        """The scene's, or a device's."""
        rotor = (self.scene if number is None else self._drawn(self.scene, number)).rotor
        return CommonRotor(
            source=self.scene.source,
            speed=rotor.speed,
            influence=cmath.rect(rotor.influence_coefficient, -rotor.lag_angle),
            unbalance=cmath.rect(rotor.unbalance, rotor.phase),
            mass=None,
            noise=0.0,
            limit=self.scene.vibration.limit,
        )

    def on_rotor(self, rotor: CommonRotor, rotors: Rotors | None = None) -> BallBalancer:
        """Raises: SceneError: below the critical speed the balls would roll to the heavy side."""
        if rotor.influence.real >= 0:
            problem = "below the critical speed balls roll to the heavy side"
            raise rotor_fault(self.scene, "rotor.speed", problem, "a lag angle beyond 90 deg")
        scene = _on(self.scene, rotor)
        return BallBalancer(replace(scene, vibration=replace(scene.vibration, limit=rotor.limit)), rotors)

    def sampling_time(self) -> float:
        """Nothing is measured."""
        return 0.0

    def lasting(self, span: float) -> BallBalancer:
        """The same for so long."""
        return BallBalancer(replace(self.scene, run=replace(self.scene.run, time_limit=span)), self.rotors)

    def quantities(self) -> tuple[Quantity, ...]:
        """Both balls side by side, their size left out."""
        reach = 2 * self.scene.balls.mass * self.scene.balls.race_radius
        return (Quantity(key="reach", name="usable moment in any direction", unit="kg m", value=reach),)

    def rows(self, run: BallRun) -> Rows:
        """Its amplitude and how it ended."""
        return _rows(run.status, run.settled, float(run.amplitude[-1]))

    def history(self, run: BallRun) -> Mapping[str, Sequence[Any]]:
        """Amplitude over time."""
        return {"time_s": run.time.tolist(), "amplitude_m": run.amplitude.tolist()}


def _on(scene: BallScene, rotor: CommonRotor) -> BallScene:
    return replace(
        scene,
        rotor=replace(
            scene.rotor,
            speed=rotor.speed,
            influence_coefficient=abs(rotor.influence),
            lag_angle=-cmath.phase(rotor.influence),
            unbalance=abs(rotor.unbalance),
            phase=cmath.phase(rotor.unbalance),
        ),
    )


def _rows(status: str, settled: bool, amplitude: float | None = None) -> Rows:
    found = Finding(code="tuned" if settled else "not_tuned", values={"text": status})
    last = Quantity(key="final_amplitude", name="amplitude at the end", unit="m", value=amplitude)
    return Rows(title="Two balls", quantities=(last,), findings=(found,))


def _rolled(scene: BallScene) -> BallRun:
    rotor, balls = scene.rotor, scene.balls
    influence = cmath.rect(rotor.influence_coefficient, -rotor.lag_angle)
    unbalance = cmath.rect(rotor.unbalance, rotor.phase)
    rate = balls.mass * rotor.speed**2 / (balls.drag * balls.race_radius)

    def whirl(angles: FloatArray) -> Any:
        return influence * (unbalance + balls.mass * balls.race_radius * np.exp(1j * angles).sum(axis=0))

    def slope(_: float, angles: FloatArray) -> FloatArray:
        return np.asarray(rate * (whirl(angles) * np.conj(1j * np.exp(1j * angles))).real)

    time = np.linspace(0.0, scene.run.time_limit, INSTANTS)
    found = solve_ivp(slope, (0.0, time[-1]), balls.initial_angle, method="LSODA", t_eval=time, rtol=1e-6)
    amplitude = np.abs(whirl(found.y))
    above = np.flatnonzero(amplitude > scene.vibration.limit)
    last = int(above[-1]) + 1 if above.size else 0
    settled = None if last == time.size else float(time[last])
    return BallRun(scene=scene, time=time, amplitude=amplitude, settling_time=settled)
