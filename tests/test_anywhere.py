"""From any folder: scenes by the names with which they come, seeds, and programs by their names."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.commands import COMMANDS
from ringbalance.export import command
from ringbalance.interface import opened

NAME = "liquid_ring_paper"


@pytest.mark.parametrize("written", [NAME, f"{NAME}.toml"])
def test_a_scene_of_the_program_is_named_in_place_of_a_file(
    written: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    named, stored = rb.load_scene(written), rb.load_scene(rb.bundled_scene(NAME))
    assert named == stored
    assert (named.file, named.source, named.sha256) == (f"{NAME}.toml", stored.source, stored.sha256)


def test_a_mesh_beside_a_scene_of_the_program_is_read_from_anywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert rb.load_scene("imported_chamber").mesh_digest


def test_a_file_of_the_user_precedes_a_scene_of_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = rb.bundled_scene(NAME).read_text(encoding="utf-8")
    Path(f"{NAME}.toml").write_text(text.replace('bore = "1.5 mm"', 'bore = "1.4 mm"'), encoding="utf-8")
    scene = rb.load_scene(f"{NAME}.toml")
    assert isinstance(scene, rb.Scene)
    assert scene.tube.bore == 1.4e-3


def test_a_misspelt_name_is_guessed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(rb.SceneError, match=r': .*, washing_machine \(did you mean "liquid_ring_paper"\?\)'):
        rb.load_scene("liquid_ring_papr")
    with pytest.raises(rb.SceneError, match="there is no such file"):
        rb.load_scene(f"elsewhere/{NAME}")


@pytest.mark.parametrize("typed", [NAME, f"{NAME}/"])
def test_a_folder_of_a_scenes_name_is_no_scene_and_the_scene_is_named(
    typed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after `--out liquid_ring_paper`; what the sentence names is loaded beside the folder."""
    monkeypatch.chdir(tmp_path)
    Path(NAME).mkdir()
    words = rf'this is a folder, .* comes with the program: .* \(as "{NAME}.toml"\)'
    with pytest.raises(rb.SceneError, match=words):
        rb.load_scene(typed)
    assert rb.load_scene(f"{NAME}.toml").source == f"{NAME}.toml"


def test_commands_run_on_a_scene_of_the_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert (
        main(["fit", NAME, str(rb.bundled_scene(NAME).parent / "measurements/trial_weight.csv"), "--preview"])
        == 0
    )
    assert main(["export", "six_chamber", "--to", "twincat", "--block", "controller", "--out", "plc"]) == 0
    assert [each.name for each in Path("plc").iterdir()] == ["six_chamber_controller.st"]
    capsys.readouterr()


def test_a_seed_replaces_that_of_the_scene_wherever_runs_are_drawn() -> None:
    drawn = {"report", "simulate", "tune", "compare", "sweep", "design"}
    assert {name for name, each in COMMANDS.items() if "seed" in each.options} == drawn
    scene = opened(rb.bundled_scene(NAME), None, 41)
    assert scene.run.seed == 41
    assert scene == rb.load_scene(NAME).with_values({"run.seed": 41})


def test_the_seed_reaches_a_sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["sweep", NAME, "--vary", "tube.bore=1mm,2mm", "--no-intervals", "--check", "0", "--no-figures"]
    assert main([*words, "--seed", "41", "--workers", "1", "--write", "1", "--out", str(tmp_path)]) == 0
    (file,) = tmp_path.rglob("*.toml")
    assert rb.load_scene(file).run.seed == 41
    capsys.readouterr()


def test_programs_are_names_of_what_they_take() -> None:
    (choices,) = [COMMANDS["export"].options["to"].hint]
    assert {*command.HOSTS} | {*command.HOSTS.values()} <= {*choices.__args__}
    for program, host in command.HOSTS.items():
        page = Path(__file__).parents[1] / "docs" / f"host-{program}.md"
        assert f"--to {host} " in page.read_text(encoding="utf-8")
    options = SimpleNamespace(to="simulink", all_systems=False, points=3)
    with pytest.raises(rb.SceneError, match="fmi2 has no grid"):
        command.export(options)


FACTORS = """# kind = "friction"
# source = "test rig 4"
# uncertainty = 0.02
reynolds,friction_factor,series
5200,{},tube 1
8100,{},tube 1
5150,{},tube 2
"""


@pytest.mark.parametrize(
    ("part", "verdict", "hint"), [(1, "confirmed", ""), (4, "refuted", "Fanning"), (3, "refuted", "")]
)
def test_fannings_factors_are_recognised(
    part: int, verdict: str, hint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [tmp_path / "first.csv", tmp_path / "second.csv"]
    for file in files:
        text = FACTORS.format(*(each / part for each in (0.0371, 0.0330, 0.0378)))
        file.write_text(text.replace("rig 4", file.stem), encoding="utf-8")
    words = [word for file in files for word in ("--data", str(file))]
    assert main(["verify", *words, "--json"]) == 0
    documents = json.loads(capsys.readouterr().out)
    assert [each["verdict"] for each in documents] == [verdict] * 2
    assert all(hint in each["hint"] if hint else not each["hint"] for each in documents)
    assert main(["verify", *words]) == 0
    assert capsys.readouterr().out.count("Fanning") == (2 if hint else 0)
    assert main(["verify", *words, "--brief"]) == 0
    short = capsys.readouterr().out
    assert short.count("3 points, bias ") == short.count(f"  {verdict} (") == 2
    assert short.count("Fanning") == (2 if hint else 0)
