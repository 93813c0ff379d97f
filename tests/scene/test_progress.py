"""Signs of life on standard error: a line now and then in a long run, nothing in a short one."""

from __future__ import annotations

import sys
import time
from types import SimpleNamespace

import pytest

from ringbalance.scene.platform import progress_line, terminal
from ringbalance.scene.platform.display import announced, displayed
from ringbalance.scene.platform.progress_line import ProgressLine
from ringbalance.scene.platform.terminal import activity


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first line after 50 ms, then one every 20 ms."""
    monkeypatch.setattr(terminal, "FIRST_LINE_S", 0.05)
    monkeypatch.setattr(terminal, "NEXT_LINE_S", 0.02)


def test_a_short_run_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with activity("simulate", "closed loop") as shown:
        shown.show("1.0 s of 120 s simulated", done=1.0, total=120.0)
    assert capsys.readouterr() == ("", "")


@pytest.mark.usefixtures("quick")
def test_a_long_run_says_where_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    with activity("simulate", "flow law: [calibrated] ...") as shown:
        time.sleep(0.2)
        shown.show("12.3 s of 120 s simulated", done=12.3, total=120.0)
        time.sleep(0.2)
    found = capsys.readouterr()
    lines = found.err.splitlines()
    assert found.out == ""
    assert lines[0].startswith("simulate: flow law: [calibrated] ... (")
    assert lines[-1].startswith("simulate: 12.3 s of 120 s simulated (")
    assert len(lines) > 2
    time.sleep(0.1)
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("quick")
def test_lines_end_with_an_interrupted_run(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), activity("calibrate", "finite elements"):
        raise KeyboardInterrupt
    time.sleep(0.15)
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("quick")
def test_without_standard_error_the_run_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    with activity("calibrate", "finite elements"):
        time.sleep(0.15)


def test_what_the_depths_announce_is_shown_while_it_lasts() -> None:
    with announced("nobody shows this"):
        pass
    with activity("simulate", "closed loop ...") as shown:
        with announced("compiling, once on this machine ..."):
            assert shown.text == "compiling, once on this machine ..."
        assert shown.text == "closed loop ..."


@pytest.mark.usefixtures("quick")
def test_a_quiet_run_shows_no_progress(capsys: pytest.CaptureFixture[str]) -> None:
    with displayed(brief=False, quiet=True, log=None), activity("calibrate", "finite elements"):
        time.sleep(0.2)
    assert capsys.readouterr() == ("", "")


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """One time, s, that a test moves."""
    now = [0.0]
    monkeypatch.setattr(progress_line, "monotonic", lambda: now[0])
    return now


def test_a_notebook_has_one_line_that_is_replaced(
    clock: list[float], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown: list[str] = []
    output = SimpleNamespace(update=lambda data, **_: shown.append(data["text/plain"]))
    made = SimpleNamespace(display=lambda _, **__: output)
    shell = SimpleNamespace(kernel=None)
    notebook = SimpleNamespace(get_ipython=lambda: shell, display=made)
    monkeypatch.setitem(sys.modules, "IPython", notebook)
    line = ProgressLine()
    for how_far in ((0.5, 120.0), ("too soon",), ("axes", 3, 12), (SimpleNamespace(text="points"),)):
        line(*how_far)
        clock[0] += 0.04
    assert shown == ["0.5 of 120", "axes: 3 of 12"]
    del shell.kernel
    ProgressLine()("an interpreter is no notebook")
    assert len(shown) == 2
    assert capsys.readouterr() == ("", "")


def test_a_terminal_keeps_one_line_and_a_file_gets_one_now_and_then(
    clock: list[float], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    line = ProgressLine()
    for _ in range(3):
        line(SimpleNamespace(text="points"))
        clock[0] += 20.0
    assert capsys.readouterr().err == "points\n"
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    line = ProgressLine()
    line("runs ...")
    clock[0] += 1.0
    line("done")
    assert capsys.readouterr().err == "\r\x1b[Kruns ...\r\x1b[Kdone"
