"""What `tune` names as the cause where runs do not settle, and that following its advice settles them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from scipy.optimize import brentq

from ringbalance.controller.algorithms.by_name import target_vector_of
from ringbalance.controller.ensemble import Probability
from ringbalance.controller.liquid_ring.loop_factor import loop_factor, usable_fill, with_driving_gas
from ringbalance.controller.tuning.recommendation import factor_uncertainty
from ringbalance.controller.tuning.result import Tuning
from ringbalance.controller.tuning.search import Candidate, Search, search, with_ways_out
from ringbalance.controller.tuning.settling import SettlingTimes
from ringbalance.controller.tuning.tune import _status_of, tune
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene.loop_models import ControllerSettings
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty

MEMBERS = 200


def with_amplitude(scene: Scene, amplitude: float, phase: float = math.radians(73)) -> Scene:
    """Along chamber B at 73 degrees, where one pair has to form all of the moment."""
    return replace(scene, rotor=replace(scene.rotor, initial_amplitude=amplitude, initial_phase=phase))


def tuned(scene: Scene) -> Tuning:
    return tune(scene, paper_model(scene), members=MEMBERS)


def largest_amplitude(scene: Scene) -> float:
    """By hand: 1218.6 g mm of one pair, less the residual fill, times 0.0108 um/(g mm)."""
    residual = residual_fill_ratio(scene, law=paper_model(scene).flow)
    return 1218.6 * (1 - residual / 0.25) * 0.0108e-6


@pytest.mark.parametrize(("count", "runs"), [(200, 200), (199, 200), (1999, 2000), (19, 20)])
def test_a_fraction_of_the_runs_is_printed_no_finer_than_their_number(count: int, runs: int) -> None:
    times = SettlingTimes(
        runs=runs,
        settled=Probability.counted(count=count, of=runs),
        quantiles={"p50": 1.0, "p95": None},
    )
    assert times.told(count / runs) == f"{count} of {runs} runs"
    half, slow, fraction, number = times.quantities()
    assert (half.value, half.status) == (1.0, "ok")
    assert (slow.value, slow.status) == (None, "not_reached")
    assert (fraction.value, number.value) == (count / runs, runs)
    assert fraction.lower is not None
    assert fraction.upper is not None
    assert fraction.lower < count / runs <= fraction.upper


def test_runs_that_need_more_moment_than_the_disc_has_are_counted_and_named(scene: Scene) -> None:
    stated = tuple(
        InputUncertainty(quantity=name, half_width=width, relative=True)
        for name, width in (("influence_coefficient", 0.1), ("draw_down_factor", 0.0))
    )
    near = replace(with_amplitude(scene, 0.98 * largest_amplitude(scene)), uncertainty=stated)
    answer = tuned(near)
    assert answer.settling is not None
    # A twentieth of the coefficient is one standard deviation; two in a hundred are missing.
    expected = 0.5 * math.erfc(0.02 / (math.log(1.1) / 1.96) / math.sqrt(2))
    assert answer.settling.beyond_capacity == pytest.approx(expected, abs=0.08)
    assert answer.settling.settled.value == pytest.approx(1 - answer.settling.beyond_capacity, abs=0.06)
    assert "need more moment than the disc can form" in answer.status
    assert tuned(replace(near, rotor=replace(near.rotor, initial_amplitude=5e-6))).succeeded


def test_runs_draw_the_depth_at_which_gas_enters_the_port(scene: Scene) -> None:
    known = InputUncertainty(quantity="influence_coefficient", half_width=0.0, relative=True)
    law, whole = paper_model(scene).flow, largest_amplitude(scene)
    near = replace(with_amplitude(scene, 0.98 * whole), uncertainty=(known,))

    def left(factor: float) -> float:
        """Of the usable fill, with that factor on the depth."""
        deeper = replace(scene, tube=replace(scene.tube, draw_down_factor=factor))
        return 1 - residual_fill_ratio(deeper, law=law) / 0.25

    largest = brentq(lambda factor: left(factor) - 0.98 * left(1.0), 1.0, 3.0)
    expected = 0.5 * math.erfc(math.log(largest) / (math.log(1.3) / 1.96) / math.sqrt(2))
    answer = tuned(near)
    assert answer.settling is not None
    # Of 200 runs a share is known to 0.05; the speed of the flow widens it by less.
    assert answer.settling.settled.value == pytest.approx(1 - expected, abs=0.08)
    assert expected > 0.12


def test_gas_that_stalls_a_chamber_is_raised(scene: Scene) -> None:
    """Eq. 19 stalls where p0 = rho omega^2 V (0.5 - 2 x)/(B theta): 0.381 MPa for an empty chamber."""
    weak = replace(with_amplitude(scene, 8e-6), gas=replace(scene.gas, pressure=0.15e6))
    model = paper_model(weak)
    stall = 0.25 * (1 - 0.15 / 0.38115)
    assert usable_fill(weak, model) == pytest.approx(stall, abs=2e-6)
    raised = with_driving_gas(weak, model)
    assert usable_fill(raised, model) == residual_fill_ratio(raised, law=model.flow)
    assert with_driving_gas(raised, model) == raised
    answer = tuned(weak)
    assert answer.succeeded, answer.status
    assert "gas.pressure" in answer.change


@pytest.mark.parametrize(
    ("cause", "words"),
    [
        ({"beyond_capacity": 0.3}, "need more moment than the disc can form"),
        ({"beyond_pressure": 0.3}, "raise gas.pressure"),
        ({"drifted": 0.3}, "lower tube.hump_radius"),
        ({"drifted": 0.2}, "raise controller.limit to 1 um, or take a valve and line 3 times as fast"),
    ],
)
def test_what_keeps_most_of_the_runs_from_settling_is_named(
    scene: Scene, cause: dict[str, Any], words: str
) -> None:
    half = Probability.counted(count=10, of=20)
    settling = SettlingTimes(runs=20, settled=half, quantiles={"p50": None, "p95": None}, **cause)
    best = Candidate(scene=scene, change="", dead=())
    found = Search(best=best, settles=False, needs=None, limit=1e-6, valve=3.0, tried=())
    assert words in _status(scene, settling, found)


def _status(scene: Scene, settling: SettlingTimes, found: Search) -> str:
    loop = loop_factor(scene, paper_model(scene), target_vector_of(scene))
    return _status_of(scene, loop, zone=0.0, smallest=0.0, settling=settling, best=found.best, found=found)


@pytest.mark.parametrize(
    ("settles", "change"),
    [
        (lambda settings: settings.integral_time is not None, 'controller.integral_time = "2.5 s"'),
        (lambda settings: settings.proportional > 1e5, 'controller.proportional = "0.128 s/um"'),
        (
            lambda settings: settings.integral_time is not None and settings.proportional > 1e5,
            'controller.integral_time = "2.5 s", controller.proportional = "0.128 s/um"',
        ),
    ],
)
def test_what_settles_a_few_runs_is_recommended(
    scene: Scene,
    monkeypatch: pytest.MonkeyPatch,
    settles: Callable[[ControllerSettings], bool],
    change: str,
) -> None:
    """Half of the runs settle with a higher gain, which is why the integral part is tried with it too."""

    def tried(asked: Scene, *_: object, **__: object) -> SettlingTimes:
        settings = asked.controller
        half = 0.0 if settings.proportional <= 1e5 else 0.5
        share = Probability.counted(count=8 if settles(settings) else int(8 * half), of=8)
        return SettlingTimes(runs=8, settled=share, quantiles={"p50": 1.0, "p95": 1.0})

    monkeypatch.setattr("ringbalance.controller.tuning.search.tried", tried)
    settings = replace(scene.controller, proportional=0.08e6, integral_time=None)
    base = Candidate(scene=replace(scene, controller=settings), change="", dead=())
    model = paper_model(scene)
    known = factor_uncertainty(scene, model)
    found = search(scene, model, known, base=base, settled=0.1, told=lambda _: None)
    assert found.settles
    assert found.best.change == change


def test_ways_out_are_named_only_where_many_runs_settle(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twice the limit would do, or a line three times as fast, or a valve-open time of a fifth."""

    def many(asked: Scene, *_: object, **__: object) -> SettlingTimes:
        settings, gas = asked.controller, asked.gas
        done = settings.limit > 0.09e-6 or (gas.conductance or 0.0) > 2.5e-8
        done = done or settings.minimum_gas_time < 0.03
        quantiles = {"p50": 1.0, "p95": 2.0 if done else None}
        share = Probability.counted(count=200 if done else 150, of=200)
        return SettlingTimes(runs=200, settled=share, quantiles=quantiles)

    monkeypatch.setattr("ringbalance.controller.tuning.search.many_runs", many)
    gas = replace(scene.gas, conductance=1e-8, critical_ratio=0.3, valve_lag=6e-3)
    slow = replace(scene, gas=gas, controller=replace(scene.controller, minimum_gas_time=0.1))
    model, best = paper_model(slow), Candidate(scene=slow, change="", dead=())
    found = with_ways_out(
        Search(best=best, settles=False, needs=None, tried=()),
        slow,
        model,
        factor_uncertainty(slow, model),
        members=200,
        runs=20,
        told=lambda _: None,
    )
    assert (found.limit, found.valve) == (pytest.approx(2 * slow.controller.limit), 3.0)
    assert found.opening == pytest.approx(0.02)
    assert [row.settled for row in found.tried].count(1.0) == 3
    status = _status(slow, many(slow), found)
    ways = "lower controller.minimum_gas_time to 20 ms, or raise controller.limit to 0.1 um, or take a valve"
    assert f"{ways} and line 3 times as fast" in status
    nothing = replace(found, limit=None, valve=None, opening=None)
    assert "raise" not in _status(slow, many(slow), nothing)
