"""`ringbalance verify`: exit codes, clean JSON, and a guess at what was meant."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest

from ringbalance.cli import main
from ringbalance.running import run_command
from ringbalance.scene import SceneError
from ringbalance.scene.models import Scene
from ringbalance.verification.case import CaseDefinition
from ringbalance.verification.command import _exit_code, _print_results
from ringbalance.verification.evidence import Found
from ringbalance.verification.runner import run_definition


def test_a_column_of_uncertainties_needs_no_key(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = '# kind = "friction"\n# source = "rig"\nreynolds,friction_factor,series{}\n5200,0.0371,a{}\n'
    text += "8100,0.0330,a{}\n"
    answers = []
    for head, cell in ((",uncertainty", ",0.02"), (",uncertainty_friction_factor [%]", ",2"), ("", "")):
        (tmp_path / "rig.csv").write_text(text.format(head, cell, cell), encoding="utf-8")
        answers.append((main(["verify", "--data", str(tmp_path / "rig.csv")]), capsys.readouterr().err))
    assert [code for code, _ in answers] == [0, 0, 2]
    assert (
        'the key "uncertainty" is missing in the first lines, marked #, and no column has it' in answers[2][1]
    )


def test_json_is_one_clean_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("verify", case_ids=("gci_celik2008", "claim_12_correction_mass"), json=True) == 0
    printed = capsys.readouterr()
    document = json.loads(printed.out)
    assert [case["id"] for case in document] == ["gci_celik2008", "claim_12_correction_mass"]
    assert [case["verdict"] for case in document] == ["passed", "refuted"]
    assert printed.err == ""


def test_the_table_says_verdict_and_consequence(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("verify", case_ids=("claim_12_correction_mass",), mutations=True) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "claim_12_correction_mass claim 12, liquid ring refuted" in words
    assert "Read 72 mm per transferred mass" in words
    assert "confirmed, caught" in words
    assert words.endswith("1 refuted")


def test_a_brief_answer_names_what_is_refuted_with_the_quantity_that_departs_most(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Of the two readings of Eq. 22 one is 1.83 times the reference, the other 1.828 times."""
    assert main(["verify", "claim_12_correction_mass", "gci_celik2008", "--brief", "--quiet"]) == 0
    refuted, total = " ".join(capsys.readouterr().out.split()).split(" g mm 1 ")
    assert refuted.startswith("claim_12_correction_mass claim 12, liquid ring refuted: Eq. 22 for ")
    assert " g mm, to be 1" in refuted
    assert total == "passed, 1 refuted"


def test_a_table_in_a_file_is_not_broken_unless_columns_says_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    row = "Eq. 22 for two adjacent full chambers, taken literally (3447"
    for columns in ("", "60"):
        monkeypatch.setenv("COLUMNS", columns) if columns else monkeypatch.delenv("COLUMNS", raising=False)
        assert run_command("verify", case_ids=("claim_12_correction_mass",)) == 0
        lines = capsys.readouterr().out.splitlines()
        assert any(line.startswith(f" {row}") for line in lines) == (not columns)
        assert any(line.startswith("consequence") and len(line) > 100 for line in lines) == (not columns)
        assert not any(line.endswith(" ") for line in lines)


def test_the_table_shows_the_limit_that_judged(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("verify", case_ids=("rotating_section",)) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "3.16228 within 15 %" in words
    assert "\u2264 1 \u00d7 10^-5" in words


def test_the_list_runs_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("verify", list_=True, json=True) == 0
    assert len(json.loads(capsys.readouterr().out)) > 40
    assert run_command("verify", list_=True) == 0
    assert "claim_20_rectangular_element" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("case_id", "meant"),
    [
        ("claim_6", "claim_06_wall_pressure"),
        ("gci_celik", "gci_celik2008"),
        ("manufactured2d", "manufactured_2d"),
        ("zzz", None),
    ],
)
def test_an_unknown_case_is_bad_input(
    capsys: pytest.CaptureFixture[str], case_id: str, meant: str | None
) -> None:
    assert run_command("verify", case_ids=(case_id,)) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert f'unknown case "{case_id}"' in printed.err
    assert ("did you mean" in printed.err) == (meant is not None)
    assert meant is None or f'"{meant}"' in printed.err


def test_a_scene_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "disc.toml"
    path.write_text("name = 3")
    with pytest.raises(SceneError):
        run_command("verify", case_ids=("claim_20_rectangular_element",), scene=path)


def test_only_code_verification_and_missed_defects_fail_the_run(
    claim: CaseDefinition,
    verification: CaseDefinition,
    made_up_code: Any,
    paper_scene: Scene,
    capsys: pytest.CaptureFixture[str],
) -> None:
    wrong = made_up_code(number=Found(value=20.0))
    refuted = run_definition(claim, wrong, scene=paper_scene)
    failed = run_definition(verification, wrong, scene=paper_scene)
    solution = dataclasses.replace(
        failed, definition=dataclasses.replace(verification, kind="solution_verification")
    )
    assert refuted.verdict == "refuted"
    assert failed.verdict == "failed"
    assert _exit_code([refuted]) == 0
    assert _exit_code([solution]) == 0
    assert _exit_code([refuted, failed]) == 1
    blind = made_up_code(defect=lambda number, _, __: number)
    broken = run_definition(claim, blind, scene=paper_scene, mutations=True)
    assert _exit_code([broken]) == 1
    _print_results([broken, refuted])
    total = " ".join(capsys.readouterr().out.split("\n\n")[-1].split())
    assert total.endswith("; 1 of these proves nothing, because a mutation was not caught")
    assert _exit_code([dataclasses.replace(broken, mutations=())]) == 0


