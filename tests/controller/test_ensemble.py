"""Ensembles against `simulate` member by member, and what an ensemble of members says."""

from __future__ import annotations

import json
import math
import tracemalloc
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from ringbalance.controller.ensemble import (
    QUANTILES,
    Probability,
    member_noise,
    simulate_ensemble,
    simulate_members,
)
from ringbalance.controller.loop import simulate
from ringbalance.controller.loop_records import MomentTable, pair_moment
from ringbalance.controller.members import BLOCK, Members, MemberUncertainty
from ringbalance.controller.rotor import Sensor, noisy_sensor
from ringbalance.controller.simulation import Outcome
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw, PaperMoment, paper_model
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene.models import Scene

EXACT = MemberUncertainty(velocity=0.0, moment=0.0, influence_coefficient=0.0, lag_angle=0.0)


def noisy(scene: Scene, *, time_limit: float = 12.0, **controller: Any) -> Scene:
    return replace(
        scene,
        sensor=replace(scene.sensor, amplitude_noise=1e-8, phase_noise=0.02),
        controller=replace(scene.controller, **controller),
        run=replace(scene.run, time_limit=time_limit),
    )


def sensor_of(scene: Scene, *, seed: int, member: int) -> Sensor:
    """The sensor that one member sees."""
    return noisy_sensor(sensor=scene.sensor, seed=member_noise(seed, member))


def alone(scene: Scene, model: BalancerModel, members: Members, member: int) -> tuple[Scene, BalancerModel]:
    """One member as a scene and a model of its own; k takes up the velocity, lambda the moment."""
    rotor = replace(
        scene.rotor,
        influence_coefficient=float(members.influence_coefficient[member]),
        lag_angle=float(members.lag_angle[member]),
    )
    settings = replace(scene.controller, proportional=float(members.proportional[member]))
    law, moment = model.flow, model.moment
    assert isinstance(law, PaperLaw)
    assert isinstance(moment, PaperMoment)
    k = (law.drag_coefficient + 1) / float(members.velocity_factor[member]) ** 2 - 1
    held = moment.moment_per_transferred_mass * float(members.moment_factor[member])
    changed = replace(
        model,
        flow=replace(law, drag_coefficient=k),
        moment=replace(moment, moment_per_transferred_mass=held),
    )
    assert members.draw_down is not None
    tube = replace(scene.tube, draw_down_factor=float(members.draw_down[member]))
    return replace(scene, rotor=rotor, controller=settings, tube=tube), changed


def various(scene: Scene, *, size: int) -> Members:
    """Members that differ in everything, some of them badly: overshooting, and with a wrong lag."""
    random = np.random.default_rng(11)
    base = Members.alike(scene, size=size)
    lag = base.lag_angle + random.uniform(-0.4, 0.4, size)
    lag[-1] += 2.5
    return Members(
        velocity_factor=random.uniform(0.6, 1.7, size),
        moment_factor=random.uniform(0.8, 1.2, size),
        influence_coefficient=base.influence_coefficient * random.uniform(0.8, 1.2, size),
        lag_angle=lag,
        proportional=base.proportional * random.uniform(0.4, 3.0, size),
        draw_down=random.uniform(0.5, 1.5, size),
    )


# --- agreement, member by member ---


@pytest.mark.parametrize(("chambers", "noise"), [(4, True), (2, False), (8, True)])
def test_every_member_is_the_scalar_run(scene: Scene, chambers: int, noise: bool) -> None:
    size = 10
    disc = replace(scene.disc, chambers=chambers, central_angle=2 * math.pi / max(chambers, 3))
    asked = replace(noisy(scene), disc=disc)
    if not noise:
        asked = replace(asked, sensor=scene.sensor)
    model = paper_model(asked)
    members = various(asked, size=size)
    residuals = members.residual_fill(asked, law=model.flow)
    found = simulate_members(asked, model, members=members, noise=partial(member_noise, 4))
    outcomes = []
    for member in range(size):
        own_scene, own_model = alone(asked, model, members, member)
        sensor = sensor_of(asked, seed=4, member=member) if noise else None
        residual = float(residuals[member])
        assert residual == pytest.approx(residual_fill_ratio(own_scene, law=own_model.flow), abs=1e-6)
        run = simulate(own_scene, own_model, sensor=sensor, residual_fill=residual)
        assert found.shortened[member] == run.shortened
        outcomes.append(run.outcome)
        assert found.settled[member] == run.settled
        assert found.overshoots[member] == run.overshoots
        assert found.misadjustments[member] == run.misadjustments
        assert found.samples[member] == len(run.samples)
        # A run beyond the disc's capacity is called that, whether it grew or not.
        if run.outcome is not Outcome.CAPACITY_EXCEEDED:
            assert found.diverged[member] == (run.outcome is Outcome.DIVERGING)
        assert found.final_amplitude[member] == pytest.approx(run.amplitude[-1], abs=3e-9)
        time = math.inf if run.settling_time is None else run.settling_time
        assert found.settling_time[member] == pytest.approx(time, rel=1e-5)
    if chambers != 2:
        assert Outcome.SETTLED in outcomes
        assert Outcome.DIVERGING in outcomes
        assert np.any(found.overshoots > 0)
    if chambers == 8:
        # Two neighbours at their residual fill, and others that take over.
        assert np.any(found.settled & (found.shortened > 1))


