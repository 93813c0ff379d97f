"""What the gas line delivers at the least, compared with the plant in time; what a run costs in gas."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pairs import Passage

from ringbalance.controller.document import simulation_document
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import GasUse, Injection
from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.gas_line import line_text
from ringbalance.reduced_model.injection.dynamics import Dynamics, Event
from ringbalance.reduced_model.injection.line_answers import line_answers
from ringbalance.reduced_model.injection.pair import Injections
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.tube.path import crest_span
from ringbalance.scene.models import Scene
from scenes import with_tables

Plant = Callable[..., Dynamics]
Pulse = Callable[..., Passage]
AMBIENT = 101325.0
LIFT = "liquid held in the tube"


def _change(calibrated: BalancerModel, scene: Scene, moved: float) -> float:
    moment = calibrated.moment.pair_moment(fill_ratio=0.25 - moved, opposite_fill_ratio=0.25 + moved)
    return abs(float(moment)) * scene.rotor.influence_coefficient


def test_the_smallest_correction_is_that_of_the_plant(
    calibrated: BalancerModel, plant: Plant, pulse: Pulse, scene: Scene
) -> None:
    for answer in line_answers(scene, calibrated):
        line = {"conductance": answer.conductance, "critical_ratio": answer.critical_ratio}
        dynamics = plant(calibrated, "gas filling", LIFT, "tube inertia", **line)
        opening = answer.shortest_opening
        assert opening is not None
        assert opening > answer.valve_lag
        end = np.array([3.0])
        # Before the tube is primed liquid at most spills over the crest.
        spilled, moved = (0.25 - pulse(dynamics, part * opening, end).fill for part in (0.99, 1.01))
        assert 0 <= spilled < moved
        assert answer.smallest_correction == pytest.approx(_change(calibrated, scene, moved), rel=0.05)


def test_the_mass_of_the_column_counts_in_a_short_injection(
    calibrated: BalancerModel, plant: Plant, pulse: Pulse, scene: Scene
) -> None:
    """A line that fills and vents at once: the column runs on, beyond one that follows the pressure."""
    gas = replace(scene.gas, conductance=4e-7, critical_ratio=0.3, valve_lag=1e-3)
    given = replace(scene, gas=gas)
    (answer,) = line_answers(given, calibrated)
    line = {"conductance": 4e-7, "critical_ratio": 0.3}
    heavy, light = (plant(calibrated, "gas filling", LIFT, *mass, **line) for mass in (["tube inertia"], []))
    moved, at_once = (
        0.25 - pulse(each, answer.shortest_opening, np.array([3.0])).fill for each in (heavy, light)
    )
    assert answer.smallest_correction == pytest.approx(_change(calibrated, scene, moved), rel=1e-3)
    assert moved > 1.1 * at_once


@pytest.mark.parametrize("fill", [0.15, 0.25, 0.35])
def test_the_dead_time_is_that_of_the_plant(
    calibrated: BalancerModel, plant_of: Plant, pulse: Pulse, scene: Scene, fill: float
) -> None:
    """An opening longer by the dead time moves what the steady velocity moves in the time alone."""
    gas = replace(scene.gas, conductance=0.6e-8, critical_ratio=0.3, valve_lag=4e-3, pressure=0.9e6)
    given = replace(scene, gas=gas)
    dynamics = plant_of(given, calibrated, "gas filling", "tube inertia", "valve lag", LIFT)
    injections = Injections.of(dynamics, calibrated, fill=fill, total=0.5)
    wanted = 0.02 * injections.steady
    dead = injections.dead_time(wanted)
    assert dead is not None
    opening = dead + 0.02
    moved = fill - pulse(dynamics, opening, np.array([3.0]), fill=fill).fill
    assert moved == pytest.approx(wanted, rel=1e-3)
    # Without it most of the injection only fills gas.
    assert fill - pulse(dynamics, 0.02, np.array([3.0]), fill=fill).fill < 0.5 * wanted


def test_a_tube_that_is_never_primed_needs_the_time_to_pass_the_crest(plant_of: Plant, scene: Scene) -> None:
    """A fast line has filled the chamber before a viscous liquid is over the crest."""
    gas = replace(scene.gas, conductance=1e-7, critical_ratio=0.3, valve_lag=1e-3)
    viscous = with_tables(scene, gas=gas, liquid={"kinematic_viscosity": 1e-4})
    law = BalancerModel.of(calibrate(viscous).flow_law)
    dynamics = plant_of(viscous, law, "gas filling", "tube inertia", LIFT)
    injections = Injections.of(dynamics, law, fill=0.25, total=0.5)
    (answer,) = line_answers(viscous, law)
    assert answer.shortest_opening is not None
    assert injections.moved(answer.filling_time) == 0.0
    assert answer.shortest_opening > 2 * answer.filling_time
    assert answer.smallest_correction is not None
    assert answer.smallest_correction > 0.0


def test_what_runs_back_has_no_dead_time(plant_of: Plant, scene: Scene) -> None:
    """Without a crest the full tube lets the fuller chamber give back what an injection has moved."""
    gas = replace(scene.gas, conductance=1e-7, critical_ratio=0.3, valve_lag=1e-3)
    full = with_tables(scene, gas=gas, tube={"hump_radius": None})
    law = BalancerModel.of(calibrate(full).flow_law)
    dynamics = plant_of(full, law, "gas filling", "tube inertia")
    assert Injections.of(dynamics, law, fill=0.25, total=0.5).dead_time(0.01) is None


def test_a_line_that_is_not_given_is_a_range(calibrated: BalancerModel, scene: Scene) -> None:
    slow, fast = line_answers(scene, calibrated)
    assert (slow.end, fast.end) == ("slow", "fast")
    # A fifth of the conductance lets everything take five times as long.
    assert slow.filling_time == pytest.approx(5 * fast.filling_time)
    # What moves while the chamber vents is in proportion, what moves while the front passes the crest is not.
    assert 2 < (slow.smallest_correction or 0.0) / (fast.smallest_correction or 1.0) < 5
    text = line_text((slow, fast))
    assert "not in the scene" in text
    for each in (slow, fast):
        opening, corrected = (each.shortest_opening or 0.0), each.smallest_correction or 0.0
        assert f"corrects {1e6 * corrected:.2g} um" in text or f"or {1e6 * corrected:.2g} um" in text
        assert f"({each.end}: {1e3 * opening:.2g} ms; " in text
    assert "opening that primes the tube at equal fills" in text


def test_a_fast_line_delivers_what_its_lag_lets_it(calibrated: BalancerModel, scene: Scene) -> None:
    """As C grows the chamber fills at once, and a valve open for its lag moves u S T less half of the arc.

    The mass of the column takes its start-up time, 2 L/((k + 1) u), of it, of which 0.2 s has little;
    the levels shift meanwhile.
    """
    gas = replace(scene.gas, conductance=1e-4, critical_ratio=0.3, valve_lag=2e-1)
    (given,) = line_answers(replace(scene, gas=gas), calibrated)
    assert given.end == "given"
    assert given.shortest_opening == 2e-1
    u = calibrated.flow.evaluate(fill_ratio=0.25, gas_pressure=0.7e6, primed=True).velocity
    start, stop = crest_span(scene.tube)
    way = float(u) * 2e-1 - (stop - start) / 2 * scene.tube.length
    moved = way * calibrated.tube_area / calibrated.chamber_volume
    moment = calibrated.moment.pair_moment(fill_ratio=0.25 - moved, opposite_fill_ratio=0.25 + moved)
    change = abs(float(moment)) * scene.rotor.influence_coefficient
    assert given.smallest_correction == pytest.approx(change, rel=2e-2)
    weak = with_tables(replace(scene, gas=gas), gas={"pressure": 0.05e6})
    (none,) = line_answers(weak, calibrated)
    assert none.smallest_correction is None
    assert "starts no flow" in line_text((none,))


def test_a_pressure_on_the_axis_counts_with_its_column(
    scene: Scene, plant_of: Plant, forces: Callable[[Dynamics], Any]
) -> None:
    """The spinning gas adds exp(omega^2 a^2/(2 R T)) - 1 up to the liquid, about 1 %, to the surroundings'
    pressure in the vented chamber too."""
    own = with_tables(scene, gas={"measured_at": "shaft"})
    a = float(surface_radius(disc=scene.disc, fill_ratio=0.25))
    factor = math.exp((10000 * math.pi / 30 * a) ** 2 / (2 * 287.05 * scene.gas.temperature))
    assert 1.005 < factor < 1.02
    # The vented chamber has such a column as well.
    ambient = factor * scene.gas.ambient_pressure
    here = calibrate(with_tables(scene, gas={"ambient_pressure": ambient}))
    there = calibrate(own)
    for name in ("priming_pressure_vented", "stall_pressure"):
        near, far = (float(getattr(result.answers, name)) for result in (here, there))
        assert near == pytest.approx(far * factor)
    asked = {"fill_ratio": 0.25, "primed": True}
    at_axis = there.flow_law.evaluate(gas_pressure=0.7e6, **asked).velocity
    assert float(at_axis) == pytest.approx(
        float(here.flow_law.evaluate(gas_pressure=0.7e6 * factor, **asked).velocity)
    )
    plants = [plant_of(own, result.model, "tube inertia") for result in (here, there)]
    near_u = forces(plants[0]).steady((0.25, 0.25), (0.7e6 * factor, 0.0), primed=True)[0]
    assert forces(plants[1]).steady((0.25, 0.25), (0.7e6, 0.0), primed=True)[0] == pytest.approx(near_u)


def injection(done: Passage, duration: float) -> Injection:
    """What a run would report of one opening of chamber A's valve, level chambers before it."""
    record = done.motion.record
    return Injection(
        time=0.0,
        chamber="A",
        duration=duration,
        fill_before=record.fill,
        fill_after=done.fill,
        regime_start=record.regime_start,
        regime_end=record.regime_end,
        event=record.event,
        energy=record.work,
        closing_pressure=record.closing_pressure,
        run_dry=record.run_dry,
    )


