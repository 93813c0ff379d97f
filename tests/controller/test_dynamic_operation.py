"""Whole operations with moving liquid, filling gas and late valves, and how their tails run on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pairs import PairState, Passage, pass_time
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.injection.dynamics import Dynamics, Event
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.reduced_model.tube.heads import roots_of
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Gas, Scene
from scenes import with_tables

Plant = Callable[..., Dynamics]
Pulse = Callable[..., Passage]
AMBIENT = 101325.0
PIPED = {"conductance": 1e-8, "critical_ratio": 0.3}


# --- lag, order, limits ---


@pytest.mark.parametrize("law", ["paper", "calibrated"])
def test_a_lag_is_an_exact_delay(
    law: str, model: BalancerModel, calibrated: BalancerModel, plant: Plant, pulse: Pulse
) -> None:
    own = model if law == "paper" else calibrated
    instants = np.linspace(0.01, 0.3, 30)
    prompt = pulse(plant(own), 0.3, instants)
    late = pulse(plant(own, "valve lag", valve_lag=0.04), 0.3, np.array([0.01, 0.04, *(0.04 + instants)]))
    assert np.all(late.fills[:2] == 0.25)
    assert late.fills[2:] == pytest.approx(prompt.fills, abs=1e-11)
    assert late.fill == pytest.approx(prompt.fill, abs=1e-11)
    assert late.motion.record.work == pytest.approx(prompt.motion.record.work, rel=1e-9)
    assert late.motion.record.regime_start is prompt.motion.record.regime_start
    assert late.motion.rests


@pytest.mark.parametrize("term", ["tube inertia", "gas filling", "valve lag"])
def test_a_vanishing_term_leaves_the_quasi_steady_operation(
    term: str, calibrated: BalancerModel, plant: Plant, pulse: Pulse
) -> None:
    """First order in the tube's length, in 1/C and in the lag."""
    still = 0.25 - pulse(plant(calibrated, "valve lag", valve_lag=0.0), 0.2, np.array([0.1])).fill

    def found(small: float) -> float:
        if term == "tube inertia":
            own = plant(calibrated, term, length=0.12 * small)
        elif term == "gas filling":
            own = plant(calibrated, term, conductance=1e-8 / small, critical_ratio=0.3)
        else:
            own = plant(calibrated, term, valve_lag=0.02 * small)
        return 0.25 - pulse(own, 0.2, np.array([0.1])).fill

    gaps = [still - found(small) for small in (0.4, 0.2, 0.1)]
    assert gaps[-1] > 0
    rates = np.log2(np.array(gaps[:-1]) / np.array(gaps[1:]))
    assert rates == pytest.approx(1.0, abs=0.12)
    assert gaps[-1] < 0.05 * still


# --- everything together, against an independent solver ---


