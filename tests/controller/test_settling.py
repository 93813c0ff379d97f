"""Settling: the loop factor, what noise leaves, and an answer that does not depend on the time limit."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pairs import Motion, PairState, opened, pass_time

from ringbalance.controller.algorithms.law_based import controller_of
from ringbalance.controller.document import simulation_document
from ringbalance.controller.liquid_ring.loop_factor import (
    LoopFactor,
    _balanced_fills,
    _stationary_deviation,
    loop_factor,
    vibration_rates,
)
from ringbalance.controller.loop import simulate
from ringbalance.controller.rotor import disc_unbalance
from ringbalance.controller.simulation import Outcome, RunVerdict, Simulation
from ringbalance.controller.terms import dynamics_of
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from scenes import with_tables

STEPS = 200_000


def noisy(
    scene: Scene, *, noise: float = 1e-8, seed: int = 0, time_limit: float = 60.0, **settings: Any
) -> Scene:
    return with_tables(
        scene,
        sensor={"amplitude_noise": noise, "phase_noise": 0.005},
        controller=settings,
        run={"seed": seed, "time_limit": time_limit},
    )


def factor(scene: Scene, model: BalancerModel) -> LoopFactor:
    return loop_factor(scene, model, controller_of(scene, model))


# --- the loop factor ---


def test_the_rate_is_what_a_short_injection_does(scene: Scene, model: BalancerModel) -> None:
    fills = _balanced_fills(scene, model)
    dynamics = dynamics_of(scene=scene, model=model, modelled=())
    rates, short = vibration_rates(scene, model), 1e-5

    def seen(first: FloatArray) -> complex:
        moment = disc_unbalance(moment=model.moment, fill_ratio=(*first, *(0.5 - first)))
        return complex(scene.rotor.vibration(moment))

    assert abs(seen(fills)) < 1e-12
    for chamber in range(4):
        pair, side, after = chamber % 2, chamber // 2, fills.copy()
        motion = Motion(pending=opened(dynamics, chamber=side, duration=short))
        begun = PairState(fill=float(fills[pair]), total=0.5, motion=motion)
        after[pair] = pass_time(dynamics, begun, instants=np.array([short])).fill
        assert abs(seen(after) - seen(fills)) / short == pytest.approx(rates[pair, side], rel=1e-4)


def test_the_balanced_fills_of_many_chambers_keep_the_residual_fill(scene: Scene) -> None:
    eight = with_tables(scene, disc={"chambers": 8, "central_angle": math.pi / 4})
    model = paper_model(eight)
    fills = _balanced_fills(eight, model)
    assert np.min(fills) == pytest.approx(residual_fill_ratio(eight, law=model.flow))
    moment = disc_unbalance(moment=model.moment, fill_ratio=(*fills, *(0.5 - fills)))
    assert abs(complex(scene.rotor.vibration(moment))) < 1e-9


def test_the_rate_at_level_chambers_is_kappa_lambda_rho_s_u(scene: Scene, model: BalancerModel) -> None:
    level = with_tables(scene, rotor={"initial_amplitude": 0.0})
    # Eq. 19 at equal fills: u = sqrt(2 p/((k + 1) rho)) = 5.2394 m/s; lambda = 72 mm a transferred mass.
    area = math.pi * 1.5e-3**2 / 4
    expected = 0.0108 * 0.072 * 1000 * area * math.sqrt(2 * 0.7e6 / 51 / 1000)
    assert vibration_rates(level, model) == pytest.approx(np.full((2, 2), expected), rel=2e-2)
    result = factor(level, model)
    assert result.value == pytest.approx(scene.controller.proportional * result.rate)
    assert result.limit == pytest.approx(2.0)


@pytest.mark.parametrize("error", [0.0, 0.6])
@pytest.mark.parametrize("h", [0.1, 0.58, 1.0, 1.5])
def test_with_p_alone_noise_leaves_the_known_deviation(h: float, error: float) -> None:
    known = math.sqrt(h / (2 * math.cos(error) - h))
    assert _stationary_deviation(loop_factor=h, noise=1.0, lag_error=error) == pytest.approx(known, rel=1e-9)


@pytest.mark.parametrize(
    ("h", "integral", "derivative"), [(0.3, 0.0, 0.0), (0.3, 0.05, 0.12), (0.8, 0.01, 0.12), (0.6, 0.2, 0.0)]
)
def test_noise_leaves_what_a_simulated_linear_loop_shows(
    h: float, integral: float, derivative: float
) -> None:
    noise = np.random.default_rng(3).standard_normal(STEPS)
    x = before = summed = 0.0
    squares = 0.0
    for k in range(STEPS):
        seen = x + noise[k]
        summed += integral * (seen + before) / 2
        x, before = x - h * (seen + summed + derivative * (seen - before)), seen
        squares += x * x
    result = _stationary_deviation(loop_factor=h, noise=1.0, integral=integral, derivative=derivative)
    # Some 1e5 independent squares: 1 % is four standard deviations.
    assert result == pytest.approx(math.sqrt(squares / STEPS), rel=0.015)


@pytest.mark.parametrize("h", [1.3, 1.7, 1.9])
def test_a_loop_that_turns_round_takes_its_derivative_of_amplitudes(h: float) -> None:
    # Far above its noise the residual alternates: its size a follows a' = h (a + n + q (a - a_before)) - a.
    q, noise = 0.12, np.random.default_rng(4).standard_normal(STEPS)
    y = before = squares = 0.0
    for k in range(STEPS):
        seen = y + noise[k]
        y, before = h * (seen + q * (seen - before)) - y, seen
        squares += y * y
    result = _stationary_deviation(loop_factor=h, noise=1.0, integral=0.3, derivative=q)
    assert result == pytest.approx(math.sqrt(squares / STEPS), rel=0.03)


def test_a_loop_beyond_its_limit_has_no_stationary_deviation() -> None:
    assert _stationary_deviation(loop_factor=2.0, noise=0.0) == math.inf
    assert _stationary_deviation(loop_factor=1.2, noise=1.0, lag_error=1.0) == math.inf
    assert _stationary_deviation(loop_factor=1.9, noise=0.0) == 0.0


# --- the verdict ---


def test_the_verdict_follows_the_loop_factor(scene: Scene, model: BalancerModel) -> None:
    rate = factor(scene, model).rate
    verdicts = {}
    for h in (0.6, 2.6):
        run = simulate(noisy(scene, noise=1.2e-8, proportional=h / rate), model)
        verdicts[h] = run.verdict
        assert run.status.startswith(run.verdict.value)
        assert run.settled == (run.verdict is RunVerdict.SETTLED) == (run.settling_time is not None)
    assert verdicts == {0.6: RunVerdict.SETTLED, 2.6: RunVerdict.UNSTABLE}


def test_a_settled_loop_stays_within_the_limit(scene: Scene, model: BalancerModel) -> None:
    above = count = 0
    rate = factor(scene, model).rate
    for seed, h in enumerate((0.4, 0.8, 1.2, 1.35)):
        asked = noisy(scene, seed=seed, time_limit=200.0, proportional=h / rate)
        run = simulate(asked, model, to_time_limit=True)
        assert run.settling_time is not None
        assert run.settling_time == simulate(asked, model).settling_time
        assert run.time[-1] == pytest.approx(200.0)
        late = run.amplitude[run.time > run.settling_time]
        above, count = above + int(np.sum(late > run.limit)), count + late.size
    assert count > 1000
    assert above <= 0.003 * count


# --- the time limit ---


def random_scene(scene: Scene, number: int) -> Scene:
    random = np.random.default_rng([14, number])
    rotor = replace(
        scene.rotor,
        initial_amplitude=float(random.uniform(1e-6, 11e-6)),
        initial_phase=float(random.uniform(0.0, 2 * math.pi)),
        influence_coefficient=float(scene.rotor.influence_coefficient * random.uniform(0.8, 1.5)),
    )
    return noisy(
        replace(scene, rotor=rotor),
        noise=float(random.choice([0.0, 3e-9, 1e-8, 1.6e-8])),
        seed=number,
        time_limit=float(random.uniform(5.0, 30.0)),
        proportional=float(scene.controller.proportional * random.uniform(0.3, 2.6)),
        assumed_lag_angle=float(scene.rotor.lag_angle + random.normal(0.0, 0.3)),
        hold_time=float(random.choice([0.7, 2.5, 5.0])),
        kind=str(random.choice(["target_vector", "target_vector", "law_based", "trial"])),
    )


def doubled(scene: Scene) -> Scene:
    return with_tables(scene, run={"time_limit": 2 * scene.run.time_limit})


def runs_that_survive(scene: Scene, model: BalancerModel, numbers: range) -> list[Simulation]:
    """Settled runs, after the check that a doubled time limit gives the same document."""
    settled = []
    for number in numbers:
        asked = random_scene(scene, number)
        run = simulate(asked, model)
        assert run.status.startswith(run.verdict.value)
        if run.settled:
            settled.append(run)
            assert simulation_document(simulate(doubled(asked), model)) == simulation_document(run)
    return settled


def test_no_settled_run_changes_its_answer_with_the_time_limit(scene: Scene, model: BalancerModel) -> None:
    settled = runs_that_survive(scene, model, range(40))
    assert 10 <= len(settled) <= 38


@pytest.mark.heavy
def test_no_settled_run_of_many_changes_its_answer(
    scene: Scene, model: BalancerModel, calibrated: BalancerModel
) -> None:
    assert len(runs_that_survive(scene, model, range(40, 300))) > 100
    assert len(runs_that_survive(scene, calibrated, range(300, 340))) > 5


def test_a_run_that_comes_to_rest_needs_no_hold(scene: Scene, model: BalancerModel) -> None:
    run = simulate(noisy(scene, noise=0.0, hold_time=50.0), model)
    exact = with_tables(scene, controller={"hold_time": 1e3})
    assert simulate(exact, model).outcome is Outcome.SETTLED
    assert run.verdict in {RunVerdict.SETTLED, RunVerdict.HOVERING}
