"""Designs as arrays: each row by itself, in any order; velocities that balance their heads."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from ringbalance.physics.tube.loss import corrected_state
from ringbalance.reduced_model.core import Answers
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.flow import growing_root
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, changes_of, in_batches
from ringbalance.scene.errors import both_sides, by_group, uncertainties
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from scenes import with_tables

Gas = Literal["vented", "trapped"]


def _drawn(scene: Scene, *, seed: int, count: int, gas: Gas = "vented", saturated: bool = True) -> Designs:
    """Designs around the paper's, some blocked, some separated, some with ports off the wall."""
    random = np.random.default_rng(seed)
    outer = 0.05 * np.exp(random.uniform(-0.5, 1.0, count))
    port = outer * random.uniform(0.95, 1.0, count)
    hump = np.minimum(outer * random.uniform(0.6, 0.85, count), 0.98 * port)
    speed = random.uniform(15, 60, count) / outer
    density = random.uniform(800, 1900, count)
    lift = density * speed**2 * (outer**2 - hump**2) / 2
    kind = with_tables(
        scene, tube={"hump_gas": gas}, liquid={"dissolved_gas": "saturated" if saturated else "none"}
    )
    return Designs.of(
        kind,
        {
            "disc.outer_radius": outer,
            "disc.inner_radius": outer * random.uniform(0.4, 0.7, count),
            "disc.axial_width": outer * random.uniform(0.3, 1.5, count),
            "disc.plate_thickness": outer * random.uniform(0.0, 0.06, count),
            "disc.max_fill_ratio": random.uniform(0.3, 0.8, count),
            "liquid.density": density,
            "liquid.kinematic_viscosity": 1e-6 * np.exp(random.uniform(-0.7, 4.0, count)),
            "tube.bore": 1e-3 * random.uniform(0.8, 4.0, count),
            "tube.port_radius": port,
            "tube.hump_radius": hump,
            "tube.length": 6 * outer,
            "tube.roughness": 1e-6 * random.uniform(0.3, 10.0, count),
            "rotor.speed": speed,
            "gas.pressure": lift * random.uniform(0.9, 2.5, count),
        },
    )


@given(
    seed=st.integers(0, 10**6),
    gas=st.sampled_from(("vented", "trapped")),
    saturated=st.booleans(),
)
@settings(max_examples=10)
def test_rows_are_answered_each_by_itself_and_in_any_order(
    table_1_scene: Scene, seed: int, gas: Gas, saturated: bool
) -> None:
    designs = _drawn(table_1_scene, seed=seed, count=6, gas=gas, saturated=saturated)
    together = vars(Answers.of(designs))
    order = np.random.default_rng(seed).permutation(6)
    mixed = vars(Answers.of(designs.take(order)))
    alone = [vars(Answers.of(designs.take(np.array([row])))) for row in range(6)]
    for name, values in together.items():
        # Pressures at the crest are differences of 1e5 to 1e7 Pa, the depth one of radii.
        atol = {"crest_pressure": 1e-5, "cavitation_margin": 1e-5, "residual_depth": 1e-15}.get(name, 0.0)
        single = [each[name][0] for each in alone]
        assert name != "residual_depth" or np.all(values >= 0)
        np.testing.assert_allclose(mixed[name], values[order], rtol=1e-12, atol=atol, err_msg=name)
        np.testing.assert_allclose(single, values, rtol=1e-12, atol=atol, err_msg=name)