class Independent:
    """The same pair written down again, from the law's own arrays, for scipy's solvers."""

    def __init__(self, model: BalancerModel, gas: Gas, *, length: float, share: float) -> None:
        assert isinstance(model.flow, CalibratedLaw)
        self.law, self.gas, self.length, self.share = model.flow, gas, length, share
        self.model = model

    def level(self, x: float) -> float:
        return float(self.law.hydrostatic_pressure(x))

    def phi(self, up: float, down: float) -> float:
        b = self.gas.critical_ratio or 0.0
        r = down / up
        if r <= b:
            return 1.0
        if r <= 0.999:
            return math.sqrt(1 - ((r - b) / (1 - b)) ** 2)
        return math.sqrt(1 - ((0.999 - b) / (1 - b)) ** 2) * (1 - r) / 1e-3

    def gas_flow(self, p: float, outside: float) -> float:
        """p V per time into a chamber at p, isothermal."""
        c = (self.gas.conductance or 0.0) * 1e5 * math.sqrt(self.gas.temperature / 293.15)
        return c * outside * self.phi(outside, p) if outside > p else -c * p * self.phi(p, outside)

    def over_crest(self, x: float, p: float, q: float, *, primed: bool) -> tuple[float, float]:
        """Pressure of what lies over the crest, and how far the spilling liquid has carried the gas out.

        Gas released from the liquid fills a cavity: halfway from vapour to the opposite chamber's pressure.
        """
        law = self.law
        cavity = (law.path.vapour_pressure + max(q - AMBIENT, law.path.vapour_pressure)) / 2
        if primed:
            return cavity, 1.0
        assert law.heads.hump is not None
        assert law.path.hump_pressure is not None
        gas = max(q - AMBIENT, cavity)
        margin = p - AMBIENT + self.level(x) - law.path.hump_pressure - gas
        if margin <= 0:
            return gas, 0.0
        table, head = law.heads.hump, margin / law.density
        spill = brentq(lambda v: float(roots_of(table, v)) ** 8 - head, 1e-35, 400.0, xtol=1e-13)
        part = min(max((spill / law.path.froude_velocity - 0.6) / 0.5, 0.0), 1.0)
        cleared = part * part * (3 - 2 * part)
        return gas + cleared * (cavity - gas), cleared

    def push(self, x: float, u: float, p: float, q: float, *, primed: bool) -> float:
        """du/dt: a full column first; if its crest would be below the pressure there, the separated one."""
        law, rho = self.law, self.law.density
        assert law.heads.hump is not None
        assert law.path.hump_pressure is not None
        hump = self.share * self.length
        speed = max(u, 1e-12)
        whole = rho * float(roots_of(law.heads.siphon, speed)) ** 8
        upper = rho * float(roots_of(law.heads.hump, speed)) ** 8
        full = (p - q + self.level(x) - self.level(0.5 - x) - whole) / (rho * self.length)
        over = p - AMBIENT + self.level(x) - law.path.hump_pressure - upper
        cavity, _ = self.over_crest(x, p, q, primed=primed)
        if over - rho * hump * full >= cavity:
            return full
        return (over - cavity) / (rho * hump)

    def rates(self, y: FloatArray, *, opened: bool, moving: bool, primed: bool) -> list[float]:
        x, u, p, q, _ = y
        u = max(u, 0.0) if moving else 0.0
        flow = self.model.tube_area * u
        first = (1 - x) * self.model.chamber_volume + (self.gas.dead_volume or 0.0)
        second = (0.5 + x) * self.model.chamber_volume + (self.gas.dead_volume or 0.0)
        outside = self.gas.pressure + AMBIENT if opened else AMBIENT
        return [
            -flow / self.model.chamber_volume,
            self.push(x, u, p, q, primed=primed) if moving else 0.0,
            (self.gas_flow(p, outside) - p * flow) / first,
            (self.gas_flow(q, AMBIENT) + q * flow) / second,
            (p - AMBIENT) * flow,
        ]

    def starts(self, y: FloatArray) -> float:
        assert self.law.path.hump_pressure is not None
        return float(y[2] - y[3] + self.level(y[0]) - self.law.path.hump_pressure)

    def run(
        self, y: FloatArray, end: float, *, opened: bool, moving: bool, primed: bool
    ) -> tuple[FloatArray, bool, float, bool]:
        """To the end, or to the first change; state, whether it moves, the time spent, whether primed."""

        def change(_: float, state: FloatArray) -> float:
            return float(state[1]) + 1e-9 if moving else self.starts(state)

        def priming(_: float, state: FloatArray) -> float:
            return self.over_crest(state[0], state[2], state[3], primed=False)[1] - 0.5

        change.terminal = priming.terminal = True  # type: ignore[attr-defined]
        change.direction = -1.0 if moving else 1.0  # type: ignore[attr-defined]
        priming.direction = 1.0  # type: ignore[attr-defined]
        result = solve_ivp(
            lambda _, state: self.rates(state, opened=opened, moving=moving, primed=primed),
            (0.0, end),
            y,
            method="Radau",
            rtol=1e-9,
            atol=[1e-11, 1e-8, 1e-3, 1e-3, 1e-7],
            events=(change, priming) if moving and not primed else change,
        )
        state = result.y[:, -1]
        ended = result.t_events[0].size > 0
        if ended and moving:
            state[1] = 0.0
        filled = primed or (moving and len(result.t_events) > 1 and result.t_events[1].size > 0)
        return state, moving != ended, float(result.t[-1]), filled


