"""Every host answers with the same bits as the program's own evaluator."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from law_in_c import compiled_answers
from law_queries import answers, queries

from ringbalance.export.blocks import law_block
from ringbalance.export.compact import CompactLaw
from ringbalance.export.hosts import COLUMNS, csv_files, identifier, python_files
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw

Both = tuple[CalibratedLaw, CompactLaw]


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")
@pytest.mark.parametrize(
    "flags",
    [
        ("-O3", "-march=native", "-std=gnu11", "-fanalyzer"),
        ("-O1", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"),
    ],
)
def test_c_has_the_bits_of_python_and_no_warning(tmp_path: Path, six: Both, flags: tuple[str, ...]) -> None:
    law, compact = six
    asked = queries(law, 20000, outside=True)
    right = np.array(list(answers(compact, asked)))
    assert set(right[:, 1].astype(int)) == {0, 1, 2, 3}
    assert set(right[:, 2].astype(int)) == {0, 1, 2, 4}
    result = compiled_answers(tmp_path, compact, asked, *flags)
    assert result[:, :4].tobytes() == right.tobytes()


def test_a_module_of_its_own_has_the_same_bits(six: Both) -> None:
    law, compact = six
    module: dict[str, object] = {}
    exec(python_files(law_block(compact), "disc")["disc.py"], module)
    flow = module["flow"]
    assert callable(flow)
    asked = queries(law, 500)
    result = [flow(x, p, y, primed) for x, y, p, primed in asked.T.tolist()]
    assert np.array(result).tobytes() == np.array(list(answers(compact, asked))).tobytes()


def test_a_table_says_its_units_and_its_error(six: Both) -> None:
    _, law = six
    text = csv_files(law, "disc", points=9, highest=8e5)["disc.csv"]
    header = [line for line in text.splitlines() if line.startswith("#")]
    lines = text.splitlines()[len(header) :]
    assert lines[0].split(",") == list(COLUMNS)
    assert len(lines) == 1 + 9 * 9 * 2
    fill, pressure, primed, velocity, *_ = map(float, lines[100].split(","))
    assert law.answer(fill_ratio=fill, gas_pressure=pressure, primed=primed != 0).velocity == velocity
    assert any("units" in line for line in header)
    finer = csv_files(law, "disc", points=33, highest=8e5)["disc.csv"]
    assert _error(finer) < 0.5 * _error(text)


def _error(text: str) -> float:
    return float(text.partition("95 % below ")[2].split()[0])


def test_names_are_those_of_every_language() -> None:
    assert [identifier(each) for each in ("My disc-2", "2nd", "ä")] == ["my_disc_2", "law_2nd", "law"]