@given(seed=st.integers(0, 10**6), saturated=st.booleans())
def test_a_full_siphon_balances_its_driving_pressure(
    table_1_scene: Scene, seed: int, saturated: bool
) -> None:
    """At equal fills the gas alone drives: p = (k + 1) rho u^2/2, by brentq on the loss."""
    designs = _drawn(table_1_scene, seed=seed, count=8, saturated=saturated)
    answers = Answers.of(designs)
    for row in np.flatnonzero(answers.regime == Regime.SIPHON):
        scene = designs.take(np.array([row])).scene
        drive = float(scene.gas.pressure[0] / scene.liquid.density[0])  # type: ignore[index]

        def excess(log_u: float, scene: Scene = scene, drive: float = drive) -> float:
            u = math.exp(log_u)
            return math.log(float((corrected_state(scene, np.array([u])).k[0] + 1) * u**2 / 2) / drive)

        u = math.exp(float(brentq(excess, math.log(1e-6), math.log(1e4), xtol=1e-13)))
        covered = answers.priming_pressure_vented[row] > 0
        assert answers.velocity[row] == pytest.approx(u, rel=1e-8) or not covered
        assert answers.drag_coefficient[row] == pytest.approx(2 * drive / answers.velocity[row] ** 2 - 1)


def test_without_a_crest_nothing_is_primed(table_1_scene: Scene) -> None:
    plain = with_tables(table_1_scene, tube={"hump_radius": None})
    answers = Answers.of(Designs.of(plain, {"gas.pressure": np.array([1e5, 7e5])}))
    assert np.all(np.isnan(answers.priming_pressure_vented) & np.isnan(answers.cavitation_margin))
    assert answers.velocity[1] > answers.velocity[0] > 0


def test_batches_larger_than_a_cache_are_answered_in_parts(table_1_scene: Scene) -> None:
    pressure = np.linspace(5e5, 9e5, 5000)
    answers = Answers.of(Designs.of(table_1_scene, {"gas.pressure": pressure}))
    ends = Answers.of(Designs.of(table_1_scene, {"gas.pressure": pressure[[0, -1]]}))
    np.testing.assert_allclose(answers.velocity[[0, -1]], ends.velocity, rtol=1e-12)
    assert np.all(np.diff(answers.velocity) >= 0)


def test_scenes_of_other_kinds_are_answered_in_their_order(table_1_scene: Scene) -> None:
    trapped = with_tables(table_1_scene, tube={"hump_gas": "trapped"})
    faster = with_tables(table_1_scene, rotor={"speed": 700.0})

    def speeds(designs: Designs) -> FloatArray:
        return np.array([np.broadcast_to(designs.scene.rotor.speed, designs.size)])

    found = in_batches([table_1_scene, trapped, faster, trapped], speeds)[0]
    assert found.tolist() == [table_1_scene.rotor.speed] * 2 + [700.0, table_1_scene.rotor.speed]


def test_an_inputs_effect_is_the_larger_change_of_both_sides(table_1_scene: Scene) -> None:
    stated = InputUncertainty(quantity="speed", half_width=10.0, relative=False)
    scene = dataclasses.replace(table_1_scene, uncertainty=(stated,))
    errors = uncertainties(scene, among=("speed",), models=False)
    here, changes = changes_of(scene, lambda designs: np.array([Answers.of(designs).stall_pressure]), errors)
    speed = scene.rotor.speed
    higher, lower = ((1 + side * 10 / speed) ** 2 - 1 for side in (1, -1))
    assert by_group(errors, changes)["speed"][0] == pytest.approx(here[0] * higher, rel=1e-9)
    assert np.ravel(both_sides(changes)) == pytest.approx([-here[0] * lower, here[0] * higher], rel=1e-9)


@given(
    power=st.floats(1.0, 2.2),
    step=st.floats(0.0, 3.0),
    wanted=st.floats(-10.0, 10.0),
)
def test_roots_of_growing_functions_are_found_from_bad_starts(
    power: float, step: float, wanted: float
) -> None:
    def function(x: FloatArray) -> FloatArray:
        return power * x + step * np.tanh(5 * (x - 0.3))

    found = growing_root(
        lambda _: function, np.array([wanted]), np.array([-3.0]), np.array([1.75]), np.array([True])
    )
    low, high = (wanted - 4) / power - 2, (wanted + 4) / power + 2
    exact = float(brentq(lambda x: float(function(np.array([x]))[0]) - wanted, low, high, xtol=1e-14))
    assert found[0] == pytest.approx(exact, abs=1e-7)