def test_the_moment_table_is_the_curve(model: BalancerModel) -> None:
    def of(x: Any) -> Any:
        return np.sin(3 * np.asarray(x)) + 1j * np.cos(2 * np.asarray(x))

    class Curve:
        def pair_moment(self, **fills: Any) -> Any:
            return self.pair_vector(**fills).real

        def pair_vector(self, *, fill_ratio: Any, opposite_fill_ratio: Any) -> Any:
            return of(fill_ratio) - of(opposite_fill_ratio)

    table = MomentTable.of(model=replace(model, moment=Curve()), total=0.5)
    x = np.random.default_rng(0).uniform(0, 0.5, 200)
    found = np.array([pair_moment(table.nodes, table.lowest, table.step, fill) for fill in x])
    assert np.max(np.abs(found - of(x) + of(0.5 - x))) < 1e-10


@pytest.mark.parametrize("rate", [0.05, 20.0])
def test_liquid_that_runs_back_is_followed(
    scene: Scene, model: BalancerModel, laws: Mapping[str, Any], rate: float
) -> None:
    def levelling(x: Any, y: Any, p: Any, _: Any) -> tuple[Any, Any]:
        return rate * (x - y) + np.where(p > 0, 12.0, 0.0), np.full(x.shape, Regime.SIPHON)

    asked = noisy(scene, time_limit=10.0, proportional=0.1e6, limit=0.6e-6)
    other = replace(model, flow=replace(laws["levelling"], function=levelling))
    found = simulate_members(asked, other, size=4, noise=partial(member_noise, 9))
    for member in range(4):
        run = simulate(asked, other, sensor=sensor_of(asked, seed=9, member=member))
        assert found.samples[member] == len(run.samples)
        assert found.settled[member] == run.settled
        assert found.overshoots[member] == run.overshoots
        assert found.misadjustments[member] == run.misadjustments
        assert found.final_amplitude[member] == pytest.approx(run.amplitude[-1], abs=1e-9)
        time = math.inf if run.settling_time is None else run.settling_time
        assert found.settling_time[member] == pytest.approx(time, rel=1e-5)
        assert found.drifted[member] == (not run.settled)


# --- the ensemble ---


def test_the_same_seed_gives_the_same_numbers_for_any_threads(scene: Scene, model: BalancerModel) -> None:
    asked = noisy(scene, time_limit=5.0)
    one = simulate_ensemble(asked, model, 2 * BLOCK + 5, 3, workers=1)
    two = simulate_ensemble(asked, model, 2 * BLOCK + 5, 3, workers=2)
    assert one.document() == two.document()
    assert one.members == 2 * BLOCK + 5
    other = simulate_ensemble(asked, model, 2 * BLOCK + 5, 4, workers=2)
    assert other.document() != one.document()


def test_a_larger_ensemble_begins_with_the_smaller(scene: Scene, model: BalancerModel) -> None:
    asked = noisy(scene, time_limit=10.0)
    uncertainty_95 = MemberUncertainty.of(asked, model)
    drawn = Members.drawn(asked, uncertainty_95=uncertainty_95, seed=1, block=0)
    a, b = (
        simulate_members(asked, model, members=drawn.at(slice(n)), noise=partial(member_noise, 1))
        for n in (7, 50)
    )
    assert np.array_equal(a.settling_time, b.settling_time[:7])
    counted = simulate_ensemble(asked, model, 50, 1)
    assert counted.settled.value == pytest.approx(b.settled.mean())
    assert counted.overshoot.value == pytest.approx((b.overshoots > 0).mean())
    # Of all members, those that have not settled at the end: a quantile that they reach into is not known.
    for q, found in zip(QUANTILES, counted.settling_quantiles, strict=True):
        known = np.quantile(b.settling_time, q, method="inverted_cdf")
        assert found == (None if math.isinf(known) else pytest.approx(float(known), abs=0.03))
    # Of all that settle the last one counts, though no further one does until the end of the run.
    settled = counted.settled.value
    assert 0 < settled < 1
    (last,) = simulate_ensemble(asked, model, 50, 1, quantiles=(settled,)).settling_quantiles
    assert last == pytest.approx(float(b.settling_time[b.settled].max()), abs=0.03)


