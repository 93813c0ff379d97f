"""Two balls in a race as every command knows them."""

import cmath
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ball_balancer.scene_keys import BallScene
from ringbalance.controller.balancer import Remedy
from ringbalance.controller.rotor import CommonRotor, rotor_fault
from ringbalance.controller.standard_balancer import Measure, StandardBalancer, StandardRun
from ringbalance.results.rows import Finding

INSTANTS = 2001


class BallBalancer(StandardBalancer):
    """Two balls of mass m at radius r in oil of drag c, under the rotor's whirl x at speed w.

    c r phi' = m w^2 Re(x conj(j exp(j phi))), x = alpha (U_0 + m r sum exp(j phi)): the tangential force of
    the race's acceleration, averaged over a turn, against the drag; the balls' own inertia is left out.
    """

    setting_paths = ("balls.drag",)

    def reach(self, device: BallScene) -> float:
        """Both balls side by side, their size left out."""
        return 2 * device.balls.mass * device.balls.race_radius

    def corrections(
        self, device: BallScene, *, assumed: BallScene, measure: Measure
    ) -> Iterator[tuple[float, complex]]:
        """The balls roll by themselves; nothing is measured."""
        rotor, balls = device.rotor, device.balls
        unbalance = cmath.rect(rotor.unbalance, rotor.phase)
        rate = balls.mass * rotor.speed**2 / (balls.drag * balls.race_radius)

        def correction(angles: Any) -> Any:
            return balls.mass * balls.race_radius * np.exp(1j * angles).sum(axis=0)

        def slope(_: float, angles: Any) -> Any:
            whirl = rotor.influence * (unbalance + correction(angles))
            return rate * (whirl * np.conj(1j * np.exp(1j * angles))).real

        time = np.linspace(0.0, device.run.time_limit, INSTANTS)
        rolled = solve_ivp(
            slope, (0.0, time[-1]), balls.initial_angle, method="LSODA", t_eval=time, rtol=1e-6
        )
        yield from zip(time.tolist(), correction(rolled.y).tolist(), strict=True)

    def scattered(self, device: BallScene, random: np.random.Generator) -> BallScene:
        """A device starts with its balls anywhere."""
        one, other = random.uniform(-math.pi, math.pi, 2).tolist()
        return replace(device, balls=replace(device.balls, initial_angle=(one, other)))

    def findings(self, run: StandardRun, device: BallScene) -> tuple[Finding, ...]:
        """Balls that do not suffice, with the mass that would."""
        needed = device.rotor.unbalance / (2 * device.balls.race_radius)
        if run.settled or needed < device.balls.mass:
            return ()
        return (Finding(code="ball.too_light", values={"mass": device.balls.mass, "needed": needed}),)

    def remedies(self) -> tuple[Remedy, ...]:
        """Balls that carry a fifth more than the unbalance."""
        mass = 1.2 * self.scene.rotor.unbalance / (2 * self.scene.balls.race_radius)
        if mass <= self.scene.balls.mass:
            return ()
        return (Remedy(code="heavier", changes={"balls.mass": mass}),)

    def check_rotor(self, rotor: CommonRotor) -> None:
        """Below the critical speed the balls would roll to the heavy side."""
        if rotor.influence.real >= 0:
            problem = "below the critical speed balls roll to the heavy side"
            raise rotor_fault(self.scene, "rotor.speed", problem, "a lag angle beyond 90 deg")
