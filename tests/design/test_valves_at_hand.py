"""Valves of a user's file, by the option --valves and in [design]: one record, whatever states the flow."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

import ringbalance as rb
from ringbalance.commands import COMMANDS
from ringbalance.controller.liquid_ring.offers import valves_of
from ringbalance.design.choices import with_valves
from ringbalance.design.space import Space
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene

FILE = """# from the data sheets
name;conductance [l/(s*bar)];nominal_flow;kv;critical_ratio;valve_lag
A;0.4;;;0.25;2 ms
B;;180 l/min;;;5 ms
CKD M4GA2 R;;;;;20 ms
D;;;0.2;0.5;10 ms
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "my.csv"
    path.write_text(FILE, encoding="utf-8")
    return path


def test_a_file_of_valves_is_tried_whatever_states_their_flow(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, logger="ringbalance"):
        scene = with_valves(rb.load_scene(rb.bundled_scene("liquid_ring_paper")), file)
    assert [message.partition("my.csv: ")[2] for message in caplog.messages] == [
        "b = 0.3 of B, as no critical ratio is stated"
    ]
    assert isinstance(scene, Scene)
    tried = [(each.name, *each.changes.values()) for each in valves_of(scene)]
    assert tried == [
        ("A", pytest.approx(0.4e-8), 0.25, 2e-3),
        ("B", pytest.approx(0.708e-8, rel=5e-4), 0.3, 5e-3),
        ("CKD M4GA2 R", pytest.approx(2.3e-8), 0.36, 20e-3),
        ("D", pytest.approx(0.2 * 3.80e-8, rel=2e-3), 0.5, 10e-3),  # 4.50 (0.5/0.7)^(1/2)
    ]


def test_a_design_chooses_from_the_same_valves(file: Path) -> None:
    """Whether the option or the scene names the file, and with the lag that is assumed of a valve."""
    file.write_text(FILE.replace("20 ms", ""), encoding="utf-8")
    spindle = rb.load_scene(rb.bundled_scene("spindle_design"))
    named = spindle.with_values({"design.valves": None, "design.valve_file": str(file)})
    for scene in map(liquid_ring_scene, (with_valves(spindle, file), named)):
        (axis,) = (each for each in Space.of(scene).axes if "gas.conductance" in each.paths)
        assert axis.names == ("A", "B", "CKD M4GA2 R", "D")
        assert [choice["gas.critical_ratio"] for choice in axis.choices] == [0.25, 0.3, 0.36, 0.5]
        assert [choice["gas.valve_lag"] for choice in axis.choices] == [2e-3, 5e-3, 20e-3, 10e-3]


def test_without_a_file_the_same_three_valves_as_ever_are_tried() -> None:
    """Their numbers stand in the reports of earlier versions."""
    scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    assert isinstance(scene, Scene)
    assert [(each.name, *each.changes.values()) for each in valves_of(scene)] == [
        ("Festo MHA2-MS1H-3/2", 0.39e-8, 0.3, 2e-3),
        ("SMC SY3000", 1.1e-8, 0.28, 12e-3),
        ("CKD M4GA2 R", 2.3e-8, 0.36, 20e-3),
    ]


def test_only_a_lag_of_the_programs_own_counts_as_assumed(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Neither a lag that a file of valves states nor that of the scene."""
    scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    assert isinstance(scene, Scene)
    assert {each.assumed for each in valves_of(scene)} == {("gas.valve_lag",)}
    file.write_text(FILE.replace("20 ms", ""), encoding="utf-8")
    with caplog.at_level(logging.WARNING, logger="ringbalance"):
        tried = valves_of(liquid_ring_scene(with_valves(scene, file)))
    assert [each.assumed for each in tried] == [(), (), ("gas.valve_lag",), ()]
    assert tried[2].changes["gas.valve_lag"] == 20e-3
    assert "a lag is assumed, as none is stated, 20 ms of CKD M4GA2 R: ask the seller" in caplog.messages[-1]
    file.write_text(FILE, encoding="utf-8")
    for stated in (with_valves(scene, file), scene.with_values({"gas.valve_lag": "15 ms"})):
        assert isinstance(stated, Scene)
        assert {each.assumed for each in valves_of(stated)} == {()}
        assert len(valves_of(stated)) >= 3


def test_the_commands_that_try_valves_take_a_file() -> None:
    assert [name for name, each in COMMANDS.items() if "valves" in each.options] == [
        "report",
        "tune",
        "design",
    ]


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("0.4;;;", "0.4 mm;;;", r'column "conductance \[l/\(s\*bar\)\]" = "0.4 mm"'),
        ("valve_lag", "lag", r"no such key"),
        ("B;;180 l/min;;;5 ms", "B;;;;;5 ms", r"valves\[2\]: no flow is stated"),
    ],
)
def test_errors_of_a_file_of_valves_are_named(file: Path, before: str, after: str, says: str) -> None:
    file.write_text(FILE.replace(before, after), encoding="utf-8")
    with pytest.raises(rb.SceneError, match=says):
        with_valves(rb.load_scene(rb.bundled_scene("liquid_ring_paper")), file)