def test_an_interrupt_ends_an_ensemble_at_once(scene: Scene, model: BalancerModel) -> None:
    seen: list[int] = []

    def interrupt(done: int, _: int) -> None:
        seen.append(done)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate_ensemble(noisy(scene, time_limit=3.0), model, 50 * BLOCK, 0, progress=interrupt)
    assert seen == [BLOCK]


def test_memory_does_not_grow_with_the_members(scene: Scene, model: BalancerModel) -> None:
    asked = noisy(scene, time_limit=2.0)
    simulate_ensemble(asked, model, 10, 0)
    peaks = []
    for blocks in (2, 6):
        tracemalloc.start()
        simulate_ensemble(asked, model, blocks * BLOCK, 0, workers=1)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]


def test_more_uncertainty_more_overshoot(scene: Scene, model: BalancerModel) -> None:
    asked = noisy(scene, time_limit=30.0)
    asked = replace(asked, sensor=replace(asked.sensor, amplitude_noise=2e-9))
    wide = replace(EXACT, velocity=0.3, influence_coefficient=0.3)
    calm, wild = (simulate_ensemble(asked, model, 2000, 0, uncertainty_95=s) for s in (EXACT, wide))
    assert wild.overshoot.low > calm.overshoot.high
    late = [
        math.inf if found.settling_quantiles[4] is None else found.settling_quantiles[4]
        for found in (calm, wild)
    ]
    assert late[1] > late[0]


def test_members_are_drawn_with_the_half_widths(scene: Scene) -> None:
    uncertainty_95 = MemberUncertainty(
        velocity=0.1, moment=0.02, influence_coefficient=0.2, lag_angle=0.05, draw_down=0.3
    )
    drawn = Members.drawn(scene, uncertainty_95=uncertainty_95, seed=0, block=0)
    for values, low, high in (
        (drawn.velocity_factor, 1 / 1.1, 1.1),
        (drawn.moment_factor, 1 / 1.02, 1.02),
        (drawn.influence_coefficient / scene.rotor.influence_coefficient, 1 / 1.2, 1.2),
        (drawn.lag_angle - scene.rotor.lag_angle, -0.05, 0.05),
        (drawn.draw_down, 1 / 1.3, 1.3),
    ):
        assert values is not None
        assert np.mean((values > low) & (values < high)) == pytest.approx(0.95, abs=0.01)
        assert np.mean(values > high) == pytest.approx(0.025, abs=0.007)


def test_the_spread_says_where_it_comes_from(scene: Scene, model: BalancerModel) -> None:
    found = MemberUncertainty.of(replace(scene, uncertainty=()), model)
    # k = 50 within 10 %: (k + 1) within 5/51, the velocity within half of that.
    assert found.velocity == pytest.approx(5 / 51 / 2)
    assert all("assumed" in source for source in found.sources[2:])


def test_a_share_has_its_interval() -> None:
    # Wilson's interval for 5 of 50.
    found = Probability.counted(count=5, of=50)
    assert (found.low, found.high) == pytest.approx((0.0435, 0.2136), abs=2e-4)
    assert Probability.counted(count=0, of=100).low == 0.0
    assert Probability.counted(count=0, of=100).high == pytest.approx(0.037, abs=1e-3)


def test_the_document_is_small_clean_json(scene: Scene, model: BalancerModel) -> None:
    seen: list[tuple[int, int]] = []
    asked = noisy(scene, time_limit=5.0)
    found = simulate_ensemble(
        asked, model, 300, 0, progress=lambda done, of: seen.append((done, of))
    ).document()
    text = json.dumps(found, allow_nan=False)
    assert len(text) < 6500
    assert seen == [(300, 300)]
    times = found["settling_time_s"]
    assert sum(times["counts"]) == round(300 * found["probability"]["settled"]["value"])
    assert len(times["edges"]) == len(times["counts"]) + 1
    assert sum(found["overshoots"]) == sum(found["misadjustments"]) == 300


@pytest.mark.parametrize("n", [0, -3])
def test_no_members_are_refused(scene: Scene, model: BalancerModel, n: int) -> None:
    with pytest.raises(ValueError, match="members"):
        simulate_ensemble(scene, model, n, 0)
