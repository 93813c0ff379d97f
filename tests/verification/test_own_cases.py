"""Cases of a user's own: the documented one runs as it stands, and what is wrong with one stops no other."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from ringbalance.running import run_command

DOCUMENT = Path(__file__).parents[2] / "docs" / "verification-cases.md"
TEXT = """
id = "{name}"
kind = "code_verification"
title = "A sum"
claim = "Two and two are four."
protects = "sums"
assumes = []
does_not_cover = []
[reference]
kind = "closed form"
source = "arithmetic"
uncertainty = "none"
[[quantity]]
name = "total"
title = "the total"
unit = "1"
basis = "ratio"
metric = "relative"
limit = 1e-12
why = "round-off"
[[must_fail]]
id = "one_more"
what = "one is added"
expect = "failed"
"""
CODE = """
def reference(scene):
    return {"total": 4}

def compute(scene, level, defect=None):
    return {"total": 2 + 2 + (defect == "one_more")}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with one good case."""
    _write(tmp_path, "good", CODE)
    return tmp_path


def _write(folder: Path, name: str, code: str, text: str = TEXT) -> None:
    (folder / name).mkdir()
    (folder / name / "case.toml").write_text(text.format(name=name))
    (folder / name / "case.py").write_text(code)


def _documented(folder: Path) -> Path:
    """The files of the page, under the names that it gives them."""
    text = DOCUMENT.read_text()
    for name, _, content in re.findall(r"`(my_cases/\S+)`:\n\n```(\w+)\n(.*?)```", text, flags=re.DOTALL):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    return folder / "my_cases"


def test_the_documented_case_passes_and_catches_its_mutation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cases = _documented(tmp_path)
    assert (
        run_command("verify", case_ids=("moment_without_plates",), cases=cases, mutations=True, json=True)
        == 0
    )
    (result,) = json.loads(capsys.readouterr().out)
    assert (result["verdict"], result["broken"]) == ("passed", False)
    assert [mutation["verdict"] for mutation in result["mutations"]] == ["failed"]


@pytest.mark.parametrize("which", ["folder of cases", "one case"])
def test_own_cases_join_the_program_s(folder: Path, capsys: pytest.CaptureFixture[str], which: str) -> None:
    cases = folder if which == "folder of cases" else folder / "good"
    assert (
        run_command(
            "verify", case_ids=("good", "claim_12_correction_mass"), cases=cases, mutations=True, json=True
        )
        == 0
    )
    results = json.loads(capsys.readouterr().out)
    assert [result["id"] for result in results] == ["good", "claim_12_correction_mass"]
    assert results[0]["quantities"][0]["value"] == 4
    assert run_command("verify", cases=cases, list_=True, json=True) == 0
    listed = [case["id"] for case in json.loads(capsys.readouterr().out)]
    assert listed[-1] == "good"
    assert len(listed) > 40


def test_a_changed_scene_is_one_that_the_program_calibrates(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = """
import ringbalance as rb

def compute(scene, level):
    wide = rb.calibrate(scene).answers.chamber_volume > 67e-6
    return {"total": 4 if wide else 3}

def reference(scene):
    return {"total": 4}
"""
    changed = 'scene = {{ "disc.axial_width" = 0.05 }}\nwhat = "one is added"'
    _write(tmp_path, "narrow", code, TEXT.replace('what = "one is added"', changed))
    assert run_command("verify", case_ids=("narrow",), cases=tmp_path, mutations=True, json=True) == 0
    (result,) = json.loads(capsys.readouterr().out)
    assert [mutation["verdict"] for mutation in result["mutations"]] == ["failed"]


def test_a_case_that_fails_or_misses_its_mutation_ends_with_one(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _write(folder, "false", CODE.replace("4", "5"))
    _write(folder, "blind", CODE.replace(' + (defect == "one_more")', ""))
    _write(folder, "broken_down", CODE.replace("2 + 2", "1 / 0"))
    for name in ("false", "broken_down"):
        assert run_command("verify", case_ids=(name,), cases=folder) == 1
    assert "ZeroDivisionError" in capsys.readouterr().out
    assert run_command("verify", case_ids=("blind",), cases=folder) == 0
    assert run_command("verify", case_ids=("blind",), cases=folder, mutations=True) == 1


@pytest.mark.parametrize(
    ("code", "named"),
    [
        ("", ["there is no function compute"]),
        ("def compute(:", ["line 1", "SyntaxError"]),
        ("import no_such_module", ["line 1", "ModuleNotFoundError", "no_such_module"]),
        (CODE.replace("2 + 2", "scene.no_such_table"), ["line 6", "AttributeError", "no_such_table"]),
        (
            CODE.replace("level, defect=None", "level").replace("(defect)", "0"),
            ["third argument", "one_more"],
        ),
        (CODE.replace('{"total": 2', '{"sum": 2'), ["compute", "sum", "total"]),
        (CODE.replace('{"total": 4}', '{"sum": 4}'), ["reference", "sum", "total"]),
        (CODE.replace('{"total": 4}', "4"), ["reference", "int"]),
        (CODE.replace('{"total": 4}', '{"total": "four"}'), ["reference", "str", "total"]),
        ("def compute(scene, level, defect=None): return 4", ["compute", "int", "Evidence"]),
    ],
)
def test_wrong_code_is_one_sentence_and_stops_no_other(
    folder: Path, capsys: pytest.CaptureFixture[str], code: str, named: list[str]
) -> None:
    _write(folder, "wrong", code)
    assert run_command("verify", case_ids=("wrong", "good"), cases=folder, json=True) == 2
    printed = capsys.readouterr()
    assert [(result["id"], result["verdict"]) for result in json.loads(printed.out)] == [("good", "passed")]
    assert len(printed.err.splitlines()) == 1
    for word in ("wrong/case.py", *named):
        assert word in printed.err


def test_the_line_of_a_wrong_code_is_said_for_a_relative_folder(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _write(folder, "wrong", CODE.replace("2 + 2", "scene.no_such_table"))
    monkeypatch.chdir(folder.parent)
    assert run_command("verify", case_ids=("wrong",), cases=Path(folder.name)) == 2
    assert "line 6: AttributeError" in capsys.readouterr().err


def test_a_wrong_text_is_one_sentence_and_stops_no_other(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _write(folder, "wrong", CODE, TEXT.replace("limit = 1e-12", "limit = 0.0"))
    assert run_command("verify", case_ids=("good",), cases=folder) == 2
    printed = capsys.readouterr()
    assert "1 passed" in printed.out
    assert len(printed.err.splitlines()) == 1
    for word in ("wrong/case.toml", "limit must be positive"):
        assert word in printed.err


def test_a_case_asked_for_by_name_says_what_is_wrong_with_its_text(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _write(folder, "wrong", CODE, TEXT.replace("limit =", "limt ="))
    assert run_command("verify", case_ids=("wrong",), cases=folder) == 2
    said = capsys.readouterr().err
    assert "wrong/case.toml" in said
    assert "unknown case" not in said


def test_a_folder_without_cases_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for folder in (tmp_path, tmp_path / "missing"):
        assert run_command("verify", case_ids=("claim_12_correction_mass",), cases=folder) == 2
        assert str(folder) in capsys.readouterr().err
