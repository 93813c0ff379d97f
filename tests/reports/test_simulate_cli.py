"""`ringbalance simulate`: exit codes, one clean document, laws by name and by file."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import ringbalance
from ringbalance.cli import main
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.running import run_command
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene


@pytest.fixture
def scene_file() -> Path:
    return ringbalance.bundled_scene("liquid_ring_paper")


def changed(scene_file: Path, tmp_path: Path, old: str, new: str) -> Path:
    """The bundled scene with one text replaced."""
    text = scene_file.read_text()
    assert old in text
    path = tmp_path / "changed.toml"
    path.write_text(text.replace(old, new))
    return path


def document(path: Path, capsys: pytest.CaptureFixture[str], **options: Any) -> tuple[int, dict[str, Any]]:
    """Exit code and document of a run; the plain run of the paper's law is made once."""
    plain = options == {"law": "paper"} and path == ringbalance.bundled_scene("liquid_ring_paper")
    if not (plain and _PLAIN):
        code = run_command("simulate", scene=path, json=True, **options)
        printed = capsys.readouterr()
        assert code in (0, 1), printed.err
        result = code, json.loads(printed.out)
        if not plain:
            return result
        _PLAIN.append(result)
    return _PLAIN[0]


_PLAIN: list[tuple[int, dict[str, Any]]] = []