def test_a_chamber_run_dry_passes_gas(model: BalancerModel, scene: Scene, plant: Plant, pulse: Pulse) -> None:
    instants = np.linspace(1e-3, 4.0, 4000)
    passage = pulse(plant(model), 4.0, instants)
    done = injection(passage, 4.0)
    assert done.event is Event.EMPTY
    assert done.run_dry == pytest.approx(4.0 - instants[np.argmax(passage.fills == 0)], abs=2e-3)
    result = GasUse.of(scene=scene, model=model, injections=[done])
    # A choked nozzle of 1.5 mm at 0.801 MPa and 20 degC passes 3.34 g/s of air at the most, 1.2929 kg/m^3.
    grams = 0.0404 * math.pi / 4 * 1.5e-3**2 * 801325.0 / math.sqrt(293.15)
    assert result.passed_through == pytest.approx(grams * done.run_dry / 1.2929, rel=2e-3)
    assert result.below_residual == result.run_dry == 1
    warning = result.finding
    assert warning is not None
    assert (warning.code, warning.values["run_dry"]) == ("gas_passed_through", 1)
    brief = injection(pulse(plant(model), 0.1, np.array([0.1])), 0.1)
    assert GasUse.of(scene=scene, model=model, injections=[brief]).finding is None
    residual = result.residual_fill_ratio
    assert 0 < residual < 0.2
    low = replace(brief, fill_after=0.9 * residual)
    drawn = GasUse.of(scene=scene, model=model, injections=[low]).finding
    assert drawn is not None
    assert drawn.code == "gas_entered_port"
    # The supply adds its gauge pressure to the ambient gas that was there.
    content = 0.7e6 * model.chamber_volume / AMBIENT * 273.15 / scene.gas.temperature
    assert result.normal_volume == pytest.approx(content + result.passed_through)


