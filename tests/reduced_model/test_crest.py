"""The siphon crest as built, against the energy equation: arc, gas in the cavity, spilling and clearing."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import fsolve, minimize_scalar

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.calibration import calibrated_model, chamber_and_law
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.pressure_profile import HumpProfile
from ringbalance.reduced_model.tube.heads import roots_of
from ringbalance.reduced_model.tube.path import crest_span, path_radius, share_at_radius
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import with_tolerance
from ringbalance.scene.origins import InputUncertainty
from scenes import with_tables

AMBIENT, VAPOUR, DENSITY = 101325.0, 2339.0, 1000.0
PORT, CREST, BORE, LENGTH = 44.5e-3, 31.5e-3, 1.5e-3, 120e-3
FLOWS = (Regime.SIPHON, Regime.SEPARATED, Regime.UNDECIDED)


@pytest.fixture(scope="module")
def law(table_1_scene: Scene) -> CalibratedLaw:
    """Arc and dissolved gas; the finest models."""
    return calibrated_model(with_tolerance(table_1_scene, "0")).flow  # type: ignore[return-value]


def changed(scene: Scene, *, viscosity: float | None = None, **tube: Any) -> Scene:
    liquid = dataclasses.replace(
        scene.liquid, kinematic_viscosity=viscosity or scene.liquid.kinematic_viscosity
    )
    return with_tables(scene, liquid=liquid, tube=tube)


def law_of(scene: Scene) -> CalibratedLaw:
    return chamber_and_law(scene)[1]


@pytest.fixture(scope="module")
def viscous(table_1_scene: Scene) -> CalibratedLaw:
    """100 cSt: slower than the velocity that carries gas out."""
    return law_of(changed(table_1_scene, viscosity=1e-4))


def by_hand(scene: Scene, *, cavity: float, fill: float, gas: float, law: CalibratedLaw) -> float:
    """Velocity at which the lowest pressure anywhere on the arc-shaped path is that of the cavity.

    Taut string about the crest's circle, stretched evenly to the tube's length; the pressure is followed
    along it place by place.
    """
    tangent = math.acos(CREST / PORT)
    leg, arc = PORT * math.sin(tangent), CREST * (math.pi - 2 * tangent)
    taut = 2 * leg + arc
    square = scene.rotor.speed**2

    def lowest(u: float) -> float:
        loss = tube_loss(scene, u)
        terms = {name: float(k) for name, k in loss.terms.items()}
        spread = terms["friction"] + terms["rotation"] + terms["extra"]

        def pressure(string: float) -> float:
            """At a length of the string behind the crest's middle, behind the first bend only."""
            beyond = max(string - arc / 2, 0.0)
            radius = math.hypot(CREST, beyond)
            lost = float(loss.state.kinetic_factor) + terms["entrance"] + terms["bends"] / 2
            lost += spread * (taut / 2 + string) / taut
            column = DENSITY * square * (PORT**2 - radius**2) / 2
            return gas + float(law.hydrostatic_pressure(fill)) - column - lost * DENSITY * u * u / 2

        found = minimize_scalar(pressure, bounds=(0.0, taut / 4), method="bounded", options={"xatol": 1e-9})
        return float(found.fun)

    return float(fsolve(lambda u: lowest(float(u[0])) - cavity, [12.0], xtol=1e-10)[0])


@pytest.mark.parametrize("released", [0.0, 0.5, 1.0])
def test_velocity_over_the_arc_for_each_cavity_pressure(
    table_1_scene: Scene, law: CalibratedLaw, released: float
) -> None:
    """The bounds of the interval and its middle; the whole interval lies within the stated uncertainty."""
    vapour = VAPOUR - AMBIENT
    expected = by_hand(table_1_scene, cavity=(1 - released) * vapour, fill=0.25, gas=0.7e6, law=law)
    each = with_tables(law, path={"released": released})
    flow = each.evaluate(fill_ratio=0.25, gas_pressure=0.7e6)
    assert float(flow.velocity) == pytest.approx(expected, rel=2e-7)
    middle = law.evaluate(fill_ratio=0.25, gas_pressure=0.7e6)
    assert abs(expected - float(middle.velocity)) < float(middle.uncertainty)


