"""Leaks of the gas distributor, compared with ISO 6358 and a plant that are written apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from own_draws import drawn
from own_plant import run, settings_of

import ringbalance as rb
from ringbalance.controller.balancer import AS_GIVEN, balancer_of
from ringbalance.controller.simulation import Simulation
from ringbalance.export.blocks import disc_block
from ringbalance.physics.gas import GasLine, applied_pressure, chamber_pressures
from ringbalance.reduced_model.injection.dynamics import WORKSPACE, Dynamics, P
from ringbalance.reduced_model.injection.events import command
from ringbalance.reduced_model.injection.march import advance
from ringbalance.reduced_model.injection.pair import at_rest
from ringbalance.scene.models import Scene

SPINDLE: Final = "grinding_spindle"
EXACT: Final = {"sensor.amplitude_noise": "0 um", "sensor.phase_noise": "0 deg"}
TO_AMBIENT, FROM_SUPPLY = "gas.leak_to_ambient", "gas.leak_from_supply"
LITRE_PER_S_BAR: Final = 1e-8
AMBIENT, R, T = 101325.0, 287.05, 293.15
DENSITY: Final = 1e5 / (R * T)
"""Of dry air in the reference atmosphere, kg/m^3."""


def scene(values: Mapping[str, object] | None = None, *, name: str = SPINDLE) -> Scene:
    return cast(Scene, rb.load_scene(rb.bundled_scene(name)).with_values({**EXACT, **(values or {})}))


def leaking(to_ambient: float = 0.0, from_supply: float = 0.0, **more: object) -> Scene:
    """Args: conductances in l/(s bar)."""
    leaks = {TO_AMBIENT: to_ambient, FROM_SUPPLY: from_supply}
    values = {key: f"{value!r} l/(s*bar)" for key, value in leaks.items() if value}
    return scene({**values, **{f"gas.{key}": value for key, value in more.items()}})


def simulated(some: Scene) -> Simulation:
    result = rb.simulate(some)
    assert isinstance(result, Simulation)
    return result


def mass_flow(c: float, p: float, q: float, b: float = 0.3) -> float:
    """By ISO 6358 from absolute p to q, kg/s, with the laminar end that the documentation declares."""
    if p < q:
        return -mass_flow(c, q, p, b)
    r = q / p
    ellipse = math.sqrt(1 - max((min(r, 0.999) - b) / (1 - b), 0.0) ** 2)
    return c * DENSITY * p * (ellipse if r <= 0.999 else ellipse * (1 - r) / 0.001)


def own_filling(
    time: float, *, room: float, leak: float, seep: float, opened: bool, start: float, adiabatic: bool
) -> float:
    """Absolute pressure of a constant volume after a time by small explicit steps: valve of 0.3 l/(s bar)."""
    valve, supply, steps = 0.3 * LITRE_PER_S_BAR, 0.6e6 + AMBIENT, 100_000
    p, mass = start, start * room / (R * T)
    for _ in range(steps):
        temperature = p * room / (mass * R) if adiabatic else T
        out = math.sqrt(T / temperature)
        paths = [(valve, supply if opened else AMBIENT), (leak, AMBIENT), (0.0 if opened else seep, supply)]
        flows = [mass_flow(c, outside, p) for c, outside in paths]
        flows = [each if each >= 0 else each * out for each in flows]
        heat = sum(each * (T if each >= 0 else temperature) for each in flows)
        p += time / steps * (1.4 if adiabatic else 1.0) * R * heat / room
        mass += time / steps * sum(flows)
    return p


@pytest.mark.parametrize(
    ("leak", "pressure"),
    [(0.05, 0.593), (0.1, 0.574), (0.15, 0.545), (0.157, 0.540), (0.2, 0.509), (0.25, 0.470)],
)
def test_a_chamber_under_gas_comes_to_the_pressure_at_which_the_valve_passes_what_leaks(
    leak: float, pressure: float
) -> None:
    """Pressures of another plant, MPa, and a balance of flows written again; a run reaches them."""
    some = leaking(leak)
    opened, closed = chamber_pressures(some.gas)
    assert applied_pressure(some.gas) == pytest.approx(1e6 * pressure, rel=0.01)
    inflow = mass_flow(0.3, 0.6e6 + AMBIENT, opened)
    assert mass_flow(leak, opened, AMBIENT) == pytest.approx(inflow, rel=1e-9)
    assert closed == AMBIENT
    longest = max(each.closing_pressure for each in simulated(some).injections)
    assert longest == pytest.approx(1e6 * pressure, rel=0.01)


def test_a_leak_as_large_as_the_valve_has_a_closed_form() -> None:
    """Choked through the leak, phi(r) = r: (1 - b)^2 r^2 + (r - b)^2 = (1 - b)^2."""
    b = 0.3
    a, c = (1 - b) ** 2 + 1, b * b - (1 - b) ** 2
    ratio = (b + math.sqrt(b * b - a * c)) / a
    opened, _ = chamber_pressures(leaking(0.3).gas)
    assert AMBIENT / opened < b
    assert opened == pytest.approx(ratio * (0.6e6 + AMBIENT), rel=1e-9)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.01, 0.5))
def test_more_leak_leaves_less_pressure(first: float, second: float, wider: float) -> None:
    less, more = sorted((first, second))
    pressures = [applied_pressure(leaking(each).gas) for each in (less, more)]
    assert 0.0 < pressures[1] <= pressures[0] <= 0.6e6
    assert applied_pressure(leaking(0.0, less).gas) >= applied_pressure(leaking(0.0, more).gas)
    larger = leaking(more, conductance=f"{0.3 + wider} l/(s*bar)")
    assert applied_pressure(larger.gas) >= pressures[1]


@pytest.mark.parametrize("process", ["isothermal", "adiabatic"])
@pytest.mark.parametrize(
    ("leak", "seep", "opened", "time"),
    [(0.2, 0.0, True, 0.04), (0.2, 0.05, False, 0.06), (0.0, 0.1, False, 0.05), (0.1, 0.1, True, 0.5)],
)
def test_gas_in_time_is_that_of_small_steps(
    leak: float, seep: float, opened: bool, time: float, process: str
) -> None:
    """A chamber at equal fills whose liquid rests, filled from ambient or vented from half the supply.

    The limit is the error of the small steps; a wrong temperature of what leaks changes the adiabatic ones
    by some percent.
    """
    some = leaking(leak, seep, process=process)
    # A crest near the shaft: no liquid moves.
    model = rb.calibrate(some.with_values({"tube.hump_radius": "21 mm", "tube.length": "160 mm"})).model
    plant = Dynamics.of(some, model, line=GasLine.of(some.gas)).plant(total=0.5)
    motion, start = at_rest(plant, fill=0.25), AMBIENT if opened else 0.3e6 + AMBIENT
    room = 0.75 * float(plant["chamber_volume"][0]) + 1e-6
    motion["state"][0, P], motion["state"][0, P + 2] = start, start * room / T
    if opened:
        command(plant[0], motion[0], 0, 10.0)
    advance(plant[0], motion[0], time, np.zeros((2, 1)), 1, 0, np.zeros(WORKSPACE))
    right = own_filling(
        time,
        room=room,
        leak=leak * LITRE_PER_S_BAR,
        seep=seep * LITRE_PER_S_BAR,
        opened=opened,
        start=start,
        adiabatic=process == "adiabatic",
    )
    assert motion["state"][0, 0] == 0.25
    assert motion["state"][0, P] == pytest.approx(right, rel=1e-3)


def test_the_leak_at_which_the_loop_stands_still_is_that_of_an_own_plant() -> None:
    """The largest leak at which the nominal machine settles, by halving, within 5 %."""

    def own(leak: float) -> bool:
        some = leaking(leak)
        machine = drawn(some, number=-1, seed=0, phase=some.rotor.initial_phase)
        return math.isfinite(run(machine, settings_of(some), noise_seed=0).settling_time)

    def program(leak: float) -> bool:
        return simulated(leaking(leak)).settled

    walls = []
    for settles in (own, program):
        low, high = 0.2, 0.4
        assert settles(low)
        assert not settles(high)
        while high - low > 0.004:
            middle = (low + high) / 2
            low, high = (middle, high) if settles(middle) else (low, middle)
        walls.append((low + high) / 2)
    assert walls[1] == pytest.approx(walls[0], rel=0.05)


def test_below_the_pressure_of_the_crest_the_usable_moment_falls() -> None:
    """None is lost up to 0.157 l/(s bar), where a chamber has what an empty one needs to prime the tube."""
    moments = []
    for leak in (0.0, 0.157, 0.2):
        calibration = rb.calibrate(leaking(leak))
        moments.append(calibration.quantities["usable_moment"].value or 0.0)
        primes = calibration.quantities["priming_pressure_vented"].value or 0.0
        if leak == 0.157:
            assert applied_pressure(leaking(leak).gas) == pytest.approx(primes, rel=0.01)
    assert moments[1] >= moments[0]
    assert moments[2] < 0.95 * moments[0]


def test_a_leak_from_the_supply_keeps_a_vented_chamber_under_pressure() -> None:
    some = leaking(0.0, 0.05)
    opened, closed = chamber_pressures(some.gas)
    assert opened == 0.6e6 + AMBIENT
    assert closed - AMBIENT == pytest.approx(42.2e3, rel=0.01)
    assert mass_flow(0.05, opened, closed) == pytest.approx(mass_flow(0.3, closed, AMBIENT), rel=1e-9)
    result, tight = simulated(some), simulated(scene())
    assert result.plant.gas_pressure == opened - closed
    # Air leaks into four chambers all the time, choked, at most.
    span = float(result.time[-1]) * 4
    span -= sum(each.duration for each in result.injections)
    litres = 0.05 * LITRE_PER_S_BAR * opened * span * 1e5 / 101325.0 * 273.15 / T * 1e3
    assert result.gas.leaked * 1e3 == pytest.approx(litres, rel=1e-6)
    assert result.gas.normal_volume > result.gas.leaked > 4 * tight.gas.normal_volume


@pytest.mark.parametrize("key", [TO_AMBIENT, FROM_SUPPLY])
def test_no_leak_is_the_limit_of_a_small_one(key: str) -> None:
    none, zero, little = (
        simulated(scene(values)) for values in ({}, {key: "0 l/(s*bar)"}, {key: "1e-13 l/(s*bar)"})
    )
    assert zero.amplitude.tolist() == none.amplitude.tolist()
    assert zero.gas == none.gas
    assert little.amplitude[-1] == pytest.approx(none.amplitude[-1], abs=1e-9 * float(none.amplitude[0]))
    assert little.gas.normal_volume == pytest.approx(none.gas.normal_volume, rel=1e-9)


def test_with_an_ideal_supply_a_leak_costs_air_alone() -> None:
    """No conductance: the same run, and what a leak passes at the supply's pressure while a valve is open."""
    values = {TO_AMBIENT: "0.1 l/(s*bar)"}
    tight, leaky = (simulated(scene(each, name="liquid_ring_paper")) for each in ({}, values))
    assert leaky.amplitude.tolist() == tight.amplitude.tolist()
    opened = sum(each.duration for each in leaky.injections)
    litres = 0.1 * 8.01325 * opened * 1e5 / 101325.0 * 273.15 / 293.15
    added = 1e3 * (leaky.gas.normal_volume - tight.gas.normal_volume)
    assert added == pytest.approx(litres, rel=1e-6)
    findings = rb.calibrate(leaky.scene).rows().findings
    assert [each.code for each in findings if each.code.startswith("leak")] == ["leak_costs_air"]
    findings = rb.calibrate(leaking(0.1)).rows().findings
    assert [each.code for each in findings if each.code.startswith("leak")] == ["leak_lowers"]


