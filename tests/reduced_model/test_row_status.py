"""Rows of the tables that do not hold for the device are marked, and each remedy removes its mark."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.documents import RowStatus, _row_status, calibration_document
from ringbalance.results.rows import sentences
from ringbalance.scene import Scene

FILLS = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
CLOSED = np.ones(6, dtype=np.bool_)


def changed(scene: Scene, *, port: float = 44.5e-3, crest: float | None = 31.5e-3) -> Scene:
    return replace(scene, tube=replace(scene.tube, port_radius=port, hump_radius=crest))


def test_the_papers_disc_has_no_limited_row(table_1_scene: Scene) -> None:
    assert set(_row_status(table_1_scene, fill_ratio=FILLS, closed=CLOSED)) == {RowStatus.OK}


def test_a_port_between_two_levels_limits_the_rows_below(table_1_scene: Scene) -> None:
    """The level at a fill of 0.2 is 40.95 mm by the paper's disc, at 0.3 it is 39.05 mm."""
    assert surface_radius(disc=table_1_scene.disc, fill_ratio=0.2) == pytest.approx(40.95e-3, abs=0.05e-3)
    states = _row_status(changed(table_1_scene, port=40e-3), fill_ratio=FILLS, closed=CLOSED)
    assert states == (RowStatus.OK, *[RowStatus.PORT_UNCOVERED] * 2, *[RowStatus.OK] * 3)


def test_a_crest_between_two_levels_limits_the_rows_above(table_1_scene: Scene) -> None:
    """The level at a fill of 0.4 is 37.03 mm, at 0.5 it is 34.89 mm."""
    states = _row_status(changed(table_1_scene, crest=36e-3), fill_ratio=FILLS, closed=CLOSED)
    assert states == (*[RowStatus.OK] * 5, RowStatus.OVER_CREST)
    without = _row_status(changed(table_1_scene, crest=None), fill_ratio=FILLS, closed=CLOSED)
    assert without == (RowStatus.OK, *[RowStatus.OVER_CREST] * 5)


def test_gas_is_drawn_through_residual_liquid(table_1_scene: Scene) -> None:
    states = _row_status(table_1_scene, fill_ratio=FILLS, closed=CLOSED, residual=0.15)
    assert states == (*[RowStatus.GAS_DRAWN] * 2, *[RowStatus.OK] * 4)


def test_velocities_of_residual_liquid_are_marked(table_1_calibration: Calibration) -> None:
    rest = table_1_calibration.residual.fill_ratio
    law = calibration_document(table_1_calibration)["law"]
    marked = [x for x, s in zip(law["fill_ratio"], law["column_status"], strict=True) if s == "gas_drawn"]
    assert marked == [x for x in law["fill_ratio"] if x < rest]
    assert 0.0 in marked


def test_an_open_ring_comes_first(table_1_scene: Scene) -> None:
    states = _row_status(changed(table_1_scene, port=40e-3), fill_ratio=FILLS, closed=FILLS > 0.15)
    assert states[:3] == (RowStatus.OK, RowStatus.NO_RING, RowStatus.PORT_UNCOVERED)


def test_every_mark_has_a_remedy() -> None:
    assert sentences().keys() >= set(RowStatus) - {RowStatus.OK}


def test_both_tables_have_the_same_rings(table_1_scene: Scene) -> None:
    slow = replace(table_1_scene, rotor=replace(table_1_scene.rotor, speed=50.0))
    document = calibration_document(calibrate(slow))
    rows, columns = document["chamber"]["row_status"], document["law"]["column_status"]
    assert [s == "no_ring" for s in rows] == [s == "no_ring" for s in columns]
    assert "no_ring" in rows


@pytest.mark.parametrize(
    ("speed", "crest", "expected"),
    [(314.0, 36e-3, RowStatus.OVER_CREST), (50.0, 31.5e-3, RowStatus.NO_RING)],
)
def test_table_and_document_mark_the_row(
    table_1_scene: Scene, speed: float, crest: float, expected: RowStatus
) -> None:
    """At 50 rad/s on a shaft that lies g/omega^2 = 3.9 mm is deeper than a ring of little liquid (0.9 mm)."""
    scene = changed(table_1_scene, crest=crest)
    environment = replace(scene.environment, gravity=9.80665, shaft="horizontal")
    scene = replace(scene, rotor=replace(scene.rotor, speed=speed), environment=environment)
    calibration = calibrate(scene)
    states = calibration_document(calibration)["chamber"]["row_status"]
    assert states[0] == "ok"
    assert expected in states
    console = Console(width=200, record=True, quiet=True)
    with console.capture() as shown:
        console.quiet = False
        console.print(calibration.rows().view())
    assert sentences()[expected].text.split(":")[0] in " ".join(shown.get().split())
