"""A key so long that reading it takes gigabytes is refused before it is read."""

from __future__ import annotations

import re
import time
import tomllib
from pathlib import Path

import pytest

from ringbalance.scene import SceneError, load_scene
from ringbalance.scene.toml import MOST_PARTS, read_toml


@pytest.mark.parametrize("part", ["a", '"a"', "'a b'", "a ", "1"])
@pytest.mark.parametrize("form", ["{} = 1", "[{}]", "[[{}]]", "x = {{ {} = 1 }}"])
def test_a_long_key_is_refused_with_its_line(part: str, form: str) -> None:
    head = 'name = "one\\"." # . . .\n'
    short = head + form.format(".".join([part] * MOST_PARTS))
    assert read_toml(short) == tomllib.loads(short)
    for parts in (MOST_PARTS + 1, 30_000):
        with pytest.raises(ValueError, match="line 2 has a key of more than 50 parts"):
            read_toml(head + form.format(".".join([part] * parts)))


@pytest.mark.parametrize(
    "text",
    [
        f'x = "{"a." * 99}"',
        f"x = '{'a.' * 99}'",
        "x = [" + "0.5, " * 99 + "1.5]",
        "x = 1\n" + "# " + ". " * 99 + "\ny = 2",
    ],
)
def test_other_dots_do_not_count(text: str) -> None:
    assert read_toml(text) == tomllib.loads(text)


@pytest.mark.parametrize(
    "text", ["a" * 1_000_000, "-" * 1_000_000, '"' * 999_999, "a. " * 40 + " " * 1_000_000]
)
def test_looking_takes_no_longer_than_the_text(text: str) -> None:
    start = time.process_time()
    with pytest.raises(ValueError, match=re.compile(".")):
        read_toml(text)
    # A search that grows with the square takes hours.
    assert time.process_time() - start < 10


def test_a_scene_with_such_a_key_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("disc." * 20_000 + "bore = 1")
    with pytest.raises(SceneError, match="line 1 has a key of more than 50 parts"):
        load_scene(path)
