"""The model hierarchies of real scenes: the right models at 300 and at 10 000 rpm, against tops computed
here."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from ringbalance.physics.pressure.ring import ring_quantities
from ringbalance.physics.results import StatusCode
from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.chamber import terms as chamber_terms
from ringbalance.reduced_model.chamber.values import (
    by_closed_form,
    by_paper,
    by_quadrature,
)
from ringbalance.reduced_model.selection.range_flow import (
    CONSTANT,
    CORRELATIONS,
    LOSSES,
    TABLES,
    head_at,
    loss_at,
    velocity_under_head,
)
from ringbalance.reduced_model.tube.path import crest_span
from ringbalance.scene import loop_models
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import with_tolerance
from ringbalance.verification.selection_studies.chambers import by_elements, chamber_hierarchies
from ringbalance.verification.selection_studies.choice import choose
from ringbalance.verification.selection_studies.laws import (
    CLOSED,
    QUADRATURE,
    REGIMES,
    SIPHON,
    LawBook,
    LawModels,
    k_hierarchy,
    velocity_hierarchy,
)
from ringbalance.verification.selection_studies.scene_numbers import scene_numbers


def at_speed(scene: Scene, rpm: float) -> Scene:
    return dataclasses.replace(scene, rotor=dataclasses.replace(scene.rotor, speed=rpm * math.pi / 30))


def large(scene: Scene) -> Scene:
    """A disc large enough to hold its ring at 300 rpm."""
    disc = dataclasses.replace(
        scene.disc,
        outer_radius=0.2,
        inner_radius=0.1,
        axial_width=0.1,
        central_angle=math.pi / 6,
        chambers=12,
    )
    return dataclasses.replace(scene, disc=disc)


def test_a_slow_and_a_fast_disc_get_different_models_for_stated_reasons(table_1_scene: Scene) -> None:
    disc = large(table_1_scene)
    slow, fast = (choose(chamber_hierarchies(at_speed(disc, rpm))[0], 0.05) for rpm in (300, 10_000))
    assert "sloshing" in slow.fidelity.name
    assert slow.fidelity.models["gravity"] == "all orders"
    assert "gravity" not in fast.fidelity.name
    assert fast.fidelity.models["gravity"] == "left out"
    assert any(r.startswith("sloshing at 1x: in; estimated contribution") for r in slow.reasons)
    assert any(r.startswith("sloshing at 1x: left out; estimated contribution") for r in fast.reasons)


def test_the_paper_disc_leaves_sloshing_out_at_one_per_cent_and_takes_it_at_a_ten_thousandth(
    table_1_scene: Scene,
) -> None:
    pressure = chamber_hierarchies(table_1_scene)[0]
    assert choose(pressure, 0.01).fidelity.name == "closed form"
    assert choose(pressure, 1e-4).fidelity.name == "quadrature, gravity to all orders, sloshing"


def test_the_mean_of_every_model_against_finite_elements(table_1_scene: Scene) -> None:
    """Each model alone, at a speed where gravity is three per cent, on the finite elements' own meshes."""
    scene = at_speed(table_1_scene, 900)
    top = ring_quantities(
        disc=scene.disc,
        density=1000.0,
        angular_velocity=scene.rotor.speed,
        fill_ratio=[0.4],
        gravity=9.80665,
    )
    errors = {
        f.__name__: abs(f(scene, 0.4).wall_pressure / top.wall_pressure.value[0] - 1)
        for f in (by_paper, by_closed_form, by_quadrature)
    }
    assert errors["by_paper"] > 0.05
    assert 1e-5 < errors["by_closed_form"] < 1e-3
    assert errors["by_quadrature"] < 1e-8
    ripple = top.ripple["wall_pressure"][0]
    assert by_quadrature(scene, 0.4).wall_pressure_ripple == pytest.approx(ripple, rel=1e-5)
    assert by_quadrature(scene, 0.4).moment_ripple == pytest.approx(top.ripple["moment"][0], rel=1e-5)
    coarse = by_elements(scene, 0.4, cells=(4, 12), gravity=False)
    assert coarse.wall_pressure == pytest.approx(by_closed_form(scene, 0.4).wall_pressure, rel=1e-6)


def test_estimates_are_worth_something(table_1_scene: Scene) -> None:
    """Each estimate of the chamber within a factor of two of what leaving the thing out really does."""
    scene = at_speed(table_1_scene, 2000)
    terms = chamber_terms.chamber_contributions(scene, np.array([0.25]))["pressures"]
    plain, exact = by_closed_form(scene, 0.25), by_quadrature(scene, 0.25)
    ripple = exact.wall_pressure_ripple / plain.wall_pressure
    mean = abs(exact.wall_pressure / plain.wall_pressure - 1)
    plates = abs(by_paper(scene, 0.25).wall_pressure / plain.wall_pressure - 1)
    for term, real in (
        (chamber_terms.RIPPLE, ripple),
        (chamber_terms.MEAN, mean),
        (chamber_terms.PLATES, plates),
    ):
        value = terms[term].value
        assert value is not None
        assert 0.5 < value / real < 2.0


def test_a_broken_ring_is_a_status(table_1_scene: Scene) -> None:
    hierarchy = chamber_hierarchies(at_speed(table_1_scene, 300))[0]
    assert hierarchy.status.code is StatusCode.OUT_OF_RANGE
    assert len(hierarchy.points) == 1
    assert "turn faster" in hierarchy.status.text


