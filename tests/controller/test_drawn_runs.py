"""Drawn devices of a liquid ring: the same by number everywhere, and what becomes of their runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.balancer import ARRAYS, Draws, Outcomes, balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.liquid_ring.devices import Spread, devices
from ringbalance.controller.liquid_ring.drawn_runs import DrawnRuns
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.injection.dynamics import MOTION, WORKSPACE
from ringbalance.reduced_model.injection.events import command
from ringbalance.reduced_model.injection.march import SPARE, advance, least_later, opening_within
from ringbalance.reduced_model.injection.pair import at_rest
from ringbalance.reduced_model.law.flow_law import BalancerModel, Flow
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.arrays import FloatArray, Records
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import half_widths, nominal_value
from scenes import with_tables

GAINS = [{"controller.proportional": gain} for gain in (0.02e6, 0.08e6)]


@pytest.fixture(scope="module")
def balancer(paper_scene: Scene) -> LiquidRingBalancer:
    made = balancer_of(paper_scene)
    assert isinstance(made, LiquidRingBalancer)
    return made


@pytest.fixture(scope="module")
def first(balancer: LiquidRingBalancer) -> Outcomes:
    return balancer.run({}, Draws.first(8))


def test_a_traced_run_comes_to_the_same(balancer: LiquidRingBalancer, first: Outcomes) -> None:
    traced = balancer.run({}, Draws.first(8), trace=True)
    assert traced.ended == first.ended
    both = np.isfinite(first.settling_time)
    assert traced.settling_time[both] == pytest.approx(first.settling_time[both], rel=1e-5)
    # Steps of untraced runs may err by 1e-6 of a fill, some 1e-11 m here. A sample nearer to the limit may be
    # answered in one of the runs alone, and a run that never settles makes errors grow.
    seen = [np.array([each.measurement.amplitude for each in one.run.samples]) for one in traced.traced]
    alike = both & [bool(np.all(np.abs(each - balancer.limit) > 1e-11)) for each in seen]
    assert np.count_nonzero(alike) >= 6
    final = traced.final_amplitude, first.final_amplitude
    assert final[0][alike] == pytest.approx(final[1][alike], rel=1e-5, abs=5e-11)
    assert traced.energy[alike] == pytest.approx(first.energy[alike], rel=1e-5)
    assert traced.usable_moment == pytest.approx(first.usable_moment, rel=1e-9)
    assert traced.unbalance == pytest.approx(first.unbalance, rel=1e-9)


def test_a_device_is_the_same_alone_and_under_any_setting(
    balancer: LiquidRingBalancer, first: Outcomes
) -> None:
    alone = balancer.run({}, Draws(numbers=(5,)))
    _, own = balancer.run_all(GAINS, Draws.first(8))
    assert alone.settling_time[0] == first.settling_time[5]
    assert own.settling_time.tolist() == first.settling_time.tolist()
    assert {name: float(places[5]) for name, places in first.inputs.items()} == {
        name: float(places[0]) for name, places in alone.inputs.items()
    }


def test_devices_have_the_stated_spread(paper_scene: Scene) -> None:
    model = paper_model(paper_scene)
    made = devices(paper_scene, model, Spread.of(paper_scene, model), range(64), seed=0)
    drawn = [each.scene for each in made]
    for name in ("bore", "density", "influence_coefficient", "pressure"):
        values = [nominal_value(scene=scene, quantity=name) or math.nan for scene in drawn]
        sigma = half_widths(paper_scene)[name] / 1.96
        mean = nominal_value(scene=paper_scene, quantity=name)
        assert np.mean(values) == pytest.approx(mean, abs=sigma / 20)
        # Of a Latin hypercube the variance is exact but for the outermost 64ths.
        assert np.std(values) == pytest.approx(sigma, rel=0.1)
    phases = np.sort([scene.rotor.initial_phase for scene in drawn])
    assert np.max(np.diff(phases)) < 2 * 2 * math.pi / 64
    assert np.ptp(phases) > 2 * math.pi * 62 / 64


def test_a_scene_may_restrict_the_direction(paper_scene: Scene) -> None:
    narrow = with_tables(paper_scene, requirement={"phase_range": 0.1})
    model = paper_model(narrow)
    made = devices(narrow, model, Spread.of(narrow, model), range(64), seed=0)
    phases = [each.scene.rotor.initial_phase for each in made]
    assert np.max(np.abs(np.array(phases) - paper_scene.rotor.initial_phase)) <= 0.1


def test_a_clipped_input_is_counted(paper_scene: Scene) -> None:
    wide = paper_scene.with_values({"uncertainty.bore": "90 %"})
    ran = balancer_of(wide, flow_law="paper").run({}, Draws.first(64))
    # A tenth of the bore is the least: 1 - 0.9 z/1.96 < 0.1 for z > 1.96, one device in 40.
    assert ran.clipped["bore"] == 2


def test_what_the_disc_cannot_reach_does_not_settle(first: Outcomes) -> None:
    short = np.array([code == "capacity_exceeded" for code in first.ended])
    assert short.any()
    assert not first.settled[short].any()
    # What the limit leaves is 5 g mm at 0.0108 um/(g mm).
    left = first.unbalance - first.usable_moment
    assert np.all(left[short] > 4e-6)
    assert np.all(left[first.settled] < 6e-6)


def test_the_papers_pressure_is_too_high_for_its_disc(balancer: LiquidRingBalancer) -> None:
    own = judged_all(balancer, [{}])[0]
    assert own.verdict == "not met"
    assert own.fraction.high >= 0.80
    assert own.fraction.low <= 0.88
    assert own.settling_time(0.5) is not None
    assert own.settling_time(0.9) is None
    # More than half settle, so the median's bound lies above it.
    value, bound = own.settling_time(0.5) or (math.nan, math.nan)
    assert value < bound


def test_static_intervals_are_those_of_the_draws(paper_scene: Scene, calibrated: BalancerModel) -> None:
    drawn = devices(paper_scene, calibrated, Spread.of(paper_scene, calibrated), range(128), seed=0)

    def flow(scene: Scene, model: BalancerModel) -> Flow:
        return model.flow.evaluate(
            fill_ratio=scene.disc.initial_fill, gas_pressure=scene.gas.pressure, primed=True
        )

    here = flow(paper_scene, calibrated)
    velocities = [float(flow(each.scene, each.model).velocity) for each in drawn]
    # To a fifth: by linear propagation the cavity's pressure, any between two bounds, counts as one of them.
    assert 1.96 * np.std(velocities) == pytest.approx(float(here.uncertainty), rel=0.2)
    fills = [residual_fill_ratio(each.scene, law=each.model.flow) for each in drawn]
    static = calibrate(paper_scene).quantities["least_fill_ratio"].parts
    assert static is not None
    assert 1.96 * np.std(fills) == pytest.approx(static.total, rel=0.2)


def test_runs_of_many_settings_and_devices_are_those_of_each_alone(balancer: LiquidRingBalancer) -> None:
    pressures: list[dict[str, Any]] = [{}, {"gas.pressure": 0.6e6}]
    settings = [
        {**gain, **kind, **pressure}
        for pressure in pressures
        for kind in ({}, {"controller.kind": "law_based"})
        for gain in GAINS
    ]
    numbers = (1, 2, 5, 17)
    together = balancer.run_all(settings, Draws(numbers=numbers, complete=False))
    assert balancer.run_all([], Draws(numbers=numbers, complete=False)) == ()
    for each, outcomes in zip(settings, together, strict=True):
        for place, number in enumerate(numbers):
            (alone,) = balancer.run_all([each], Draws(numbers=(number,), complete=False))
            assert alone.ended == outcomes.ended[place : place + 1]
            for name in ARRAYS:
                assert getattr(alone, name)[0].tobytes() == getattr(outcomes, name)[place].tobytes()


def test_a_shortened_opening_is_the_longest_that_keeps_the_residual_fill(
    balancer: LiquidRingBalancer, paper_scene: Scene
) -> None:
    """Of several devices: a millionth of it later the driven chamber falls below."""
    chosen = DrawnRuns(
        scene=paper_scene,
        model=balancer.model,
        spread=Spread.of(paper_scene, balancer.model),
        limit=balancer.limit,
    )
    under = chosen._under(range(4), True, paper_scene.gas.pressure)
    for plant, residual in zip(under.group.plants, under.residual, strict=True):
        motions, w = np.zeros(1 + SPARE, dtype=MOTION), np.zeros(WORKSPACE)
        motions[0] = at_rest(plant[None], fill=paper_scene.disc.initial_fill)[0]
        motions[0]["residual"] = residual

        def lowest(
            time: float, plant: np.void = plant, motions: Records = motions, w: FloatArray = w
        ) -> float:
            motions[1] = motions[0]
            command(plant, motions[1], 0, time)
            advance(plant, motions[1], plant["valve_lag"] + time, w, 0, 0, w)
            return least_later(plant, motions, 1, w)

        longest = opening_within(plant, motions, 0, 1, 0, 5.0, lowest(5.0), w)
        assert 0.0 < longest < 5.0
        assert lowest(longest) >= residual > lowest(1.000001 * longest)
        half = longest / 2
        assert opening_within(plant, motions, 0, 1, 0, half, lowest(half), w) == half


def test_chambers_that_are_empty_are_found_by_what_the_vibration_does() -> None:
    """28 of 64 settle where an empty chamber is asked again and again, 52 where a sensor tells of it."""
    scene = load_scene(bundled_scene("six_chamber")).with_values(
        {"controller.proportional": "0.117 s/um", "rotor.initial_vibration.amplitude": "16 um"}
    )
    (result,) = balancer_of(scene).run_all([{"controller.gas_time_offset": (2.8e-3,)}], Draws.first(64))
    assert np.count_nonzero(result.settled) >= 52
