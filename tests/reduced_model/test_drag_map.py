"""The map of k over bore and viscosity, compared with the calibrated law and `tube_loss` point by point."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.making import side_laws
from ringbalance.reduced_model.law.sides import half_widths_of
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.reports.pages.drag_map import DragMap, _velocity_paper, liquids_in_tube
from ringbalance.scene.fitted import CLEARING_ERROR, MODEL
from ringbalance.scene.liquids import liquid_at
from ringbalance.scene.models import Scene
from scenes import with_tables

POINTS = [(0.3e-3, 1e-6), (0.9e-3, 3e-7), (1.5e-3, 5e-5), (2.4e-3, 6e-6), (4.1e-3, 2.2e-4)]


def with_values(calibration: Calibration, **tables: dict[str, float]) -> Calibration:
    """A calibration with its chamber and other values in its scene."""
    return replace(calibration, scene=with_tables(calibration.scene, **tables))


@pytest.fixture(scope="module")
def drag(point_calibration: Calibration) -> DragMap:
    return DragMap.of(calibration=point_calibration)


def moved(scene: Scene, bore: float, viscosity: float) -> Scene:
    """The scene with another bore and an exactly known viscosity."""
    liquid = {"kinematic_viscosity": viscosity, "viscosity_uncertainty": 0.0}
    return with_tables(scene, tube={"bore": bore}, liquid=liquid)


def of_primed_tube(scene: Scene) -> float:
    """Half-width of the velocity at equal fills by all but the waves of the chambers, the last two laws."""
    point = map(np.array, (0.25, 0.25, scene.gas.pressure, True))
    return float(half_widths_of(side_laws(scene)[:-2], *point)[0])


@pytest.mark.parametrize(("bore", "viscosity"), POINTS)
def test_a_point_is_what_law_and_tube_loss_say(
    point_calibration: Calibration, bore: float, viscosity: float
) -> None:
    found = DragMap.of(calibration=point_calibration, bore=[bore], kinematic_viscosity=[viscosity]).point
    scene = moved(point_calibration.scene, bore, viscosity)
    law = replace(point_calibration.flow_law, heads=TubeHeads.of(scene))
    x = law.max_fill_ratio / 2
    flow = law.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=scene.gas.pressure, primed=True)
    loss = tube_loss(scene, flow.velocity)
    if flow.regime != Regime.UNDECIDED:
        assert found.regime[0, 0] == flow.regime
    # The law interpolates its heads, too.
    assert found.velocity[0, 0] == pytest.approx(float(flow.velocity), rel=1e-7)
    assert found.k[0, 0] == pytest.approx(float(loss.k.value), rel=1e-7)
    assert found.velocity_uncertainty[0, 0] == pytest.approx(of_primed_tube(scene), rel=1e-3)
    causes = calibrate(scene).quantities["drag_coefficient"].causes
    if f"{MODEL}{CLEARING_ERROR}" not in causes:
        # Else gas lies over the crest of the tube that is not primed, of which the calibration knows.
        assert found.k_uncertainty[0, 0] == pytest.approx(math.hypot(*causes.values()), rel=1e-3)
    assert found.in_range[0, 0] == loss.in_range
    assert found.flow_state[0, 0] == loss.flow_state


def test_a_point_holds_the_gas_column_as_the_law_does(point_calibration: Calibration) -> None:
    on_shaft = calibrate(with_tables(point_calibration.scene, gas={"measured_at": "shaft"}))
    law, (bore, viscosity) = on_shaft.flow_law, POINTS[0]
    scene = moved(on_shaft.scene, bore, viscosity)
    point = DragMap.of(calibration=on_shaft, bore=[bore], kinematic_viscosity=[viscosity]).point
    flow = replace(law, heads=TubeHeads.of(scene)).evaluate(
        fill_ratio=0.25, opposite_fill_ratio=0.25, gas_pressure=scene.gas.pressure, primed=True
    )
    assert point.velocity[0, 0] == pytest.approx(float(flow.velocity), rel=1e-8)


def test_the_contour_is_really_at_fifty(point_calibration: Calibration, drag: DragMap) -> None:
    pairs = [
        (nu, d)
        for nu, d in zip(drag.kinematic_viscosity, drag.bores_for(drag.point.k), strict=True)
        if d is not None
    ]
    assert len(pairs) > 20
    for nu, d in pairs[::7]:
        point = DragMap.of(calibration=point_calibration, bore=[d], kinematic_viscosity=[nu]).point
        assert point.k[0, 0] == pytest.approx(50, rel=2e-3)


def test_where_the_apparent_k_is_fifty_eq_19_has_the_velocity(
    point_calibration: Calibration, drag: DragMap
) -> None:
    nu, bore = drag.kinematic_viscosity[25], drag.bores_for(drag.point.apparent_k)[25]
    assert bore is not None
    one = DragMap.of(calibration=point_calibration, bore=[bore], kinematic_viscosity=[nu])
    printed = _velocity_paper(point_calibration.scene.liquid.density, point_calibration.scene.gas.pressure)
    assert printed / one.point.velocity[0, 0] == pytest.approx(1, abs=2e-3)
    np.testing.assert_allclose(
        printed / drag.point.velocity, np.sqrt((drag.point.apparent_k + 1) / 51), rtol=1e-10
    )


def test_separated_columns_look_like_more_drag(drag: DragMap) -> None:
    point = drag.point
    separated = point.regime == Regime.SEPARATED
    assert np.any(separated)
    assert np.any(~separated)
    assert np.all(point.apparent_k[separated] > point.k[separated])
    np.testing.assert_allclose(point.apparent_k[~separated], point.k[~separated], rtol=1e-7)


def test_without_a_hump_every_point_is_a_siphon(point_calibration: Calibration) -> None:
    scene = point_calibration.scene
    straight = calibrate(with_tables(scene, tube={"hump_radius": None}))
    point = DragMap.of(calibration=straight).point
    assert np.all(point.regime == Regime.SIPHON)
    np.testing.assert_allclose(point.apparent_k, point.k, rtol=1e-7)


def test_a_gas_that_drives_nothing_maps_nothing(point_calibration: Calibration) -> None:
    blocked = DragMap.of(calibration=with_values(point_calibration, gas={"pressure": 0.0}))
    assert not np.any(blocked.point.runs)
    assert np.all(blocked.point.regime == Regime.BLOCKED)
    assert np.all(blocked.point.k == 0)
    assert not any(blocked.bores_for(blocked.point.k))


@pytest.fixture(scope="module")
def liquids(point_calibration: Calibration) -> dict[str, dict[str, Any]]:
    return {record["name"]: record for record in liquids_in_tube(point_calibration)}


def test_the_scenes_liquid_comes_first_and_agrees_with_the_calibration(
    point_calibration: Calibration, liquids: dict[str, dict[str, Any]]
) -> None:
    answers, first = point_calibration.answers, next(iter(liquids.values()))
    assert first["name"] == point_calibration.scene.liquid.name
    assert first["velocity_m_s"] == pytest.approx(answers.velocity, rel=1e-8)
    assert first["k"] == pytest.approx(answers.drag_coefficient, rel=1e-8)
    assert first["velocity_uncertainty"] == pytest.approx(of_primed_tube(point_calibration.scene), rel=1e-3)


def test_a_dense_liquid_starts_at_just_its_starting_pressure(
    point_calibration: Calibration, liquids: dict[str, dict[str, Any]]
) -> None:
    gallium = liquid_at(name="gallium", temperature=303.15)
    start = liquids["gallium"]["starting_pressure_Pa"]
    assert not liquids["gallium"]["starts_at_scene_pressure"]
    equal = point_calibration.scene.gas.pressure * gallium.density / point_calibration.scene.liquid.density
    assert liquids["gallium"]["gas_pressure_Pa"] == pytest.approx(equal)
    for factor, flows in ((0.999, False), (1.001, True)):
        pressed = with_values(point_calibration, gas={"pressure": factor * start})
        assert liquids_in_tube(pressed, [gallium])[1]["starts_at_scene_pressure"] is flows


def test_the_bore_for_fifty_has_fifty(
    point_calibration: Calibration, liquids: dict[str, dict[str, Any]]
) -> None:
    oil = liquid_at(name="silicone oil 50 cSt", temperature=298.15)
    # At equal head: the bore is for the same p/rho.
    pressure = point_calibration.scene.gas.pressure / point_calibration.scene.liquid.density * oil.density
    bore = liquids[oil.name]["bore_for_paper_m"]
    wide = with_values(point_calibration, tube={"bore": bore}, gas={"pressure": pressure})
    assert liquids_in_tube(wide, [oil])[1]["k"] == pytest.approx(50, rel=2e-3)
