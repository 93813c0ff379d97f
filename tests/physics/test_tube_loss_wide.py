"""k(u) for any tube that a scene may hold: one velocity per head, no jump, no NaN, honest ranges."""

from __future__ import annotations

import cProfile
import dataclasses
import math
from typing import cast

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ringbalance
from ringbalance.physics.tube.loss import TubeLoss, tube_loss
from ringbalance.scene.models import Bend, Liquid, Scene, Tube

VELOCITIES = np.geomspace(1e-5, 1e3, 1500)
SCENE = cast("Scene", ringbalance.load_scene(ringbalance.bundled_scene("liquid_ring_paper")))


@st.composite
def tubes(draw: st.DrawFn) -> Tube:
    """Bores of 0.1 to 20 mm, lengths of 10 to 1000 mm, roughness up to 5 %, bends that fit."""
    bore, length = 10 ** draw(st.floats(-4, -1.7)), 10 ** draw(st.floats(-2, 0))
    bends, left = [], length
    for _ in range(draw(st.integers(0, 4))):
        bend = Bend(angle=draw(st.floats(0.1, math.pi)), radius=bore * draw(st.floats(0.5, 6)))
        if bend.angle * bend.radius <= left:
            bends.append(bend)
            left -= bend.angle * bend.radius
    return Tube(
        bore=bore,
        port_radius=44.5e-3,
        hump_radius=31.5e-3,
        hump_position=draw(st.floats(0.02, 0.98)),
        hump_shape="arc",
        hump_gas="vented",
        length=length,
        roughness=bore * draw(st.one_of(st.just(0.0), st.floats(0, 0.05))),
        entrance=draw(st.sampled_from(["sharp", "rounded", "projecting"])),
        entrance_radius=bore * draw(st.floats(0, 1)),
        bends=tuple(bends),
        extra_loss=draw(st.one_of(st.just(0.0), st.floats(0, 20))),
        drag_coefficient=None,
    )


viscosities = st.floats(-7, -2).map(lambda e: 10.0**e)
speeds = st.floats(2, 5).map(lambda e: 10.0**e * 2 * math.pi / 60)


def loss(tube: Tube, nu: float, omega: float, velocity: npt.ArrayLike = VELOCITIES) -> TubeLoss:
    liquid = Liquid(
        name="custom",
        temperature=None,
        density=1000.0,
        kinematic_viscosity=nu,
        vapour_pressure=2339.0,
        dissolved_gas="saturated",
        density_uncertainty=0.001,
        viscosity_uncertainty=0.02,
        source="test",
    )
    rotor = dataclasses.replace(SCENE.rotor, speed=omega)
    scene = dataclasses.replace(SCENE, tube=tube, liquid=liquid, rotor=rotor, uncertainty=())
    return tube_loss(scene, velocity)


def slopes(head: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    return np.asarray(np.diff(np.log(head * velocity**2)) / np.diff(np.log(velocity)))


@given(tube=tubes(), nu=viscosities, omega=speeds)
def test_any_tube_has_one_velocity_for_a_head_and_no_jump(tube: Tube, nu: float, omega: float) -> None:
    found = loss(tube, nu, omega)
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


@given(tube=tubes(), nu=viscosities, omega=speeds)
def test_ranges_are_reported_wherever_a_source_ends(tube: Tube, nu: float, omega: float) -> None:
    found = loss(tube, nu, omega)
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


def test_cost_does_not_grow_by_calls() -> None:
    """Vectorised: a thousand times as many velocities, the same calls."""
    tube = dataclasses.replace(TUBE, bends=(Bend(angle=1.5, radius=3e-3),))
    calls = []
    loss(tube, 1e-6, 1047.2, np.geomspace(0.1, 20, 20))  # fills caches, of numpy and importlib, too
    for count in (20, 20000):
        velocity = np.geomspace(0.1, 20, count)
        profile = cProfile.Profile()
        profile.enable()
        loss(tube, 1e-6, 1047.2, velocity)
        profile.disable()
        calls.append(sum(entry.callcount for entry in profile.getstats()))
    assert calls[1] == pytest.approx(calls[0], rel=0.02)


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
    bends=(),
    extra_loss=0.0,
    drag_coefficient=None,
)


def test_scalar_and_array_agree() -> None:
    velocity = np.geomspace(0.1, 20, 7)
    together = loss(TUBE, 1e-6, 1047.2, velocity)
    for i, u in enumerate(velocity):
        alone = loss(TUBE, 1e-6, 1047.2, u)
        assert float(alone.k.value) == pytest.approx(float(together.k.value[i]), rel=1e-13)
