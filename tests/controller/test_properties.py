"""Whatever the scene: liquid is conserved, fills stay in range, nothing is NaN, and every run ends."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from transfers import Drive, adaptive_ode, closed_form, marched

from ringbalance import bundled_scene, load_scene
from ringbalance.controller.balancer import WATCH_TIME_S
from ringbalance.controller.document import simulation_document
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from scenes import with_tables

MARCH = marched(liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper"))).tube)

DriveBy = Callable[..., Drive]
NAMES = ("tube inertia", "gas filling", "valve lag")
ASKED = [names for count in (1, 2, 3) for names in combinations(NAMES, count)]


@st.composite
def scenes(draw: st.DrawFn, base: Scene) -> Scene:
    """Random changes of everything that the loop reads."""
    number = st.floats
    maximum = draw(number(0.1, 0.9))
    return with_tables(
        base,
        disc={
            "chambers": draw(st.sampled_from([2, 4, 6, 8])),
            "max_fill_ratio": maximum,
            "initial_fill": maximum * draw(number(0.05, 0.95)),
        },
        tube={"bore": draw(number(0.3e-3, 6e-3)), "drag_coefficient": draw(number(0.0, 500.0))},
        gas={"pressure": draw(number(0.0, 3e6))},
        rotor={
            "speed": draw(number(50.0, 2000.0)),
            "influence_coefficient": draw(number(1e-4, 1.0)),
            "lag_angle": draw(number(-4.0, 4.0)),
            "initial_amplitude": draw(number(0.0, 1e-4)),
            "initial_phase": draw(number(-7.0, 7.0)),
        },
        sensor={
            "amplitude_noise": draw(st.sampled_from([0.0, 1e-8, 1e-6])),
            "phase_noise": draw(number(0.0, 0.5)),
        },
        controller={
            "kind": draw(st.sampled_from(["target_vector", "trial", "law_based"])),
            "period": draw(number(0.01, 2.0)),
            "proportional": draw(number(1e2, 1e7)),
            "integral_time": draw(st.none() | number(0.1, 1e3)),
            "derivative_time": draw(number(0.0, 1.0)),
            "minimum_gas_time": draw(number(0.0, 0.01)),
            "maximum_gas_time": draw(number(0.02, 10.0)),
            "sequence": ("A", "B"),
        },
        run={"time_limit": draw(number(0.1, 5.0)), "seed": draw(st.integers(0, 99))},
    )


@st.composite
def terms(draw: st.DrawFn, base: Scene) -> tuple[Scene, tuple[str, ...]]:
    """A scene with any of the plant's terms, far beyond what anyone would build."""
    gas = replace(
        base.gas,
        conductance=10.0 ** draw(st.floats(-11.0, -6.5)),
        critical_ratio=draw(st.floats(0.01, 0.99)),
        dead_volume=draw(st.sampled_from([0.0, 1e-6, 1e-3])),
        valve_lag=draw(st.floats(0.0, base.controller.period)),
        temperature=draw(st.floats(250.0, 400.0)),
    )
    asked = draw(st.sampled_from(ASKED))
    tube = replace(base.tube, length=base.tube.length * draw(st.floats(0.5, 20.0)))
    return replace(base, gas=gas, tube=tube), asked


def check(scene: Scene, model: BalancerModel, modelled: tuple[str, ...] | None = None) -> None:
    run = simulate(scene, model, modelled=modelled)
    fills = np.array(list(run.fill_ratio.values()))
    half = scene.disc.chambers // 2
    assert fills[:half] + fills[half:] == pytest.approx(2 * scene.disc.initial_fill, abs=1e-12)
    assert np.all((fills >= 0) & (fills <= scene.disc.max_fill_ratio))
    assert np.all(np.isfinite(run.amplitude) & np.isfinite(run.phase))
    assert np.all(np.diff(run.time) > 0)
    # A run within its limit in time is watched until it has settled.
    watched = scene.controller.hold_time + WATCH_TIME_S + 2 * scene.controller.period
    assert run.time[-1] <= (scene.run.time_limit + watched) * (1 + 1e-12)
    assert run.status
    assert run.settled == (run.settling_time is not None)
    assert math.isfinite(run.energy)
    json.dumps(simulation_document(run), allow_nan=False)