@pytest.mark.parametrize(("duration", "conductance"), [(0.06, 1e-8), (0.2, 3e-9)])
def test_an_operation_with_all_terms_against_scipy(
    scene: Scene, calibrated: BalancerModel, plant: Plant, duration: float, conductance: float, pulse: Pulse
) -> None:
    asked: dict[str, Any] = {
        "conductance": conductance,
        "critical_ratio": 0.35,
        "dead_volume": 3e-6,
        "valve_lag": 0.01,
    }
    terms = ("tube inertia", "gas filling", "valve lag")
    own = plant(calibrated, *terms, **asked)
    # Of a taut string from port to port over the crest's circle, what lies before the end of the arc.
    tangent = math.acos(31.5 / 44.5)
    leg, arc = 44.5 * math.sin(tangent), 31.5 * (math.pi - 2 * tangent)
    share = (leg + arc) / (2 * leg + arc)
    known = Independent(calibrated, replace(scene.gas, **asked), length=0.12, share=share)
    y, moving, stops = np.array([0.25, 0.0, AMBIENT, AMBIENT, 0.0]), False, []
    fills, clock, primed = [], 0.01, False
    for opened, stop in ((True, 0.01 + duration), (False, 0.01 + duration + 0.15)):
        while clock < stop - 1e-12:
            y, now, spent, primed = known.run(y, stop - clock, opened=opened, moving=moving, primed=primed)
            clock += spent
            if now != moving:
                stops.append(clock)
            moving = now
        fills.append(y[0])
    assert len(stops) == 2
    assert primed
    instants = np.array([stops[0], 0.01 + duration, stops[1], 0.01 + duration + 0.15])
    result = pulse(own, duration, instants)
    assert result.fills[[1, 3]] == pytest.approx(np.array(fills), abs=1e-6)
    assert result.fills[0] == 0.25
    # The flow begins and ends at the same times: a microsecond to either side is told apart.
    assert pulse(own, duration, np.array([stops[0] - 1e-6])).motion.velocity == 0
    assert pulse(own, duration, np.array([stops[0] + 1e-6])).motion.velocity > 0
    assert pulse(own, duration, np.array([stops[1] - 2e-6])).motion.velocity > 0
    assert pulse(own, duration, np.array([stops[1] + 2e-6])).motion.velocity == 0
    work = result.motion.record.work
    assert work == pytest.approx(y[4], rel=1e-5)


# --- how an operation's tail runs on ---


def test_a_stretch_may_be_cut_anywhere(
    calibrated: BalancerModel, plant: Plant, pulse: Pulse, resumed: Callable[..., Passage]
) -> None:
    own = plant(calibrated, "tube inertia", "gas filling", "valve lag", valve_lag=0.007, **PIPED)
    whole = pulse(own, 0.05, np.array([0.4]))
    for cut in (0.003, 0.03, 0.0572, 0.08):
        first = pulse(own, 0.05, np.array([cut]))
        second = resumed(own, first, 0.4 - cut)
        assert second.fill == pytest.approx(whole.fill, abs=1e-9)
        assert second.motion.record.work == pytest.approx(whole.motion.record.work, rel=1e-6)


def test_what_stops_the_flow_is_reported(calibrated: BalancerModel, plant: Plant, pulse: Pulse) -> None:
    own = plant(calibrated, "tube inertia")
    empty = pulse(own, 3.0, np.array([3.2]))
    assert (empty.motion.record.event, empty.fill, empty.primed) == (Event.EMPTY, 0.0, False)
    weak = pulse(replace(own, gas_pressure=0.3e6), 0.5, np.array([0.6]))
    assert (weak.motion.record.event, weak.fill) == (Event.BLOCKED, 0.25)
    again = pulse(own, 0.5, np.array([0.6]), fill=0.0)
    assert (again.motion.record.event, again.fill) == (Event.EMPTY, 0.0)
    short = pulse(own, 0.05, np.array([0.3]))
    assert short.motion.record.event is Event.NONE
    assert short.motion.rests
    assert short.motion.record.regime_end in {Regime.SEPARATED, Regime.SIPHON}


def test_the_opposite_chamber_can_be_full(model: BalancerModel, plant: Plant, pulse: Pulse) -> None:
    own = replace(plant(model, "tube inertia"), max_fill_ratio=0.3)
    result = pulse(own, 3.0, np.array([3.2]), fill=0.25)
    assert (result.motion.record.event, result.fill) == (Event.FULL, pytest.approx(0.2, abs=1e-15))


def test_work_bounds_the_integrators_steps(
    calibrated: BalancerModel, plant: Plant, monkeypatch: pytest.MonkeyPatch, pulse: Pulse
) -> None:
    monkeypatch.setattr("ringbalance.reduced_model.injection.dynamics.MOST_STEPS", 20)
    result = pulse(plant(calibrated, "tube inertia", "gas filling", **PIPED), 0.5, np.array([0.6]))
    assert result.motion.record.event is Event.UNFINISHED
    assert 0 <= result.fill <= 0.5