def test_the_calibrated_law_is_the_default(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, run = document(scene_file, capsys)
    # At 1 % the inertia of the liquid in the tube counts, so that fill and velocity are integrated together.
    assert run["law"] == "calibrated"
    assert code == (0 if run["settled"] else 1)


def test_the_papers_law_settles(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, run = document(scene_file, capsys, law="paper")
    assert (code, run["law"]) == (0, "paper")
    assert run["settling_time_s"] < 5


def test_a_saved_law_gives_the_same_run(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], paper_scene: Scene
) -> None:
    saved = paper_law(paper_scene).save(tmp_path / "law.json")
    assert document(scene_file, capsys, law=str(saved)) == document(scene_file, capsys, law="paper")


def test_not_settling_is_exit_code_1_with_its_result(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = changed(scene_file, tmp_path, 'pressure = "0.7 MPa"', 'pressure = "0.1 MPa"')
    code, run = document(path, capsys, law="paper")
    assert code == 1
    assert run["outcome"] == "stalled"
    assert "gas.pressure" in run["status"]


def test_tables_go_to_standard_output_and_progress_does_not(
    scene_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", str(scene_file), "--law", "paper"]) == 0
    printed = capsys.readouterr()
    assert "settling time" in printed.out
    assert "injections" in printed.out
    assert "settling" not in printed.err


def test_bad_input_is_exit_code_2_and_says_what(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", str(scene_file), "--law", str(tmp_path / "none.json")]) == 2
    assert "none.json" in capsys.readouterr().err
    path = changed(scene_file, tmp_path, 'kind = "target_vector"', 'kind = "guesswork"')
    assert main(["simulate", str(path), "--law", "paper", "--json"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert '[controller] kind = "guesswork"' in printed.err


def test_the_law_based_algorithm_runs_from_a_scene(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = changed(scene_file, tmp_path, 'kind = "target_vector"', 'kind = "law_based"')
    assert main(["simulate", str(path), "--law", "paper", "--json"]) == 0
    run = json.loads(capsys.readouterr().out)
    assert len({injection["time_s"] for injection in run["injections"]}) == 1


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("max_fill_ratio = 0.5 ", "max_fill_ratio = 0.6 ", "max_fill_ratio"),
        ('axial_width = "62 mm"', 'axial_width = "80 mm"', "axial_width"),
    ],
)
def test_a_law_of_another_disc_is_refused(
    scene_file: Path, tmp_path: Path, paper_scene: Scene, old: str, new: str, key: str
) -> None:
    saved = paper_law(paper_scene).save(tmp_path / "law.json")
    scene_file = changed(scene_file, tmp_path, "initial_fill = 0.25", "# initial_fill = 0.25")
    with pytest.raises(SceneError, match=rf"\[disc\] {key}"):
        run_command("simulate", scene=changed(scene_file, tmp_path, old, new), law=str(saved))


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def test_a_table_holds_every_instant_of_a_run(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, run = document(scene_file, capsys, law="paper", csv=tmp_path / "run.csv")
    rows = rows_of(tmp_path / "run.csv")
    assert [float(row["time_s"]) for row in rows] == run["time_s"]
    assert [float(row["amplitude_m"]) for row in rows] == run["amplitude_m"]
    assert [float(row["fill_ratio_B"]) for row in rows] == run["fill_ratio"]["B"]
    seen = [float(row["measured_amplitude_m"]) for row in rows if row["measured_amplitude_m"]]
    assert seen == run["samples"]["amplitude_m"]
    opened = run["injections"][0]
    at = [
        row
        for row in rows
        if opened["time_s"] <= float(row["time_s"]) < opened["time_s"] + opened["duration_s"]
    ]
    assert {row[f"valve_open_{opened['chamber']}"] for row in at} == {"1"}
    assert rows[-1][f"valve_open_{opened['chamber']}"] == "0"


def test_a_table_of_eccentric_masses_holds_every_sample(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = ringbalance.bundled_scene("driven_masses_small")
    short = changed(path, tmp_path, 'time_limit = "30 s"', 'time_limit = "0.5 s"')
    _, run = document(short, capsys, csv=tmp_path / "run.csv", plot=tmp_path / "run.svg")
    rows = rows_of(tmp_path / "run.csv")
    assert len(rows) == 501
    assert float(rows[-1]["time_s"]) == pytest.approx(0.5)
    assert float(rows[-1]["energy_J"]) == run["energy_J"]
    assert math.hypot(float(rows[7]["whirl_x_m"]), float(rows[7]["whirl_y_m"])) == pytest.approx(
        float(rows[7]["amplitude_m"])
    )
    begun = {stage["name"]: stage["start_s"] for stage in run["stages"]}
    for name, start in begun.items():
        assert float(next(row for row in rows if row["stage"] == name)["time_s"]) == start
    sheet = ElementTree.fromstring((tmp_path / "run.svg").read_text())
    figures = sheet.findall("{http://www.w3.org/2000/svg}svg")
    # At constant speed there is no run-up.
    assert len(figures) == 4
    assert "var(" not in (tmp_path / "run.svg").read_text()


def test_a_sheet_shows_the_figures_of_a_run(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document(scene_file, capsys, law="paper", plot=tmp_path / "run.svg")
    sheet = ElementTree.fromstring((tmp_path / "run.svg").read_text())
    message = [figure.attrib["aria-label"] for figure in sheet.findall("{http://www.w3.org/2000/svg}svg")]
    assert len(message) == 4
    for words in ("amplitude", "valve open", "fill ratios", "polar"):
        assert any(words in text for text in message)
    below = [float(figure.attrib["y"]) for figure in sheet.findall("{http://www.w3.org/2000/svg}svg")]
    assert below == sorted(below)
    assert len(set(below)) == 3


def test_a_seed_replaces_that_of_the_scene(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reseeded = changed(scene_file, tmp_path, "seed = 0", "seed = 3")
    _, by_option = document(scene_file, capsys, law="paper", seed=3)
    _, by_file = document(reseeded, capsys, law="paper")
    _, other = document(scene_file, capsys, law="paper")
    assert by_option | {"scene": by_file["scene"]} == by_file
    assert by_option["samples"] != other["samples"]


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--csv", "run.txt", "ends in .csv"),
        ("--plot", "run.png", "ends in .svg"),
        ("--seed", "-1", "from 0 to 2^63 - 1"),
        ("--csv", "file.csv/run.csv", "is a file, not a folder"),
        ("--plot", "folder.svg", "is a folder, not a file"),
    ],
)
def test_outputs_that_cannot_be_written_are_refused_before_the_run(
    option: str, value: str, said: str, scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file.csv").touch()
    (tmp_path / "folder.svg").mkdir()
    argument = value if option == "--seed" else str(tmp_path / value)
    assert main(["simulate", str(scene_file), "--law", "paper", option, argument, "--json"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert said in printed.err
    assert len(printed.err.strip().splitlines()) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file.csv", "folder.svg"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["simulate", "SMALL", "--law", "paper"], '--law = "paper": the balancer of'),
        (["tune", "SMALL", "--law", "paper"], '--law = "paper": the balancer of'),
        (["simulate", "SMALL", "--seed", "1.5"], "1.5 is not a whole number"),
        (["verify", "gci_behaviour", "--workers", "0"], "--workers = 0: there is no process to work"),
    ],
)
def test_an_option_that_cannot_be_meant_is_refused(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    small = str(ringbalance.bundled_scene("driven_masses_small"))
    assert main([small if word == "SMALL" else word for word in words]) == 2
    out, error = capsys.readouterr()
    assert (out, message in error, len(error.splitlines())) == ("", True, 1)
