"""Rows of the tables that do not hold for the device are marked, and each remedy removes its mark."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.documents import RowStatus, _row_status, calibration_document
from ringbalance.results.rows import sentences
from ringbalance.scene import Scene
from scenes import with_tables

FILLS = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
CLOSED = np.ones(6, dtype=np.bool_)


def changed(scene: Scene, *, port: float = 44.5e-3, crest: float | None = 31.5e-3) -> Scene:
    return with_tables(scene, tube={"port_radius": port, "hump_radius": crest})


OK, OPEN, OVER, DRAWN, DRY = (
    RowStatus.OK,
    RowStatus.PORT_UNCOVERED,
    RowStatus.OVER_CREST,
    RowStatus.GAS_DRAWN,
    RowStatus.NO_RING,
)


@pytest.mark.parametrize(
    ("tube", "limits", "expected"),
    [
        ({}, {}, [OK] * 6),
        # The levels at fills of 0.2, 0.3, 0.4 and 0.5 are 40.95, 39.05, 37.03 and 34.89 mm.
        ({"port": 40e-3}, {}, [OK, OPEN, OPEN, OK, OK, OK]),
        ({"crest": 36e-3}, {}, [OK, OK, OK, OK, OK, OVER]),
        ({"crest": None}, {}, [OK, OVER, OVER, OVER, OVER, OVER]),
        ({}, {"residual": 0.15}, [DRAWN, DRAWN, OK, OK, OK, OK]),
        ({"port": 40e-3}, {"closed": FILLS > 0.15}, [OK, DRY, OPEN, OK, OK, OK]),
    ],
)
def test_what_limits_a_row(
    table_1_scene: Scene, tube: dict[str, Any], limits: dict[str, Any], expected: list[RowStatus]
) -> None:
    scene = changed(table_1_scene, **tube)
    assert list(_row_status(scene, fill_ratio=FILLS, **({"closed": CLOSED} | limits))) == expected


def test_velocities_of_residual_liquid_are_marked(table_1_calibration: Calibration) -> None:
    rest = table_1_calibration.answers.residual_fill_ratio
    law = calibration_document(table_1_calibration)["law"]
    marked = [x for x, s in zip(law["fill_ratio"], law["column_status"], strict=True) if s == "gas_drawn"]
    assert marked == [x for x in law["fill_ratio"] if x < rest]
    assert 0.0 in marked


def test_every_mark_has_a_remedy() -> None:
    assert sentences().keys() >= set(RowStatus) - {RowStatus.OK}


def test_both_tables_have_the_same_rings(table_1_scene: Scene) -> None:
    slow = with_tables(table_1_scene, rotor={"speed": 50.0})
    document = calibration_document(calibrate(slow))
    rows, columns = document["chamber"]["row_status"], document["law"]["column_status"]
    assert [s == "no_ring" for s in rows] == [s == "no_ring" for s in columns]
    assert "no_ring" in rows


@pytest.mark.parametrize(
    ("speed", "crest", "expected"),
    [(314.0, 36e-3, RowStatus.OVER_CREST), (50.0, 31.5e-3, RowStatus.NO_RING)],
)
def test_the_document_marks_the_row(
    table_1_scene: Scene, speed: float, crest: float, expected: RowStatus
) -> None:
    """At 50 rad/s on a shaft that lies g/omega^2 = 3.9 mm is deeper than a ring of little liquid (0.9 mm)."""
    scene = changed(table_1_scene, crest=crest)
    environment = replace(scene.environment, gravity=9.80665, shaft="horizontal")
    scene = with_tables(scene, rotor={"speed": speed}, environment=environment)
    calibration = calibrate(scene)
    states = calibration_document(calibration)["chamber"]["row_status"]
    assert states[0] == "ok"
    assert expected in states
