"""k(u) for any tube: the "+1" held, one velocity per head, no jump, no NaN, honest about its ranges."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import pytest
from fluids.fittings import bend_rounded, entrance_sharp
from hypothesis import given
from hypothesis import strategies as st

import ringbalance
from ringbalance.physics.tube.local_losses import bend_loss, bend_uncertainty
from ringbalance.physics.tube.loss import MODEL_CAUSES, TubeLoss, model_parts, tube_loss, with_errors
from ringbalance.physics.tube.state import TubeState, tube_state
from ringbalance.scene.fitted import ModelError
from ringbalance.scene.models import Bend, Liquid, Scene, Tube
from ringbalance.scene.origins import InputUncertainty
from ringbalance.scene.uncertain import NORMAL_95
from scenes import with_tables

SCENE = cast("Scene", ringbalance.load_scene(ringbalance.bundled_scene("liquid_ring_paper")))
WATER = Liquid(
    name="custom",
    temperature=None,
    density=1000.0,
    kinematic_viscosity=1e-6,
    vapour_pressure=2339.0,
    dissolved_gas="saturated",
    density_uncertainty=0.001,
    viscosity_uncertainty=0.02,
    source="test",
)
TUBE = Tube(
    bore=1.5e-3,
    port_radius=44.5e-3,
    hump_radius=31.5e-3,
    hump_position=0.5,
    hump_shape="arc",
    hump_gas="vented",
    length=120e-3,
    roughness=1.5e-6,
    entrance="sharp",
    entrance_radius=0.0,
    bends=(Bend(angle=math.pi / 2, radius=3e-3), Bend(angle=math.pi / 2, radius=3e-3)),
    extra_loss=0.0,
    drag_coefficient=None,
)
OMEGA = 1047.2
VELOCITIES = np.geomspace(0.1, 20, 1200)


def loss(
    tube: Tube = TUBE,
    nu: float = 1e-6,
    omega: float = OMEGA,
    velocity: npt.ArrayLike = VELOCITIES,
    inputs: tuple[InputUncertainty, ...] = (),
) -> TubeLoss:
    liquid = dataclasses.replace(WATER, kinematic_viscosity=nu)
    rotor = dataclasses.replace(SCENE.rotor, speed=omega)
    return tube_loss(
        dataclasses.replace(SCENE, tube=tube, liquid=liquid, rotor=rotor, uncertainty=inputs), velocity
    )


tubes = st.builds(
    dataclasses.replace,
    st.just(TUBE),
    bore=st.floats(0.8e-3, 4e-3),
    length=st.floats(30e-3, 1.0),
    roughness=st.floats(0, 40e-6),
    entrance=st.sampled_from(["sharp", "rounded", "projecting"]),
    entrance_radius=st.floats(0, 2e-3),
    extra_loss=st.floats(0, 5),
    hump_position=st.floats(0.05, 0.95),
)
viscosities = st.floats(-7, -3.4).map(lambda e: 10.0**e)
speeds = st.sampled_from([0.0, 5.0, 100.0, 1047.2, 6000.0])


def test_terms_add_up_and_the_turbulent_exit_is_not_counted_twice() -> None:
    found = loss(omega=0.0, velocity=np.array([20.0]), nu=1e-7)
    np.testing.assert_allclose(sum(found.terms.values()), found.k.value, rtol=1e-14)
    assert float(found.terms["exit"][0]) < 1e-3
    assert float(found.terms["entrance"][0]) == pytest.approx(entrance_sharp(), abs=1e-3)


def test_both_laminar_ends_together_cost_about_2_3_with_the_plus_one() -> None:
    found = loss(dataclasses.replace(TUBE, bends=()), omega=0.0, velocity=1000 * 1e-6 / 1.5e-3)
    ends = float(found.terms["entrance"] + found.terms["exit"])
    assert ends == pytest.approx(1.3, abs=0.05)
    assert float(found.state.kinetic_factor) == pytest.approx(2, abs=0.05)


def test_head_of_a_long_laminar_tube_is_hagen_poiseuille() -> None:
    tube = dataclasses.replace(TUBE, bends=(), length=10.0)
    u, nu = 0.2, 1e-5
    found = loss(tube, nu=nu, omega=0.0, velocity=u)
    head = float(found.k.value + 1) * u**2 / 2
    assert head == pytest.approx(32 * nu * u * 10.0 / tube.bore**2, rel=1e-3)


def test_arc_friction_is_counted_once() -> None:
    tube = dataclasses.replace(TUBE, bends=(Bend(angle=math.pi, radius=20e-3),), length=math.pi * 20e-3)
    found = loss(tube, omega=0.0)
    np.testing.assert_allclose(found.terms["friction"], 0.0, atol=1e-12)
    re, tight = float(found.reynolds[0]), tube.bore / 40e-3
    arc = 64 / re * math.pi * 20e-3 / tube.bore
    dean = re**2 * tight
    excess = 1.25 * 2 * math.sqrt(tight) / 0.5 * dean / (dean + 28.0**2)
    assert float(found.terms["bends"][0]) == pytest.approx(arc + excess, rel=1e-6)


def _bend(**numbers: Any) -> tuple[float, float]:
    return float(bend_loss(**numbers)), float(bend_uncertainty(**numbers))


@pytest.mark.parametrize("angle", [1.0, 30.0, 90.0, 135.0, 180.0])
@pytest.mark.parametrize("radius", [0.5, 1.0, 2.0, 20.0])
def test_a_turbulent_bend_is_the_librarys(angle: float, radius: float) -> None:
    """The array form of its formula, over all of its range."""
    friction, bore = np.geomspace(0.008, 0.1, 9), 1.5e-3
    bend = Bend(angle=math.radians(angle), radius=radius * bore)
    numbers: Any = {"bend": bend, "bore": bore, "friction_factor": friction, "reynolds": 1e9}
    expected = [bend_rounded(Di=bore, angle=angle, rc=radius * bore, fd=f) for f in friction]
    np.testing.assert_allclose(bend_loss(**numbers), expected, rtol=1e-9)
    np.testing.assert_allclose(bend_uncertainty(**numbers), 0.25 * np.array(expected), rtol=1e-9)


@pytest.mark.parametrize("turns", [1.5, 2.0, 5.0])
def test_a_turbulent_bend_beyond_half_a_turn_costs_in_proportion(turns: float) -> None:
    """Two loops cost no less than one, and the sine of half the angle is never below zero."""
    numbers = {"bore": 1.5e-3, "friction_factor": 0.02, "reynolds": 1e6}
    half, _ = _bend(bend=Bend(angle=math.pi, radius=3e-3), **numbers)
    more, width = _bend(bend=Bend(angle=turns * math.pi, radius=3e-3), **numbers)
    assert more == pytest.approx(turns * half, rel=1e-6)
    assert width == pytest.approx(0.25 * more, rel=1e-6)


@pytest.mark.parametrize(("reynolds", "excess"), [(20, 0.18), (50, 0.55), (100, 0.94), (200, 1.14)])
def test_a_laminar_bend_at_rest_is_that_of_the_three_dimensional_solution(
    reynolds: float, excess: float
) -> None:
    f = 64 / reynolds
    bend = Bend(angle=math.pi / 2, radius=2.0)
    k, width = _bend(bend=bend, bore=1.0, friction_factor=f, reynolds=reynolds)
    assert float(k) - f * math.pi == pytest.approx(excess, abs=0.05)
    assert float(width) > 0.05


@pytest.mark.parametrize("found", [-0.34, 0.30])
def test_the_half_width_of_a_turning_bend_holds_both_senses(found: float) -> None:
    """Re 200, R 118, by the three-dimensional solution, against and with the rotation."""
    bend = Bend(angle=math.pi / 2, radius=2.0)
    k, width = _bend(bend=bend, bore=1.0, friction_factor=0.32, reynolds=200.0, rotation_reynolds=118.0)
    assert abs(float(k) - 0.32 * math.pi - found) < float(width)


@given(tube=tubes, nu=viscosities, omega=speeds)
def test_uncertainty_is_finite_positive_and_made_of_its_parts(tube: Tube, nu: float, omega: float) -> None:
    found = loss(tube, nu=nu, omega=omega, velocity=np.geomspace(1e-6, 1e4, 60))
    assert np.all(np.isfinite(found.k.uncertainty) & (found.k.uncertainty > 0))
    combined = np.sqrt(sum(p**2 for p in found.uncertainty_parts.values()))
    np.testing.assert_allclose(found.k.uncertainty, combined, rtol=1e-12)
    assert not found.in_range[0]
    assert not found.in_range[-1]
    upstream = found.state.upstream_loss(tube.hump_position)
    assert np.all((upstream >= 0) & (upstream <= found.k.value + 1e-9))


def test_rotation_costs_far_more_than_friction_in_the_papers_tube_when_slow() -> None:
    found = loss(velocity=np.array([0.5, 15.0]))
    assert found.terms["rotation"][0] > 3 * found.terms["friction"][0]
    assert found.terms["rotation"][1] < 0.5 * found.terms["friction"][1]
    assert list(found.flow_state) == ["laminar", "turbulent"]


def test_a_prescribed_k_holds_at_every_velocity() -> None:
    found = loss(dataclasses.replace(TUBE, drag_coefficient=50.0))
    assert np.all(found.k.value == 50.0)
    assert set(found.terms) == {"decree"}
    assert np.all(found.state.upstream_loss(0.5) == 25.0)
    assert np.all(found.k.uncertainty == 0.0)
    assert np.all(found.in_range)


def test_input_uncertainty_is_the_change_of_k() -> None:
    tube = dataclasses.replace(TUBE, bends=(), length=10.0)
    inputs = (InputUncertainty(quantity="bore", half_width=0.02, relative=True),)
    found = loss(tube, nu=1e-4, omega=0.0, velocity=1.0, inputs=inputs)
    # Laminar: k is L/d * 64 nu/(u d), so 2 % of the bore is 4 % of k.
    assert float(found.uncertainty_parts["input: bore"] / found.k.value) == pytest.approx(0.04, abs=2e-3)
    assert float(found.uncertainty_parts["input: kinematic_viscosity"] / found.k.value) == pytest.approx(
        0.02, abs=1e-3
    )


def test_upstream_loss_knows_where_the_hump_lies() -> None:
    found = loss()
    between = found.state.upstream_loss(0.9) - found.state.upstream_loss(0.1)
    along = 0.8 * (found.terms["friction"] + found.terms["rotation"])
    np.testing.assert_allclose(between, along, rtol=1e-12)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5])
def test_each_leg_has_half_of_the_bends_from_either_end(count: int) -> None:
    """What lies before the crest from one end and from the other is all of every bend."""
    state = loss(velocity=5.0).state
    losses = tuple(np.array(2.0**i) for i in range(count))

    def before(bends: tuple[np.ndarray, ...]) -> float:
        return float(dataclasses.replace(state, bends=bends).upstream_loss(0.0) - state.terms["entrance"])

    assert before(losses) + before(losses[::-1]) == pytest.approx(2.0**count - 1)
    whole, half = count // 2, count % 2
    assert before(losses) == pytest.approx(2.0**whole - 1 + half * 2.0**whole / 2)


@pytest.mark.parametrize("velocity", [0.0, -1.0, np.nan, np.inf])
def test_velocity_must_be_positive_and_finite(velocity: float) -> None:
    with pytest.raises(ValueError, match="velocity"):
        loss(velocity=velocity)


def test_arcs_longer_than_the_tube_are_refused() -> None:
    with pytest.raises(ValueError, match="arcs"):
        loss(dataclasses.replace(TUBE, length=5e-3))


def test_the_interval_of_k_at_low_velocity_is_made_of_what_the_page_says(paper_scene: Scene) -> None:
    scene = paper_scene
    loss = tube_loss(dataclasses.replace(scene, uncertainty=()), np.array([3.0]))
    share = {name: float(part[0] / loss.k.value[0]) for name, part in loss.uncertainty_parts.items()}
    assert float(loss.k.uncertainty[0] / loss.k.value[0]) == pytest.approx(0.23, abs=0.005)
    told = {"bends": 0.16, "rotation model": 0.11, "ends": 0.10, "rotation entry": 0.06}
    assert {name: share[name] for name in told} == pytest.approx(told, abs=0.005)


@st.composite
def any_tubes(draw: st.DrawFn) -> Tube:
    """Bores of 0.1 to 20 mm, lengths of 10 to 1000 mm, roughness up to 5 %, bends that fit."""
    bore, length = 10 ** draw(st.floats(-4, -1.7)), 10 ** draw(st.floats(-2, 0))
    bends, left = [], length
    for _ in range(draw(st.integers(0, 4))):
        bend = Bend(angle=draw(st.floats(0.1, math.pi)), radius=bore * draw(st.floats(0.5, 6)))
        if bend.angle * bend.radius <= left:
            bends.append(bend)
            left -= bend.angle * bend.radius
    return dataclasses.replace(
        TUBE,
        bore=bore,
        hump_position=draw(st.floats(0.02, 0.98)),
        length=length,
        roughness=bore * draw(st.one_of(st.just(0.0), st.floats(0, 0.05))),
        entrance=draw(st.sampled_from(["sharp", "rounded", "projecting"])),
        entrance_radius=bore * draw(st.floats(0, 1)),
        bends=tuple(bends),
        extra_loss=draw(st.one_of(st.just(0.0), st.floats(0, 20))),
    )


ANY_VISCOSITY = st.floats(-7, -2).map(lambda e: 10.0**e)
ANY_SPEED = st.floats(2, 5).map(lambda e: 10.0**e * 2 * math.pi / 60)


def slopes(head: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    return np.asarray(np.diff(np.log(head * velocity**2)) / np.diff(np.log(velocity)))


@given(tube=any_tubes(), nu=ANY_VISCOSITY, omega=ANY_SPEED)
def test_any_tube_has_one_velocity_for_a_head_and_no_jump(tube: Tube, nu: float, omega: float) -> None:
    found = loss(tube, nu, omega, np.geomspace(1e-5, 1e3, 1500))
    assert np.all(np.isfinite(found.k.value))
    assert np.all(found.k.value > -1)
    assert np.all(np.isfinite(found.k.uncertainty) & (found.k.uncertainty > 0))
    upstream = found.state.upstream_loss(tube.hump_position)
    assert np.all(np.isfinite(upstream))
    # The head between chambers and that up to the crest: no slower than linear in u, no faster than u^4.
    for head in (found.k.value + 1, found.state.kinetic_factor + upstream):
        slope = slopes(head, found.velocity)
        assert np.min(slope) > 0.9
        assert np.max(slope) < 4.0
    # A jump would show as a slope that grows without bound on a finer grid.
    slope = slopes(found.k.value + 1, found.velocity)
    at = int(np.argmax(np.abs(np.diff(slope))))
    near = np.geomspace(found.velocity[at], found.velocity[at + 2], 200)
    fine = slopes(loss(tube, nu, omega, near).k.value + 1, near)
    assert np.max(np.abs(fine)) < 1.05 * np.max(np.abs(slope[at : at + 2])) + 0.1


@given(tube=any_tubes(), nu=ANY_VISCOSITY, omega=ANY_SPEED)
def test_ranges_are_reported_wherever_a_source_ends(tube: Tube, nu: float, omega: float) -> None:
    found = loss(tube, nu, omega, np.geomspace(1e-5, 1e3, 1500))
    re, rotation = found.reynolds, found.rotation_reynolds
    u = found.velocity
    outside = (u < 0.0999) | (u > 20.01) | (re > 1.001e6)
    outside |= (found.flow_state == "laminar") & ((re * rotation > 1.001e7) | (rotation > 1.001e5))
    if tube.bends:
        outside |= found.flow_state == "laminar"
    assert not np.any(found.in_range & outside)
    assert found.k.status.ok == bool(np.all(found.in_range))
    # Far outside the laminar table the answer is wide.
    far = (found.flow_state == "laminar") & (re * rotation > 1e8)
    friction = found.terms["friction"] + found.terms["rotation"]
    assert np.all(found.k.uncertainty[far] > 0.2 * friction[far])


FOUR_VELOCITIES = np.array([1.0, 3.0, 8.0, 20.0])


def erring(scene: Scene, *errors: tuple[str, float, float]) -> tuple[Tube, TubeState]:
    supposed = tuple(
        ModelError.named(f"model: {cause}, {part}", size)
        for cause, *both in errors
        for part, size in zip(("even", "odd"), both, strict=True)
    )
    tube = dataclasses.replace(scene.tube, model_errors=supposed)
    state = tube_state(scene, FOUR_VELOCITIES, tube=tube)
    return tube, with_errors(tube=tube, state=state)


@pytest.mark.parametrize("cause", MODEL_CAUSES)
def test_both_parts_together_are_the_stated_uncertainty_at_every_velocity(
    paper_scene: Scene, cause: str
) -> None:
    """Independent parts of one standard deviation each: e^2 = U^2/1.96^2 (cos^2 + sin^2)."""
    tube, right = erring(paper_scene)
    sides = [erring(paper_scene, (cause, n, 1 - n))[1].k - right.k for n in (1.0, 0.0)]
    stated = model_parts(tube=tube, state=right)[cause] / NORMAL_95
    assert np.hypot(*sides) == pytest.approx(stated, rel=1e-9)
    angle = np.log(right.reynolds)
    assert sides[0] == pytest.approx(stated * np.cos(angle), abs=1e-12)


def test_no_error_makes_a_loss_a_gain(paper_scene: Scene) -> None:
    """Friction of a rough bore of 22 um is known to 140 % near Re 2400; a tenth of k is left at least."""
    fine = dataclasses.replace(paper_scene.tube, bore=22e-6, length=62e-3, bends=())
    scene = dataclasses.replace(paper_scene, tube=fine)
    right = tube_state(scene, np.geomspace(0.1, 200.0, 400))
    width = model_parts(tube=fine, state=right)["friction correlation"]
    assert np.max(width / right.k) > 1.3
    shares = []
    for size in (-3.0, 3.0):
        error = ModelError.named("model: friction correlation, odd", size)
        wrong = with_errors(tube=dataclasses.replace(fine, model_errors=(error,)), state=right)
        shares.append(wrong.k / right.k)
    assert np.min(shares) == pytest.approx(0.1)
    assert np.max(shares) > 2.0


def test_an_error_of_bends_stays_with_the_bends(paper_scene: Scene) -> None:
    """Of two bends alike one lies before the crest, and half of the error with it."""
    (_, right), (_, wrong) = erring(paper_scene), erring(paper_scene, ("bends", 1.0, 0.0))
    assert sum(wrong.bends) == pytest.approx(wrong.terms["bends"])
    before = wrong.upstream_loss(0.5) - right.upstream_loss(0.5)
    assert before == pytest.approx((wrong.k - right.k) / 2)


def test_a_prescribed_loss_has_no_model_to_err(paper_scene: Scene) -> None:
    prescribed = with_tables(paper_scene, tube={"drag_coefficient": 50.0})
    errors = [(cause, 1.0, 1.0) for cause in MODEL_CAUSES]
    assert np.array_equal(erring(prescribed, *errors)[1].k, np.full(4, 50.0))
