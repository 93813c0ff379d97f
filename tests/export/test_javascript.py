"""JavaScript has the bits of C and of the program's own evaluator."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from c_warnings import WARNINGS
from law_in_c import compiled_answers
from law_queries import answers, queries

from ringbalance.export.blocks import Block, law_block
from ringbalance.export.compact import CompactLaw
from ringbalance.export.hosts import c_files, js_files
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.scene.arrays import FloatArray

Both = tuple[CalibratedLaw, CompactLaw]
FOLDER = Path(__file__).parent
RUN, IN_PYTHON = 500, 250
"""Steps from one start of a block to the next, and those that the program's own evaluator takes too."""
QUERIES = 700_000
STEPS = {"disc": 150_000, "controller": 100_000, "trial": 48_000, "law_based": 2_000}
"""A million in all; a law-based controller makes hundreds of queries a step."""

pytestmark = [
    pytest.mark.skipif(shutil.which("node") is None, reason="no Node"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler"),
]


def bits_in_node(folder: Path, block: Block, rows: FloatArray) -> bytes:
    """Outputs as in `same_bits.mjs`."""
    (module,) = js_files(block, "block").items()
    (folder / module[0]).write_text(module[1])
    command = ["node", str(FOLDER / "same_bits.mjs"), str(folder / module[0]), str(RUN)]
    ran = subprocess.run(command, input=rows.tobytes(), capture_output=True, check=True)
    assert ran.stderr == b""
    return ran.stdout


def bits_in_c(folder: Path, block: Block, rows: FloatArray) -> bytes:
    """Outputs as in `same_bits.c`."""
    indices = [[str(v.index) for v in block.variables if v.input is side] for side in (True, False)]
    places = f"enum {{ STEPS = {RUN} }};\n" + "".join(
        f"static const int {name}[] = {{{', '.join(each)}}};\n"
        for name, each in zip(("inputs", "outputs"), indices, strict=True)
    )
    for file, text in (c_files(block, "block") | {"places.h": places}).items():
        (folder / file).write_text(text)
    command = ["gcc", *WARNINGS, "-O2", "-I.", "block.c", str(FOLDER / "same_bits.c"), "-lm", "-o", "ask"]
    subprocess.run(command, cwd=folder, check=True)
    return subprocess.run([folder / "ask"], input=rows.tobytes(), capture_output=True, check=True).stdout


def conditions(block: Block, count: int) -> FloatArray:
    """Rows of a time and all inputs: steps of any length, some valves open, any vibration."""
    rng = np.random.default_rng(5)
    names = [each.name for each in block.variables if each.input]
    rows = np.zeros((count, 1 + len(names)))
    if block.kind == "disc":
        rows[:, 0] = rng.exponential(2e-4, count)
        rows[::100, 0] = rng.uniform(0.0, 0.05, rows[::100].shape[0])
        open_times = rng.uniform(0.0, 0.05, (count, len(names)))
        rows[:, 1:] = open_times * (rng.random((count, len(names))) < 0.05)
    else:
        rows[:, 0] = rng.uniform(0.0, 0.6, count)
        vibration = 10 ** rng.uniform(-9.0, -4.5, count) * np.exp(2j * np.pi * rng.random(count))
        rows[:, 1], rows[:, 2] = vibration.real, vibration.imag
        rows[:, 3:] = rng.random((count, len(names) - 2)) < 0.02
        rows[::97, 1] = np.nan
    # Times that no host lets pass; the program's own evaluator is not asked about them.
    rows[IN_PYTHON::999, 0] = rng.choice([-1.0, 2e6, np.nan, np.inf], rows[IN_PYTHON::999].shape[0])
    return rows


def test_the_law_has_the_bits_of_c_and_python(tmp_path: Path, six: Both) -> None:
    law, compact = six
    asked = queries(law, QUERIES, outside=True)
    in_node = bits_in_node(tmp_path, law_block(compact), asked.T.copy())
    assert in_node == compiled_answers(tmp_path, compact, asked, "-O2").tobytes()
    right = np.array(list(answers(compact, asked[:, :3000])))
    assert set(right[:, 1].astype(int)) == {0, 1, 2, 3}
    assert np.frombuffer(in_node).reshape(-1, 6)[:3000, :4].tobytes() == right.tobytes()


@pytest.mark.parametrize("kind", list(STEPS))
def test_a_block_has_the_bits_of_c_and_python(tmp_path: Path, blocks: dict[str, Block], kind: str) -> None:
    block = blocks[kind]
    rows = conditions(block, STEPS[kind])
    in_node = bits_in_node(tmp_path, block, rows)
    assert in_node == bits_in_c(tmp_path, block, rows)

    names = [each.name for each in block.variables if each.input]
    row, outputs = list(block.start), np.frombuffer(in_node).reshape(len(rows), -1)
    for (time, *inputs), told in zip(rows[:IN_PYTHON].tolist(), outputs.tolist(), strict=False):
        assert list(block.run(row, time, dict(zip(names, inputs, strict=True))).values()) == told
    assert np.unique(outputs, axis=0).shape[0] > STEPS[kind] // 3


STEP_BY_NAME = """
import { Block } from "./disc.mjs";
const block = new Block();
for (let at = 0; at < 20; at++) {
    const told = block.step(0.01, at ? {} : { open_time_a: 0.03, open_time_e: 0.02 });
    console.log(Object.values(told).map(String).join(" "));
}
try {
    block.step(0.01, { constructor: 1 });
} catch (error) {
    console.log(error.message);
}
"""


def test_steps_by_name(tmp_path: Path, blocks: dict[str, Block]) -> None:
    block = blocks["disc"]
    (tmp_path / "disc.mjs").write_text(js_files(block, "disc")["disc.mjs"])
    (tmp_path / "main.mjs").write_text(STEP_BY_NAME)
    ran = subprocess.run(["node", "main.mjs"], cwd=tmp_path, capture_output=True, text=True, check=True)
    *lines, refused = ran.stdout.splitlines()
    row, inputs = list(block.start), {"open_time_a": 0.03, "open_time_e": 0.02}
    for at, line in enumerate(lines):
        right = block.run(row, 0.01, {} if at else inputs)
        assert [float(each) for each in line.split()] == list(right.values())
    assert refused.startswith("no input is named constructor: open_time_a, ")


def test_the_declarations_say_unit_range_and_meaning(blocks: dict[str, Block]) -> None:
    text = js_files(blocks["disc"], "m")["m.mjs"]
    assert "// out, Pa, 0 to 1e+08: absolute pressure of the gas in chamber F" in text
    assert text.count(" // in, ") + text.count(" // out, ") == len(blocks["disc"].variables)
    assert not re.search(r"^import\b|\brequire\(|\beval\(", text, re.MULTILINE)