@pytest.fixture
def creeping(scene: Scene, plant: Plant, monkeypatch: pytest.MonkeyPatch) -> Dynamics:
    """Of a thick liquid, and few steps for it."""
    monkeypatch.setattr("ringbalance.reduced_model.injection.dynamics.MOST_STEPS", 5000)
    thick = with_tables(
        scene,
        liquid={"name": "custom", "kinematic_viscosity": 1e-3},
        rotor={"speed": 250.0},
        environment={"gravity": 0.0},
    )
    return plant(calibrate(thick).model, "tube inertia")


def test_a_creep_through_a_narrow_tube_takes_few_steps(
    creeping: Dynamics, forces: Callable[[Dynamics], Any]
) -> None:
    """Friction answers in 70 us, the levels within seconds: explicit steps would take half a million."""
    own = creeping
    instants = np.array([0.5, 5.0, 50.0])
    result = pass_time(own, PairState(fill=0.3, total=0.5, primed=True), instants=instants)

    def rates(_: float, y: FloatArray) -> list[float]:
        flow = own.tube_area * max(y[1], 0.0) / own.chamber_volume
        fills = (float(y[0]), 0.5 - float(y[0]))
        return [-flow, min(forces(own).accelerations(fills, (0.0, 0.0), speed=max(float(y[1]), 0.0)))]

    exact = solve_ivp(
        rates, (0.0, 50.0), [0.3, 0.0], method="Radau", t_eval=instants, rtol=1e-10, atol=[1e-13, 1e-12]
    )
    assert result.motion.record.event is not Event.UNFINISHED
    assert result.fills == pytest.approx(exact.y[0], abs=3e-9)
    assert 0.25 < result.fills[2] < result.fills[1] < result.fills[0] < 0.3


def test_a_creep_near_its_balance_takes_few_steps(creeping: Dynamics) -> None:
    """Slower than the error allowed to a step: explicit steps would stop it and start it again without
    end."""
    left = []
    for offset in (1e-5, 1e-7):
        start = PairState(fill=0.25 + offset, total=0.5, primed=True)
        result = pass_time(creeping, start, instants=np.array([20.0]))
        assert result.motion.record.event is not Event.UNFINISHED
        left.append((result.fill - 0.25) / offset)
    # Laminar: the same share is left of any offset.
    assert left[1] == pytest.approx(left[0], rel=1e-6)
    assert 0.9 < left[0] < 0.99


# --- in the loop ---


def test_the_controller_commands_and_the_plant_follows(scene: Scene, calibrated: BalancerModel) -> None:
    gas = replace(scene.gas, conductance=1e-8, critical_ratio=0.3, valve_lag=0.02)
    slow = with_tables(scene, gas=gas, controller={"kind": "law_based"}, run={"time_limit": 4.0})
    run = simulate(slow, calibrated)
    assert {
        t.term for t in run.models_used if t.term in {"gas filling", "valve lag"} and t.model != "left out"
    } == {
        "gas filling",
        "valve lag",
    }
    quiet = simulate(slow, calibrated, modelled=())
    assert run.injections[0].duration == quiet.injections[0].duration
    # The period runs from the commanded end, whatever the plant still does.
    longest = max(i.duration for i in run.injections if i.time == 0)
    assert run.samples[1].time == pytest.approx(longest + 0.5)
    first = run.injections[0]
    at = int(np.flatnonzero(run.time == run.samples[1].time)[0])
    assert run.fill_ratio[first.chamber][at] == first.fill_after
    opened = (run.time > 0) & (run.time <= 0.02)
    assert np.all(run.fill_ratio[first.chamber][opened] == 0.25)


def test_short_trials_settle_with_moving_liquid(scene: Scene, calibrated: BalancerModel) -> None:
    trial = with_tables(
        scene,
        controller={"kind": "trial", "short_step": 0.002, "minimum_gas_time": 0.001},
        run={"time_limit": 6.0},
    )
    run = simulate(trial, calibrated)
    assert {t.term: t.model for t in run.models_used}["tube inertia"].startswith("rho L du/dt")
    assert run.status
    fills = np.array(list(run.fill_ratio.values()))
    assert fills[:2] + fills[2:] == pytest.approx(0.5, abs=1e-15)


def test_energy_is_pressure_times_displaced_volume(scene: Scene, model: BalancerModel) -> None:
    run = simulate(scene, model)
    for injection in run.injections:
        done = injection
        volume = (done.fill_before - done.fill_after) * model.chamber_volume
        assert done.energy == pytest.approx(0.7e6 * volume, rel=1e-12)
    assert run.energy == pytest.approx(math.fsum(i.energy for i in run.injections))
