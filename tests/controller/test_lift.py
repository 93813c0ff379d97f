"""Liquid that an injection lifts to the crest: against the column written down again for scipy's solver."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ringbalance.controller.liquid_ring.interval import Passage
from ringbalance.controller.liquid_ring.motion import Dynamics
from ringbalance.physics.tube.state import tube_state
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.scene.models import Scene

Plant = Callable[..., Dynamics]
Pulse = Callable[..., Passage]
LIFT = "liquid held in the tube"
INERTIA = "tube inertia"
FILLING = "gas filling"


@dataclass(frozen=True)
class Column:
    """The liquid between port and front, from geometry and the tube's loss; s is a length, m."""

    scene: Scene
    law: CalibratedLaw

    @property
    def leg(self) -> tuple[float, float]:
        """Lengths from the port to the crest's circle and to its end, on the shortest path stretched."""
        tube = self.scene.tube
        assert tube.hump_radius is not None
        if tube.hump_shape == "point":
            return tube.length / 2, tube.length / 2
        straight = math.sqrt(tube.port_radius**2 - tube.hump_radius**2)
        arc = tube.hump_radius * (math.pi - 2 * math.acos(tube.hump_radius / tube.port_radius))
        scale = tube.length / (2 * straight + arc)
        return straight * scale, (straight + arc) * scale

    def radius(self, s: float) -> float:
        tube, start = self.scene.tube, self.leg[0]
        assert tube.hump_radius is not None
        out = max(1 - s / start, 0.0)
        if tube.hump_shape == "point":
            return tube.hump_radius + (tube.port_radius - tube.hump_radius) * out
        return math.hypot(tube.hump_radius, math.sqrt(tube.port_radius**2 - tube.hump_radius**2) * out)

    def head(self, radius: float) -> float:
        """rho omega^2 (R2^2 - r^2)/2, Pa."""
        outer = self.scene.disc.outer_radius
        return self.scene.liquid.density * self.scene.rotor.speed**2 * (outer**2 - radius**2) / 2

    def loss(self, s: float, u: float) -> float:
        """Of entrance, friction so far and the bends passed so far, with the kinetic energy, Pa."""
        scene, tube = self.scene, self.scene.tube
        speed = np.array([max(u, 1e-4)])
        state = tube_state(tube=tube, liquid=scene.liquid, angular_velocity=scene.rotor.speed, velocity=speed)
        along = state.terms["friction"] + state.terms["rotation"]
        passed = state.terms["entrance"] + state.kinetic_factor + along * s / tube.length
        return float(passed[0]) * scene.liquid.density * u * u / 2

    def rest(self, x: float) -> float:
        """Where the leg stands at the level of a chamber."""
        low, high = 0.0, self.leg[0]
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if self.head(self.radius(middle)) < self.level(x) else (low, middle)
        return low

    def level(self, x: float) -> float:
        return float(self.law.wall_pressure(x))

    def lifted(self, x: float, p: Callable[[float], float], start: float) -> tuple[float, float]:
        """Time, s, and velocity, m/s, at which the front reaches the crest's end under p(t), gauge."""
        rho = self.scene.liquid.density

        def rates(t: float, y: np.ndarray) -> list[float]:
            s, u = y
            push = self.law.gas_factor * p(t) + self.level(x) - self.head(self.radius(s))
            return [u, (push - math.copysign(self.loss(s, abs(u)), u)) / (rho * s)]

        def there(_: float, y: np.ndarray) -> float:
            return float(y[0] - self.leg[1])

        there.terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(rates, (0, 1.0), [start, 0.0], method="LSODA", rtol=1e-8, atol=1e-10, events=there)
        assert found.t_events[0].size
        return float(found.t[-1]), float(found.y[1, -1])


@pytest.fixture(scope="module")
def smooth(scene: Scene) -> Scene:
    """Without bends, whose loss the column of the reference would meet in steps."""
    return replace(scene, tube=replace(scene.tube, bends=()))


def gained(dynamics: Dynamics, pulse: Pulse, duration: float, tail: float = 0.0) -> float:
    return 0.25 - pulse(dynamics, duration, np.array([duration + tail])).fill


@pytest.mark.parametrize("shape", ["arc", "point"])
def test_liquid_passes_the_crest_when_a_second_model_has_it_there(
    shape: str, smooth: Scene, plant_of: Callable[..., Dynamics], pulse: Pulse
) -> None:
    scene = replace(smooth, tube=replace(smooth.tube, hump_shape=shape))  # type: ignore[arg-type]
    model = calibrate(scene).model
    assert isinstance(model.flow, CalibratedLaw)
    column = Column(scene, model.flow)
    time, speed = column.lifted(0.25, lambda _: scene.gas.pressure, column.rest(0.25))
    own = plant_of(scene, model, INERTIA, LIFT)
    instants = np.linspace(1e-5, 2 * time, 4001)
    seen = pulse(own, 1.0, instants)
    through = (0.25 - seen.fills) * model.chamber_volume / model.tube_area
    # What lies beyond the middle of the crest counts, and the front goes on at the velocity of the reference.
    beyond = (column.leg[1] - column.leg[0]) / 2
    found = float(np.interp(beyond + 1e-6, through, instants))
    print(shape, time, found, speed)
    assert found == pytest.approx(time, rel=0.02)