def test_with_a_line_the_chamber_runs_dry_too(calibrated: BalancerModel, plant: Plant, pulse: Pulse) -> None:
    line = {"conductance": 1e-8, "critical_ratio": 0.3}
    dynamics = plant(calibrated, "gas filling", "tube inertia", **line)
    instants = np.linspace(5e-4, 2.0, 4000)
    passage = pulse(dynamics, 2.0, instants)
    emptied = instants[np.argmax(passage.fills < 1e-12)]
    assert passage.motion.record.run_dry == pytest.approx(2.0 - emptied, abs=2e-3)
    brief = pulse(dynamics, 0.01, np.array([0.01])).motion.record
    # Choked, so the pressure rises by C p_0 p_1/V until the valve shuts.
    volume = 0.75 * calibrated.chamber_volume
    assert brief.closing_pressure == pytest.approx(1e-8 * 1e5 * 801325.0 / volume * 0.01, rel=0.02)
    assert brief.run_dry == 0


def test_a_run_reports_its_gas(model: BalancerModel, scene: Scene) -> None:
    run = simulate(scene, model=model)
    document = simulation_document(run)
    gas, fills = document["gas"], [injection.fill_after for injection in run.injections]
    content = 0.7e6 * math.fsum((1 - x) * model.chamber_volume for x in fills)
    assert gas["compression_energy_J"] == pytest.approx(content * math.log(801325.0 / AMBIENT))
    assert gas["fillings"] == len(run.injections)
    assert document["gas_line"]["given"] is False
    assert document["energy_J"] == run.energy


def test_what_a_cavity_decides_is_not_said_to_last(scene: Scene) -> None:
    """At equal fills the column is sure to stand down to 5446 rpm, and under half of the gas to 3851 rpm."""
    hangs = "hangs on the pressure of a cavity"
    for rpm, holds in ((5600, True), (5300, None), (4000, None), (3700, False)):
        slower = with_tables(scene, rotor={"speed": rpm * math.pi / 30})
        answers = line_answers(slower, BalancerModel.of(calibrate(slower).flow_law))
        assert {each.holds for each in answers} == {holds}
        assert (hangs in line_text(answers)) is (holds is None)