def test_the_arc_takes_44_percent_of_the_shortest_path(table_1_scene: Scene) -> None:
    tangent = math.acos(CREST / PORT)
    arc = CREST * (math.pi - 2 * tangent)
    start, end = crest_span(table_1_scene.tube)
    assert end - start == pytest.approx(arc / (arc + 2 * PORT * math.sin(tangent)))
    assert (round(end - start, 2), round(end, 2)) == (0.44, 0.72)
    shares = np.linspace(0, 1, 2001)
    radius = path_radius(tube=table_1_scene.tube, share=shares)
    assert np.min(radius) == CREST
    assert (radius[0], radius[-1]) == (pytest.approx(PORT), pytest.approx(PORT))
    # Each leg is a straight line in the plane across the shaft: x = r cos, y = r sin from the tangent point.
    leg = shares > end
    along = np.sqrt(radius[leg] ** 2 - CREST**2)
    np.testing.assert_allclose(np.diff(along), np.diff(along)[0], rtol=1e-9)
    for far in (False, True):
        share = share_at_radius(tube=table_1_scene.tube, radius=38e-3, far_leg=far)
        assert float(path_radius(tube=table_1_scene.tube, share=share)) == pytest.approx(38e-3, rel=1e-12)


def test_a_short_arc_tends_to_the_point(point_scene: Scene) -> None:
    """A crest just inside the ports has hardly any straight leg; one near the shaft hardly any arc."""
    scene = changed(point_scene, hump_radius=1e-4)
    pair = [law_of(changed(scene, hump_shape=shape)).heads.hump for shape in ("point", "arc")]
    lost = [roots_of(table, [0.5, 1.0]) ** 8 for table in pair if table is not None]
    np.testing.assert_allclose(lost[1] / lost[0], 1.0, rtol=2e-3)


def test_pressure_along_the_path_falls_over_the_arc(table_1_scene: Scene, law: CalibratedLaw) -> None:
    found = HumpProfile.of(scene=table_1_scene, law=law, fill_ratio=0.1, gas_pressure=1.5e6)
    start, end = (share * LENGTH for share in crest_span(table_1_scene.tube))
    on_arc = (found.path > start) & (found.path < end)
    assert np.all(found.radius[on_arc] == CREST)
    assert np.all(np.diff(found.pressure[on_arc]) < 0)
    assert found.hump_path == pytest.approx(end)
    assert found.hump_pressure is not None
    assert found.cavity_pressure is not None
    # Up to the bend of the far leg, of which the scene does not say where it lies.
    lowest = np.min(found.pressure[found.path < 0.85 * LENGTH])
    assert found.cavitation_margin == pytest.approx(lowest - found.cavity_pressure, abs=500)
    assert lowest < found.hump_pressure


def test_the_velocity_has_no_jump_at_priming(law: CalibratedLaw, viscous: CalibratedLaw) -> None:
    """From zero at the priming pressure, with no step larger than a smooth curve's, and never falling."""
    for each in (law, viscous):
        p = np.linspace(0.25e6, 1.2e6, 20001)
        velocity = each.evaluate(fill_ratio=0.25, gas_pressure=p).velocity
        steps = np.diff(velocity)
        assert np.all(steps >= 0)
        first = int(np.flatnonzero(velocity)[0])
        # Just above the threshold u grows like the root of the excess, steps of at most sqrt(2 dp/rho).
        assert velocity[first] <= math.sqrt(2 * (p[1] - p[0]) / DENSITY)
        assert np.max(steps) <= math.sqrt(2 * (p[1] - p[0]) / DENSITY)


