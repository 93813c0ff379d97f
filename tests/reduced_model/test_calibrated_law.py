"""The calibrated law: four regimes, thresholds, hysteresis, continuity, and never a NaN."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.physics.gas import pressure_factor
from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.estimates import range_flow
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.making import nominal_law, nominal_laws
from ringbalance.reduced_model.pressure_profile import HumpProfile
from ringbalance.reduced_model.tube.flow import column_pressure
from ringbalance.reduced_model.tube.regime import driving_pressure, stall_pressure
from ringbalance.scene.models import HumpGas, Scene
from scenes import with_tables

AMBIENT = 101325.0


@pytest.fixture(scope="module")
def law(point_calibration: Calibration) -> CalibratedLaw:
    return point_calibration.flow_law


def law_fixture(speed: float | None = None, **tube: object) -> Any:
    """Fixture with the law of the paper's disc with another tube or speed, rad/s."""

    def variant(point_scene: Scene) -> CalibratedLaw:
        rotor = {} if speed is None else {"speed": speed}
        return chamber_and_law(with_tables(point_scene, tube=tube, rotor=rotor))[1]

    return pytest.fixture(scope="module")(variant)


slow = law_fixture(speed=314.0)  # a column holds over the crest without gas
slow_near = law_fixture(speed=314.0, hump_position=0.2)
slow_far = law_fixture(speed=314.0, hump_position=0.8)
trapped = law_fixture(hump_gas="trapped")
straight = law_fixture(hump_radius=None)
inner_port = law_fixture(port_radius=43.5e-3)


def test_siphon_obeys_the_energy_balance(law: CalibratedLaw, point_scene: Scene) -> None:
    x, p = np.array([0.1, 0.2, 0.3]), 1.2e6
    flow = law.evaluate(fill_ratio=x, gas_pressure=p)
    assert np.all(flow.regime == Regime.SIPHON)
    loss = tube_loss(point_scene, flow.velocity)
    surplus = p + law.hydrostatic_pressure(x) - law.hydrostatic_pressure(0.5 - x)
    np.testing.assert_allclose((loss.k.value + 1) * 1000 * flow.velocity**2 / 2, surplus, rtol=1e-8)


def test_separated_flow_obeys_the_humps_balance_and_forgets_the_receiving_chamber(
    law: CalibratedLaw, point_scene: Scene
) -> None:
    flow = law.evaluate(fill_ratio=0.4, opposite_fill_ratio=[0.05, 0.1, 0.12], gas_pressure=0.6e6)
    assert np.all(flow.regime == Regime.SEPARATED)
    assert np.ptp(flow.velocity) == 0.0
    loss = tube_loss(point_scene, flow.velocity)
    hump = column_pressure(scene=point_scene, radius=31.5e-3)
    margin = 0.6e6 + AMBIENT - 2339.0 + law.hydrostatic_pressure(0.4) - hump
    head = (loss.state.kinetic_factor + loss.state.upstream_loss(0.5)) * 1000 * flow.velocity**2 / 2
    np.testing.assert_allclose(head, margin, rtol=1e-8)


@pytest.mark.parametrize("factor", [1 - 1e-9, 1 + 1e-9])
def test_priming_thresholds_of_both_readings_are_0_54_mpa(
    law: CalibratedLaw, trapped: CalibratedLaw, factor: float
) -> None:
    readings = (
        (law, {"fill_ratio": 0.0, "opposite_fill_ratio": 0.5}, "vented"),
        (trapped, {"fill_ratio": 0.25, "opposite_fill_ratio": 0.25}, "trapped"),
    )
    for each, fills, gas in readings:
        threshold = each.priming_pressure(**fills, hump_gas=gas)  # type: ignore[arg-type]
        assert threshold is not None
        assert round(float(threshold) / 1e6, 2) == 0.54
        flow = each.evaluate(**fills, gas_pressure=float(threshold) * factor)
        assert (float(flow.velocity) > 0) == (factor > 1)
        assert float(flow.velocity) < 1e-3
        assert not flow.primed  # it spills over; only a faster flow carries the gas out
        above = each.evaluate(**fills, gas_pressure=float(threshold) + 0.3e6)
        assert bool(above.primed)


def test_straight_tube_stalls_without_a_jump(straight: CalibratedLaw) -> None:
    stall = float(stall_pressure(straight.path, straight.ends(fill_ratio=0.0)))
    offsets = np.array([-1e3, 0.0, 1e-3, 1e-1, 1e1])
    flow = straight.evaluate(fill_ratio=0.0, gas_pressure=stall + offsets)
    assert list(flow.regime) == [Regime.REVERSE, Regime.BLOCKED, *[Regime.SIPHON] * 3]
    assert np.all(np.diff(flow.velocity[2:]) > 0)
    assert flow.velocity[2] < 1e-5


