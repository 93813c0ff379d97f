"""Every command runs on a balancer of another package that is installed beside the program."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from own_balancers import EXAMPLE, described, install_balls

HEAVY = EXAMPLE.replace(b"80 g*mm", b"120 g*mm")


@pytest.fixture(scope="module")
def beside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("balls")
    install_balls(folder / "site")
    (folder / "balls.toml").write_bytes(EXAMPLE)
    (folder / "heavy.toml").write_bytes(HEAVY)
    return folder


def ended(folder: Path, line: str) -> tuple[int, str]:
    """Exit code and output of a command in a process of its own."""
    child = subprocess.run(
        [sys.executable, "-m", "ringbalance", *line.split(), "--quiet"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder / "site"), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert child.stderr == ""
    return child.returncode, child.stdout


def test_simulate_says_what_the_balancer_says(beside: Path) -> None:
    """Two balls of 1 g at 50 mm carry 100 g mm; of 120 g mm they leave 20 g mm, or 10 um."""
    assert ended(beside, "simulate balls.toml")[0] == 0
    code, text = ended(beside, "simulate heavy.toml --json")
    document = json.loads(text)
    assert code == 1
    assert document["amplitude_m"][-1] == pytest.approx(0.5 * 20e-6, rel=1e-2)
    own = document["findings"][1]
    assert own["code"] == "ball.too_light"
    assert own["text"] == "balls of 1 g are too light, more than 1.2 g each are needed"
    assert own["change"] == {"balls.mass": "raise"}


def test_tune_tries_its_settings_and_its_remedies(beside: Path) -> None:
    code, text = ended(beside, "tune heavy.toml --json")
    document = json.loads(text)
    assert code == 1
    assert document["settings"].keys() <= {"balls.drag"}
    assert document["own"]["verdict"] == "not met"
    (remedy,) = document["remedies"]
    assert remedy["changes"]["balls.mass"] == pytest.approx(1.44e-3, rel=1e-2)
    assert remedy["verdict"] == "met"


def test_compare_puts_it_beside_itself(beside: Path) -> None:
    code, text = ended(beside, "compare balls.toml heavy.toml --rotor first --json")
    assert code == 0
    assert json.loads(text)["balancer"] == ["ball", "ball"]


def test_sweep_runs_its_designs_in_two_processes(beside: Path) -> None:
    """Reach is 2 m r."""
    line = "sweep balls.toml --vary balls.mass=0.5g:1.5g:3 --runs 4 --workers 2 --out sweep"
    assert ended(beside, line)[0] == 0
    rows = list(csv.DictReader((beside / "sweep" / "table.csv").read_text().splitlines()))
    assert [float(row["reach [kg m]"]) for row in rows] == pytest.approx([5e-5, 1e-4, 1.5e-4])
    assert [row["verdict"] for row in rows] == ["not met", "undecided", "undecided"]


def test_report_has_its_section(beside: Path) -> None:
    """80 of 100 g mm: the balls rest 2 arccos(0.8) = 73.74 deg apart, opposite to the unbalance."""
    assert ended(beside, "report balls.toml --out report")[0] == 0
    page = (beside / "report" / "report.html").read_text()
    assert "Where the balls come to rest" in page
    evidence = json.loads((beside / "report" / "evidence.json").read_text())
    assert evidence["balls"]["apart_rad"] == pytest.approx(1.2870, abs=1e-4)
    assert "liquid" not in page
    assert "eccentric mass" not in page.lower()


def test_doctor_lists_it_and_what_cannot_be_used(tmp_path: Path) -> None:
    install_balls(tmp_path / "site")
    described(tmp_path / "site", "trim-weight", "0.1", {"trim": "nothing:register"})
    described(tmp_path / "site", "second-ring", "0.1", {"liquid_ring": "nothing:register"})
    _, text = ended(tmp_path, "doctor --json")
    states = {each["name"]: each for each in json.loads(text)["checks"] if "balancer" in each["name"]}
    assert states["balancer ball"]["state"] == "ok"
    assert states["balancer ball"]["text"] == "of ball-balancer 1.0"
    assert states["balancer trim"]["state"] == states["balancer liquid_ring"]["state"] == "broken"
    assert "No module named 'nothing'" in states["balancer trim"]["text"]
    assert states["balancer liquid_ring"]["text"].endswith("the program has a balancer of that name")


def test_check_balancer_passes(beside: Path) -> None:
    code, text = ended(beside, "check-balancer ball")
    assert code == 0
    assert text.startswith("the balancer ball passes all 18 checks")


@pytest.mark.parametrize(
    ("last", "said"),
    [
        ("yield -count * 0.1, 0j", "correction 0+0j kg m at -0.1 s, after 0 s"),
        ("yield count * 0.1, complex('nan')", "correction nan+0j kg m at 0 s"),
        ("yield 1.0 + count, 0j", "correction 0+0j kg m at 1 s"),
        ("yield count * 0.1, None", "yields (0.0, None)"),
        ("return; yield", "BallBalancer.corrections yields nothing"),
        ("1 / 0; yield", "raises ZeroDivisionError: division by zero (balancer.py:"),
    ],
)
def test_a_correction_that_cannot_be_is_one_sentence(tmp_path: Path, last: str, said: str) -> None:
    install_balls(tmp_path / "site")
    (tmp_path / "balls.toml").write_bytes(EXAMPLE)
    (module,) = (tmp_path / "site").rglob("balancer.py")
    text = module.read_text(encoding="utf-8")
    head = "    def corrections("
    begin = text.index(head)
    signature = text[begin : text.index(":\n", text.index("->", begin)) + 2]
    body = f"        for count in range(10**9):\n            {last}\n\n"
    end = text.index("\n    def ", begin + 1) + 1 if "\n    def " in text[begin + 1 :] else len(text)
    module.write_text(text[:begin] + signature + body + text[end:], encoding="utf-8")
    child = subprocess.run(
        [sys.executable, "-m", "ringbalance", "simulate", "balls.toml"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path / "site"), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert child.returncode == 2
    error = " ".join(child.stderr.split())
    assert said in error
    assert "pairs (time in s, complex moment in kg m)" in error
    assert "Traceback" not in child.stderr
