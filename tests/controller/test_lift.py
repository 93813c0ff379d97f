"""Liquid that an injection lifts to the crest: against the column written down again for scipy's solver."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from pairs import Motion, Passage, packed
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ringbalance.physics.tube.state import tube_state
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.gas_line import line_ends
from ringbalance.reduced_model.injection.column import ends
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.injection.lift import crest_start, crest_stop, lift_rates, shown
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.tube.path import crest_span
from ringbalance.scene.models import Scene
from scenes import with_tables

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
        state = tube_state(scene, speed)
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
        return float(self.law.hydrostatic_pressure(x))

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
        result = solve_ivp(rates, (0, 1.0), [start, 0.0], method="LSODA", rtol=1e-8, atol=1e-10, events=there)
        assert result.t_events[0].size
        return float(result.t[-1]), float(result.y[1, -1])


@pytest.fixture(scope="module")
def smooth(scene: Scene) -> Scene:
    """Without bends, whose loss the column of the reference would meet in steps."""
    return with_tables(scene, tube={"bends": ()})


def gained(dynamics: Dynamics, pulse: Pulse, duration: float, tail: float = 0.0) -> float:
    return 0.25 - pulse(dynamics, duration, np.array([duration + tail])).fill


@pytest.mark.parametrize("shape", ["arc", "point"])
def test_liquid_passes_the_crest_when_a_second_model_has_it_there(
    shape: str, smooth: Scene, plant_of: Callable[..., Dynamics], pulse: Pulse
) -> None:
    scene = with_tables(smooth, tube={"hump_shape": shape})
    model = calibrate(scene).model
    assert isinstance(model.flow, CalibratedLaw)
    column = Column(scene, model.flow)
    time = column.lifted(0.25, lambda _: scene.gas.pressure, column.rest(0.25))[0]
    own = plant_of(scene, model, INERTIA, LIFT)
    instants = np.linspace(1e-5, 2 * time, 4001)
    seen = pulse(own, 1.0, instants)
    through = (0.25 - seen.fills) * model.chamber_volume / model.tube_area
    # What lies beyond the middle of the crest counts, and the front goes on at the velocity of the reference.
    beyond = (column.leg[1] - column.leg[0]) / 2
    result = float(np.interp(beyond + 1e-6, through, instants))
    assert result == pytest.approx(time, rel=0.02)


def test_without_inertia_the_front_moves_at_the_velocity_of_its_balance(
    smooth: Scene, plant_of: Callable[..., Dynamics], pulse: Pulse
) -> None:
    """t = integral of ds/u(s), with u from the reference's own loss."""
    model = calibrate(smooth).model
    assert isinstance(model.flow, CalibratedLaw)
    column, scene, factor = Column(smooth, model.flow), smooth, model.flow.gas_factor

    def speed(s: float) -> float:
        push = factor * scene.gas.pressure + column.level(0.25)
        push -= column.head(column.radius(s))
        return float(brentq(lambda u: column.loss(s, u) - push, 0.1, 100.0))

    places = np.linspace(column.rest(0.25), column.leg[1], 201)
    slow = np.array([1 / speed(s) for s in places])
    time = float(np.sum((slow[1:] + slow[:-1]) / 2 * np.diff(places)))
    instants = np.linspace(1e-5, 2 * time, 2001)
    seen = pulse(plant_of(scene, model, LIFT), 1.0, instants)
    through = (0.25 - seen.fills) * model.chamber_volume / model.tube_area
    beyond = (column.leg[1] - column.leg[0]) / 2
    assert float(np.interp(beyond, through, instants)) == pytest.approx(time, rel=0.02)


@pytest.mark.parametrize("inertia", [[], [INERTIA]])
def test_an_opening_too_short_to_reach_the_crest_moves_nothing(
    inertia: list[str],
    scene: Scene,
    calibrated: BalancerModel,
    plant_of: Callable[..., Dynamics],
    pulse: Pulse,
) -> None:
    own = plant_of(scene, calibrated, LIFT, *inertia)
    assert gained(own, pulse, 0.5e-3, 0.5) == pytest.approx(0.0, abs=1e-15)
    assert gained(plant_of(scene, calibrated, INERTIA), pulse, 0.5e-3, 0.5) > 1e-5
    assert gained(own, pulse, 8e-3, 0.5) > 1e-4


def test_a_long_injection_lacks_what_fell_back(
    scene: Scene, calibrated: BalancerModel, plant_of: Callable[..., Dynamics], pulse: Pulse
) -> None:
    """From the level to the middle of the crest, at a front that is faster than the column."""
    late = with_tables(scene, gas={"valve_lag": 0.0})
    own, bare = (
        gained(plant_of(late, calibrated, "valve lag", *terms), pulse, 0.1, 0.5) for terms in ((LIFT,), ())
    )
    lost = (bare - own) * calibrated.chamber_volume / calibrated.tube_area
    assert isinstance(calibrated.flow, CalibratedLaw)
    column = Column(scene, calibrated.flow)
    lifted = sum(column.leg) / 2 - column.rest(0.25)
    assert 0.6 * lifted < lost < lifted