@pytest.mark.parametrize("primed", [True, False])
def test_straight_tube_levels_out_with_the_gas_off(straight: CalibratedLaw, primed: bool) -> None:
    off = straight.evaluate(fill_ratio=[0.1, 0.25, 0.4], gas_pressure=0.0, primed=primed)
    assert list(off.regime) == [Regime.REVERSE, Regime.BLOCKED, Regime.SIPHON]
    # The levels alone drive what the same gas pressure drives between equal ones.
    ends = straight.ends(fill_ratio=0.4)
    alike = straight.evaluate(
        fill_ratio=0.25, gas_pressure=float(driving_pressure(straight.path, ends)), primed=primed
    )
    u = float(alike.velocity)
    np.testing.assert_allclose(off.velocity, [-u, 0.0, u], rtol=1e-12)


def test_hysteresis_a_running_column_needs_less_than_an_empty_tube(slow: CalibratedLaw) -> None:
    threshold = slow.priming_pressure(fill_ratio=0.25, hump_gas="vented")
    assert threshold is not None
    below = 0.5 * float(threshold)
    assert float(slow.evaluate(fill_ratio=0.25, gas_pressure=below, primed=False).velocity) == 0
    running = slow.evaluate(fill_ratio=0.25, gas_pressure=below, primed=True)
    assert float(running.velocity) > 0
    assert bool(running.primed)


def test_gas_off_a_slow_rotors_column_levels_the_chambers_out(slow: CalibratedLaw) -> None:
    x = np.array([0.05, 0.2, 0.25, 0.3, 0.45])
    flow = slow.evaluate(fill_ratio=x, gas_pressure=0.0, primed=True)
    assert list(flow.regime[[0, 1]]) == [Regime.REVERSE] * 2
    assert list(flow.regime[[3, 4]]) == [Regime.SIPHON] * 2
    np.testing.assert_allclose(flow.velocity, -flow.velocity[::-1], atol=1e-9)
    assert np.all(flow.primed)
    assert np.all(slow.evaluate(fill_ratio=x, gas_pressure=0.0, primed=False).regime == Regime.BLOCKED)


def test_gas_off_a_fast_rotors_column_separates(law: CalibratedLaw) -> None:
    flow = law.evaluate(fill_ratio=[0.05, 0.45], gas_pressure=0.0, primed=True)
    assert np.all(flow.regime == Regime.BLOCKED)
    assert not np.any(flow.primed)


def test_reverse_flow_is_judged_from_the_opposite_side(
    slow_near: CalibratedLaw, slow_far: CalibratedLaw
) -> None:
    forward = slow_near.evaluate(fill_ratio=0.4, opposite_fill_ratio=0.05, gas_pressure=0.0, primed=True)
    backward = slow_far.evaluate(fill_ratio=0.05, opposite_fill_ratio=0.4, gas_pressure=0.0, primed=True)
    assert float(backward.velocity) == pytest.approx(-float(forward.velocity), rel=1e-12)


def test_levels_that_leave_the_port(inner_port: CalibratedLaw) -> None:
    law, fills = inner_port, np.linspace(0, 0.5, 5001)
    covered = float(np.interp(law.path.port_pressure, law.hydrostatic_pressure(fills), fills))
    blown = law.evaluate(fill_ratio=[covered * 0.99, covered * 1.01], gas_pressure=1e6, primed=True)
    assert list(blown.velocity > 0) == [False, True]
    assert list(blown.primed) == [False, True]
    # Receiving chamber below its port: the jet meets gas there, whatever is below.
    free = law.evaluate(fill_ratio=0.3, opposite_fill_ratio=[0.0, covered * 0.9], gas_pressure=1.5e6)
    assert free.velocity[0] == free.velocity[1] > 0


conditions = {
    "x": st.floats(0, 0.5),
    "y": st.floats(0, 0.5),
    "p": st.one_of(st.floats(-AMBIENT, 5e6), st.sampled_from([0.0, 5e-324, 1e-300, 1e-290, -AMBIENT])),
    "primed": st.booleans(),
}


