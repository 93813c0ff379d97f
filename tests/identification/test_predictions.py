"""Predictions of measurements agree with the calibrated law, the closed loop's plant, and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from pairs import PairState, opened, pass_time
from synthetic_rigs import READINGS, observations

from ringbalance.controller.rotor import disc_unbalance
from ringbalance.controller.terms import dynamics_of
from ringbalance.identification.device import ModelledDevice, Models
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.reading import KINDS
from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.chamber.values import RingValues
from ringbalance.reduced_model.terms import HELD, INERTIA
from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES, nominal_value, with_value
from scenes import with_tables


def predicted(scene: Scene, data: Observations) -> FloatArray:
    return KINDS[data.kind].predict(scene, data, Models.of(scene))


def test_the_quick_law_is_the_calibrated_one(paper_scene: Scene) -> None:
    slow = calibrated_model(paper_scene)
    quick = ModelledDevice.of(paper_scene, Models.of(paper_scene)).law
    fills = np.linspace(0.02, 0.48, 60)
    for gas in (0.0, 0.6e6, 1.2e6):
        one, other = (
            law.evaluate(fill_ratio=fills, gas_pressure=gas, primed=True) for law in (slow.flow, quick)
        )
        np.testing.assert_allclose(other.velocity, one.velocity, rtol=1e-4)
        np.testing.assert_array_equal(other.primed, one.primed)
    moments = [
        curve.pair_moment(fill_ratio=fills, opposite_fill_ratio=0.5 - fills)
        for curve in (slow.moment, quick.moment)
    ]
    np.testing.assert_allclose(moments[1], moments[0], rtol=1e-12, atol=1e-15)


def test_injections_are_those_of_the_closed_loop(paper_scene: Scene) -> None:
    """Two injections into one pair and one into the other, through the plant that `simulate` runs."""
    scene = with_value(scene=paper_scene, quantity="lambda_factor", value=0.9)
    columns = {"gas_time": [0.2, 0.1, 0.15], "pressure": [scene.gas.pressure] * 3}
    zeros = {name: [0.0] * 3 for name in READINGS}
    found = predicted(scene, observations("injection", columns | zeros, ["A", "C", "D"]))
    model = calibrated_model(scene)
    dynamics = dynamics_of(scene=scene, model=model, modelled=[INERTIA, HELD])
    pairs, before, expected = [PairState(fill=0.25, total=0.5)] * 2, 0j, []
    for chamber, time in ((0, 0.2), (2, 0.1), (3, 0.15)):
        begun = pairs[chamber % 2]
        valve = opened(dynamics, chamber=chamber // 2, duration=time)
        begun = replace(begun, motion=replace(begun.motion, pending=valve))
        end = pass_time(dynamics, begun, instants=np.array([3.0]))
        pairs[chamber % 2] = replace(begun, fill=end.fill, primed=end.primed, motion=end.motion)
        first = np.array([pair.fill for pair in pairs])
        moment = disc_unbalance(moment=model.moment, fill_ratio=np.concatenate([first, 0.5 - first]))
        after = complex(scene.rotor.influence * moment)
        expected.append(after - before)
        before = after
    np.testing.assert_allclose(found[:3] + 1j * found[3:], expected, rtol=2e-4)


@pytest.mark.parametrize("bends", [1, 2, 3])
def test_injections_do_not_step_as_the_crest_moves(bends: int) -> None:
    """A straight line through five places, 0.5 +- 0.05, misses by less than 0.2 %, from whichever chamber.

    A bend that changed its leg would make a step of 1 to 7 % of the velocity.
    """
    scene = liquid_ring_scene(load_scene(bundled_scene("six_chamber")))
    scene = with_tables(scene, tube={"bends": scene.tube.bends[:1] * bends})
    assert _misses_a_line(scene, Models.of(scene)) < 2e-3


def _misses_a_line(scene: Scene, models: Models) -> float:
    """Largest change of an injection, relative, that is not linear in the crest's place."""
    columns = {"gas_time": [0.1] * 2, "pressure": [scene.gas.pressure] * 2}
    data = observations("injection", columns | {name: [0.0] * 2 for name in READINGS}, ["A", "D"])
    places = np.linspace(0.45, 0.55, 5)
    moved = np.array(
        [
            KINDS["injection"].predict(
                with_value(scene=scene, quantity="hump_position", value=place), data, models
            )
            for place in places.tolist()
        ]
    )
    sizes = np.hypot(moved[:, :2], moved[:, 2:])
    line = np.polynomial.Polynomial.fit
    left = [column / column.mean() - line(places, column / column.mean(), 1)(places) for column in sizes.T]
    return float(np.max(np.abs(left)))


