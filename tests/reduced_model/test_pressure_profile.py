"""Pressure along the path: energy balance at every landmark, regimes, mirror images, and Eq. 18 misread."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration, calibrate_chamber
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.making import calibrated_law, side_laws
from ringbalance.reduced_model.law.sides import half_widths_of
from ringbalance.reduced_model.pressure_profile import HumpProfile
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.reports.pages.drag_map import read_by_eq_18
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from scenes import with_tables

AMBIENT, VAPOUR, DENSITY = 101325.0, 2339.0, 1000.0


@pytest.fixture(scope="module")
def law(point_calibration: Calibration) -> CalibratedLaw:
    return point_calibration.flow_law


def variant(scene: Scene, **tube: object) -> tuple[Scene, CalibratedLaw]:
    """The paper's disc with another tube; the chamber is the same."""
    changed = with_tables(scene, tube=tube)
    return changed, calibrated_law(scene=changed, chamber=_chamber(scene), heads=TubeHeads.of(changed))


_CHAMBERS: dict[str, ChamberCalibration] = {}


def _chamber(scene: Scene) -> ChamberCalibration:
    return _CHAMBERS.setdefault(scene.sha256, calibrate_chamber(scene))


def column(scene: Scene, inner: float, outer: float) -> float:
    """rho omega^2 (outer^2 - inner^2)/2."""
    return scene.liquid.density * scene.rotor.speed**2 * (outer**2 - inner**2) / 2


def test_siphon_agrees_with_the_energy_balance_at_hump_and_ends(
    point_scene: Scene, law: CalibratedLaw
) -> None:
    found = HumpProfile.of(scene=point_scene, law=law, fill_ratio=0.1, gas_pressure=0.9e6)
    assert found.regime is Regime.SIPHON
    assert np.all(found.full)
    loss = tube_loss(point_scene, found.velocity)
    head = DENSITY * found.velocity**2 / 2
    start = 0.9e6 + float(law.hydrostatic_pressure(0.1))
    before = float(loss.state.kinetic_factor + loss.state.upstream_loss(0.5))
    expected = start - column(point_scene, 31.5e-3, 44.5e-3) - head * before
    assert found.hump_pressure == pytest.approx(expected, rel=1e-9)
    assert found.pressure[0] == pytest.approx(start, rel=1e-12)
    assert found.pressure[-1] == pytest.approx(float(law.hydrostatic_pressure(0.4)), rel=1e-7)
    assert found.hump_path == pytest.approx(0.06)
    assert found.radius[np.argmin(np.abs(found.path - 0.06))] == pytest.approx(31.5e-3)
    assert found.cavitation_margin == pytest.approx(expected + AMBIENT - VAPOUR, rel=1e-6)


def test_drops_at_ends_and_bends_and_the_even_slope_between(point_scene: Scene, law: CalibratedLaw) -> None:
    found = HumpProfile.of(scene=point_scene, law=law, fill_ratio=0.1, gas_pressure=0.9e6)
    loss = tube_loss(point_scene, found.velocity)
    terms = {name: float(term) for name, term in loss.terms.items()}
    alpha = float(loss.state.kinetic_factor)
    head = DENSITY * found.velocity**2 / 2
    reduced = (
        found.pressure - DENSITY * point_scene.rotor.speed**2 * (found.radius**2 - 44.5e-3**2) / 2
    ) / head
    twice = np.flatnonzero(np.diff(found.path) == 0)
    np.testing.assert_allclose(found.path[twice], [0.0, 0.03, 0.09, 0.12])
    drops = -np.diff(reduced)[twice]
    np.testing.assert_allclose(drops[0], terms["entrance"] + alpha, rtol=1e-9)
    np.testing.assert_allclose(drops[1:3], terms["bends"] / 2, rtol=1e-9)
    np.testing.assert_allclose(drops[3], terms["exit"] + 1 - alpha, atol=1e-9)
    slopes = np.diff(reduced) / np.where(np.diff(found.path) > 0, np.diff(found.path), 1.0)
    even = np.delete(slopes, twice)
    np.testing.assert_allclose(even, -(terms["friction"] + terms["rotation"]) / 0.12, rtol=1e-6)


