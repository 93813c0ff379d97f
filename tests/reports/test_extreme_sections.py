"""The sections on waves and on the extremes: what they say follows the numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import pytest

from ringbalance.reports import extremes_cli
from ringbalance.reports.pages import extremes, sloshing
from ringbalance.reports.section import Work
from ringbalance.scene import Scene

Record = dict[str, Any]


def waves(*, resonant: list[Record], top: float, code: str = "ok", text: str = "solved") -> Record:
    return {
        "fill_ratio": [0.1, 0.3, 0.5],
        "frequency_ratio": [[0.3, 0.5, top], [0.8, 1.2, 1.5], [0.9, 1.1, 1.6]],
        "amplification": [0.2, 1.0, 4.0],
        "pressure_amplification": [3.1, 3.5, 6.0],
        "surface_amplitude_m": [1e-6, 1e-6, 2e-6],
        "largest_surface_amplitude_m": [2e-6, 2e-6, 4e-6],
        "depth_m": [1e-3, 3e-3, 5e-3],
        "resonant": resonant,
        "imported": False,
        "equal": {
            "fill_ratio": 0.25,
            "amplification": 0.8,
            "pressure_amplification": 3.6,
            "amplification_interval": [0.63, 1.02],
            "pressure_amplification_interval": [3.1, 4.1],
            "surface_amplitude_m": 1e-6,
            "tilt_ratio": 2e-4,
        },
        "status": {"code": code, "text": text},
    }


def findings(record: Record) -> str:
    view = sloshing.SECTION.view({"sloshing": record})
    assert view is not None
    return " ".join(view["findings"])


def test_fills_that_gravity_drives_are_named_and_others_are_not() -> None:
    met = [{"mode": 2, "fill_ratio": 0.2}, {"mode": 3, "fill_ratio": 0.2}]
    told = findings(waves(resonant=met, top=0.6))
    # A frequency known to 6 % meets the speed anywhere from 0.94 to 1.06 of it.
    assert "0.14 to 0.26 (mode 3)" in told
    assert "mode 2" not in told


def test_a_first_mode_that_nears_the_speed_is_named() -> None:
    assert "from about 0.5 up" in findings(waves(resonant=[], top=0.95))
    assert "No mode" in findings(waves(resonant=[], top=0.6) | {"frequency_ratio": [[0.3, 0.5, 0.6]]})


def test_a_mode_that_only_may_meet_the_speed_is_named() -> None:
    record = waves(resonant=[], top=0.6)
    record["frequency_ratio"][2] = [0.7, 0.8, 0.97]
    assert "0.47 to 0.5 (mode 3)" in findings(record)


def test_the_swing_of_the_pressure_is_reported_beside_that_of_the_moment() -> None:
    told = findings(waves(resonant=[], top=0.6))
    assert "0.8 (0.63 to 1" in told
    assert "the wall pressure 3.6 (3.1 to 4.1) times" in told


def test_waves_that_are_not_small_are_said() -> None:
    assert "Avoid that fill" in findings(
        waves(resonant=[], top=0.6, code="out_of_range", text="avoid that fill")
    )


def test_no_gravity_no_waves(vertical_scene: Scene) -> None:
    work = Work(scene=vertical_scene, calibration=cast(Any, None), level="light")
    assert sloshing.SECTION.collect(work) is None
    assert sloshing.SECTION.view({}) is None


@pytest.fixture
def vertical_scene(paper_scene: Scene) -> Scene:
    return replace(paper_scene, environment=replace(paper_scene.environment, shaft="vertical"))


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
    view = extremes.SECTION.view(evidence())
    assert view is not None
    slow, fast, fill = view["table"].rows
    assert slow[:3] == ("speed", "1.00 to 160 rpm", "refused")
    assert slow[-1].startswith("[rotor] speed")
    assert (fast[0], *fast[2:]) == ("", "solved", "time limit", "")
    assert (fill[0], *fill[2:4]) == ("fill", "solved", "settled")
    assert "to" not in fill[1]


def test_extremes_that_were_not_run_say_so() -> None:
    assert extremes.SECTION.view({"verification": [{"id": "extremes", "tables": []}]}) == {"ran": False}


def test_a_table_named_in_a_message_is_not_taken_for_markup(capsys: pytest.CaptureFixture[str]) -> None:
    told = {
        "judged": 3,
        "endings": {"solved": 2, "refused with a message": 1},
        "worst_residual": 1e-13,
        "worst_error_over_half_width": 0.8,
        "violations": [],
    }
    extremes_cli._show(told, extremes.axis_rows(table()))
    assert "[rotor]" in capsys.readouterr().out