@given(data=st.data())
@settings(max_examples=40)
def test_any_run_under_the_papers_law(data: st.DataObject, scene: Scene) -> None:
    drawn = data.draw(scenes(scene))
    check(drawn, paper_model(drawn))


@given(data=st.data())
@settings(max_examples=8)
def test_any_run_with_any_terms_under_the_papers_law(data: st.DataObject, scene: Scene) -> None:
    drawn, asked = data.draw(terms(data.draw(scenes(scene))))
    law = paper_model(drawn)
    check(drawn, law, asked)


@given(data=st.data())
@settings(max_examples=8)
def test_any_run_with_any_terms_under_the_calibrated_law(
    data: st.DataObject, scene: Scene, calibrated: BalancerModel
) -> None:
    drawn = data.draw(scenes(scene))
    # The law is that of one disc at one speed and pressure; all else may be anything.
    own = with_tables(drawn, disc=scene.disc, rotor={"speed": scene.rotor.speed})
    own = replace(own, gas=scene.gas, tube=scene.tube)
    changed, asked = data.draw(terms(own))
    check(changed, calibrated, asked)


@given(
    data=st.data(),
    name=st.sampled_from(["constant", "two_regimes", "levelling", "square_root", "proportional"]),
)
@settings(max_examples=25)
def test_any_run_under_other_laws(
    data: st.DataObject, name: str, scene: Scene, model: BalancerModel, laws: Mapping[str, Any]
) -> None:
    drawn = data.draw(scenes(scene))
    law = replace(laws[name], max_fill_ratio=drawn.disc.max_fill_ratio)
    check(drawn, replace(model, name=name, flow=law))


@given(
    fill=st.floats(0.0, 0.5),
    pressure=st.just(0.0) | st.floats(1.0, 2e6),
    duration=st.floats(1e-6, 30.0),
)
@settings(max_examples=60)
def test_the_march_and_closed_form_agree(drive: Drive, fill: float, pressure: float, duration: float) -> None:
    asked = replace(drive, fill=fill, gas_pressure=pressure)
    t = np.linspace(0.0, duration, 4)
    exact, result = closed_form(asked, t), MARCH(asked, t)
    assert result.fill == pytest.approx(exact.fill, abs=1e-9)
    # The last 1e-9 of fill before a stall take long.
    at_rest = abs(exact.fill[-1] - exact.fill[0]) <= 1e-9
    assert result.event is exact.event or at_rest or exact.event_time == pytest.approx(duration, rel=1e-3)


@given(
    name=st.sampled_from(["constant", "two_regimes", "levelling", "proportional"]),
    fill=st.floats(0.0, 0.5),
    pressure=st.just(0.0) | st.floats(1.0, 1e5),
    primed=st.booleans(),
    duration=st.floats(1e-3, 10.0),
)
@settings(max_examples=40)
def test_the_march_and_adaptive_ode_agree(
    drive_by: DriveBy, name: str, fill: float, pressure: float, primed: bool, duration: float
) -> None:
    asked = drive_by(name, fill=fill, gas_pressure=pressure, primed=primed)
    t = np.linspace(0.0, duration, 4)
    assert MARCH(asked, t).fill == pytest.approx(adaptive_ode()(asked, t).fill, abs=2e-4)


@given(fill=st.floats(0.0, 0.5), split=st.floats(0.01, 0.99))
def test_two_stretches_are_one(drive: Drive, fill: float, split: float) -> None:
    for integrator in (closed_form, MARCH):
        whole = integrator(replace(drive, fill=fill), np.array([1.0])).fill[-1]
        first = integrator(replace(drive, fill=fill), np.array([split])).fill[-1]
        second = integrator(replace(drive, fill=float(first), primed=True), np.array([1.0 - split])).fill[-1]
        assert second == pytest.approx(whole, abs=1e-10)
        assert not math.isnan(second)
