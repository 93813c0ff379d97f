"""Whatever stands in a file of measurements: sound observations, or errors of one printable line each."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from ringbalance.cli import main
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.reading import KINDS, read_observations
from ringbalance.scene import SceneError, bundled_scene
from ringbalance.scene.faults import MOST_SHOWN_FAULTS
from ringbalance.scene.models import Scene

PAPER: Final = str(bundled_scene("liquid_ring_paper"))
ONE_IN: Final = 20
"""Of the refused files, those that go through the whole command."""
# fmt: off
CELLS: Final = (
    "", " ", "nan", "inf", "-inf", "1,5", "1.234,5", "1e999", "-1", "1e-320", "0", "x", "--", "1 mm", "5 %",
    "１", "1_000", "0x10", "TRUE", "#N/A", "#DIV/0!", "12.03.2026", "µ", "°", "\x00", "\x1b[31m", "\u2028",
    "A", "a", "Z", "1;2", '"', '""', "'", "9" * 400, "=A1+B1", "\ufeff", "−1", "½",
)
HEADS: Final = (
    "", "amplitude", "amplitude [um]", "amplitude [furlong]", "phase [K]", "x [", "x []", "[um]",
    "x [[um]]", "Amplitude [um]", "series", "note", "chamber", "uncertainty", "uncertainty_amplitude [um]",
    "µ [µm]", "speed [1]", "volume [ml]", "mass [g]", "fill_ratio [%]", "amplitude (um)",
)
HEADERS: Final = (
    '# kind = "flow"', "# kind = 3", '# kind = "rain"', "# kind", "#", "# [uncertainty]", "# = 3",
    "# a.b.c = 1", '# amplitude = "rms"', "# amplitude = true", "# uncertainty = -1", "# uncertainty = nan",
    "# source = []", "# uncertainty = { amplitude = 1 }", '# uncertainty = { phase = "1 deg" }',
    "# uncertainty = 1979-05-27", '# uncertainty = { "a\\nb" = "1 um" }', "# source = '''",
    '# "\\u001b" = 1', "# x = " + "[" * 400, "# uncertainty = 1e-400",
    "# uncertainty = 99999999999999999999", "# kind = { }", "sep=;", "sep=|",
)
SIGNS: Final = (
    (",", ";"), (",", "\t"), (",", "|"), (".", ","), ("\n", "\r\n"), ("\n", "\r"), ("\n", "\n\n"), ('"', "'"),
)
# fmt: on


def lines_changed(text: str, change: Callable[[list[str]], None]) -> str:
    lines = text.split("\n")
    change(lines)
    return "\n".join(lines)


def junk_cell(draw: random.Random, text: str) -> str:
    """Another cell, in a row or in the line of names."""

    def change(lines: list[str]) -> None:
        first = next((i for i, line in enumerate(lines) if not line.startswith("#")), 0)
        row = draw.randrange(first, len(lines))
        cells = lines[row].split(",")
        cells[draw.randrange(len(cells))] = draw.choice(HEADS if row == first else CELLS)
        lines[row] = ",".join(cells)

    return lines_changed(text, change)


def junk_header(draw: random.Random, text: str) -> str:
    """A further line before the names, or one in place of another."""

    def change(lines: list[str]) -> None:
        at = draw.randrange(min(5, len(lines)))
        lines[at : at + draw.randrange(2)] = [draw.choice(HEADERS)]

    return lines_changed(text, change)


def moved_line(draw: random.Random, text: str) -> str:
    """A line that is gone, stands twice or somewhere else."""

    def change(lines: list[str]) -> None:
        line = lines.pop(draw.randrange(len(lines)))
        for _ in range(draw.randrange(3)):
            lines.insert(draw.randrange(len(lines) + 1), line)

    return lines_changed(text, change)


def other_signs(draw: random.Random, text: str) -> str:
    """Separators, line ends and points as other machines write them."""
    return text.replace(*draw.choice(SIGNS))


def random_characters(draw: random.Random, text: str) -> str:
    at = draw.randrange(len(text) + 1)
    inserted = "".join(chr(draw.randrange(1, 0x3000)) for _ in range(draw.randrange(4)))
    return text[:at] + inserted + text[at + draw.randrange(30) :]


CHANGES: Final = (junk_cell, junk_cell, junk_header, moved_line, other_signs, random_characters)


def encoded(draw: random.Random, text: str) -> bytes:
    """Mostly UTF-8, now and then something else or cut off."""
    encoding = draw.choice(["utf-8"] * 6 + ["utf-8-sig", "utf-16", "cp1252", "latin-1"])
    content = text.encode(encoding, "replace")
    if draw.random() < 0.05:
        return draw.randbytes(draw.randrange(200))
    return content[: draw.randrange(len(content) + 1)] if draw.random() < 0.1 else content


def changed_files(sound: Mapping[str, str], *, seed: int) -> Iterator[bytes]:
    """Files without end, each a sound one with up to three changes."""
    draw = random.Random(seed)
    kinds = [kind for kind in KINDS if KINDS[kind].balancer == "liquid_ring"]
    while True:
        text = sound[draw.choice(kinds)]
        for _ in range(draw.randrange(1, 4)):
            text = draw.choice(CHANGES)(draw, text)
        yield encoded(draw, text)


def observed(path: Path, scene: Scene) -> Observations | list[str]:
    """What a file is read as, or the lines of the message."""
    try:
        return read_observations([path], scene=scene)[0]
    except SceneError as error:
        return [str(fault) for fault in error.faults]


def assert_one_line_each(messages: list[str], path: Path) -> None:
    assert messages
    assert [text for text in messages if not text.isprintable() or not text.startswith(f"{path}: ")] == []


def assert_sound(found: Observations) -> None:
    numbers = (found.columns, found.uncertainty)
    assert all(np.all(np.isfinite(values)) for columns in numbers for values in columns.values())
    assert all(np.all(width > 0) for width in found.uncertainty.values())
    assert {values.shape for columns in numbers for values in columns.values()} == {(len(found),)}
    assert set(found.chamber.tolist()) <= {"", "A", "B", "C", "D"}


@pytest.mark.parametrize("malformed", [300, pytest.param(5000, marks=pytest.mark.faults)])
def test_a_malformed_file_is_refused_with_its_place(
    malformed: int,
    sound_files: Mapping[str, str],
    paper_scene: Scene,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, refused, sound = tmp_path / "x.csv", 0, 0
    for content in changed_files(sound_files, seed=malformed):
        path.write_bytes(content)
        found = observed(path, paper_scene)
        if isinstance(found, Observations):
            assert_sound(found)
            sound += 1
            continue
        assert_one_line_each(found, path)
        refused += 1
        if refused % ONE_IN == 0:
            assert main(["fit", PAPER, str(path)]) == 2
            written = capsys.readouterr()
            assert written.out == ""
            assert written.err.splitlines()[:MOST_SHOWN_FAULTS] == found[:MOST_SHOWN_FAULTS]
        if refused == malformed:
            break
    # Changes that do not matter are let through, so that not everything is refused.
    assert sound > malformed / 50
