"""Results of cases that are kept between reports: taken only whole, of the right form and of this program."""

from __future__ import annotations

from pathlib import Path

import pytest

import ringbalance.reports.saved as saved_module
from ringbalance.reports.saved import keep_cases, kept_cases, saved_cases
from ringbalance.scene.platform import program
from ringbalance.scene.platform.kept_code import write_checked


@pytest.mark.parametrize("damage", [b"", b"{}", b"\xff" * 99], ids=["empty", "no checksum", "garbage"])
def test_damaged_results_are_not_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: bytes
) -> None:
    monkeypatch.setattr(saved_module, "code_root", lambda: tmp_path)
    assert kept_cases() == {}
    keep_cases({"claim_01_volume": {"date": "2026-01-01", "record": saved_cases()[0]}})
    assert list(kept_cases()) == ["claim_01_volume"]
    (damaged,) = tmp_path.iterdir()
    content = bytearray(damaged.read_bytes())
    content[len(content) // 2] ^= 1
    for wrong in (damage, bytes(content)):
        damaged.write_bytes(wrong)
        assert kept_cases() == {}
        assert not damaged.exists()


@pytest.mark.parametrize(
    "content",
    [
        b"[]",
        b"null",
        b"5",
        b"[" * 100_000,
        b'{"c": {}}',
        b'{"c": {"date": "", "record": "text"}}',
        b'{"c": NaN}',
    ],
    ids=["list", "null", "number", "deep", "empty case", "text", "not a number"],
)
def test_results_of_another_form_are_not_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes
) -> None:
    """Whole, with a checksum that holds, but nothing that a report could show."""
    monkeypatch.setattr(saved_module, "code_root", lambda: tmp_path)
    keep_cases({})
    (path,) = tmp_path.iterdir()
    write_checked(path, content)
    assert kept_cases() == {}
    assert not path.exists()


def test_results_of_another_program_are_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(saved_module, "code_root", lambda: tmp_path)
    monkeypatch.setattr(saved_module, "program_digest", lambda: "old")
    keep_cases({"claim_01_volume": {"date": "2026-01-01", "record": {}}})
    monkeypatch.setattr(saved_module, "program_digest", lambda: "new")
    assert kept_cases() == {}


def test_another_file_of_the_program_or_package_counts_as_another_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(program, "files", lambda _: tmp_path)
    digests = set()
    for content in ("one", "other"):
        (tmp_path / "module.py").write_text(content)
        digests.add(program.program_digest.__wrapped__())
    monkeypatch.setattr(program, "version_of", lambda _: "9.9")
    digests.add(program.program_digest.__wrapped__())
    assert len(digests) == 3


def test_results_that_cannot_be_kept_cost_time_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(saved_module, "code_root", lambda: tmp_path / "file")
    keep_cases({"claim_01_volume": {"date": "2026-01-01", "record": {}}})
    assert kept_cases() == {}