def test_drawn_devices_leak_as_a_single_run_does() -> None:
    some = leaking(0.15, 0.01)
    result, balancer = simulated(some), balancer_of(some)
    together = balancer.run_all([{}, {"gas.pressure": (0.65e6,)}], AS_GIVEN)
    assert together[0].settling_time[0] == pytest.approx(result.settling_time, rel=1e-3)
    assert together[0].energy[0] > 0.9 * result.gas.energy
    higher = simulated(leaking(0.15, 0.01, pressure="0.65 MPa"))
    assert together[1].usable_moment[0] == pytest.approx(higher.usable_moment, rel=1e-3)
    assert together[1].settling_time[0] == pytest.approx(higher.settling_time, rel=1e-2)


def test_the_exported_disc_leaks_as_a_run_does() -> None:
    """Gas pressures and fills through an injection, with both leaks and liquid without mass."""
    some = leaking(0.15, 0.02)
    calibration = rb.calibrate(some)
    block = disc_block(some, calibration.flow_law)
    dynamics = Dynamics.of(some, calibration.model, line=GasLine.of(some.gas), valve_lag=3e-3)
    plant = dynamics.plant(total=0.5)
    motion, row = at_rest(plant, fill=0.25), list(block.start)
    command(plant[0], motion[0], 0, 2.0)
    vented = chamber_pressures(some.gas)[1]
    assert block.outputs(row)["gas_pressure_a"] == pytest.approx(vented, rel=1e-12)
    for step in range(60):
        outputs = block.run(row, 0.05, {"open_time_a": 2.0 if step == 0 else 0.0})
        advance(plant[0], motion[0], 0.05, np.zeros((2, 1)), 1, 0, np.zeros(WORKSPACE))
        pressure = [outputs["gas_pressure_a"], outputs["gas_pressure_c"]]
        assert pressure == pytest.approx(motion["state"][0, P : P + 2], rel=1e-3)
        assert outputs["fill_ratio_a"] == pytest.approx(motion["state"][0, 0], abs=3e-4)
    assert outputs["fill_ratio_a"] < 0.235


def test_an_uncertain_leak_counts_in_the_usable_moment() -> None:
    sure = leaking(0.2)
    unsure = sure.with_values({"uncertainty.leak_to_ambient": "20 %"})
    first, second = (rb.calibrate(each).quantities["usable_moment"] for each in (sure, unsure))
    assert second.lower is not None
    assert first.lower is not None
    assert second.lower < first.lower - 0.02 * (first.value or 0.0)