def test_laws_made_together_are_those_made_alone_with_one_chamber_for_all(
    paper_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The chamber under gravity was worked out for every law, a third of a fit's time."""
    counted: list[float] = []
    of = RingValues.of

    def counting(scene: Scene, **values: Any) -> RingValues:
        counted.append(scene.rotor.speed)
        return of(scene, **values)

    columns = {"gas_time": [0.2, 0.1], "pressure": [paper_scene.gas.pressure] * 2}
    data = observations("injection", columns | {name: [0.0] * 2 for name in READINGS}, ["A", "D"])
    tubes = [
        with_value(scene=paper_scene, quantity=name, value=value)
        for name, value in (("bore", 1.49e-3), ("bore", 1.52e-3), ("extra_loss", 0.3), ("length", 0.125))
    ]
    scenes = [*tubes, with_value(scene=paper_scene, quantity="speed", value=1.001 * paper_scene.rotor.speed)]
    monkeypatch.setattr(RingValues, "of", counting)
    models = Models.of(paper_scene)
    models.expect(scenes)
    together = [KINDS["injection"].predict(each, data, models) for each in scenes]
    assert len(counted) == 3, "of the scene, of the tubes, of the other speed"
    for each, found in zip(scenes, together, strict=True):
        alone = KINDS["injection"].predict(each, data, Models.of(paper_scene))
        np.testing.assert_allclose(found, alone, rtol=1e-11)


@pytest.mark.parametrize("drag", [None, 50.0])
def test_laws_made_together_may_differ_in_any_number_alone(paper_scene: Scene, drag: float | None) -> None:
    """Where only k or the extra loss differed, many laws could not be made at once."""
    scene = (
        paper_scene
        if drag is None
        else with_value(scene=paper_scene, quantity="drag_coefficient", value=drag)
    )

    def left(device: ModelledDevice) -> float:
        before_and_after = device.injected(fill=0.25, chamber=0, pressure=scene.gas.pressure, gas_time=0.1)
        return float(before_and_after[1, 0])

    for name in UNCERTAIN_QUANTITIES:
        value = nominal_value(scene=scene, quantity=name)
        if value is None:
            continue
        moved = [value * (1 + part) if value else part for part in (1e-4, 2e-4)]
        scenes = [with_value(scene=scene, quantity=name, value=each) for each in moved]
        together = Models.of(scene)
        together.expect(scenes)
        for each in scenes:
            one, other = (left(ModelledDevice.of(each, models)) for models in (together, Models.of(scene)))
            assert one == pytest.approx(other, rel=1e-11), name


def test_a_stated_fill_begins_again(paper_scene: Scene) -> None:
    """Rows that state their chamber's fill do not depend on those before, on either side of a pair."""
    columns = {"gas_time": [0.2] * 3, "pressure": [paper_scene.gas.pressure] * 3, "fill_ratio": [0.3] * 3}
    zeros = {name: [0.0] * 3 for name in READINGS}
    found = predicted(paper_scene, observations("injection", columns | zeros, ["A", "A", "C"]))
    change = found[:3] + 1j * found[3:]
    np.testing.assert_allclose(change[1:], [change[0], -change[0]], rtol=1e-6)


def test_a_gas_line_delays_what_is_moved(paper_scene: Scene) -> None:
    """A lag alone moves nothing but time; a narrow line moves less liquid."""
    data = observations(
        "transfer", {"fill_ratio": [0.25], "pressure": [0.8e6], "gas_time": [0.2], "volume": [1.0]}
    )
    plain = float(predicted(paper_scene, data)[0])
    gas = replace(paper_scene.gas, conductance=2e-9, critical_ratio=0.3, dead_volume=0.0)
    narrow = float(predicted(replace(paper_scene, gas=gas), data)[0])
    late = float(predicted(with_tables(paper_scene, gas={"valve_lag": 0.05}), data)[0])
    assert late == pytest.approx(plain, rel=1e-6)
    assert 0.2 * plain < narrow < 1.5 * plain
    assert narrow != pytest.approx(plain, rel=0.02)


def test_mass_is_density_times_volume(paper_scene: Scene) -> None:
    rows = {"fill_ratio": [0.25, 0.3], "pressure": [0.8e6] * 2, "gas_time": [0.2, 0.3]}
    volume, mass = (
        predicted(paper_scene, observations("transfer", rows | {n: [1.0] * 2})) for n in ("volume", "mass")
    )
    np.testing.assert_allclose(mass, paper_scene.liquid.density * volume, rtol=1e-12)
    assert np.all((volume > 0) & (volume < 0.3 * chamber_volume(disc=paper_scene.disc)))


def test_flow_at_rest_obeys_the_definition_of_k(paper_scene: Scene) -> None:
    """(k + 1) rho u^2/2 = p with k of a tube that does not turn."""
    pressures = np.geomspace(1e3, 1e6, 9)
    rate = predicted(paper_scene, observations("flow", {"pressure_difference": pressures}))
    u = rate / (math.pi / 4 * paper_scene.tube.bore**2)
    still = with_tables(paper_scene, rotor={"speed": 0.0})
    k = tube_loss(still, u).k.value
    np.testing.assert_allclose((k + 1) * paper_scene.liquid.density * u**2 / 2, pressures, rtol=1e-8)


def test_pressure_of_a_turning_ring(paper_scene: Scene) -> None:
    disc, rho = paper_scene.disc, paper_scene.liquid.density
    radius = np.array([disc.outer_radius, disc.outer_radius, disc.inner_radius])
    data = observations("pressure", {"radius": radius, "fill_ratio": [0.2, 0.4, 0.2], "pressure": [1.0] * 3})
    a = surface_radius(disc=disc, fill_ratio=np.array([0.2, 0.4]))
    wall = rho * paper_scene.rotor.speed**2 * (disc.outer_radius**2 - a**2) / 2
    np.testing.assert_allclose(predicted(paper_scene, data), [*wall, 0.0], rtol=1e-12)


def test_the_vibration_without_weight_is_free_in_each_series(paper_scene: Scene) -> None:
    """Any vibration of a series lies in what its two unknowns can take up; K U does not."""
    data = replace(
        observations("trial_weight", {"unbalance": [0, 1e-4, 0, 1e-4], "angle": [0, 1, 0, 1]}),
        series=np.array(["a", "a", "b", "b"]),
    )
    free = KINDS["trial_weight"].free(data)
    assert np.linalg.matrix_rank(free) == 4
    alike = np.array([1, 1, 3, 3, 2, 2, -5, -5.0])
    assert np.linalg.norm(alike - free @ np.linalg.lstsq(free, alike, rcond=None)[0]) < 1e-12
    k = paper_scene.rotor.influence
    found = predicted(paper_scene, data)
    assert found[1] + 1j * found[5] == pytest.approx(k * 1e-4 * np.exp(1j))


def chain(shared: bool) -> Observations:
    random = np.random.default_rng(3)
    seen = 1e-5 + 1e-6 * random.standard_normal(4)
    again = seen if shared else seen * (1 + 1e-3 * random.standard_normal(4))
    columns: dict[str, npt.ArrayLike] = {
        "gas_time": [0.1] * 3,
        "pressure": [1e6] * 3,
        "amplitude_before": again[:-1],
        "phase_before": [0.1] * 3,
        "amplitude_after": seen[1:],
        "phase_after": [0.1] * 3,
    }
    return observations("injection", columns, ["A", "B", "A"])


@pytest.mark.parametrize("shared", [True, False])
def test_errors_of_readings_that_serve_twice(shared: bool) -> None:
    """Against many draws of the readings' errors."""
    data = chain(shared)
    random = np.random.default_rng(5)
    if shared:
        errors = random.standard_normal((200_000, 4))
        changes = errors[:, 1:] - errors[:, :-1]
    else:
        changes = np.diff(random.standard_normal((200_000, 3, 2)), axis=2)[:, :, 0]
    np.testing.assert_allclose(KINDS["injection"].covariance(data)[:3, :3], np.cov(changes.T), atol=0.03)


def test_a_stated_noise_of_amplitude_and_phase() -> None:
    """Along the vector by the amplitude, across it by the phase; against draws."""
    data = observations(
        "trial_weight", {"unbalance": [0.0], "angle": [0.0], "amplitude": [1e-5], "phase": [0.7]}
    )
    stated = {"amplitude": np.array([4e-7]), "phase": np.array([0.01])}
    data = replace(data, uncertainty=stated)
    random = np.random.default_rng(2)
    seen = (1e-5 + 4e-7 / 1.96 * random.standard_normal(400_000)) * np.exp(
        1j * (0.7 + 0.01 / 1.96 * random.standard_normal(400_000))
    )
    expected = np.cov(np.stack([seen.real, seen.imag]))
    np.testing.assert_allclose(KINDS["trial_weight"].covariance(data), expected, rtol=0.02)


@pytest.mark.parametrize(
    ("kind", "column"),
    [
        ("trial_amplitude", "amplitude"),
        ("transfer", "mass"),
        ("flow", "flow_rate"),
        ("pressure", "pressure"),
        ("positioning", "angle"),
    ],
)
def test_a_stated_noise_of_numbers(kind: str, column: str) -> None:
    """95 of 100 normal errors of the covariance lie within the stated uncertainty, row by row."""
    stated = np.array([0.02, 0.3])
    data = replace(observations(kind, {column: [1.0, 2.0]}), uncertainty={column: stated})
    covariance = KINDS[kind].covariance(data)
    errors = np.random.default_rng(4).multivariate_normal(np.zeros(2), covariance, size=100_000)
    np.testing.assert_allclose(np.mean(np.abs(errors) <= stated, axis=0), 0.95, atol=0.005)
    assert covariance[0, 1] == 0
