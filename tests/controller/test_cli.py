"""`ringbalance simulate`: exit codes, one clean document, laws by name and by file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import ringbalance
from ringbalance.cli import main
from ringbalance.controller.cli import simulate
from ringbalance.controller.loop import simulate as run_loop
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_law
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
    code = simulate(path, json=True, **options)
    return code, json.loads(capsys.readouterr().out)


def test_the_calibrated_law_is_the_default(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, found = document(scene_file, capsys)
    # At 1 % the inertia of the liquid in the tube counts, so that fill and velocity are integrated together.
    assert (found["law"], found["integrator"]) == ("calibrated", "runge_kutta")
    assert code == (0 if found["settled"] else 1)


def test_the_papers_law_settles(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, found = document(scene_file, capsys, law="paper")
    assert (code, found["law"], found["integrator"]) == (0, "paper", "closed_form")
    assert found["settling_time_s"] < 5


def test_a_saved_law_gives_the_same_run(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], paper_scene: Scene
) -> None:
    saved = paper_law(paper_scene).save(tmp_path / "law.json")
    assert document(scene_file, capsys, law=str(saved)) == document(scene_file, capsys, law="paper")


def test_not_settling_is_exit_code_1_with_its_result(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = changed(scene_file, tmp_path, 'pressure = "0.7 MPa"', 'pressure = "0.1 MPa"')
    code, found = document(path, capsys, law="paper")
    assert code == 1
    assert found["outcome"] == "stalled"
    assert "gas.pressure" in found["status"]


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
    found = json.loads(capsys.readouterr().out)
    assert len({injection["time_s"] for injection in found["injections"]}) == 1


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
        simulate(changed(scene_file, tmp_path, old, new), law=str(saved))


def test_python_takes_a_model_or_a_law(scene: Scene, model: BalancerModel) -> None:
    law = paper_law(scene)
    by_law, by_model = run_loop(scene, flow_law=law), run_loop(scene, model)
    assert by_law.status == by_model.status
    assert by_law.time.tolist() == by_model.time.tolist()
    with pytest.raises(ValueError, match="flow_law"):
        run_loop(scene)
    with pytest.raises(ValueError, match="flow_law"):
        run_loop(scene, model, flow_law=law)