@pytest.mark.parametrize("name", ["law", "slow", "trapped", "straight", "inner_port"])
def test_never_nan_and_always_consistent(request: pytest.FixtureRequest, name: str) -> None:
    each: CalibratedLaw = request.getfixturevalue(name)

    @given(**conditions)
    def check(x: float, y: float, p: float, primed: bool) -> None:
        flow = each.evaluate(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=primed)
        u, regime = float(flow.velocity), Regime(int(flow.regime))
        assert np.isfinite(u)
        assert np.isfinite(flow.uncertainty)
        assert float(flow.uncertainty) >= 0
        assert (u == 0) == (regime is Regime.BLOCKED)
        assert (u < 0) == (regime is Regime.REVERSE)
        if u != 0:
            assert float(flow.uncertainty) > 0
        again = each.evaluate(fill_ratio=[x, x], opposite_fill_ratio=y, gas_pressure=p, primed=primed)
        assert float(again.velocity[1]) == u

    check()


@given(x=st.floats(0.01, 0.49), p=st.floats(1e5, 3e6), step=st.floats(1e3, 1e6))
def test_more_gas_never_means_less_flow(law: CalibratedLaw, x: float, p: float, step: float) -> None:
    flow = law.evaluate(fill_ratio=x, gas_pressure=[p, p + step])
    assert flow.velocity[1] >= flow.velocity[0]


@pytest.mark.parametrize("crest_gas", ["vented", "trapped"])
def test_pressures_on_the_shaft_are_those_on_the_liquid_times_the_columns_ratio(
    point_scene: Scene, crest_gas: HumpGas
) -> None:
    """Supply and surroundings alike: the same disc with both pressures as they are on the liquid flows alike,
    separated over vapour as well, and holds alike at rest."""
    on_shaft = with_tables(point_scene, tube={"hump_gas": crest_gas}, gas={"measured_at": "shaft"})
    ratio, gas = pressure_factor(on_shaft), point_scene.gas
    pressures = {"pressure": ratio * gas.pressure, "ambient_pressure": ratio * gas.ambient_pressure}
    on_liquid = with_tables(point_scene, tube={"hump_gas": crest_gas}, gas=pressures)
    laws = [nominal_law(each, gravity=False) for each in (on_shaft, on_liquid)]
    for p in (0.0, 0.56e6, 0.7e6, 1.5e6):
        one, other = (
            each.evaluate(fill_ratio=[0.1, 0.25, 0.4], gas_pressure=f * p, primed=[False, False, True])
            for each, f in zip(laws, (1.0, ratio), strict=True)
        )
        np.testing.assert_allclose(one.velocity, other.velocity, rtol=1e-9)
        assert np.array_equal(one.regime, other.regime)
        lines = [
            HumpProfile.of(scene=each, law=law, fill_ratio=0.25, gas_pressure=f * p).pressure
            for each, law, f in zip((on_shaft, on_liquid), laws, (1.0, ratio), strict=True)
        ]
        np.testing.assert_allclose(lines[0], lines[1], rtol=1e-9, atol=1e-3)
    flows = [range_flow(each) for each in (on_shaft, on_liquid)]
    np.testing.assert_allclose(flows[0].velocity, flows[1].velocity, rtol=1e-9)


@pytest.mark.parametrize("tube", [{}, {"hump_radius": None}, {"drag_coefficient": 50.0}], ids=str)
@pytest.mark.parametrize("speeds", [(1.0, 1.0), (1.0, 1.02)])
def test_laws_of_many_scenes_are_those_of_each(
    point_scene: Scene, tube: dict[str, float | None], speeds: tuple[float, ...]
) -> None:
    """Whether everything that the tube's head depends on differs between them, a part of it, or nothing."""
    scene = with_tables(point_scene, tube=tube)
    scenes = [with_tables(scene, rotor={"speed": each * scene.rotor.speed}) for each in speeds]
    many, single = nominal_laws(scenes, gravity=False), [nominal_law(each, gravity=False) for each in scenes]
    for p in (0.7e6, 1.5e6):
        at_once, alone = (
            [float(law.evaluate(fill_ratio=0.2, gas_pressure=p, primed=True).velocity) for law in laws]
            for laws in (many, single)
        )
        assert min(alone) > 0
        np.testing.assert_allclose(at_once, alone, rtol=1e-12)


def test_table_inverts_to_the_law(law: CalibratedLaw) -> None:
    table = law.table()
    x, p = 0.2, 1.5e6
    level = np.interp([x, 0.5 - x], table["fill_ratio"], table["hydrostatic_pressure"])
    head = (p + level[0] - level[1]) / table["density"][0]
    u = np.exp(np.interp(np.log(head), table["log_head"], table["log_velocity"]))
    assert u == pytest.approx(float(law.evaluate(fill_ratio=x, gas_pressure=p).velocity), rel=1e-4)
