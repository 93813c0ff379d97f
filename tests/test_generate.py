"""One program writes all that is generated, or says where a file holds something else."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import generate
import pytest


def test_what_differs_is_named_or_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    same, other = tmp_path / "same", tmp_path / "new" / "other"
    same.write_bytes(b"a")
    contents = {same: b"a", other: b"b"}
    calls: list[list[str]] = []

    def files(words: list[str]) -> Iterator[tuple[Path, bytes]]:
        calls.append(words)
        yield from contents.items()

    module = SimpleNamespace(files=files)
    monkeypatch.setitem(sys.modules, "letters", module)
    monkeypatch.setattr(generate, "TARGETS", {"letters": ("letters", ""), "digits": ("letters", "")})
    assert generate.main(["letters", "x", "y"]) == 1
    assert capsys.readouterr().out == f"{other}: not what is generated now\n"
    assert not other.exists()
    assert generate.main(["--write", "letters", "digits", "z"]) == 0
    assert capsys.readouterr().out == f"{other}: written\n"
    assert other.read_bytes() == b"b"
    assert generate.main(["letters"]) == 0
    assert calls == [["x", "y"], [], ["z"], []]


@pytest.mark.parametrize("words", [[], ["--write"], ["tables"]])
def test_a_word_that_is_no_target_is_answered_with_all_of_them(words: list[str]) -> None:
    with pytest.raises(SystemExit) as refused:
        generate.main(words)
    assert all(name in str(refused.value.code) for name in generate.TARGETS)


def test_every_target_has_a_module() -> None:
    tools = Path(generate.__file__).parent
    assert all((tools / f"{module}.py").exists() for module, _ in generate.TARGETS.values())
