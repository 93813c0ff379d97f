"""The option --tolerance: what it decides, and what it refuses."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ringbalance import cli
from ringbalance.reduced_model.terms import ModelUsed, models_used
from ringbalance.scene import Scene, SceneError, bundled_scene, load_scene
from ringbalance.scene.narrowing import with_tolerance
from scenes import with_tables

PAPER = str(bundled_scene("liquid_ring_paper"))
COMMANDS = (
    ("calibrate", PAPER),
    ("simulate", PAPER),
    ("compare", PAPER, PAPER),
    ("trade", PAPER),
    ("report", PAPER),
)


def by_term(scene: Scene) -> dict[str, ModelUsed]:
    return {used.term: used for used in models_used(scene)}


@pytest.fixture(scope="module")
def paper() -> Scene:
    scene = load_scene(PAPER)
    assert isinstance(scene, Scene)
    return scene


@pytest.mark.parametrize(
    ("text", "value"), [("0.5 %", 0.005), ("0.5%", 0.005), ("0.005", 0.005), ("1e-4", 1e-4)]
)
def test_a_tolerance_is_a_fraction_or_a_percentage(paper: Scene, text: str, value: float) -> None:
    assert with_tolerance(paper, text) == replace(paper, tolerance=value)
    assert with_tolerance(paper, None) is paper


def test_a_tolerance_of_zero_models_everything(paper: Scene) -> None:
    scene = with_tolerance(paper, "0")
    assert scene.tolerance == with_tolerance(paper, "0 %").tolerance == 0
    assert by_term(scene)["gravity, mean over a turn"].modelled
    assert by_term(paper)["gravity, mean over a turn"].modelled
    assert by_term(scene)["surface tension"].model == "not modelled in this version"
    # Without gravity there is nothing to model, at any tolerance.
    weightless = with_tables(scene, environment={"gravity": 0.0})
    assert not by_term(weightless)["gravity, mean over a turn"].modelled


@pytest.mark.parametrize("text", ["1", "5", "-1 %", "nan", "inf", "1 mm", "0,5 %", "", "fine"])
def test_other_tolerances_are_refused(paper: Scene, text: str) -> None:
    with pytest.raises(SceneError, match=r'--tolerance = ".*".*allowed: a fraction below 1'):
        with_tolerance(paper, text)


@pytest.mark.parametrize("words", COMMANDS)
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--tolerance", "7"), "--tolerance"),
        (("--tolerance", "fine"), "0 takes the finest"),
    ],
)
def test_every_command_that_answers_takes_the_option(
    words: tuple[str, ...], options: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([*words, *options]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert message in shown.err
    assert "unknown" not in shown.err.lower()


def test_the_option_reaches_the_answer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "short.toml"
    scene.write_text(Path(PAPER).read_text().replace('time_limit = "120 s"', 'time_limit = "1 s"'))
    rows = []
    for command in (("calibrate", scene), ("simulate", scene)):
        code = cli.main([*map(str, command), "--tolerance", "60 %", "--json"])
        printed = capsys.readouterr()
        # One second settles no run.
        assert code == (0 if command[0] == "calibrate" else 1), printed.err
        document: dict[str, Any] = json.loads(printed.out)
        rows.append(document["models_used"])
    assert rows[0] == rows[1]
    assert {row["term"]: row["model"] for row in rows[0]}["tube inertia"] != "left out"
    assert "tolerance of 60 %" in {row["term"]: row["why"] for row in rows[0]}["surface tension"]