def test_separated_tube_is_full_again_where_the_opposite_chamber_holds_the_column(
    point_scene: Scene, law: CalibratedLaw
) -> None:
    found = HumpProfile.of(scene=point_scene, law=law, fill_ratio=0.4, gas_pressure=0.7e6)
    assert found.regime is Regime.SEPARATED
    assert found.hump_pressure == pytest.approx(VAPOUR - AMBIENT, rel=1e-6)
    assert found.cavitation_margin is not None
    assert found.cavitation_margin < 0
    empty = ~found.full
    np.testing.assert_allclose(found.pressure[empty], VAPOUR - AMBIENT)
    assert np.all(np.diff(np.flatnonzero(empty)) == 1)
    assert found.path[empty][0] == pytest.approx(0.06)
    # On both sides of either surface of the cavity the pressure is the same.
    for i in np.flatnonzero(np.diff(found.full)):
        assert found.pressure[i] == pytest.approx(found.pressure[i + 1], abs=1.0)
    # The column that is left, by hand: friction and rotation of the rest of the tube, no bend, exit.
    share = found.path[empty][-1] / 0.12
    assert share > 0.75
    loss = tube_loss(point_scene, found.velocity)
    along = float(loss.terms["friction"] + loss.terms["rotation"]) * (1 - share)
    lost = along + float(loss.terms["exit"]) + 1 - float(loss.state.kinetic_factor)
    radius = 31.5e-3 + (44.5e-3 - 31.5e-3) * (share - 0.5) / 0.5
    held = float(law.hydrostatic_pressure(0.1)) - column(point_scene, radius, 44.5e-3)
    assert held + lost * DENSITY * found.velocity**2 / 2 == pytest.approx(VAPOUR - AMBIENT, abs=5.0)


def test_blocked_legs_stand_at_the_chambers_levels(point_scene: Scene, law: CalibratedLaw) -> None:
    found = HumpProfile.of(scene=point_scene, law=law, fill_ratio=0.25, gas_pressure=0.0)
    assert found.regime is Regime.BLOCKED
    first, second = np.flatnonzero(np.diff(found.full))
    surface = np.sqrt(
        44.5e-3**2 - 2 * float(law.hydrostatic_pressure(0.25)) / DENSITY / point_scene.rotor.speed**2
    )
    np.testing.assert_allclose(found.radius[[first, second]], surface, rtol=1e-9)
    np.testing.assert_allclose(found.pressure[~found.full], 0.0)
    assert found.hump_pressure == 0.0


def test_trapped_gas_obeys_boyle_or_leaves_at_the_port(point_scene: Scene) -> None:
    scene, law = variant(point_scene, hump_gas="trapped")
    before, after = (
        HumpProfile.of(scene=scene, law=law, fill_ratio=0.25, gas_pressure=p) for p in (0.0, 0.1e6)
    )
    length = [float(np.ptp(each.path[~each.full])) for each in (before, after)]
    pressure = [float(each.pressure[~each.full][0]) + AMBIENT for each in (before, after)]
    assert pressure[1] > pressure[0] == AMBIENT
    assert pressure[0] * length[0] == pytest.approx(pressure[1] * length[1], rel=1e-8)
    # A column that would stand above the crest is held just below it.
    pressed = HumpProfile.of(scene=scene, law=law, fill_ratio=0.25, gas_pressure=0.5e6)
    assert pressed.regime is Regime.BLOCKED
    assert pressed.path[~pressed.full][0] == pytest.approx(0.06)
    assert pressed.hump_pressure is not None
    assert 0 < pressed.hump_pressure <= float(law.hydrostatic_pressure(0.25))


def test_reverse_flow_is_the_mirror_image(point_scene: Scene) -> None:
    slow = with_tables(point_scene, rotor={"speed": 314.0}, sha256="slow")
    near, far = (variant(slow, hump_position=s, bends=slow.tube.bends[:1]) for s in (0.2, 0.8))
    ahead = HumpProfile.of(
        scene=near[0], law=near[1], fill_ratio=0.4, opposite_fill_ratio=0.1, gas_pressure=0.0, primed=True
    )
    back = HumpProfile.of(
        scene=far[0], law=far[1], fill_ratio=0.1, opposite_fill_ratio=0.4, gas_pressure=0.0, primed=True
    )
    assert (ahead.regime, back.regime) == (Regime.SIPHON, Regime.REVERSE)
    np.testing.assert_allclose(back.pressure[::-1], ahead.pressure, rtol=1e-9)
    np.testing.assert_allclose(back.path[::-1], 0.12 - ahead.path, atol=1e-15)
    assert back.cavitation_margin == pytest.approx(ahead.cavitation_margin)
    resting = HumpProfile.of(scene=near[0], law=near[1], fill_ratio=0.25, gas_pressure=0.0, primed=True)
    assert resting.velocity == 0
    assert np.all(resting.full)
    assert resting.pressure[0] == resting.pressure[-1]


