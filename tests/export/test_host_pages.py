"""The page of each host: its example is run, or as far as it runs here its names are compared."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET
from zipfile import ZipFile

import pytest

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.export.blocks import Block, Kind
from ringbalance.export.fmu import fmu_bytes
from ringbalance.export.hosts import c_files, js_files, python_files, st_files

PAGES = Path(__file__).resolve().parents[2] / "docs"
FENCE = re.compile(r"```(\w*)\n(.*?)```", re.DOTALL)
NAMES: Mapping[str, Kind] = {"law": "law", "disc": "disc", "ctrl": "controller"}


def examples(page: str, language: str) -> list[str]:
    text = (PAGES / page).read_text(encoding="utf-8")
    return [body for name, body in FENCE.findall(text) if name == language]


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")
def test_the_page_on_c(tmp_path: Path, paper_blocks: dict[str, Block]) -> None:
    for name, kind in NAMES.items():
        for file, content in c_files(paper_blocks[kind], name).items():
            (tmp_path / file).write_text(content)
    (example,) = examples("host-c.md", "c")
    (tmp_path / "main.c").write_text(example)
    command = [
        "gcc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-O2",
        *map("{}.c".format, NAMES),
        "main.c",
        "-lm",
    ]
    subprocess.run([*command, "-o", "example"], cwd=tmp_path, check=True)
    told = subprocess.run([tmp_path / "example"], capture_output=True, text=True, check=True).stdout
    assert re.fullmatch(r"\d+\.\d{3} m/s\n\d+ samples, resting: 1\n", told)


def test_the_page_on_python(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    paper_blocks: dict[str, Block],
) -> None:
    for name, kind in NAMES.items():
        for file, content in python_files(paper_blocks[kind], name).items():
            (tmp_path / file).write_text(content)
    (table,) = examples("host-python.md", "text")
    (tmp_path / "influence.csv").write_text(table)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    names: dict[str, Any] = {}
    for example in examples("host-python.md", "python"):
        exec(example, names)
    assert names["told"]["resting"] == 1.0
    assert capsys.readouterr().out.splitlines()[-1] == "True A True True"
    assert names["there"].rotor.influence == pytest.approx(names["table"].at(names["there"].rotor.speed))
    assert names["pair"][0] == names["spread"][0] == names["row"].value


@pytest.mark.skipif(shutil.which("node") is None, reason="no Node")
def test_the_page_on_javascript(tmp_path: Path, paper_blocks: dict[str, Block]) -> None:
    for name, kind in NAMES.items():
        for file, content in js_files(paper_blocks[kind], name).items():
            (tmp_path / file).write_text(content)
    (example,) = examples("host-javascript.md", "js")
    (tmp_path / "main.mjs").write_text(example)
    told = subprocess.run(
        ["node", "main.mjs"], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    assert re.fullmatch(r"\d+\.\d{3} [12] \d+ 1\n", told)


@pytest.mark.parametrize("page", ["host-simulink.md", "host-openmodelica.md"])
def test_pages_of_hosts_of_units_name_variables_that_there_are(
    page: str, paper_blocks: dict[str, Block]
) -> None:
    text = (PAGES / page).read_text(encoding="utf-8")
    told = set(re.findall(r"\b(?:vibration_[xy]|at_residual_[a-z]|open_time_[a-z])\b", text))
    assert {"vibration_x", "vibration_y", "at_residual_a", "open_time_a"} <= told
    for kind in ("disc", "controller"):
        unit = ZipFile(BytesIO(fmu_bytes(paper_blocks[kind], "m", "fmi2")[0]))
        model = ET.fromstring(unit.read("modelDescription.xml"))
        assert told <= {each.get("name") for each in model.iter("ScalarVariable")}


def test_the_page_on_controllers(paper_blocks: dict[str, Block]) -> None:
    parse = pytest.importorskip("blark.parse")
    (example,) = examples("host-twincat.md", "")
    (program,) = parse.parse_source_code(example).transform().items
    assert str(program.name) == "Balancing"
    for instance, name in (("control", "ctrl"), ("model", "disc")):
        block = st_files(paper_blocks[NAMES[name]], name)[f"{name}.st"].partition("FUNCTION_BLOCK")[2]
        declared = set(re.findall(r"^    (\w+) : (?:LREAL|DINT|BOOL);", block, re.MULTILINE))
        assert f"{instance} : FB_{name};" in example
        assert set(re.findall(rf"{instance}\.(\w+)", example)) <= declared
        (call,) = re.findall(rf"^{instance}\((.*?)\);", example, re.DOTALL | re.MULTILINE)
        assert set(re.findall(r"(\w+) :=", call)) <= declared


def test_the_commands_that_the_pages_begin_with(tmp_path: Path) -> None:
    """The quickest of each page: the controller needs no calibration."""
    scene = str(rb.bundled_scene("liquid_ring_paper"))
    for page in PAGES.glob("host-*.md"):
        commands = re.findall(
            r"^    ringbalance (export SCENE .*)$", page.read_text(encoding="utf-8"), re.MULTILINE
        )
        assert commands
        for command in (each for each in commands if "controller" in each):
            words = command.replace("SCENE", scene).replace(" --all-systems", "").split()
            assert main([*words, "--out", str(tmp_path / page.stem)]) == 0