def test_a_primed_tube_lifts_nothing(
    scene: Scene, calibrated: BalancerModel, plant_of: Callable[..., Dynamics], pulse: Pulse
) -> None:
    instants = np.array([0.05, 0.06])
    with_it, without = (
        pulse(plant_of(scene, calibrated, INERTIA, *terms), 0.05, instants, primed=True).fills
        for terms in ((LIFT,), ())
    )
    assert with_it == pytest.approx(without, abs=1e-9)


@pytest.mark.parametrize("inertia", [[], [INERTIA]])
def test_a_lift_goes_on_where_an_interval_ends(
    inertia: list[str],
    scene: Scene,
    calibrated: BalancerModel,
    plant_of: Callable[..., Dynamics],
    pulse: Pulse,
    resumed: Callable[..., Passage],
) -> None:
    """Within the error of a single run's steps, before the middle of the crest and beyond it."""
    own = plant_of(scene, calibrated, LIFT, *inertia)
    whole = pulse(own, 0.02, np.array([0.5]))
    middle = sum(crest_span(scene.tube)) / 2
    passed = set()
    for until in (1e-3, 2e-3, 3e-3, 4e-3):
        first = pulse(own, 0.02, np.array([until]))
        begun, place, _ = first.motion.lifted
        if place > begun:
            assert (place > middle) is (first.fill < 0.25)
            passed.add(place > middle)
        second = resumed(own, first, 0.5 - until)
        assert second.fill == pytest.approx(whole.fill, abs=1e-9)
    assert passed == {False, True}


@pytest.mark.parametrize("conductance", [0.2e-8, 1e-8, 4e-8, 20e-8])
def test_a_leg_rises_with_the_gas_of_a_line(
    conductance: float, smooth: Scene, plant_of: Callable[..., Dynamics], pulse: Pulse
) -> None:
    """Within 0.4 ms, or 1 %, of a front that the reference has carried from the level by the rising pressure.

    The reference leaves out that the gas expands by what it lifts, 0.1 % of its volume.
    """
    gas = replace(smooth.gas, conductance=conductance, critical_ratio=0.3, valve_lag=0.0)
    scene = replace(smooth, gas=gas)
    model = calibrate(scene).model
    assert isinstance(model.flow, CalibratedLaw)
    column, (end,) = Column(scene, model.flow), line_ends(scene)
    supply, ambient = end.line.supply_pressure, end.line.ambient_pressure
    steps = np.linspace(ambient, supply, 4001)
    times = end.line.filling_time(steps, volume=0.75 * model.chamber_volume)
    reference, _ = column.lifted(
        0.25, lambda t: float(np.interp(t, times, steps)) - ambient, column.rest(0.25)
    )
    instants = np.linspace(1e-5, reference + 5e-3, 8001)
    seen = pulse(plant_of(scene, model, LIFT, INERTIA, FILLING), 1.0, instants)
    through = (0.25 - seen.fills) * model.chamber_volume / model.tube_area
    result = float(np.interp((column.leg[1] - column.leg[0]) / 2, through, instants))
    assert result == pytest.approx(reference, rel=0.01, abs=0.4e-3)


def test_the_front_counts_from_where_it_starts_and_has_the_slopes_that_it_states(
    scene: Scene, plant_of: Callable[..., Dynamics]
) -> None:
    plant = plant_of(scene, calibrate(scene).model, INERTIA, LIFT).kept_plant(total=0.5)[0]
    start, stop = crest_start(plant, 1), crest_stop(plant, 1)
    for place in (0.6 * start, 0.4 * start + 0.6 * stop):
        motion = Motion(velocity=1.0, lifted=(place, place, 1))
        state = packed(np.array([plant]), fill=0.25, primed=False, motion=motion)[0]
        assert state["lifting"]
        assert shown(plant, state, 0.25) == 0.25
        at, x, step = ends(plant, 0.24, 0.26, 3e5, 0.0, 1), 0.2499, 1e-6

        _, by_x, by_speed, *_ = lift_rates(plant, state, at, x, 1.0)
        changes = [
            lift_rates(plant, state, at, x + dx, 1.0 + du)[0]
            - lift_rates(plant, state, at, x - dx, 1.0 - du)[0]
            for dx, du in ((step, 0.0), (0.0, step))
        ]
        assert changes[0] / (2 * step) == pytest.approx(by_x, rel=1e-5)
        assert changes[1] / (2 * step) == pytest.approx(by_speed, rel=1e-3)