@given(
    x=st.floats(0, 0.5),
    y=st.floats(0, 0.5),
    p=st.floats(-AMBIENT, 4e6),
    primed=st.booleans(),
)
def test_any_state_has_a_profile_that_fits_its_regime(
    point_scene: Scene, law: CalibratedLaw, x: float, y: float, p: float, primed: bool
) -> None:
    found = HumpProfile.of(
        scene=point_scene,
        law=law,
        fill_ratio=x,
        opposite_fill_ratio=y,
        gas_pressure=p,
        primed=primed,
        points=21,
    )
    assert np.all(np.isfinite(found.pressure))
    assert np.all(np.diff(found.path) >= 0)
    margin = found.cavitation_margin
    assert margin is not None
    assert found.cavitation_margin_uncertainty is not None
    assert np.isfinite(margin + found.cavitation_margin_uncertainty)
    if abs(margin) > 1e-3 and found.velocity > 0 and primed:
        assert (margin > 0) == bool(np.all(found.full))
    if abs(margin) > 1e-3 and found.regime in (Regime.SIPHON, Regime.SEPARATED):
        assert bool(np.all(found.full)) == (found.regime is Regime.SIPHON)
    scale = 1e-6 * max(p + AMBIENT, 1e6)
    assert _steps_at_cavity(found) < scale


def _steps_at_cavity(found: HumpProfile) -> float:
    """Largest step of the pressure where flowing liquid ends."""
    if found.velocity == 0:
        return 0.0
    changes = np.flatnonzero(np.diff(found.full)).tolist()
    inside = [abs(found.pressure[i + 1] - found.pressure[i]) for i in changes if _within(found, i)]
    return max(inside, default=0.0)


def _within(found: HumpProfile, i: int) -> bool:
    # At a bend or the exit the cavity may end in the step that is lumped there.
    places = [0.0, 0.03, 0.09, 0.12]
    return all(abs(found.path[i] - at) > 1e-9 for at in places)


def test_margin_moves_with_an_input_by_what_its_half_width_says(point_scene: Scene) -> None:
    """The scene's own half-width of the crest's radius and of the gas pressure, against scenes that
    differ."""
    for quantity, width in (("hump_radius", 0.05e-3), ("extra_loss", 0.5)):
        entry = InputUncertainty(quantity=quantity, half_width=width, relative=False)
        stated = dataclasses.replace(point_scene, uncertainty=(entry,))
        plain = HumpProfile.of(scene=point_scene, law=variant(point_scene)[1], fill_ratio=0.1)
        point = tuple(map(np.array, (0.1, 0.4, point_scene.gas.pressure, True)))
        widths = [float(half_widths_of(side_laws(each), *point)[1]) for each in (point_scene, stated)]
        # The profile reads it off the law's table.
        assert plain.cavitation_margin_uncertainty == pytest.approx(widths[0], rel=0.05)
        scene, law = variant(point_scene, **{quantity: getattr(point_scene.tube, quantity) + width})
        moved = HumpProfile.of(scene=scene, law=law, fill_ratio=0.1)
        added = np.sqrt(widths[1] ** 2 - widths[0] ** 2)
        change = abs(moved.cavitation_margin - plain.cavitation_margin)  # type: ignore[operator]
        assert added == pytest.approx(change, rel=0.05, abs=20)


def test_what_eq_18_reads_is_what_the_law_does(law: CalibratedLaw) -> None:
    pressures, other = np.linspace(0.48e6, 1.2e6, 13), 0.1
    fills = np.array([0.2, 0.3, 0.4])
    for x, p in itertools.product(fills, pressures):
        flow = law.evaluate(fill_ratio=x, opposite_fill_ratio=other, gas_pressure=p, primed=True)
        if flow.regime == Regime.BLOCKED:
            continue
        surplus = p + float(law.hydrostatic_pressure(x) - law.hydrostatic_pressure(other))
        k = 2 * surplus / DENSITY / float(flow.velocity) ** 2 - 1
        siphon, separated = read_by_eq_18(law, flow.velocity, opposite_fill_ratio=other)
        assert float(max(siphon, separated)) == pytest.approx(k, rel=1e-7)
        if flow.regime != Regime.UNDECIDED:
            assert (separated > siphon) == (flow.regime == Regime.SEPARATED)


def test_what_cannot_be_drawn_is_refused(point_scene: Scene, law: CalibratedLaw) -> None:
    with pytest.raises(ValueError, match="points"):
        HumpProfile.of(scene=point_scene, law=law, fill_ratio=0.2, points=1)
    with pytest.raises(ValueError, match="fill_ratio"):
        HumpProfile.of(scene=point_scene, law=law, fill_ratio=0.7)
    scene, straight = variant(point_scene, hump_radius=None)
    with pytest.raises(ValueError, match="hump"):
        read_by_eq_18(straight, 1.0, opposite_fill_ratio=0.1)
    for gas in (0.0, 0.3e6):
        found = HumpProfile.of(scene=scene, law=straight, fill_ratio=0.2, gas_pressure=gas)
        assert found.cavitation_margin is None
        assert np.all(found.full)