_VESSEL = (
    '# kind = "vessel"\n# source = "rig 4"\n# uncertainty = 0.05\n'
    "time [ms],pressure [kPa],start_pressure [kPa],far_pressure [kPa],temperature [K],volume [ml],"
    "conductance [l/(s*bar)],series\n"
)


def _judged(path: Path, rows: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    path.write_text(_VESSEL + rows, encoding="utf-8")
    code = main(["verify", "--data", str(path), "--json"])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def test_a_file_of_measurements_is_predicted_and_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "rig.csv"
    # V/(C p0) = 51 ms; choked up to 0.5, so 300 kPa take 2/8 of it, less up to 1/1.4 when adiabatic.
    isothermal = 51 * 200 / 800
    rows = "".join(f"{0.86 * isothermal * f:.4f},300,100,800,293.15,51,1,a\n" for f in (0.98, 1.0, 1.02))
    code, out, _ = _judged(path, rows, capsys)
    document = json.loads(out)
    assert (code, document["verdict"]) == (0, "confirmed")
    assert document["points"][1]["predicted"] == pytest.approx(
        isothermal * (1 + 1 / 1.4) / 2 / 1000, rel=1e-3
    )
    code, out, err = _judged(path, rows.replace(",51,", ",80,"), capsys)
    assert code == 0, err
    assert json.loads(out)["verdict"] == "refuted"
    assert run_command("verify", data=[path]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "refuted (rig 4)" in words
    assert "rule confirmed where at least" in words
    assert "predictions known to" in words


_FRICTION = '# kind = "friction"\n# source = "rig 5"\n# uncertainty = "1 %"\n'


@pytest.mark.parametrize(
    ("head", "rows", "verdict", "hint", "remarks"),
    [
        # 30 % above 64/Re, where the program allows for early transition.
        ("", [(re, 1.3 * 64 / re) for re in (1850, 1900, 1950, 2000)], "confirmed", "only because", 0),
        ("", [(re, 64 / re) for re in (300, 500, 900)], "confirmed", "", 0),
        ("", [(re, 16 / re) for re in (300, 500, 900)], "refuted", "these are Fanning's", 0),
        (
            ",series",
            [(500, 0.032, "b"), (900, 16 / 900, "b"), (400, 0.16, "a")],
            "refuted",
            "those of b are",
            0,
        ),
        (",uncertainty [%]", [(300, 64 / 300, 2), (500, 64 / 500, 2)], "confirmed", "", 1),
    ],
)
def test_a_judgement_says_what_it_rests_on(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    head: str,
    rows: list[tuple[float | str, ...]],
    verdict: str,
    hint: str,
    remarks: int,
) -> None:
    path = tmp_path / "tube.csv"
    lines = "".join(",".join(map(str, row)) + "\n" for row in rows)
    path.write_text(f"{_FRICTION}reynolds,friction_factor{head}\n{lines}", encoding="utf-8")
    assert run_command("verify", data=[path], json=True) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["verdict"] == verdict
    assert hint in document["hint"]
    assert bool(hint) == bool(document["hint"])
    assert len(document["remarks"]) == remarks
    shares = [each["stated"] / each["predicted"] for each in document["points"]]
    assert document["half_width"]["largest"] == pytest.approx(max(shares))


def test_a_cell_with_an_error_has_no_second_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "tube.csv"
    path.write_text(_FRICTION + "reynolds,friction_factor\n300,nan\n500,abc\n900,0\n", encoding="utf-8")
    assert main(["verify", "--data", str(path)]) == 2
    error = capsys.readouterr().err
    assert error.count("tube.csv: line") == 3
    assert "relative" not in error


@pytest.mark.parametrize(
    ("rows", "named"),
    [
        ("10,900,100,800,293,51,1,a\n" * 2, "between start_pressure and far_pressure"),
        ("10,300,100,800,293,0,1,a\n" * 2, '"volume [ml]" = "0": it is not above zero'),
        ("10,300,100,800,293,51,1,a\n", "1 point"),
        ("10,300,100,800,293,51,x,a\n" * 2, 'line 6, column "conductance [l/(s*bar)]"'),
    ],
)
def test_a_file_that_cannot_be_judged_is_bad_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rows: str, named: str
) -> None:
    path = tmp_path / "rig.csv"
    code, out, err = _judged(path, rows, capsys)
    assert (code, out) == (2, "")
    assert named in err
    assert all("rig.csv: " in line for line in err.splitlines())