@given(x=st.floats(0.02, 0.48), p=st.floats(1e5, 2e6), primed=st.booleans())
def test_velocity_is_continuous_in_fill(law: CalibratedLaw, x: float, p: float, primed: bool) -> None:
    """But where a column that is primed separates at rest, which is the only jump left."""
    near = law.evaluate(fill_ratio=[x, x + 1e-9], gas_pressure=p, primed=primed).velocity
    if np.all(near > 0):
        assert abs(near[1] - near[0]) < 1e-3 * (near[0] + 1)


def test_slow_liquid_spills_over_gas_and_fast_liquid_carries_it_out(
    law: CalibratedLaw, viscous: CalibratedLaw, table_1_scene: Scene
) -> None:
    froude = table_1_scene.rotor.speed * math.sqrt(CREST * BORE)
    assert law.path.froude_velocity == pytest.approx(froude)
    for each, runs_full in ((law, True), (viscous, False)):
        at = {"fill_ratio": 0.3, "gas_pressure": 0.7e6}
        empty, full = (each.evaluate(**at, primed=primed) for primed in (False, True))
        spill = with_tables(each, path={"released": 1.0})
        gas = float(spill.evaluate(**at, primed=True).velocity)
        assert bool(empty.primed) is runs_full
        if runs_full:
            assert gas > 1.1 * froude
            assert float(empty.velocity) == float(full.velocity)
        else:
            # With gas at the vented chamber's pressure over the crest, or full where that is slower.
            assert float(full.velocity) < 0.6 * froude
            assert float(empty.velocity) == pytest.approx(gas, rel=1e-12)


def test_the_regime_cannot_be_told_within_its_uncertainty(table_1_scene: Scene, law: CalibratedLaw) -> None:
    """A scan over the pressure passes separated, undecided, siphon, in this order; the label says it."""
    p = np.linspace(0.5e6, 3e6, 2001)
    regimes = law.evaluate(fill_ratio=0.25, gas_pressure=p, primed=True).regime
    order = [Regime(int(r)) for r in regimes[np.flatnonzero(np.diff(regimes, prepend=-1))]]
    assert [r for r in order if r in FLOWS] == [Regime.SEPARATED, Regime.UNDECIDED, Regime.SIPHON]
    assert Regime.UNDECIDED.label == "undecided"
    for i in np.linspace(0, p.size - 1, 60).astype(int):
        found = HumpProfile.of(
            scene=table_1_scene, law=law, fill_ratio=0.25, gas_pressure=float(p[i]), primed=True, points=3
        )
        margin, width = found.cavitation_margin, found.cavitation_margin_uncertainty
        assert margin is not None
        assert width is not None
        if abs(margin) > 1.5 * width:
            assert found.regime is (Regime.SIPHON if margin > 0 else Regime.SEPARATED)
        if abs(margin) < 0.5 * width:
            assert found.regime is Regime.UNDECIDED


def test_place_and_radius_of_the_crest_widen_the_velocity(table_1_scene: Scene, law: CalibratedLaw) -> None:
    """By what the velocity of a scene with the crest elsewhere differs."""
    at = {"fill_ratio": 0.25, "gas_pressure": 0.7e6, "primed": True}
    plain = law.evaluate(**at)
    for quantity, width in (("hump_position", 0.05), ("hump_radius", 0.1e-3)):
        entry = InputUncertainty(quantity=quantity, half_width=width, relative=False)
        stated = law_of(dataclasses.replace(table_1_scene, uncertainty=(entry,))).evaluate(**at)
        moved = law_of(
            changed(table_1_scene, **{quantity: getattr(table_1_scene.tube, quantity) + width})
        ).evaluate(**at)
        added = math.sqrt(float(stated.uncertainty) ** 2 - float(plain.uncertainty) ** 2)
        assert added == pytest.approx(abs(float(moved.velocity - plain.velocity)), rel=0.15)
