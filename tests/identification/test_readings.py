"""Files of a rig by another simulator, read wrongly: the fit fails, and names how they are to be read."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import foreign_rigs
import pytest

from ringbalance.cli import main

RIG = 6
"""Water, four chambers: trial weights, transfers and injections."""
Cells = dict[str, str]
Edit = Callable[[Cells], None]


def edited(text: str, edit: Edit) -> str:
    """A file with every row changed."""
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    heads = lines[first].split(",")
    rows = [dict(zip(heads, line.split(","), strict=True)) for line in lines[first + 1 :]]
    for row in rows:
        edit(row)
    return "\n".join([*lines[: first + 1], *(",".join(row.values()) for row in rows)]) + "\n"


def exchange(row: Cells) -> None:
    for before in [head for head in row if "_before" in head]:
        after = before.replace("_before", "_after")
        row[before], row[after] = row[after], row[before]


def letter_against_the_rotation(row: Cells) -> None:
    row["chamber"] = "ADCB"["ABCD".index(row["chamber"])]


def times(factor: float, *starts: str) -> Edit:
    def edit(row: Cells) -> None:
        for head in row:
            if head.startswith(starts):
                row[head] = repr(factor * float(row[head]))

    return edit


MISREAD: Mapping[str, tuple[Edit, tuple[str, ...]]] = {
    "before_and_after_exchanged": (exchange, ("injection.csv",)),
    "phases_turned": (times(-1, "phase"), ("trial_weight.csv", "injection.csv")),
    "chambers_turned": (letter_against_the_rotation, ("injection.csv",)),
    "amplitudes_halved": (times(2, "amplitude"), ("injection.csv",)),
    "pressures_tenth": (times(10, "pressure"), ("transfer.csv", "injection.csv")),
    "times_in_seconds": (times(1e-3, "gas_time"), ("transfer.csv", "injection.csv")),
}
"""By the code of the reading that the fit is to find: what was done, to which files."""
OFTEN = ("before_and_after_exchanged", "pressures_tenth")


@pytest.fixture
def fitted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, dict[str, Any]]]:
    """Exit code and JSON of a fit to the rig's files, some of them changed."""

    def run(changed: Mapping[str, str]) -> tuple[int, dict[str, Any]]:
        rig = foreign_rigs.rig(RIG)
        (tmp_path / "scene.toml").write_text(rig.scene, encoding="utf-8")
        for name, text in (rig.files | dict(changed)).items():
            (tmp_path / name).write_text(text, encoding="utf-8")
        files = [str(tmp_path / name) for name in rig.files]
        code = main(["fit", str(tmp_path / "scene.toml"), *files, "--json"])
        return code, json.loads(capsys.readouterr().out)["criticism"]

    return run


@pytest.mark.parametrize(
    "code", [pytest.param(each, marks=() if each in OFTEN else pytest.mark.heavy) for each in MISREAD]
)
def test_a_file_that_is_read_wrongly_fails_and_is_named(
    code: str, fitted: Callable[..., tuple[int, dict[str, Any]]]
) -> None:
    edit, names = MISREAD[code]
    files = foreign_rigs.rig(RIG).files
    exit_code, criticism = fitted({name: edited(files[name], edit) for name in names})
    assert exit_code == 1
    assert not criticism["describes"]
    (named,) = [each for each in criticism["readings"] if each["named"]]
    assert named["code"] == code
    assert [Path(file).name for file in named["files"]] == list(names)
    if code in ("before_and_after_exchanged", "chambers_turned"):
        shares = {Path(each["file"]).name: each for each in criticism["explained"]}
        assert shares["injection.csv"]["fails"]
        assert shares["injection.csv"]["share"] < 0.5
        assert not shares["trial_weight.csv"]["fails"]
    if code == "pressures_tenth":
        far = [each for each in criticism["ranges"] if each["fails"]]
        found = {(Path(each["file"]).name, each["column"], each["unit"]) for each in far}
        assert found == {(name, "pressure", "MPa") for name in names}
        # Gauges show 0.95 to 1.25 of the scene's pressure.
        assert all(9 < each["ratio"] < 13 for each in far)


def test_files_that_are_read_rightly_are_not_doubted(
    fitted: Callable[..., tuple[int, dict[str, Any]]],
) -> None:
    exit_code, criticism = fitted({})
    assert exit_code == 0
    assert criticism["describes"]
    assert not any(each["named"] for each in criticism["readings"])
    assert not any(each["fails"] for each in criticism["ranges"])
    assert all(each["share"] > 0.9 for each in criticism["explained"])
