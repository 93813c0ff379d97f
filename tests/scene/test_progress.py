"""Signs of life on standard error: a line now and then in a long run, nothing in a short one."""

from __future__ import annotations

import sys
import time

import pytest

from ringbalance.scene.platform import terminal
from ringbalance.scene.platform.display import announced, displayed
from ringbalance.scene.platform.terminal import activity


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first line after 50 ms, then one every 20 ms."""
    monkeypatch.setattr(terminal, "FIRST_LINE", 0.05)
    monkeypatch.setattr(terminal, "NEXT_LINE", 0.02)


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
