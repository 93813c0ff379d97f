"""A machine without OpenGL gets a sentence, not a crash."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from ringbalance.reports.pictures import opengl
from ringbalance.reports.pictures.opengl import DEBIAN_PACKAGES, find_opengl


def test_a_missing_library_is_named_with_what_to_install() -> None:
    machine = find_opengl(egl="libNoSuchEGL.so.1", osmesa="libNoSuchOSMesa.so.8")
    assert not machine.available
    assert machine.window == ""
    assert "libNoSuchEGL.so.1" in machine.text
    assert DEBIAN_PACKAGES in machine.text


def test_without_pyvista_it_is_said_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opengl, "find_spec", lambda _: None)
    machine = find_opengl()
    assert not machine.available
    assert "ringbalance[pictures]" in machine.text


def test_a_library_that_is_no_egl_is_refused() -> None:
    machine = find_opengl(egl="libm.so.6", osmesa="libNoSuchOSMesa.so.8")
    assert not machine.available
    assert "eglGetProcAddress" in machine.text


def fake_python(folder: Path, script: str) -> str:
    """An interpreter that runs a shell script instead."""
    path = folder / "python"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
def test_a_driver_that_crashes_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", fake_python(tmp_path, "kill -SEGV $$"))
    machine = find_opengl()
    assert not machine.available
    assert "code -11" in machine.text


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
def test_a_driver_that_hangs_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", fake_python(tmp_path, "exec sleep 60"))
    monkeypatch.setattr(opengl, "_TIMEOUT_S", 0.2)
    machine = find_opengl()
    assert not machine.available
    assert "did not answer" in machine.text
