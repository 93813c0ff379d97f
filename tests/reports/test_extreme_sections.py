"""The sections on waves and on the extremes: what they say follows the numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ringbalance.reports.pages import chamber
from ringbalance.reports.pages.cases import EXTREMES
from ringbalance.reports.section import Work
from ringbalance.scene import Scene
from scenes import with_tables

Record = dict[str, Any]


def meeting(first: list[float], third: list[float], met: list[int]) -> Record:
    """Fills at which mode 3 meets the speed, of three modes at three fills."""
    ratios = np.array([first, [0.8, 1.2, 1.5], third])
    fills = np.array([0.1, 0.3, 0.5])
    avoided = {each["mode"]: each for each in chamber._to_avoid(ratios, fills, met, imported=False)}
    assert 2 not in avoided
    return avoided.get(3, {})


def test_fills_that_gravity_drives_are_named_and_others_are_not() -> None:
    interval = meeting([0.3, 0.5, 0.6], [0.9, 1.1, 1.6], [2, 3])
    # A frequency known to 6 % meets the speed anywhere from 0.94 to 1.06 of it.
    assert (interval["from_fill_ratio"], interval["to_fill_ratio"]) == pytest.approx((0.14, 0.26), abs=0.01)


def test_a_mode_that_only_may_meet_the_speed_is_named() -> None:
    interval = meeting([0.3, 0.5, 0.6], [0.7, 0.8, 0.97], [])
    assert (interval["from_fill_ratio"], interval["to_fill_ratio"]) == pytest.approx((0.47, 0.5), abs=0.005)


def test_the_fill_at_which_the_swing_doubles_is_found() -> None:
    fills = np.array([0.1, 0.3, 0.5])
    assert chamber._nearing(fills, np.array([0.2, 1.0, 4.0])) == 0.5
    assert chamber._nearing(fills, np.array([3.0, 3.0, 4.0])) == 0.1


def test_no_gravity_no_waves(vertical_scene: Scene) -> None:
    work = Work(scene=vertical_scene, level="light")
    assert chamber.WAVES.collect(work) is None
    assert chamber.WAVES.view({}) is None


@pytest.fixture
def vertical_scene(paper_scene: Scene) -> Scene:
    return with_tables(paper_scene, environment={"shaft": "vertical"})


def table() -> Record:
    return {
        "axis": ["speed", "speed", "fill"],
        "unit": ["rpm", "rpm", "1"],
        "from": [1.0, 162.0, 1e-6],
        "to": [160.0, 1e5, 1e-6],
        "ending": ["refused with a message", "solved", "solved"],
        "loop": ["", "time_limit", "settled"],
        "said": ['disc.toml: [rotor] speed = "160 rpm": too slow; allowed: more', "", ""],
    }


def evidence() -> Record:
    # A map of an evidence file kept by an older version is not shown.
    tables = [{"name": "axes", "columns": table()}, {"name": "map of speed and fill", "columns": {}}]
    return {
        "verification": [{"id": "extremes", "explanation": "All held.", "tables": tables, "date": "today"}]
    }


def test_the_extremes_say_how_far_and_what_is_beyond() -> None:
    view = EXTREMES.view(evidence())
    assert view is not None
    slow, fast, fill = view["table"].rows
    assert slow[:3] == ("speed", "1.00 to 160 rpm", "refused")
    assert slow[-1].startswith("[rotor] speed")
    assert (fast[0], *fast[2:]) == ("", "solved", "time limit", "")
    assert (fill[0], *fill[2:4]) == ("fill", "solved", "settled")
    assert "to" not in fill[1]


def test_extremes_that_were_not_run_say_so() -> None:
    assert EXTREMES.view({"verification": [{"id": "extremes", "tables": []}]}) == {"ran": False}
