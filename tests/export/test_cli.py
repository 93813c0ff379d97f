"""The command: its files, and one clear error for what it cannot use."""

from __future__ import annotations

from pathlib import Path

import pytest

import ringbalance as rb
from ringbalance.cli import main

OIL = str(rb.bundled_scene("silicone_oil_100cst"))


@pytest.mark.parametrize(
    ("to", "files"),
    [
        ("c", ["a.c", "a.h"]),
        ("st", ["a.st"]),
        ("python", ["a.py"]),
        ("js", ["a.mjs"]),
        ("csv", ["a.csv"]),
        ("fmi2", ["a.fmu"]),
        ("fmi3", ["a.fmu"]),
    ],
)
def test_it_writes_the_files_it_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], to: str, files: list[str]
) -> None:
    words = ["--points", "3"] if to == "csv" else []
    assert main(["export", OIL, "--to", to, "--out", str(tmp_path), "--name", "a", *words]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == files
    assert sorted(capsys.readouterr().out.split()) == [str(tmp_path / name) for name in files]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([OIL, "--to", "c", "--points", "5"], "--points = 5"),
        ([OIL, "--to", "csv", "--points", "1"], "--points = 1"),
        ([OIL, "--to", "c", "--name", "2 b"], '--name = "2 b"'),
        ([OIL, "--to", "python", "--name", "class"], '--name = "class"'),
        ([OIL, "--to", "python", "--name", "math"], '--name = "math"'),
        ([OIL, "--to", "rust"], "rust"),
        ([OIL, "--to", "c", "--all-systems"], "--all-systems = true"),
        (["none.toml", "--to", "c"], "none.toml"),
    ],
)
def test_bad_input_is_one_error_and_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    assert main(["export", *words, "--out", str(tmp_path / "out")]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("grinding_spindle", ("0.856 s/um", "1.5 s/um"), "the loop is near instability: gain margin 1.1"),
        ("grinding_spindle", ("0.856 s/um", "2.5 s/um"), "the loop is unstable: gain margin 0.68"),
        ("grinding_spindle", ("0.856 s/um", "0.8 s/um"), ""),
        ("washing_machine", ("state_weight = 3.5", "state_weight = 1e9"), "the regulator is unstable"),
        ("washing_machine", ("", ""), ""),
    ],
)
def test_settings_of_an_unstable_loop_are_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, change: tuple[str, str], says: str
) -> None:
    scene = tmp_path / "scene.toml"
    text = rb.bundled_scene(name).read_text(encoding="utf-8")
    scene.write_text(text.replace(*change, 1), encoding="utf-8")
    words = ["--to", "python", "--block", "controller", "--out", str(tmp_path / "out")]
    assert main(["export", str(scene), *words]) == 0
    told = capsys.readouterr().err.replace("\n", " ")
    assert says in told
    assert ("unstable" in told or "near instability" in told) == bool(says)


def test_a_law_based_scene_exports_its_controller(tmp_path: Path) -> None:
    """What `tune --save` may recommend."""
    text = Path(OIL).read_text(encoding="utf-8")
    scene = tmp_path / "tuned.toml"
    scene.write_text(
        text.replace("[controller]\n", '[controller]\nkind = "law_based"\n').replace(
            'kind = "target_vector"\n', ""
        )
    )
    words = ["export", str(scene), "--to", "python", "--block", "controller", "--name", "ctrl"]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    assert "Law-based controller" in (tmp_path / "out" / "ctrl.py").read_text(encoding="utf-8")
