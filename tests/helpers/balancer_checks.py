"""What holds for every balancer, as scikit-learn's `check_estimator` for every estimator."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ringbalance.controller.balancer import AS_GIVEN, Balancer, Draws, Outcomes, balancer_of
from ringbalance.scene import SceneError
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.units import DIMENSIONS
from scenes import with_tables

UNITS = {unit for kind in DIMENSIONS.values() for unit in kind.units} | {"1"}
Check = Callable[[Balancer], None]


def _same(one: Outcomes, other: Outcomes) -> None:
    np.testing.assert_array_equal(one.settled, other.settled)
    np.testing.assert_array_equal(one.settling_time, other.settling_time)
    np.testing.assert_array_equal(one.final_amplitude, other.final_amplitude)


def inputs_have_units_and_intervals(balancer: Balancer) -> None:
    inputs = balancer.inputs()
    assert len({each.path for each in inputs}) == len(inputs) > 0
    assert all(math.isfinite(each.value) and 0 <= each.half_width < math.inf for each in inputs)
    assert {each.unit for each in inputs} <= UNITS
    assert any(each.half_width > 0 for each in inputs)


def settings_lie_within_their_bounds(balancer: Balancer) -> None:
    settings = balancer.settings()
    assert settings
    assert all(each.lowest < each.value < each.highest for each in settings)


def the_scenes_own_settings_change_nothing(balancer: Balancer) -> None:
    own = {each.path: each.value for each in balancer.settings()}
    draws = Draws.first(2)
    _same(balancer.run(own, draws), balancer.run({}, draws))


def every_setting_has_an_effect(balancer: Balancer) -> None:
    given = balancer.run({}, AS_GIVEN, trace=True).final_amplitude
    effects = [
        balancer.run({each.path: 1.3 * each.value}, AS_GIVEN, trace=True).final_amplitude != given
        for each in balancer.settings()
    ]
    assert np.any(effects)


def the_same_draws_give_the_same_rows(balancer: Balancer) -> None:
    again = balancer_of(balancer.scene)
    _same(balancer.run({}, Draws.first(3)), again.run({}, Draws.first(3)))


def a_number_is_the_same_device_in_every_block(balancer: Balancer) -> None:
    several, alone = balancer.run({}, Draws.first(3)), balancer.run({}, Draws(numbers=(2,)))
    assert several.final_amplitude[2] == alone.final_amplitude[0]
    assert several.settling_time[2] == alone.settling_time[0]


def devices_differ(balancer: Balancer) -> None:
    assert np.unique(balancer.run({}, Draws.first(3)).final_amplitude).size == 3


def a_time_is_finite_where_it_settled(balancer: Balancer) -> None:
    found = balancer.run({}, Draws.first(3))
    np.testing.assert_array_equal(np.isfinite(found.settling_time), found.settled)


def a_run_answers_what_its_row_says(balancer: Balancer) -> None:
    """Trace, document and history are those of one run, which is a sample with its trace kept."""
    found = balancer.run({}, AS_GIVEN, trace=True)
    (traced,) = found.traced
    run = traced.run
    document = run.to_dict()
    assert document["balancer"] == balancer.scene.balancer
    assert document["settled"] == run.settled == bool(found.settled[0])
    assert document["status"] == run.status != ""
    assert traced.energy >= 0
    assert traced.worst_amplitude >= found.final_amplitude[0] * (1 - 1e-9)
    columns = balancer.history(run)
    assert len({len(column) for column in columns.values()}) == 1
    assert "time_s" in columns


def a_row_does_not_depend_on_the_trace(balancer: Balancer) -> None:
    plain, traced = (balancer.run({}, Draws.first(2, devices=False), trace=kept) for kept in (False, True))
    np.testing.assert_array_equal(plain.settled, traced.settled)
    np.testing.assert_allclose(plain.settling_time, traced.settling_time, rtol=1e-4)


def only_asked_for_runs_are_kept(balancer: Balancer) -> None:
    assert balancer.run({}, Draws.first(1, devices=False)).traced == ()


def its_own_rotor_is_the_common_one(balancer: Balancer) -> None:
    rotor = balancer.rotor()
    again = balancer.on_rotor(rotor).rotor()
    assert again.speed == pytest.approx(rotor.speed)
    assert again.influence == pytest.approx(rotor.influence, rel=1e-9)
    assert again.unbalance == pytest.approx(rotor.unbalance, rel=1e-9)
    assert (again.limit, again.noise) == (rotor.limit, rotor.noise)


def a_span_is_what_was_asked_for(balancer: Balancer) -> None:
    assert balancer.lasting(7.5).span() == pytest.approx(7.5)


def it_survives_a_pickle(balancer: Balancer) -> None:
    again = pickle.loads(pickle.dumps(balancer))
    _same(again.run({}, Draws.first(2)), balancer.run({}, Draws.first(2)))


def a_foreign_option_is_refused(balancer: Balancer) -> None:
    with pytest.raises(ValueError, match="has no colour"):
        balancer_of(balancer.scene, colour="red")


def a_changed_record_is_checked_again(balancer: Balancer) -> None:
    """Its scene is of the registered kind: one with a value changed in another way is refused."""
    scene = balancer.scene
    assert scene.with_values({"run.seed": 5}).run.seed == 5
    with pytest.raises(SceneError):
        with_tables(scene, run={"seed": 6}).with_values({"run.seed": 7})


def its_scene_describes_itself(balancer: Balancer) -> None:
    assert Path(balancer.scene.source).name in repr(balancer.scene)
    assert len(repr(balancer.scene).splitlines()) > 1


CHECKS: tuple[Check, ...] = (
    inputs_have_units_and_intervals,
    settings_lie_within_their_bounds,
    the_scenes_own_settings_change_nothing,
    every_setting_has_an_effect,
    the_same_draws_give_the_same_rows,
    a_number_is_the_same_device_in_every_block,
    devices_differ,
    a_time_is_finite_where_it_settled,
    a_run_answers_what_its_row_says,
    a_row_does_not_depend_on_the_trace,
    only_asked_for_runs_are_kept,
    its_own_rotor_is_the_common_one,
    a_span_is_what_was_asked_for,
    it_survives_a_pickle,
    a_foreign_option_is_refused,
    a_changed_record_is_checked_again,
    its_scene_describes_itself,
)
"""Each called with the balancer of a scene that was read."""


def short(scene: SceneFile, seconds: float) -> Balancer:
    """The balancer of a scene whose runs are short."""
    return balancer_of(scene.with_values({"run.time_limit": seconds}))