def test_the_top_of_k_is_the_calibrated_k(table_1_scene: Scene) -> None:
    u = np.array([0.5, 5.0, 20.0])
    top = tube_loss(table_1_scene, u)
    found = loss_at(table_1_scene, loss=TABLES, velocity=u)
    assert found.k == pytest.approx(top.k.value, rel=1e-12)
    end = crest_span(table_1_scene.tube)[1]
    assert found.upstream_loss(end) == pytest.approx(top.state.upstream_loss(end), rel=1e-12)
    assert np.all(loss_at(table_1_scene, loss=CONSTANT, velocity=u).k == 50.0)


def test_a_prescribed_k_is_every_models_k(table_1_scene: Scene) -> None:
    tube = dataclasses.replace(table_1_scene.tube, drag_coefficient=30.0)
    scene = dataclasses.replace(table_1_scene, tube=tube)
    assert {float(loss_at(scene, loss=loss, velocity=3.0).k) for loss in LOSSES} == {30.0}
    assert choose(k_hierarchy(scene), 1e-6).fidelity.name == CONSTANT


def test_an_unknown_loss_is_refused(table_1_scene: Scene) -> None:
    with pytest.raises(ValueError, match="must be one of"):
        loss_at(table_1_scene, loss="guess", velocity=1.0)


def test_the_velocity_under_a_head(table_1_scene: Scene) -> None:
    for loss in LOSSES:
        u = velocity_under_head(table_1_scene, loss=loss, head=700.0)
        k = float(loss_at(table_1_scene, loss=loss, velocity=u).k)
        assert (k + 1) * u**2 / 2 == pytest.approx(700.0, rel=1e-9)


def test_the_highest_law_against_the_calibrated_one_and_a_root_of_its_own(
    table_1_scene: Scene,
) -> None:
    book = LawBook(table_1_scene)
    law = book.law(LawModels(level=QUADRATURE, loss=TABLES, regimes=REGIMES))
    fills = np.array([0.1, 0.25, 0.4])
    found = law.evaluate(fill_ratio=fills, gas_pressure=7e5)
    finest = calibrated_model(with_tolerance(table_1_scene, models="finest")).flow
    wanted = finest.evaluate(fill_ratio=fills, gas_pressure=7e5)
    assert found.velocity == pytest.approx(wanted.velocity, rel=1e-6)
    siphon = book.law(LawModels(level=CLOSED, loss=CORRELATIONS, regimes=SIPHON))
    head = (
        700.0
        + (
            by_closed_form(table_1_scene, 0.1).wall_pressure
            - by_closed_form(table_1_scene, 0.4).wall_pressure
        )
        / 1000
    )

    def excess(u: float) -> float:
        return (float(loss_at(table_1_scene, loss=CORRELATIONS, velocity=u).k) + 1) * u**2 / 2 - head

    exact = brentq(excess, 0.1, 60.0, xtol=1e-12)
    assert float(siphon.evaluate(fill_ratio=0.1, gas_pressure=7e5).velocity) == pytest.approx(exact, rel=1e-6)


def test_velocities_within_ten_and_one_per_cent(table_1_scene: Scene) -> None:
    hierarchy = velocity_hierarchy(LawBook(table_1_scene))
    rough, fine = choose(hierarchy, 0.1), choose(hierarchy, 1e-3)
    assert rough.fidelity.models["loss of the tube"] != CONSTANT
    assert fine.fidelity.models["level of a chamber"] == CLOSED
    assert fine.fidelity.models["flow over the siphon crest"] == REGIMES
    assert rough.cost < fine.cost


def test_numbers_by_hand(table_1_scene: Scene) -> None:
    found = {n.name: n.value for n in scene_numbers(table_1_scene)}
    omega = 10_000 * math.pi / 30
    assert found["R_Omega"] == pytest.approx(omega * 1.5e-3**2 / 1e-6)
    assert found["Ekman number"] == pytest.approx(1e-6 / (omega * 0.0445**2))
    assert found["priming ratio"] == pytest.approx(1000 * omega**2 * (0.0445**2 - 0.0315**2) / 2 / 7e5)
    assert found["filling time over valve-open time"] is None
    assert 4000 < (found["omega^2 a/g"] or 0.0) < 4700


def test_a_scene_without_gravity_has_no_number_for_it(table_1_scene: Scene) -> None:
    still = loop_models.Environment(shaft="horizontal", gravity=0.0)
    scene = dataclasses.replace(table_1_scene, environment=still)
    found = {n.name: n.value for n in scene_numbers(scene)}
    assert found["omega^2 a/g"] is None
    pressure, moment = chamber_hierarchies(scene)
    assert choose(pressure, 1e-6).fidelity.name == choose(moment, 1e-6).fidelity.name == "closed form"


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("to_crest", [False, True])
def test_the_velocity_under_a_head_has_that_head(table_1_scene: Scene, loss: str, to_crest: bool) -> None:
    """From creeping to turbulent flow; limit: round-off of a logarithm."""
    heads = np.geomspace(1e-4, 1e5, 301)
    u = velocity_under_head(table_1_scene, loss=loss, head=heads, to_crest=to_crest)
    assert np.all(np.diff(u) > 0)
    found = head_at(table_1_scene, loss=loss, velocity=u, to_crest=to_crest)
    np.testing.assert_allclose(found, heads, rtol=1e-13)
