"""Findings of `doctor` on a machine that lacks something."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NoReturn

import pytest

from ringbalance import doctor
from ringbalance.running import run_command


@pytest.fixture
def lacks(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Takes one installed package away."""

    def take(package: str) -> None:
        def found(name: str) -> str:
            if name == package:
                raise PackageNotFoundError(name)
            return version(name)

        monkeypatch.setattr(doctor, "version", found)

    return take


def by_name() -> dict[str, doctor.MachineCheck]:
    return {check.name: check for check in doctor.checks()}


def test_everything_that_is_required_is_here(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("doctor") == 0
    assert "scikit-fem" in capsys.readouterr().out


@pytest.mark.parametrize(("package", "state", "code"), [("numpy", "broken", 1), ("pyvista", "absent", 0)])
def test_a_package_that_lacks(
    package: str, state: str, code: int, lacks: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    lacks(package)
    check = by_name()[package]
    assert check.state == state
    assert "pip install" in check.advice
    assert run_command("doctor") == code
    assert "pip install" in capsys.readouterr().out


def test_code_that_others_may_write_is_broken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(doctor, "trusted", lambda _: False)
    (tmp_path / "ringbalance").mkdir()
    assert by_name()["compiled code"].state == "broken"


def test_one_process_where_there_are_no_semaphores(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: str) -> NoReturn:
        raise OSError("no /dev/shm")

    monkeypatch.setattr(doctor, "get_context", refuse)
    check = by_name()["processes"]
    assert (check.state, "no /dev/shm" in check.text) == ("absent", True)
